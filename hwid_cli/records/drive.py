"""The physics simulation of a drive: mass, spring, damper, and effects on top."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from hwid_cli.records.rules import (
    NOT_NEGATIVE,
    POSITIVE,
    OneOf,
    Reading,
    Refusal,
    Refused,
    check_fields,
)

# How recordings start: at rest in equilibrium; at rest wherever friction holds the drive;
# anyhow, so that position and velocity are found from the recording.
STARTS = ("rest", "held", "estimated")
HOLDS = ("linear", "zero", "smooth")
# Parameters of the base that a re-fit may move; the mass only sets the scale.
BASE_PARAMETERS = (
    "damping_N_s_per_m",
    "stiffness_N_per_m",
    "force_constant_N_per_A",
)
# What may differ between recordings (effect ``parameter_change``).
CHANGING = ("stiffness", "force_constant", "damping")
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
class Repeatable(Reading):
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
    """A cascade: proportional position loop around a proportional velocity loop.

    ``input = velocity_gain (position_gain (reference - output) - velocity)``, computed
    at every sample and held until the next one.

    Parameters
    ----------
    position_gain_per_s : float, [1/s]
    velocity_gain : float, [input unit s/m]
    limit : float or None, [input unit]
        The command is cut to plus and minus this; None for no limit.
    """

    position_gain_per_s: Annotated[float, POSITIVE]
    velocity_gain: Annotated[float, POSITIVE]
    limit: Annotated[float | None, POSITIVE] = None

    def __post_init__(self) -> None:
        check_fields(self)


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

    def __post_init__(self) -> None:
        check_fields(self)


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
    """

    name: str
    time_s: np.ndarray
    input: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    rms: float
