"""Simulations that are a program: it reads two files and writes one.

``{inputs}`` stands for a CSV file with the time and the inputs, ``{parameters}`` for a JSON
file, ``{outputs}`` for the CSV file that the program writes. Every run has a folder of its
own for them. Files that its arguments name are looked for in the configuration's folder.
"""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from hwid_cli.errors import SimulationError
from hwid_cli.records.programs import (
    Capabilities,
    CommandSimulation,
    RunRequest,
    SimulatorRun,
)
from hwid_cli.simulations.answers import checked_run, failed
from hwid_cli.simulations.simulation import (
    EFFECTS_ALONE,
    SimulationKind,
    hash_of_file,
)

FILES = {"inputs": "inputs.csv", "parameters": "parameters.json", "outputs": "out.csv"}
_LONGEST_TEXT = 300


def _run(options: CommandSimulation, request: RunRequest) -> SimulatorRun:
    with tempfile.TemporaryDirectory(prefix="hwid_run_") as folder:
        places = {key: Path(folder) / name for key, name in FILES.items()}
        _write_inputs(places["inputs"], options, request)
        places["parameters"].write_text(json.dumps(dict(request.parameters)))
        _call(options, request, places)
        return checked_run(_read_outputs(places["outputs"], request), options, request)


def _write_inputs(path: Path, options: CommandSimulation, request: RunRequest) -> None:
    columns = {
        "time_s": request.sample_time_s * np.arange(request.input.size),
        options.input: request.input,
    }
    if options.force_input is not None:
        force = request.force if request.force.size else np.zeros(request.input.size)
        columns[options.force_input] = force
    np.savetxt(
        path,
        np.column_stack(list(columns.values())),
        fmt="%.17g",
        delimiter=",",
        header=",".join(columns),
        comments="",
    )


def _call(
    options: CommandSimulation, request: RunRequest, places: Mapping[str, Path]
) -> None:
    command = [
        _filled(one, {key: str(path) for key, path in places.items()})
        for one in options.command
    ]
    # A group of its own, so that what it starts can be ended with it.
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    ) as process:
        try:
            said = process.communicate(timeout=options.time_limit_s)[1]
        except subprocess.TimeoutExpired:
            _end(process)
            late = f"{command[0]} did not end within {options.time_limit_s:g} s"
            raise failed(request, late) from None
        except BaseException:
            _end(process)
            raise
    if process.returncode != 0:
        lines = said.decode("utf-8", "replace").strip().splitlines()
        last = f": {lines[-1][:_LONGEST_TEXT]}" if lines else ""
        raise failed(
            request, f"{command[0]} ended with code {process.returncode}{last}"
        )


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a program and what it has started."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except (AttributeError, OSError):
        process.kill()
    process.wait()


def _filled(argument: str, places: Mapping[str, str]) -> str:
    for key, path in places.items():
        argument = argument.replace(f"{{{key}}}", path)
    return argument


def _read_outputs(path: Path, request: RunRequest) -> dict[str, np.ndarray]:
    try:
        lines = path.read_text(encoding="utf-8-sig").split("\n")
        names = [one.strip().strip('"') for one in lines[0].split(",")]
        rows = [one.split(",") for one in lines[1:] if one.strip()]
        table = np.array(rows, dtype=np.float64).reshape(len(rows), -1)
    except OSError:
        raise failed(
            request, "wrote no outputs; expected a CSV file at {outputs}"
        ) from None
    except ValueError as error:
        raise failed(request, f"wrote outputs that are no numbers: {error}") from error
    if table.shape[1] != len(names):
        raise failed(
            request,
            f"wrote {len(names)} names and {table.shape[1]} columns; expected a header "
            "with one name for each column",
        )
    return dict(zip(names, table.T, strict=True))


def _capabilities(options: CommandSimulation) -> Capabilities:
    return Capabilities(
        run=True, parameters=bool(options.free), force=options.force_input is not None
    )


def _content(options: CommandSimulation) -> str:
    """Hash of the command, and of the files that it names."""
    if shutil.which(options.command[0]) is None:
        raise SimulationError(
            f"simulation.command: found {options.command[0]!r}; expected a program that "
            "can be run; name it with its folder, or install it"
        )
    whole = hashlib.sha256(json.dumps(options.command).encode())
    for one in options.command:
        if Path(one).is_file():
            whole.update(hash_of_file(one).encode())
    return whole.hexdigest()


def _placed(options: CommandSimulation, folder: Path) -> CommandSimulation:
    """Files that its arguments name; programs on the search path stay."""
    there = [
        str((folder / one).resolve()) if (folder / one).is_file() else one
        for one in options.command
    ]
    return replace(options, command=tuple(there))


def _own_code(options: CommandSimulation) -> str:
    return " ".join(options.command)


KIND = SimulationKind(
    _capabilities,
    _run,
    _content,
    placed=_placed,
    own_code=_own_code,
    exports=EFFECTS_ALONE,
)
