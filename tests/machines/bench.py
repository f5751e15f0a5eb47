"""Draws a machine's numbers: base, recordings, and how far and fast it moves."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tests.machines.excitation import Timing, plan
from tests.machines.gap import linear_output
from tests.machines.hidden import Hidden
from tests.machines.integrate import Loop
from tests.machines.machine import Answers, Machine
from tests.machines.plants import Base

# The frozen sets. Numbers, recordings and noise are drawn anew in each. A report is made
# once with one of them; where the program has changed since, with the next.
SEEDS = {
    "development": 20_260_101,
    "reporting": 77_431_902,
    "second_reporting": 41_907_263,
    "third_reporting": 63_580_417,
    "fourth_reporting": 18_946_035,
    "fifth_reporting": 52_718_394,
    "sixth_reporting": 87_205_631,
}
# Largest share by which the simulation's parameters are wrong.
LARGEST_ERROR = 0.3
# Noise of the sensor, as a share of the motion's rms.
USUAL_NOISE = (0.0007, 0.015)


@dataclass
class Draw:
    """Random numbers of one machine in one of the sets."""

    name: str
    seeds: str

    def __post_init__(self):
        number = zlib.crc32(self.name.encode())
        self.rng = np.random.default_rng([SEEDS[self.seeds], number])

    def near(self, value: float, spread: float = 0.2) -> float:
        """A number within a share of the one given, rounded as in a data sheet."""
        return float(f"{value * (1.0 + self.rng.uniform(-spread, spread)):.3g}")

    def angle(self) -> float:
        """Any phase, in rad."""
        return float(self.rng.uniform(0.0, 2.0 * np.pi))

    def angles(self, count: int) -> np.ndarray:
        """Phases, one for each recording, in rad."""
        return self.rng.uniform(0.0, 2.0 * np.pi, count)

    def bench(
        self,
        menu: str,
        *,
        mass: float,
        pace: float,
        damping: float,
        force_constant: float,
        top: float,
        sample_s: float,
        samples: int = 1200,
        count: int = 9,
        free: bool = False,
        resistance: float | None = None,
    ) -> "Bench":
        """A base near the given numbers, and its recordings.

        Parameters
        ----------
        menu : str
            Kinds of commands, see `excitation.KINDS`.
        pace : float, [Hz]
            Natural frequency, or on a free axis that of typical moves.
        damping : float, [-]
            Damping ratio; on a free axis the share of a mass that stops within a swing.
        top : float, [A or V]
            Largest command.
        """
        mass, pace = self.near(mass), self.near(pace)
        rate = 2.0 * np.pi * pace
        base = Base(
            mass,
            self.near(2.0 * self.near(damping) * mass * rate),
            0.0 if free else float(f"{mass * rate**2:.4g}"),
            self.near(force_constant),
            None if resistance is None else self.near(resistance),
        )
        timing = Timing(samples, 1.0 / (pace * sample_s))
        signals = plan(self.rng, menu.split(), count, timing)
        return Bench(self, base, self.near(top), sample_s, signals)

    def servo(
        self,
        menu: str,
        *,
        mass: float,
        damping_time_s: float,
        force_constant: float,
        travel: float,
        bandwidth: float,
        sample_s: float,
        samples: int = 1500,
        count: int = 8,
        stiffness: float = 0.0,
        swing_s: float | None = None,
    ) -> "Bench":
        """A machine under position control, with the references of its recordings.

        Parameters
        ----------
        damping_time_s : float, [s]
            Time in which the free axis stops by its damping.
        travel : float, [m or rad]
            Largest reference.
        bandwidth : float, [Hz]
            Of the position loop.
        """
        mass, force_constant = self.near(mass), self.near(force_constant)
        base = Base(mass, self.near(mass / damping_time_s), stiffness, force_constant)
        timing = Timing(samples, (swing_s or 4.0 / bandwidth) / sample_s)
        rate = 2.0 * np.pi * self.near(bandwidth, 0.1)
        gain = mass * rate**2 / force_constant
        signals = plan(self.rng, menu.split(), count, timing)
        bench = Bench(self, base, self.near(travel), sample_s, signals)
        references = bench.top * np.stack([one.values for one in signals], axis=1)
        speed = np.abs(np.diff(references, axis=0)).max() / sample_s
        limit = 1.5 * mass * min(speed, bench.top * rate) * rate / force_constant
        integral = float(self.rng.choice([0.0, 0.1])) * gain * rate
        bench.loop = Loop(gain, 1.6 * mass * rate / force_constant, integral, limit)
        bench.force, bench.travel = 0.3 * limit * force_constant, bench.top
        bench.speed = min(speed, bench.top * rate)
        return bench


@dataclass
class Bench:
    """A base with recordings; force, travel and speed are those of the linear machine.

    `travel` is the longest way of any recording, `usual` what at least three reach.
    """

    draw: Draw
    base: Base
    top: float
    sample_s: float
    signals: list
    loop: Loop | None = None
    force: float = 0.0
    travel: float = 0.0
    speed: float = 0.0
    usual: float = 0.0

    def __post_init__(self):
        commands = self.top * np.stack([one.values for one in self.signals], axis=1)
        self.count, self.duration = len(self.signals), len(commands) * self.sample_s
        self.force = self.base.force_constant * self.top / (self.base.resistance or 1.0)
        outputs = linear_output(self.base, commands, self.sample_s, "linear")
        self.travel = float(np.abs(outputs).max())
        self.usual = float(np.sort(np.abs(outputs).max(axis=0))[-3])
        self.speed = float(np.abs(np.diff(outputs, axis=0)).max() / self.sample_s)

    def machine(
        self,
        story: str,
        hidden: Sequence[Hidden] = (),
        *,
        exact: bool = False,
        answers: Answers | None = None,
        **more,
    ) -> Machine:
        """The machine with its effects; without `answers` only its own names are right."""
        simulation = {} if self.loop is None else {"hold": "zero"}
        if self.loop is None and "noise" not in more:
            more["noise"] = float(np.exp(self.draw.rng.uniform(*np.log(USUAL_NOISE))))
        return Machine(
            name=self.draw.name,
            family="",
            story=story,
            base=self.base,
            sample_s=self.sample_s,
            signals=self.signals,
            top=self.top,
            hidden=list(hidden),
            answers=answers or own_names(hidden),
            loop=self.loop,
            off={} if exact else self.errors(),
            simulation=simulation | more.pop("simulation", {}),
            rng=self.draw.rng,
            **more,
        )

    def errors(self) -> dict[str, float]:
        """Factors by which the simulation's parameters are wrong."""
        free = [
            "damping",
            "force_constant",
            *(["stiffness"] if self.base.stiffness else []),
        ]
        return {
            name: 1.0 + self.draw.rng.uniform(-LARGEST_ERROR, LARGEST_ERROR)
            for name in free
        }


def own_names(hidden: Sequence[Hidden]) -> Answers:
    """All effects by their own names are right, some of them are partly right."""
    names = [one.effect for one in hidden]
    partial = [
        list(some)
        for size in range(1, len(names))
        for some in combinations(names, size)
    ]
    return Answers(full=[names] if names else [], partial=partial)
