"""Simulations that are an FMU: co-simulation by FMI 2 or 3.

The FMU runs in a process of its own, which is kept from run to run: a crash or a hang
ends that process, and nothing else.
"""

import base64
import shutil
import tempfile
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hwid_cli.errors import SimulationError
from hwid_cli.files.isolated_process import IsolatedReader, Labelled, serve
from hwid_cli.records.programs import (
    Capabilities,
    FmuSimulation,
    RunRequest,
    SimulatorRun,
)
from hwid_cli.simulations.answers import checked_run, failed
from hwid_cli.simulations.simulation import (
    EFFECTS_ALONE,
    SimulationKind,
    hash_of_file,
)

if TYPE_CHECKING:
    from hwid_cli.simulations.fmu_unit import FmuUnit

_PROCESS = IsolatedReader("hwid_cli.simulations.fmu", "the FMU")
# Unpacking and loading a large one, and starting Python.
_OPENING_S = 120.0
# A step fits into the sample time a whole number of times, to rounding in files.
_ROUNDING = 1e-6


def _run(options: FmuSimulation, request: RunRequest) -> SimulatorRun:
    about = _opened(options)
    about["run"] = _told(options, request)
    try:
        arrays = _PROCESS.ask(about, most_seconds=options.time_limit_s)
    except ValueError as error:
        name = Path(options.file).name
        raise failed(request, f"{name}: {error}") from error
    outputs = {str(label[0]): values for label, values in arrays}
    return checked_run(outputs, options, request)


def _told(options: FmuSimulation, request: RunRequest) -> dict[str, Any]:
    """What the process has to know of a run."""
    columns = [request.input]
    if options.force_input is not None:
        force = request.force if request.force.size else np.zeros(request.input.size)
        columns.append(force)
    inputs = np.column_stack(columns).astype("<f8")
    return {
        # As text in base 64: numbers as text would take longer than the run.
        "inputs": base64.b64encode(inputs.tobytes()).decode("ascii"),
        "n_inputs": len(columns),
        "values": dict(request.parameters),
        "sample_time_s": request.sample_time_s,
        "every": _steps_of_a_sample(options, request),
    }


def _steps_of_a_sample(options: FmuSimulation, request: RunRequest) -> int:
    """Communication steps from sample to sample."""
    sample = request.sample_time_s
    if options.step_s is None:
        return 1
    share = sample / options.step_s
    every = round(share)
    if every < 1 or abs(share - every) > _ROUNDING * every:
        raise SimulationError(
            f"simulation.step_s: found {options.step_s:g}; expected a step that fits a "
            f"whole number of times into the sample time of recording {request.name!r}, "
            f"{sample:g} s; take {sample / max(every, 1):g}, or leave step_s out"
        )
    return every


def _opened(options: FmuSimulation) -> dict[str, Any]:
    """Have the FMU unpacked, loaded and checked; what names it to the process.

    Raises
    ------
    SimulationError
        If it cannot be run as the section says.
    """
    about = {
        "file": options.file,
        "sha256": _hash_of(options.file),
        "folder": _folder().name,
        "names": {
            "input": options.input,
            "output": options.output,
            "force_input": options.force_input,
            "velocity": options.velocity,
            "parameters": list(options.parameters),
        },
    }
    try:
        _PROCESS.ask(about, most_seconds=_OPENING_S)
    except ImportError as error:
        raise SimulationError(
            f"simulation.kind: found fmu, which needs FMPy ({error}); install it with "
            "pip install 'hwid[fmu]'"
        ) from error
    except ValueError as error:
        said = str(error)
        place = "" if said.startswith("simulation.") else "simulation.file: "
        name = Path(options.file).name
        raise SimulationError(f"{place}{name} {said}" if place else said) from error
    return about


@cache
def _folder() -> "tempfile.TemporaryDirectory[str]":
    """Where this program's FMUs are unpacked; goes with it."""
    return tempfile.TemporaryDirectory(prefix="hwid_fmu_", ignore_cleanup_errors=True)


def _hash_of(file: str) -> str:
    """Checksum, read again only where the file has changed."""
    try:
        found = Path(file).stat()
    except OSError:
        return hash_of_file(file)
    return _kept_hash(file, found.st_mtime_ns, found.st_size)


@cache
def _kept_hash(file: str, time_ns: int, size: int) -> str:  # noqa: ARG001
    return hash_of_file(file)


def _answer(request: dict[str, Any]) -> Iterator[Labelled]:
    """Open an FMU, and run it: the work of the process."""
    from hwid_cli.simulations.fmu_unit import FmuNames, FmuRequest

    unit = _unit(request["file"], request["sha256"], request["folder"])
    told = request["names"]
    names = FmuNames(**{**told, "parameters": tuple(told["parameters"])})
    unit.check(names)
    run = request.get("run")
    if run is None:
        return
    inputs = np.frombuffer(base64.b64decode(run["inputs"]), "<f8")
    found = unit.run(
        FmuRequest(
            names,
            inputs.reshape(-1, run["n_inputs"]),
            run["values"],
            run["sample_time_s"],
            run["every"],
        )
    )
    told_names = [one for one in (names.output, names.velocity) if one is not None]
    for name, values in zip(told_names, found, strict=True):
        yield [name], values


@cache
def _unit(file: str, sha256: str, folder: str) -> "FmuUnit":
    from hwid_cli.simulations.fmu_unit import FmuUnit

    there = Path(folder) / sha256
    if not there.is_dir():
        part = Path(tempfile.mkdtemp(dir=folder))
        try:
            with zipfile.ZipFile(file) as archive:
                archive.extractall(part)
        except (zipfile.BadZipFile, NotImplementedError) as error:
            raise ValueError(
                f"is no FMU: {error}; expected a zip archive that a simulation program "
                "exported"
            ) from None
        # An earlier process that was ended may have left half of it.
        part.rename(there)
    return FmuUnit(there)


def _capabilities(options: FmuSimulation) -> Capabilities:
    return Capabilities(
        run=True,
        parameters=bool(options.free),
        force=options.force_input is not None,
        step=True,
    )


def _content(options: FmuSimulation) -> str:
    """Hash of the file, which was found to be an FMU that can be run."""
    return str(_opened(options)["sha256"])


def _files(options: FmuSimulation) -> list[Path]:
    return [Path(options.file)]


KIND = SimulationKind(
    _capabilities,
    _run,
    _content,
    files=_files,
    exports=("fmu", "python", *EFFECTS_ALONE),
)

if __name__ == "__main__":
    _FOLDERS: set[str] = set()

    def _remembered(request: dict[str, Any]) -> Iterator[Labelled]:
        _FOLDERS.add(request["folder"])
        yield from _answer(request)

    serve(_remembered, most_memory=None)
    # The program has gone, and may not have had time for it.
    for _one in _FOLDERS:
        shutil.rmtree(_one, ignore_errors=True)
