"""Simulations that are a Python function: ``simulate(time_s, inputs, parameters)``.

The function runs in a process of its own, which is kept from run to run: a crash or an
endless loop ends that process, and nothing else.
"""

import hashlib
import importlib.util
import inspect
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from hwid_cli.files.isolated_process import IsolatedReader, Labelled, serve
from hwid_cli.records.programs import (
    Capabilities,
    PythonSimulation,
    RunRequest,
    SimulatorRun,
)
from hwid_cli.simulations.answers import checked_run, failed
from hwid_cli.simulations.simulation import (
    EFFECTS_ALONE,
    SimulationKind,
    hash_of_file,
)

_PROCESS = IsolatedReader("hwid_cli.simulations.python", "the function")
_ARGUMENTS = 3
# Marks a module as loaded here.
_IS_SIMULATION = "_is_a_simulation_of_hwid"


def _run(options: PythonSimulation, request: RunRequest) -> SimulatorRun:
    inputs = {options.input: request.input.tolist()}
    if options.force_input is not None:
        force = request.force if request.force.size else np.zeros(request.input.size)
        inputs[options.force_input] = force.tolist()
    try:
        arrays = _PROCESS.ask(
            {
                "file": options.file,
                "function": options.function,
                "sample_time_s": request.sample_time_s,
                "inputs": inputs,
                "parameters": dict(request.parameters),
            },
            most_seconds=options.time_limit_s,
        )
    except ValueError as error:
        place = f"{Path(options.file).name}: {options.function}()"
        raise failed(request, f"{place}: {error}") from error
    outputs = {
        str(label[0]): values.reshape([int(one) for one in label[1]])
        for label, values in arrays
    }
    return checked_run(outputs, options, request)


def _answer(request: dict[str, Any]) -> Iterator[Labelled]:
    """Run the function: the work of the process."""
    function = _function(request["file"], request["function"])
    inputs = {name: np.array(one) for name, one in request["inputs"].items()}
    size = next(iter(inputs.values())).size
    time_s = request["sample_time_s"] * np.arange(size)
    try:
        found = function(time_s, inputs, dict(request["parameters"]))
    except SystemExit as error:
        raise ValueError(f"called exit({error.code!r})") from None
    except KeyError as error:
        given = ", ".join([*inputs, *request["parameters"]])
        said = _said(error, request["file"])
        raise ValueError(
            f"{said}; it is given {given}; correct simulation.input, force_input or "
            "parameters"
        ) from error
    except Exception as error:
        raise ValueError(_said(error, request["file"])) from error
    if not isinstance(found, dict):
        raise ValueError(
            f"gave a {type(found).__name__}; expected a dict of arrays by name"
        )
    for name, values in found.items():
        array = np.asarray(values, dtype=np.float64)
        yield [str(name), list(array.shape)], array.ravel()


def _said(error: Exception, file: str) -> str:
    """Type and text of an error, and the last line of the file that led to it."""
    line, trace = None, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    where = "" if line is None else f"line {line}: "
    return f"{where}{type(error).__name__}: {error}"


@cache
def _function(file: str, name: str) -> Any:
    module = _module(file)
    function = getattr(module, name, None)
    if not callable(function):
        known = [
            one
            for one, value in vars(module).items()
            if inspect.isfunction(value) and not one.startswith("_")
        ]
        raise ValueError(
            f"defines no such function; it defines {', '.join(known)}; "
            "name one of them in simulation.function"
        )
    try:
        inspect.signature(function).bind(*range(_ARGUMENTS))
    except TypeError:
        raise ValueError(
            f"takes {inspect.signature(function)}; expected three arguments: time_s, "
            "inputs, parameters; give it these, or name another simulation.function"
        ) from None
    return function


def _module(file: str) -> ModuleType:
    # What lies beside it can be imported, as when it is run itself.
    sys.path.insert(0, str(Path(file).parent))
    name = _module_name(Path(file).stem)
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ValueError("is no Python file; expected a name that ends in .py")
    module = importlib.util.module_from_spec(spec)
    # What it keeps compiled names it so, and is read by the user's own scripts as well.
    setattr(module, _IS_SIMULATION, True)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except SystemExit as error:
        raise ValueError(f"called exit({error.code!r})") from None
    except Exception as error:
        raise ValueError(f"its file does not run: {_said(error, file)}") from error
    return module


def _module_name(stem: str) -> str:
    """Name of the module of a file, which takes the place of no other one."""
    before = sys.modules.get(stem)
    is_taken = before is not None and not hasattr(before, _IS_SIMULATION)
    return "hwid_simulation" if is_taken or not stem.isidentifier() else stem


def _capabilities(options: PythonSimulation) -> Capabilities:
    return Capabilities(
        run=True, parameters=bool(options.free), force=options.force_input is not None
    )


def _content(options: PythonSimulation) -> str:
    """Hash of all of its files."""
    _, *beside = _files(options)
    whole = hashlib.sha256(hash_of_file(options.file).encode())
    for one in beside:
        whole.update(one.name.encode() + hash_of_file(str(one)).encode())
    return whole.hexdigest()


def _files(options: PythonSimulation) -> list[Path]:
    """The file and all Python files beside it, which it may import."""
    file = Path(options.file)
    return [file, *sorted(one for one in file.parent.glob("*.py") if one != file)]


KIND = SimulationKind(
    _capabilities,
    _run,
    _content,
    files=_files,
    exports=("python", *EFFECTS_ALONE),
)

if __name__ == "__main__":
    serve(_answer, most_memory=None)
