"""Diagnoses of fitted models beside machines that have changed since, and their score.

``python -m tests.black_boxes.run_models [--only CASE ...] [--seed 6]``. The machine is
integrated here or by scipy; of the program it gets recordings alone. The model is exact
but for what a case says: what is missing is known.
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np
from scipy.signal import cont2discrete, lsim

from hwid_cli import Recording
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.programs import ModelSimulation
from hwid_cli.simulations.model import free_parameters
from hwid_cli.stages.foreign_simulation import simulator_of
from tests.black_boxes.plants import LINEAR, Hidden, integrate

STEP_S, N, NOISE = 1e-3, 500, 2e-5
TIME = STEP_S * np.arange(N)
NO_MAP = StaticMap("none", np.zeros(0))


def inputs(size=3.0):
    """Steps and sines after a rest."""
    on = TIME > 0.05
    for share in (0.4, -0.8, 1.0):
        yield f"step_{share}", share * size * (on & (TIME < 0.3))
    for turns, share in ((4.0, 1.0), (7.0, 0.7), (9.0, 1.0), (2.0, 0.9)):
        wave = np.sin(2 * np.pi * turns * (TIME - 0.05))
        yield f"sine_{turns}", share * size * wave * on


@dataclass(frozen=True)
class Machine:
    """The stage as it is now.

    Parameters
    ----------
    given : callable
        From the command to the current that flows.
    read : callable
        From the position to what the sensor shows.
    hidden : Hidden or None
        Friction or a force; the machine is integrated here then.
    stiffer, more_damped : float
        Factors.
    """

    given: object = lambda u: u
    read: object = lambda x: x
    gain: float = 1.0
    hidden: object = None
    stiffer: float = 1.0
    more_damped: float = 1.0

    def recordings(self, seed=6):
        """What is measured on it."""
        rng = np.random.default_rng(seed)
        denominator = [0.8, 11.0 * self.more_damped, 2100.0 * self.stiffer]
        found = []
        for name, u in inputs():
            moved = self.gain * self.given(u)
            if self.hidden is None:
                x = lsim(([9.0], denominator), moved, TIME)[1]
            else:
                values = LINEAR.values
                x = integrate(LINEAR, values, moved, STEP_S, self.hidden, finer=4)
            y = self.read(x) + NOISE * rng.standard_normal(N)
            kind = name.split("_", maxsplit=1)[0]
            found.append(Recording(name, u, y, STEP_S, kind=kind))
        return found


def model_of(input_map=NO_MAP, delay=0, hold="foh"):
    """The stage as a fitted model holds it, exact for the inputs of this ``hold``."""
    plant = cont2discrete(([9.0], [0.8, 11.0, 2100.0]), STEP_S, method=hold)
    numerator, denominator = np.ravel(plant[0]), plant[1]
    if hold == "zoh":
        # What is held shows a sample later.
        numerator, delay = numerator[1:], delay + 1
    return HammersteinWiener(input_map, numerator, denominator, delay, NO_MAP, STEP_S)


def bent(u):
    """Current of an amplifier that gives less of large commands."""
    return 3 * np.tanh(np.asarray(u) / 3)


def pieces(widest, count=41):
    """That amplifier as a map with break-points as far as recordings went."""
    places = np.linspace(-widest, widest, count)
    return StaticMap("piecewise_linear", np.r_[places, bent(places)])


def play(x, half):
    """Mechanical play: the follower is pushed along."""
    y, found = 0.0, []
    for one in x:
        y = min(max(y, one - half), one + half)
        found.append(y)
    return np.array(found)


def presliding(force, way):
    """Friction that builds up over a way (Dahl, 1968)."""
    state = [0.0, 0.0, 0.0]

    def push(x, v, t):
        # A new recording starts unloaded.
        share, before = (0.0, 0.0) if t < state[2] else state[:2]
        change = (x - before) / way
        share += change * (1 - share * np.sign(change))
        state[:] = min(max(share, -1.0), 1.0), x, t
        return -force * state[0]

    return push


def late(u, delay_s=0.0036):
    """The command, later."""
    return np.interp(TIME - delay_s, TIME, u)


@dataclass(frozen=True, eq=False)
class Case:
    """A model, the machine as it is now, and what a right verdict says.

    Parameters
    ----------
    words : tuple of str
        Verdicts that are right.
    effects : tuple of str
        Named then; for a law, what it acts on.
    """

    model: HammersteinWiener
    machine: Machine
    words: tuple
    effects: tuple = ()


def cases(size=1.0):
    """Every case.

    Parameters
    ----------
    size : float
        Of what has changed.
    """
    wide = model_of(pieces(3.6))
    changed = ("parameters",)
    named = ("named", "ambiguous")
    dry = Hidden("dry", (), dry=2.0 * size)
    forces = {
        "drag": lambda x, v, t: -20 * size * v * abs(v),
        "hysteresis": presliding(3.0 * size, 4e-4),
    }
    return {
        "nothing": Case(wide, Machine(bent), ("none", *changed)),
        "gain, no map": Case(model_of(), Machine(gain=1 + 0.2 * size), changed),
        "gain": Case(wide, Machine(bent, gain=1 + 0.2 * size), changed),
        "gain, held input": Case(
            model_of(pieces(3.6), hold="zoh"),
            Machine(lambda u: late(bent(u), 0.0005), gain=1 - 0.1 * size), changed,
        ),
        "amplifier's gain": Case(
            wide, Machine(lambda u: bent((1 + 0.2 * size) * u)), changed
        ),
        "spring and damper": Case(
            wide,
            Machine(bent, stiffer=1 + 0.3 * size, more_damped=1 + 0.4 * size), changed,
        ),
        "delay": Case(
            wide, Machine(lambda u: late(bent(u), 0.0036 * size)), named,
            ("input_delay",),
        ),
        "delay, no map": Case(
            model_of(), Machine(lambda u: late(u, 0.0036 * size)), named,
            ("input_delay",),
        ),
        "play at the output": Case(
            wide, Machine(bent, lambda x: play(x, 3e-4 * size)), named,
            ("output_backlash",),
        ),
        "friction at the output": Case(
            wide, Machine(bent, hidden=dry), named, ("coulomb_friction",)
        ),
        "hysteresis": Case(
            wide, Machine(bent, hidden=Hidden("h", (), force=forces["hysteresis"])),
            named, ("hysteresis",),
        ),
        "drag": Case(
            wide, Machine(bent, hidden=Hidden("d", (), force=forces["drag"])),
            named, ("quadratic_drag",),
        ),
        "map ends, cut": Case(
            model_of(StaticMap("saturation", np.array([-1.4, 1.4]) / size)),
            Machine(), ("law",), ("input",),
        ),
        "map ends, straight on": Case(
            model_of(pieces(1.8 / size)), Machine(bent), ("law",), ("input",)
        ),
    }  # fmt: skip


@dataclass
class Count:
    """Runs tasks in turn; counts runs of the simulation."""

    runs: int = 0

    def __call__(self, tasks, *, keep):  # noqa: ARG002
        """Results in the order of the tasks."""
        self.runs += sum(one.name.startswith("run ") for one in tasks)
        return [one.function(*one.arguments) for one in tasks]


def diagnosed(case, seed=6, run_tasks=None, options=None):
    """What the diagnosis says."""
    model = case.model
    section = ModelSimulation(
        file="model.json", model=model, model_sample_time_s=STEP_S,
        parameters=free_parameters(model),
    )  # fmt: skip
    recordings = case.machine.recordings(seed)
    return diagnose_foreign(
        recordings,
        simulator_of(section, recordings, ()),
        options or DiagnoseOptions(),
        run_tasks or Count(),
        lambda what, total: None,
    )


def said(found):
    """Effects that are named, or what a law acts on."""
    if found.law is not None:
        return (found.law.acts_on,)
    return tuple(sorted(one.id for one in found.effects))


def score(case, found):
    """One word for what a verdict is worth."""
    sets = {said(found), *(tuple(sorted(one)) for one in found.ambiguous_with)}
    if found.verdict in case.words and (case.effects in sets or not case.effects):
        return "right"
    if not case.effects and found.verdict in ("named", "ambiguous", "law"):
        return "false alarm"
    return "unknown" if not said(found) else "wrong"


def main():
    """Run all that was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", default=[])
    parser.add_argument("--seed", type=int, default=6)
    options = parser.parse_args()
    # Sizes of another seed are others as well.
    rng = np.random.default_rng(options.seed)
    size = 1.0 if options.seed == 6 else float(rng.uniform(0.7, 1.4))
    for name, case in cases(size).items():
        if options.only and name not in options.only:
            continue
        began, count = time.time(), Count()
        found = diagnosed(case, options.seed, count)
        row = (
            name,
            score(case, found),
            found.verdict,
            "+".join(said(found)),
            found.ambiguous_with,
            found.confirmed,
            f"{found.given.ratio_to_noise:.3g}",
            f"{found.after.ratio_to_noise:.3g}",
            count.runs,
            f"{time.time() - began:.0f} s",
        )
        print(*row, sep=" | ", flush=True)


if __name__ == "__main__":
    main()
