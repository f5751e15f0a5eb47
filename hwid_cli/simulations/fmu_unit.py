"""One FMU for co-simulation in this process: opened once, run many times, by FMPy.

An instance is reset from run to run. Whether a reset leads back to the start is tried
after the first run; an FMU whose reset does not gets a fresh instance for each run.

Between samples inputs are straight lines. An FMU holds an input during a communication
step; it is given the mean over the step, which moves a continuous system as the line
does but for terms of the second order. One that is stepped at a fixed rate samples its
inputs itself, and is given the value at the start of the step.
"""

import ctypes
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.fmi3 import FMU3Slave
from fmpy.logging import addLoggerProxy
from fmpy.model_description import ModelDescription, read_model_description

from hwid_cli.files.messages import shown
from hwid_cli.files.suggestions import did_you_mean

_REAL = ("Real", "Float64")
_OUTPUTS = ("output", "local")
_GIVEN_STARTS = ("exact", "approx")
_STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")
_WARNING, _FATAL = 1, 4
# A run after a reset is compared over so many samples; a computer's sums may differ.
_COMPARED, _SAME = 500, 1e-9
_LONGEST_TEXT = 200


@dataclass(frozen=True)
class FmuNames:
    """Variables of an FMU, by what they are for.

    Parameters
    ----------
    force_input, velocity : str or None
        Where there is one.
    """

    input: str
    output: str
    force_input: str | None
    velocity: str | None
    parameters: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class FmuRequest:
    """One run.

    Parameters
    ----------
    inputs : ndarray, shape (n_samples, n_inputs)
    values : dict of str to float
        Of parameters and start values.
    every : int
        Communication steps between two samples.
    """

    names: FmuNames
    inputs: np.ndarray
    values: Mapping[str, float]
    sample_time_s: float
    every: int


@dataclass(frozen=True, eq=False)
class _Calls:
    """What the step loop calls; each gives a status."""

    set_inputs: Callable[[int], int]
    get_outputs: Callable[[int], int]
    do_step: Callable[[float, float], int]


class FmuUnit:
    """An FMU that was unpacked.

    Parameters
    ----------
    folder : Path
        With modelDescription.xml.

    Raises
    ------
    ValueError
        If it is none that can run here; the text says what to do.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.description = _description(folder)
        _check_platform(folder, self.description)
        self._variables = {one.name: one for one in self.description.modelVariables}
        self._fmu: Any = None
        self._said: list[str] = []
        self._is_reset_enough: bool | None = None
        self._is_fatal = False

    def check(self, names: FmuNames) -> None:
        """Raise ``ValueError`` where a name is not what it is used for."""
        self._input(names.input, "input")
        if names.force_input is not None:
            self._input(names.force_input, "force_input")
        self._output(names.output, "output")
        if names.velocity is not None:
            self._output(names.velocity, "velocity")
        for one in names.parameters:
            self._parameter(one)

    def run(self, request: FmuRequest) -> np.ndarray:
        """Outputs at the samples.

        Returns
        -------
        ndarray, shape (n_outputs, n_samples)

        Raises
        ------
        ValueError
            If the FMU fails; the text says where.
        """
        try:
            found = self._run(request)
            if self._is_reset_enough is None:
                self._is_reset_enough = self._resets(request, found)
        except FMICallException as error:
            self._is_fatal = error.status == _FATAL
            raise ValueError(
                f"{error.function} gave {_named(error.status)}{self._last_said()}"
            ) from None
        return found

    def _run(self, request: FmuRequest) -> np.ndarray:
        self._said.clear()
        self._start_again()
        names = request.names
        given = [one for one in (names.input, names.force_input) if one is not None]
        told = [one for one in (names.output, names.velocity) if one is not None]
        points = _between(request.inputs, request.every)
        first = dict(zip(given, points[0].tolist(), strict=True))
        self._initialise({**request.values, **first})
        found = self._stepped(request, self._references(given), points, told)
        self._fmu.terminate()
        return found

    def _resets(self, request: FmuRequest, before: np.ndarray) -> bool:
        """Whether a reset leads back to the start: the same run twice tells."""
        part = FmuRequest(
            request.names, request.inputs[:_COMPARED], request.values,
            request.sample_time_s, request.every,
        )  # fmt: skip
        self._is_reset_enough = True
        try:
            again = self._run(part)
        except (FMICallException, ValueError):
            # What it would do on being freed is not known.
            self._is_fatal = True
            return False
        size = np.max(np.abs(before), axis=1, keepdims=True)
        near = np.abs(again - before[:, :_COMPARED]) <= _SAME * size
        return bool(np.all(near | np.isnan(again)))

    def _start_again(self) -> None:
        """An instance in the state of a new one."""
        if self._fmu is not None and self._is_reset_enough is not False:
            with suppress(FMICallException):
                if not self._is_fatal:
                    self._fmu.reset()
                    return
        if self._fmu is not None and not self._is_fatal:
            with suppress(FMICallException):
                self._fmu.freeInstance()
        self._fmu, self._is_fatal = None, False
        self._fmu = self._instance()

    def _instance(self) -> Any:
        kind = FMU3Slave if self._is_3 else FMU2Slave
        try:
            fmu = kind(
                guid=self.description.guid,
                modelIdentifier=self.description.coSimulation.modelIdentifier,
                unzipDirectory=str(self._folder),
                instanceName="hwid",
            )
            if self._is_3:
                fmu.instantiate(logMessage=self._hear)
            else:
                fmu.instantiate(callbacks=self._callbacks())
        except Exception as error:
            # FMPy raises plain ones.
            raise ValueError(
                f"cannot be loaded ({str(error)[:_LONGEST_TEXT]}){self._last_said()}; "
                "expected a co-simulation FMU that runs in `fmpy simulate`"
            ) from error
        return fmu

    def _callbacks(self) -> Any:
        found = fmi2CallbackFunctions()
        found.logger = fmi2CallbackLoggerTYPE(
            lambda _, name, status, category, text: self._hear(
                None, status, category, text
            )
        )
        found.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        found.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
        with suppress(Exception):
            # Fills in what a message formats; some platforms have no such library.
            addLoggerProxy(ctypes.byref(found))
        return found

    def _hear(self, _: object, status: int, __: object, text: bytes) -> None:
        if status > _WARNING:
            self._said.append(" ".join(text.decode("utf-8", "replace").split()))

    def _last_said(self) -> str:
        return f": {shown(self._said[-1][:_LONGEST_TEXT])}" if self._said else ""

    def _initialise(self, starts: Mapping[str, float]) -> None:
        references = [self._variables[name].valueReference for name in starts]
        values = list(starts.values())
        if self._is_3:
            self._fmu.setFloat64(references, values)
            self._fmu.enterInitializationMode(startTime=0.0)
        else:
            self._fmu.setReal(references, values)
            self._fmu.setupExperiment(startTime=0.0)
            self._fmu.enterInitializationMode()
        self._fmu.exitInitializationMode()

    def _stepped(
        self,
        request: FmuRequest,
        references: Any,
        points: np.ndarray,
        told: Sequence[str],
    ) -> np.ndarray:
        """The step loop; values go in and out by address, without a copy.

        Parameters
        ----------
        points : ndarray, shape (n_steps + 1, n_inputs)
            Inputs at the communication points.
        """
        every, n_samples = request.every, len(request.inputs)
        held = points if self._samples_inputs else 0.5 * (points[1:] + points[:-1])
        held = np.ascontiguousarray(held)
        found = np.empty((n_samples, len(told)))
        calls = self._calls(references, self._references(told))
        set_inputs, get_outputs, do_step = (
            calls.set_inputs, calls.get_outputs, calls.do_step,
        )  # fmt: skip
        at, held_at, found_at = (one.ctypes.data for one in (points, held, found))
        width, found_width = points.strides[0], found.strides[0]
        step = request.sample_time_s / every
        last = n_samples - 1
        for sample in range(n_samples):
            first = sample * every
            # An output may answer to the input of the same instant.
            status = set_inputs(at + first * width)
            if status > _WARNING:
                raise self._failed("setting its inputs", status, first * step)
            status = get_outputs(found_at + sample * found_width)
            if status > _WARNING:
                raise self._failed("reading its outputs", status, first * step)
            if sample == last:
                break
            for now in range(first, first + every):
                status = set_inputs(held_at + now * width)
                if status > _WARNING:
                    raise self._failed("setting its inputs", status, now * step)
                status = do_step(now * step, step)
                if status > _WARNING:
                    raise self._failed("its step", status, now * step)
        return np.ascontiguousarray(found.T)

    def _failed(self, what: str, status: int, time_s: float) -> ValueError:
        self._is_fatal = status == _FATAL
        return ValueError(
            f"{what} gave {_named(status)} at {time_s:g} s{self._last_said()}; expected "
            "OK; narrow simulation.parameters bounds, or try a smaller simulation.step_s"
        )

    def _calls(self, given: Any, told: Any) -> _Calls:
        """Functions of the FMU with all that stays the same from step to step."""
        component, library = self._fmu.component, self._fmu.dll
        pointer, size, real = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_double
        if self._is_3:
            access = [pointer, pointer, size, pointer, size]
            set_one = _prototype(library, "fmi3SetFloat64", access)
            get_one = _prototype(library, "fmi3GetFloat64", access)
            flags = (ctypes.c_bool * 3)()
            time = ctypes.c_double()
            event, end, early = (ctypes.addressof(flags) + one for one in range(3))
            until = ctypes.addressof(time)
            step_types = [pointer, real, real, ctypes.c_bool, *[pointer] * 4]
            step_one = _prototype(library, "fmi3DoStep", step_types)

            def step_3(now: float, step: float) -> int:
                status = step_one(component, now, step, True, event, end, early, until)
                # A simulation that asks to end gives no more outputs.
                return 2 if flags[1] and status <= _WARNING else status

            n, m = len(given), len(told)
            return _Calls(
                lambda at: set_one(component, given, n, at, n),
                lambda at: get_one(component, told, m, at, m),
                step_3,
            )
        access = [pointer, pointer, size, pointer]
        set_one = _prototype(library, "fmi2SetReal", access)
        get_one = _prototype(library, "fmi2GetReal", access)
        step_types = [pointer, real, real, ctypes.c_int]
        step_one = _prototype(library, "fmi2DoStep", step_types)
        n, m = len(given), len(told)
        return _Calls(
            lambda at: set_one(component, given, n, at),
            lambda at: get_one(component, told, m, at),
            lambda now, step: step_one(component, now, step, 1),
        )

    @property
    def _is_3(self) -> bool:
        return str(self.description.fmiVersion).startswith("3")

    @property
    def _samples_inputs(self) -> bool:
        return not self.description.coSimulation.canHandleVariableCommunicationStepSize

    def _references(self, names: Sequence[str]) -> Any:
        found = [self._variables[name].valueReference for name in names]
        return (ctypes.c_uint32 * len(found))(*found)

    def _input(self, name: str, key: str) -> None:
        self._check(name, key, lambda one: one.causality == "input", "an input")

    def _output(self, name: str, key: str) -> None:
        self._check(name, key, lambda one: one.causality in _OUTPUTS, "an output")

    def _parameter(self, name: str) -> None:
        what = "a parameter or start value that can be set before a run"
        self._check(name, "parameters", _can_be_set, what)

    def _check(
        self, name: str, key: str, is_right: Callable[[Any], bool], what: str
    ) -> None:
        place = f"simulation.{key}: found {name!r}"
        possible = [
            one.name
            for one in self._variables.values()
            if is_right(one) and one.type in _REAL and not one.dimensions
        ]
        one = self._variables.get(name)
        step = did_you_mean(name, possible)
        if one is None:
            raise ValueError(f"{place}, which the FMU does not have; {step}")
        if not is_right(one):
            kinds = " ".join(filter(None, (one.variability, one.causality or "local")))
            raise ValueError(f"{place}, a {kinds}; expected {what}; {step}")
        if one.type not in _REAL or one.dimensions:
            kind = (
                f"an array of {one.type}" if one.dimensions else f"of type {one.type}"
            )
            raise ValueError(
                f"{place}, {kind}; expected a scalar {' or '.join(_REAL)}; {step}"
            )


def _can_be_set(one: Any) -> bool:
    if one.causality == "parameter":
        return one.variability != "constant"
    is_state = one.causality in (*_OUTPUTS, None) and one.variability != "constant"
    return is_state and one.initial in _GIVEN_STARTS


def _named(status: int) -> str:
    return _STATUS[status] if 0 <= status < len(_STATUS) else f"status {status}"


def _prototype(library: Any, name: str, types: list[Any]) -> Any:
    """A function of the library, apart from the one that FMPy calls."""
    found = library[name]
    found.argtypes, found.restype = types, ctypes.c_int
    return found


def _between(inputs: np.ndarray, every: int) -> np.ndarray:
    """Inputs at communication points, on straight lines between samples."""
    if every == 1:
        return np.ascontiguousarray(inputs)
    samples = np.arange(len(inputs))
    points = np.arange((len(inputs) - 1) * every + 1) / every
    return np.column_stack([np.interp(points, samples, one) for one in inputs.T])


def _description(folder: Path) -> ModelDescription:
    if not (folder / "modelDescription.xml").is_file():
        raise ValueError(
            "is no FMU: it holds no modelDescription.xml; expected a file that a "
            "simulation program exported as FMI 2 or 3"
        )
    try:
        found = read_model_description(str(folder), validate=False)
    except Exception as error:
        said = str(error)[:_LONGEST_TEXT]
        raise ValueError(
            f"has a modelDescription.xml that cannot be read ({said}); expected FMI "
            "2.0 or 3.0; export it again"
        ) from error
    if not str(found.fmiVersion).startswith(("2.", "3.")):
        raise ValueError(
            f"is of FMI version {found.fmiVersion}; expected 2.0 or 3.0; export it so"
        )
    if found.coSimulation is None:
        raise ValueError(
            "is for model exchange only, without a solver; expected co-simulation; "
            "export it as a co-simulation FMU"
        )
    return found


def _check_platform(folder: Path, description: ModelDescription) -> None:
    is_3 = str(description.fmiVersion).startswith("3")
    here = fmpy.platform_tuple if is_3 else fmpy.platform
    name = f"{description.coSimulation.modelIdentifier}{fmpy.sharedLibraryExtension}"
    if (folder / "binaries" / here / name).is_file():
        return
    others = sorted(one.name for one in (folder / "binaries").glob("*") if one.is_dir())
    held = ", ".join(others) or "none"
    step = "export it for this platform"
    if any((folder / "sources").glob("*.c")):
        step += ", or build its sources with `fmpy compile`"
    raise ValueError(
        f"has binaries for other platforms ({held}); expected binaries/{here}/{name}; "
        f"{step}"
    )
