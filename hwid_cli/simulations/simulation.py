"""What a kind of simulation must offer."""

import errno
import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hwid_cli.errors import SimulationError
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.programs import (
    Capabilities,
    FreeParameter,
    RunRequest,
    SimulatorRun,
)

# Formats of what a diagnosis found, to be called beside a simulation.
EFFECTS_ALONE = ("c", "simulink", "modelica")


def with_file_placed(options: Any, folder: Path) -> Any:
    """The section with an absolute path to its ``file``, where it names one."""
    file = getattr(options, "file", "")
    return replace(options, file=str((folder / file).resolve())) if file else options


def named_file(options: Any) -> str:
    """The ``file`` of a section, empty where it names none."""
    return str(getattr(options, "file", ""))


def with_fitted(options: Any, fitted: Mapping[str, float]) -> Any:
    """The section with other values of those of its ``parameters`` that are free."""
    given = getattr(options, "parameters", None)
    if given is None:
        return options
    parameters = {
        name: replace(one, value=fitted[name])
        if isinstance(one, FreeParameter) and name in fitted
        else one
        for name, one in given.items()
    }
    return replace(options, parameters=parameters)


@dataclass(frozen=True, eq=False)
class SimulationKind:
    """How simulations of one kind are run, and what there is to say of them.

    A section that names its file ``file`` and its parameters ``parameters``, with ``free``
    and ``values``, needs no more than the first three.

    Parameters
    ----------
    capabilities : callable
        From the section of the configuration to what such a simulation can do.
    run : callable or None
        One run, from the section, with its file as an absolute path, and a request.
        Raises ``SimulationError`` where it cannot be run or gives no answer. None where
        the recordings hold what it gave, or it is the program's own drive.
    content : callable or None
        From the section to a hash of all that decides what it gives; raises
        ``SimulationError`` where a file is missing.
    placed : callable
        From the section and the folder of the configuration to the section with absolute
        paths.
    own_code : callable
        From the section to the words for what runs that is the user's, empty for nothing.
    with_fitted : callable
        From the section and parameters by name to the section with these.
    with_model : callable or None
        From the section and the fitted model that its ``file`` or ``results`` name to the
        section that holds it; raises ``SimulationError`` where they do not agree. None
        for a kind that is no fitted model.
    files : callable or None
        From the section to the files that a copy of the simulation needs, its ``file``
        first. None where that cannot be told.
    exports : tuple of str
        Formats that it can be exported in with what a diagnosis found. In the first the
        export is the whole simulation.
    """

    capabilities: Callable[[Any], Capabilities]
    run: Callable[[Any, RunRequest], SimulatorRun] | None = None
    content: Callable[[Any], str] | None = None
    placed: Callable[[Any, Path], Any] = with_file_placed
    own_code: Callable[[Any], str] = named_file
    with_fitted: Callable[[Any, Mapping[str, float]], Any] = with_fitted
    with_model: Callable[[Any, HammersteinWiener], Any] | None = None
    files: Callable[[Any], list[Path]] | None = None
    exports: tuple[str, ...] = ()


def hash_of_file(path: str) -> str:
    """Checksum of a file.

    Returns
    -------
    str
        SHA-256, hexadecimal.

    Raises
    ------
    SimulationError
        If it cannot be read.
    """
    try:
        # A pipe would be waited for without an end.
        if Path(path).exists() and not Path(path).is_file():
            raise OSError(errno.EINVAL, "Is no plain file")
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise SimulationError(
            f"simulation.file: found {path!r}, {error.strerror}; expected a file; paths "
            "are relative to the configuration"
        ) from error
