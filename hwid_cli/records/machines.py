"""Machines whose measurements can be simulated, and the plan of what is measured.

Every field is a key of the ``simulate:`` section of a configuration file; ``kind``
tells the machines apart. docs/method_simulation.md gives the equations and the reasons
for the numbers.
"""

import re
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from hwid_cli.records.mechanics import Mechanics
from hwid_cli.records.recordings import KINDS, frozen_vector
from hwid_cli.records.rules import (
    NOT_NEGATIVE,
    POSITIVE,
    SHARE,
    Each,
    FileLimit,
    Integer,
    OneOf,
    Refusal,
    Refused,
    check_fields,
)

CHANGING_PARAMETERS = ("stiffness", "damping", "force_constant")
_Count = Annotated[int, Integer(least=1), FileLimit(10_000_000)]
_CountOrNone = Annotated[int, Integer(least=0), FileLimit(10_000_000)]
_Seed = Annotated[int, Integer(least=0)]


@dataclass(frozen=True)
class ServoMachine:
    """The simulated servo of the thesis's chapter 2 (its table T2.1-1).

    Parameters
    ----------
    kind : str
        ``servo``.
    source_voltage_V : float, [V]
        DC voltage that is switched on.
    currents_A : tuple of float, [A]
        One recording each; the resistor is chosen as voltage / current. Empty: one
        recording with ``resistance_ohm``.
    resistance_ohm : float, [ohm]
        Resistor in series, used only where ``currents_A`` is empty.
    inductance_H : float, [H]
        Inductor in series.
    back_emf_V_per_rpm : float, [V/rpm]
        Back-EMF constant; in SI units it is the torque constant too.
    motor_resistance_ohm, motor_inductance_H : float, [ohm], [H]
    inertia_kg_m2 : float, [kg m2]
        Shaft and wheel.
    wheel_radius_m : float, [m]
    spring_rate_N_per_mm : float, [N/mm]
        Spring at the wheel's rim.
    damping_ratio : float, [-]
        Viscous damping of shaft and spring; the thesis's table has none.
    sample_time_s : float, [s]
    samples : int, [samples]
        Length of each recording, the rest included.
    rest_s : float, [s]
        Rest before the source is switched on.
    noise_relative : float, [-]
        Standard deviation of the sensors' noise as a share of the largest value.
    seed : int, [-]
    """

    kind: Annotated[str, OneOf(["servo"])] = "servo"
    source_voltage_V: Annotated[float, POSITIVE] = 220.0
    currents_A: Annotated[tuple[float, ...], POSITIVE] = (1.0, 2.0, 3.0, 4.0, 5.0)
    resistance_ohm: Annotated[float, NOT_NEGATIVE] = 100.0
    inductance_H: Annotated[float, POSITIVE] = 1.0
    back_emf_V_per_rpm: Annotated[float, NOT_NEGATIVE] = 7.2e-5
    motor_resistance_ohm: Annotated[float, NOT_NEGATIVE] = 3.9
    motor_inductance_H: Annotated[float, NOT_NEGATIVE] = 1.2e-5
    inertia_kg_m2: Annotated[float, POSITIVE] = 0.3
    wheel_radius_m: Annotated[float, POSITIVE] = 1.0
    spring_rate_N_per_mm: Annotated[float, POSITIVE] = 293.1
    damping_ratio: Annotated[float, NOT_NEGATIVE] = 0.02
    sample_time_s: Annotated[float, POSITIVE] = 2e-4
    samples: _Count = 2500
    rest_s: Annotated[float, NOT_NEGATIVE] = 0.04
    noise_relative: Annotated[float, NOT_NEGATIVE] = 0.0
    seed: _Seed = 1

    def __post_init__(self) -> None:
        check_fields(self)
        length_s = self.samples * self.sample_time_s
        if self.rest_s >= length_s:
            expected = f"shorter than the recording of {length_s:g} s"
            raise Refused(Refusal(self.rest_s, expected, ("rest_s",)))


@dataclass(frozen=True)
class ParameterChange:
    """A parameter that is another one in some recordings, constant within each.

    Parameters
    ----------
    parameter : str
        One of ``CHANGING_PARAMETERS``.
    largest : float, [-]
        Relative change is uniform within plus and minus this.
    share : float, [-]
        Probability that a recording is changed.
    """

    parameter: Annotated[str, OneOf(CHANGING_PARAMETERS)] = "stiffness"
    largest: Annotated[float, SHARE] = 0.1
    share: Annotated[float, SHARE] = 0.7

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Sensors:
    """What measuring adds to current and displacement.

    Parameters
    ----------
    displacement_noise_m, current_noise_A : float, [m], [A]
        Standard deviation of white noise.
    displacement_offset_m, current_offset_A : float, [m], [A]
        Offset is uniform within plus and minus this, constant in a recording.
    displacement_resolution_m : float, [m]
        Smallest difference that the sensor shows; 0 for none.
    damaged_samples : int, [samples]
        Largest number of single damaged samples in a column.
    displacement_damage_m, current_damage_A : float, [m], [A]
        A damaged sample is off by 50 to 100 % of this, in either direction.
    """

    displacement_noise_m: Annotated[float, NOT_NEGATIVE] = 1e-4
    displacement_offset_m: Annotated[float, NOT_NEGATIVE] = 3e-3
    displacement_resolution_m: Annotated[float, NOT_NEGATIVE] = 1e-4
    displacement_damage_m: Annotated[float, NOT_NEGATIVE] = 0.4
    current_noise_A: Annotated[float, NOT_NEGATIVE] = 0.004
    current_offset_A: Annotated[float, NOT_NEGATIVE] = 0.03
    current_damage_A: Annotated[float, NOT_NEGATIVE] = 8.0
    damaged_samples: _CountOrNone = 3

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class GunPlan:
    """Which recordings are made of the gun.

    Parameters
    ----------
    sample_time_s : float, [s]
    samples : int, [samples]
        Useful samples of each column, from the first one of the excitation on.
    step_ramps_samples : tuple of int, [samples]
        Rows of the table of steps: rise time, 0 for a jump.
    step_amplitudes_A : tuple of float, [A]
        Its columns.
    sine_frequencies_rad_per_sample : tuple of float, [rad/sample]
        Rows of the table of sines.
    sine_amplitudes_A : tuple of float, [A]
        Its columns.
    sine_left_out : tuple of str
        Cells of that table that are not measured, ``<row>x<column>`` from 1.
    sine_fade_in_samples : int, [samples]
        Time in which a sine's amplitude rises; 0 for all at once.
    random_amplitudes_A : tuple of float, [A]
        One random recording each.
    random_shortest_samples, random_longest_samples : int, [samples]
        Range of the distance between two random levels.
    shortest_lead_in_samples, longest_lead_in_samples : int, [samples]
        Range of the rest before the excitation.
    shortest_tail_samples, longest_tail_samples : int, [samples]
        Range of what each column goes on beyond the useful samples.
    only : tuple of str or None
        Names of the recordings to make; None for all. Leaving some out does not change
        the others.
    """

    sample_time_s: Annotated[float, POSITIVE] = 0.005
    samples: _Count = 7500
    step_ramps_samples: Annotated[tuple[int, ...], FileLimit(10_000_000)] = (
        0,
        100,
        300,
    )
    step_amplitudes_A: tuple[float, ...] = (2.0, 4.0, 6.0, 8.0, 10.0)
    sine_frequencies_rad_per_sample: tuple[float, ...] = (0.5, 0.34, 0.22, 0.11, 0.005)
    sine_amplitudes_A: tuple[float, ...] = (1.0, 2.0, 3.0, 4.0, 5.0)
    sine_left_out: Annotated[
        tuple[str, ...],
        Each(
            re.compile(r"[1-9]\d*x[1-9]\d*").fullmatch,
            "cells such as 4x5 (row x column)",
        ),
    ] = ("4x4", "4x5")
    sine_fade_in_samples: _CountOrNone = 500
    random_amplitudes_A: tuple[float, ...] = (1.0, 2.0, 3.0, 4.0, 5.0)
    random_shortest_samples: _Count = 20
    random_longest_samples: _Count = 80
    shortest_lead_in_samples: _CountOrNone = 150
    longest_lead_in_samples: _CountOrNone = 400
    shortest_tail_samples: _CountOrNone = 20
    longest_tail_samples: _CountOrNone = 200
    only: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        for shortest, longest in (
            ("random_shortest_samples", "random_longest_samples"),
            ("shortest_lead_in_samples", "longest_lead_in_samples"),
            ("shortest_tail_samples", "longest_tail_samples"),
        ):
            found, least = getattr(self, longest), getattr(self, shortest)
            if found < least:
                expected = f"at least {shortest} = {least!r}"
                raise Refused(Refusal(found, expected, (longest,)))


@dataclass(frozen=True)
class GunMachine:
    """The virtual welding gun that stands in for the thesis's chapter 3.

    Parameters
    ----------
    kind : str
        ``gun``.
    current_limit_A : float, [A]
        The drive cuts its command to plus and minus this.
    seed : int, [-]
    """

    kind: Annotated[str, OneOf(["gun"])] = "gun"
    mechanics: Mechanics = field(default_factory=Mechanics)
    current_limit_A: Annotated[float, POSITIVE] = 9.5
    change: ParameterChange = field(default_factory=ParameterChange)
    sensors: Sensors = field(default_factory=Sensors)
    plan: GunPlan = field(default_factory=GunPlan)
    seed: _Seed = 1

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True, eq=False)
class VirtualMeasurement:
    """One simulated recording, as raw as a measured one.

    Parameters
    ----------
    kind : str
        One of ``recordings.KINDS``.
    time_s : ndarray, shape (n_time,), [s]
        As long as the longer column.
    input : ndarray, shape (n_input,), [A]
    output : ndarray, shape (n_output,), [m]
        Starts together with the input, may end earlier or later.
    plan : dict of str to float, str or int
        How it was made: columns of ``raw/plan.csv``.
    """

    name: str
    kind: str
    time_s: np.ndarray
    input: np.ndarray
    output: np.ndarray
    plan: dict[str, float | str | int]

    def __post_init__(self) -> None:
        for name in ("time_s", "input", "output"):
            object.__setattr__(self, name, frozen_vector(getattr(self, name), name))
        if self.kind not in KINDS:
            raise ValueError(f"kind {self.kind!r} is none of {', '.join(KINDS)}")
        if self.time_s.size != max(self.input.size, self.output.size):
            raise ValueError(
                f"time_s must be as long as the longer column, "
                f"{max(self.input.size, self.output.size)}, got {self.time_s.size}"
            )
