"""Simulations of the user's own, as a configuration names them.

A function, a program, an FMU, a model that was exported, or only what some simulation has
given. What each of them can do decides what a diagnosis may claim.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Annotated

import numpy as np

from hwid_cli.records.drive import Repeatable
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.rules import (
    NO_KEY,
    POSITIVE,
    Filled,
    Number,
    OneOf,
    Refusal,
    Refused,
)

_TIME_LIMIT = Number(above=0, words="a number of seconds > 0")


# Without bounds a fit leaves this share of a parameter at least.
_LEAST_OF_GIVEN = 1e-3


@dataclass(frozen=True)
class FreeParameter:
    """A parameter of a simulation that may be fitted again.

    Parameters
    ----------
    bounds : tuple of float
        Lowest and highest value; empty for none.
    """

    value: float
    bounds: tuple[float, ...] = ()

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest value of a fit: without bounds its sign stays.

        A damping that turns negative imitates what is missing. A value of 0 has no sign.
        """
        if self.bounds:
            return self.bounds[0], self.bounds[1]
        if self.value == 0:
            return -inf, inf
        least = _LEAST_OF_GIVEN * self.value
        return (least, inf) if least > 0 else (-inf, least)

    def __post_init__(self) -> None:
        if not self.bounds:
            return
        if len(self.bounds) != 2 or not self.bounds[0] < self.bounds[1]:
            expected = "two numbers, the lower one first"
            raise Refused(Refusal(list(self.bounds), expected, ("bounds",)))
        if not self.bounds[0] <= self.value <= self.bounds[1]:
            low, high = self.bounds
            expected = f"a number within its bounds, {low:g} to {high:g}"
            raise Refused(Refusal(self.value, expected, ("value",)))


@dataclass(frozen=True)
class StandInChange:
    """What stands in for parameters that a simulation does not offer.

    Factors of the drive that stands for the simulation: what that drive gives more, or
    less, acts on the simulation as a force.

    Parameters
    ----------
    damping, stiffness, force_constant : float, [-]
    curve : float, [-]
        Of what bends its spring, if anything does.
    """

    damping: Annotated[float, POSITIVE] = 1.0
    stiffness: Annotated[float, POSITIVE] = 1.0
    force_constant: Annotated[float, POSITIVE] = 1.0
    curve: Annotated[float, POSITIVE] = 1.0

    @property
    def is_none(self) -> bool:
        """Whether it changes nothing."""
        return self == StandInChange()

    def is_within(self, share: float) -> bool:
        """Whether each factor is 1 but for a share."""
        factors = self.damping, self.stiffness, self.force_constant, self.curve
        return all(abs(one - 1.0) <= share for one in factors)

    def beside(self, other: "StandInChange") -> "StandInChange":
        """Both changes, one after the other."""
        return StandInChange(
            self.damping * other.damping,
            self.stiffness * other.stiffness,
            self.force_constant * other.force_constant,
            self.curve * other.curve,
        )


class _Parametrised:
    """Parameters of a simulation, by name: numbers that stay, and those that are free."""

    parameters: dict[str, float | FreeParameter]

    @property
    def free(self) -> dict[str, FreeParameter]:
        """Parameters that may be fitted again, by name."""
        return {
            name: one
            for name, one in self.parameters.items()
            if isinstance(one, FreeParameter)
        }

    @property
    def values(self) -> dict[str, float]:
        """All parameters as given, by name."""
        return {
            name: one.value if isinstance(one, FreeParameter) else float(one)
            for name, one in self.parameters.items()
        }


@dataclass(frozen=True, kw_only=True)
class _Program(_Parametrised):
    """What all simulations that can be run have in common.

    Parameters
    ----------
    input, output : str
        Which of its inputs the recordings' input drives, and which of its outputs they
        measure.
    force_input : str or None
        An input at which a missing force may act.
    velocity : str or None
        An output.
    parameters : dict of str to float or FreeParameter
        A plain number is handed over and stays as it is.
    time_limit_s : float, [s]
        Of one run.
    effects : dict of str to dict of str to float or str
        Put into the simulation beside what it has.
    stand_in : StandInChange
        Put into it beside its own parameters.
    """

    input: Annotated[str, Filled("the name of an input")]
    output: Annotated[str, Filled("the name of an output")]
    force_input: str | None = None
    velocity: str | None = None
    parameters: dict[str, float | FreeParameter] = field(default_factory=dict)
    time_limit_s: Annotated[float, _TIME_LIMIT] = 60.0
    effects: Annotated[dict[str, dict[str, float | str]], Repeatable()] = field(
        default_factory=dict
    )
    stand_in: StandInChange = field(default_factory=StandInChange)


@dataclass(frozen=True, kw_only=True)
class PythonSimulation(_Program):
    """A function ``simulate(time_s, inputs, parameters)`` that returns outputs by name.

    Parameters
    ----------
    file : str
        Relative to the configuration.
    """

    kind: Annotated[str, OneOf(["python"])] = "python"
    file: Annotated[str, Filled("a Python file")]
    function: Annotated[str, Filled("the name of a function")] = "simulate"


@dataclass(frozen=True, kw_only=True)
class FmuSimulation(_Program):
    """An FMU for co-simulation, FMI 2 or 3.

    Parameters
    ----------
    file : str
        Relative to the configuration.
    step_s : float or None, [s]
        Communication step; None for the sample time.
    """

    kind: Annotated[str, OneOf(["fmu"])] = "fmu"
    file: Annotated[str, Filled("a file")]
    step_s: Annotated[float | None, POSITIVE] = None


@dataclass(frozen=True, kw_only=True)
class CommandSimulation(_Program):
    """A program that reads ``{inputs}`` and ``{parameters}`` and writes ``{outputs}``."""

    kind: Annotated[str, OneOf(["command"])] = "command"
    command: Annotated[tuple[str, ...], Filled("a program and its arguments")]


@dataclass(frozen=True, kw_only=True)
class ModelSimulation(_Parametrised):
    """A model that was fitted: out of a folder of results, or exported as JSON.

    Parameters
    ----------
    file : str
        Of an exported model, relative to the configuration.
    results : str
        Folder of results in place of a file, relative to the configuration.
    name : str
        Of the model in it; empty: the one that covers most recordings in the final test.
    parameters : dict of str to float or FreeParameter
        Factors of its linear block (``simulations.model``); a plain number stays.
    model : HammersteinWiener or None
        That the file holds; None until it is read.
    """

    kind: Annotated[str, OneOf(["model"])] = "model"
    file: str = ""
    results: str = ""
    name: str = ""
    parameters: dict[str, float | FreeParameter] = field(default_factory=dict)
    model: HammersteinWiener | None = field(default=None, metadata=NO_KEY)
    model_sample_time_s: float = field(default=0.0, metadata=NO_KEY)
    effects: Annotated[dict[str, dict[str, float | str]], Repeatable()] = field(
        default_factory=dict
    )
    stand_in: StandInChange = field(default_factory=StandInChange)

    def __post_init__(self) -> None:
        if bool(self.file) == bool(self.results) and self.model is None:
            said = (
                "found file and results"
                if self.file
                else "found neither file nor results"
            )
            expected = (
                "file: a model's JSON file, or results: a folder of hwid's results"
            )
            step = "hwid test CONFIG makes such a folder"
            raise Refused(Refusal(None, expected, said=said, step=step))


@dataclass(frozen=True, kw_only=True)
class OutputsSimulation:
    """What a simulation has given: ``recordings.columns.simulated``."""

    kind: Annotated[str, OneOf(["outputs"])] = "outputs"
    effects: Annotated[dict[str, dict[str, float | str]], Repeatable()] = field(
        default_factory=dict
    )
    stand_in: StandInChange = field(default_factory=StandInChange)


Program = PythonSimulation | FmuSimulation | CommandSimulation
# The table of kinds: what ``simulation.kind`` may say beside ``drive``, and how each of
# them is run says the module of that name in ``simulations``.
ForeignSimulation = Program | OutputsSimulation | ModelSimulation


@dataclass(frozen=True)
class Capabilities:
    """What a simulation can do.

    Parameters
    ----------
    run : bool
        It can be run with other inputs.
    parameters : bool
        Some of its parameters may be changed.
    force : bool
        A force can act on it beside its input.
    step : bool
        It can be run step by step.
    """

    run: bool
    parameters: bool = False
    force: bool = False
    step: bool = False


OF_DRIVE = Capabilities(run=True, parameters=True, force=True)


@dataclass(frozen=True, eq=False)
class RunRequest:
    """One run of a simulation.

    Parameters
    ----------
    name : str
        Of the recording.
    input : ndarray, shape (n_samples,)
    force : ndarray, shape (n_samples,) or (0,), [N]
        At the simulation's force input; empty for none.
    """

    name: str
    sample_time_s: float
    input: np.ndarray
    force: np.ndarray
    parameters: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class SimulatorRun:
    """What a run has given.

    Parameters
    ----------
    output : ndarray, shape (n_samples,)
    velocity : ndarray, shape (n_samples,) or (0,)
        Empty where the simulation does not give it.
    """

    output: np.ndarray
    velocity: np.ndarray
