"""The physics simulation of a drive: mass, spring, damper, and effects on top."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from hwid_cli.records.axis import AXES, MotionUnits, unit_on
from hwid_cli.records.rules import (
    NOT_NEGATIVE,
    POSITIVE,
    OneOf,
    OtherForm,
    Refusal,
    Refused,
    check_fields,
)

# How recordings start: at rest in equilibrium; at rest wherever friction holds the drive;
# anyhow, so that position and velocity are found from the recording.
STARTS = ("rest", "held", "estimated")
# How an input goes on between samples: in a line, held, or smoothly.
LINE, HELD = "linear", "zero"
HOLDS = (LINE, HELD, "smooth")
# What a configuration says that leaves it to the recordings.
UNSAID_HOLD = "auto"
# What the sensor of the output measures.
OUTPUTS = ("position", "velocity")
# Parameters of the base that a re-fit may move; the mass only sets the scale.
BASE_PARAMETERS = (
    "damping_N_s_per_m",
    "stiffness_N_per_m",
    "force_constant_N_per_A",
)
# Where the input is the force itself, that sets the scale.
BASE_UNDER_FORCE = ("mass_kg", "damping_N_s_per_m", "stiffness_N_per_m")
# All that the motion of the base depends on.
BASE_AND_MASS = ("mass_kg", *BASE_PARAMETERS)
# Fields of a drive that its file form has not: two are told by the names of others, one is
# a matter of a re-fit.
NOT_IN_FILES = ("axis", "input_unit", "is_resistance_free", "is_mass_free")
# Of a motor under a voltage whose resistance is off, so that a damping below 0 would fit.
BASE_WITH_RESISTANCE = (
    "resistance_ohm",
    "stiffness_N_per_m",
    "force_constant_N_per_A",
)
# What the input of a simulation may be, by the unit of its numbers; a force as it acts.
SOURCES = {"A": "current", "V": "voltage", "N": "force", "N m": "torque"}
FORCES = ("N", "N m")
# Keys of a controller that is a cascade, and of a PID controller; the needed ones first.
CASCADE_KEYS = ("position_gain_per_s", "velocity_gain", "reset_rate_per_s")
PID_KEYS = ("proportional_gain", "integral_gain", "derivative_gain")
# What may differ between recordings (effect ``parameter_change``).
CHANGING = ("stiffness", "force_constant", "damping", "mass")
# The effect that an inductance of the simulation is where a re-fit moves it.
WINDING = "winding_inductance"
# Marks the id of an effect that is there for the second time.
SECOND = ":second"
EffectValues = dict[str, float | str]


def told_apart(
    effects: Iterable[tuple[str, EffectValues]],
) -> dict[str, EffectValues]:
    """Effects by their ids, the second one of an id with a mark.

    Parameters
    ----------
    effects : iterable of (str, dict of str to float or str)
        Ids and parameters.

    Raises
    ------
    Refused
        If an id comes a third time.

    Examples
    --------
    >>> told_apart([("end_stop", {}), ("cogging", {}), ("end_stop", {})])
    {'end_stop': {}, 'cogging': {}, 'end_stop:second': {}}
    """
    found: dict[str, EffectValues] = {}
    for identifier, values in effects:
        name = identifier + SECOND if identifier in found else identifier
        if name in found:
            said, step = "{} is there a third time", "an effect may occur twice"
            raise Refused(Refusal(identifier, said=said, step=step))
        found[name] = values
    return found


def as_written(
    effects: Mapping[str, EffectValues],
) -> dict[str, EffectValues] | list[dict[str, EffectValues]]:
    """Effects as a file holds them: a list of one key each where one occurs twice.

    Examples
    --------
    >>> as_written({"end_stop": {"position_m": 1}, "end_stop:second": {}})
    [{'end_stop': {'position_m': 1}}, {'end_stop': {}}]
    """
    if not any(name.endswith(SECOND) for name in effects):
        return dict(effects)
    return [{name.removesuffix(SECOND): one} for name, one in effects.items()]


@dataclass(frozen=True)
class Repeatable(OtherForm):
    """Effects of a file: a section with keys, or a list of sections with one key."""

    def read(self, value: Any) -> Any:
        """Value as the record holds it."""
        if isinstance(value, dict):
            marked = [key for key in value if isinstance(key, str) and SECOND in key]
            if marked:
                expected = "the id of an effect"
                step = "write a list of effects, each with one key, to have one twice"
                raise Refused(Refusal(marked[0], expected, step=step))
        if not isinstance(value, list):
            return value
        for one in value:
            if not isinstance(one, dict) or len(one) != 1:
                expected = "an effect: one key with its parameters"
                raise Refused(Refusal(one, expected))
        return told_apart([next(iter(one.items())) for one in value])


@dataclass(frozen=True)
class Controller:
    """A cascade or a PID controller, computed at every sample and held until the next.

    Cascade: a proportional position loop around a proportional velocity loop, with
    ``reset_rate_per_s`` a proportional-integral one: ``error = position_gain (reference -
    position) - velocity``, ``input = velocity_gain (error + reset_rate sum(error) dt)``.

    PID, or P, PI and PD: ``error = reference - output``, ``input = proportional_gain
    error + integral_gain sum(error) dt + derivative_gain (error - previous error) / dt``.

    Parameters
    ----------
    position_gain_per_s : float or None, [1/s]
    velocity_gain : float or None, [input unit s/m]
        None with a PID controller, as is the position gain.
    limit : float or None, [input unit]
        The command is cut to plus and minus this; None for no limit. The integral part
        does not grow while it is cut.
    reset_rate_per_s : float, [1/s]
    proportional_gain : float or None, [input unit/output unit]
        None with a cascade.
    integral_gain : float, [input unit/(output unit s)]
    derivative_gain : float, [input unit s/output unit]
    """

    position_gain_per_s: Annotated[float | None, POSITIVE] = None
    velocity_gain: Annotated[float | None, POSITIVE] = None
    limit: Annotated[float | None, POSITIVE] = None
    reset_rate_per_s: Annotated[float, NOT_NEGATIVE] = 0.0
    proportional_gain: Annotated[float | None, POSITIVE] = None
    integral_gain: Annotated[float, NOT_NEGATIVE] = 0.0
    derivative_gain: Annotated[float, NOT_NEGATIVE] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        cascade, pid = (
            [name for name in keys if getattr(self, name)]
            for keys in (CASCADE_KEYS, PID_KEYS)
        )
        if cascade and pid:
            expected = (
                f"a cascade ({', '.join(CASCADE_KEYS)}) or a PID controller "
                f"({', '.join(PID_KEYS)})"
            )
            said = f"found {{}} beside {cascade[0]}"
            value = getattr(self, pid[0])
            raise Refused(Refusal(value, expected, (pid[0],), said, step="remove one"))
        for name in PID_KEYS[:1] if pid else CASCADE_KEYS[:2]:
            if getattr(self, name) is None:
                step = "add the key"
                if not cascade and not pid:
                    step += f", or {PID_KEYS[0]} of a PID controller"
                refusal = Refusal(None, "a number > 0", (name,), "missing", step=step)
                raise Refused(refusal)

    @property
    def has_sum(self) -> bool:
        """Whether it holds a command without an error: an integral part."""
        return self.integral_gain > 0 or self.reset_rate_per_s > 0

    @property
    def at_once_per_position(self) -> float:
        """Command that an error of the position makes at once, [input unit/m]."""
        if self.proportional_gain is not None:
            return self.proportional_gain
        return (self.position_gain_per_s or 0.0) * (self.velocity_gain or 0.0)


@dataclass(frozen=True)
class Drive:
    """A drive with the effects that its simulation holds.

    Parameters
    ----------
    mass_kg : float, [kg]
    damping_N_s_per_m : float, [N s/m]
    stiffness_N_per_m : float, [N/m]
        0 for a free axis.
    force_constant_N_per_A : float, [N/A]
    effects : mapping of str to mapping of str to float
        Parameters of each effect by its id, of the second one of an id marked
        (``told_apart``); ``which`` of ``parameter_change`` is text.
    reference_current_A, reference_displacement_m : float, [A], [m]
        Where laws that need a reference count from (Iref and xr).
    resistance_ohm : float or None, [ohm]
        None: the input is the current. Else it is the voltage.
    inductance_H : float, [H]
    back_emf_V_s_per_m : float or None, [V s/m]
        None: the same number as the force constant.
    hold : str
        One of ``HOLDS``: how the input goes on between samples; ``smooth`` for one that
        was low-pass filtered before it was sampled.
    controller : Controller or None
        None: the input is given. Else it follows a reference.
    output : str
        One of ``OUTPUTS``: what is measured.
    axis : str
        One of ``AXES``: rotating where m stands for rad, N for N m and kg for kg m^2.
    input_unit : str
        One of ``SOURCES``; empty for A, or V where there is a circuit. Under N and N m the
        force constant is a number without unit, and exact.
    is_resistance_free : bool
        Whether a re-fit moves the resistance in the place of the damping: of both,
        recordings tell one.
    is_mass_free : bool
        Whether a re-fit moves the mass, and the force constant sets the scale.
    """

    mass_kg: Annotated[float, POSITIVE] = 1.0
    damping_N_s_per_m: Annotated[float, NOT_NEGATIVE] = 0.0
    stiffness_N_per_m: Annotated[float, NOT_NEGATIVE] = 0.0
    force_constant_N_per_A: float = 1.0
    effects: Mapping[str, Mapping[str, float | str]] = field(default_factory=dict)
    reference_current_A: Annotated[float, POSITIVE] = 1.0
    reference_displacement_m: Annotated[float, POSITIVE] = 1.0
    resistance_ohm: Annotated[float | None, POSITIVE] = None
    inductance_H: Annotated[float, NOT_NEGATIVE] = 0.0
    back_emf_V_s_per_m: float | None = None
    hold: Annotated[str, OneOf(HOLDS)] = "linear"
    controller: Controller | None = None
    output: Annotated[str, OneOf(OUTPUTS)] = "position"
    axis: Annotated[str, OneOf(AXES)] = "linear"
    input_unit: Annotated[str, OneOf(("", *SOURCES))] = ""
    is_resistance_free: bool = False
    is_mass_free: bool = False

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def source_unit(self) -> str:
        """Unit of the input, one of ``SOURCES``."""
        return self.input_unit or ("A" if self.resistance_ohm is None else "V")

    @property
    def units(self) -> MotionUnits:
        """Of force, displacement and input on this axis."""
        force, length = (unit_on(self.axis, one) for one in ("N", "m"))
        return MotionUnits(force, length, self.source_unit)

    @property
    def straight_units(self) -> MotionUnits:
        """The same on a straight axis, whatever this one is."""
        return MotionUnits(source=self.source_unit)

    @property
    def source(self) -> str:
        """What the input is, in words."""
        return SOURCES[self.source_unit]

    @property
    def is_driven_by_force(self) -> bool:
        """Whether the input is the force, or the torque, as it acts."""
        return self.source_unit in FORCES

    @property
    def has_known_forces(self) -> bool:
        """Whether forces are to scale beside the input, and the mass is fitted."""
        return self.is_driven_by_force or self.is_mass_free

    @property
    def fitted_base(self) -> tuple[str, ...]:
        """Parameters of the base that a re-fit may move; the other one sets the scale."""
        if self.is_resistance_free:
            return BASE_WITH_RESISTANCE
        return BASE_UNDER_FORCE if self.has_known_forces else BASE_PARAMETERS


@dataclass(frozen=True)
class StandIn(Drive):
    """A drive that stands for a simulation which cannot be opened.

    Its spring may be curved, ``k x + k2 x^2 + k3 x^3``, beside any effect.

    Parameters
    ----------
    quadratic_N_per_m2, cubic_N_per_m3 : float, [N/m^2], [N/m^3]
        k2 and k3, of either sign.
    one_curve_N_per_m : float, [N/m]
        Stiffness k that k2 and k3 belong to, where the spring is one curve that changes
        as a whole; 0 where k changes alone.
    lag_s : float, [s]
        Time constant of a lag that the simulation's input passes before it acts as a
        force; 0 for none.
    reset_per_s : float, [1/s]
        At which an integral part of a loop inside the simulation sums up what drives the
        mass beside its spring; 0 for none.
    own_units : MotionUnits
        Of the simulation.
    """

    quadratic_N_per_m2: float = 0.0
    cubic_N_per_m3: float = 0.0
    one_curve_N_per_m: float = 0.0
    lag_s: float = 0.0
    reset_per_s: float = 0.0
    own_units: MotionUnits = field(default_factory=MotionUnits)

    @property
    def units(self) -> MotionUnits:
        """Those of the simulation."""
        return self.own_units

    @property
    def straight_units(self) -> MotionUnits:
        """The same: it has no axis of another kind."""
        return self.own_units

    @property
    def bends(self) -> tuple[float, float]:
        """k2 and k3 beside the stiffness that the drive has now."""
        of_curve = self.one_curve_N_per_m
        share = self.stiffness_N_per_m / of_curve if of_curve > 0 else 1.0
        return share * self.quadratic_N_per_m2, share * self.cubic_N_per_m3


@dataclass(frozen=True, eq=False)
class DriveResponse:
    """A recording beside the simulation of its drive.

    Parameters
    ----------
    time_s, input, measured, simulated : ndarray, shape (n_samples,)
        Under a controller input, measured and simulated are the reference, the measured
        command and the simulated one.
    rms : float
        Of measured minus simulated, in the unit of what is compared.
    start : float
        By how much the recording starts above the simulation, which was added to it.
    """

    name: str
    time_s: np.ndarray
    input: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    rms: float
    start: float = 0.0
