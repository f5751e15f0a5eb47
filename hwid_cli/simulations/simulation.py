"""What a kind of simulation must offer."""

import errno
import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hwid_cli.errors import SimulationError
from hwid_cli.records.programs import Capabilities, RunRequest, SimulatorRun


@dataclass(frozen=True, eq=False)
class SimulationKind:
    """How simulations of one kind are run.

    Parameters
    ----------
    capabilities : callable
        From the section of the configuration to what such a simulation can do.
    run : callable or None
        One run, from the section, with its file as an absolute path, and a request.
        Raises ``SimulationError`` where it cannot be run or gives no answer.
    content : callable or None
        From the section to a hash of all that decides what it gives; raises
        ``SimulationError`` where a file is missing.
    """

    capabilities: Callable[[Any], Capabilities]
    run: Callable[[Any, RunRequest], SimulatorRun] | None = None
    content: Callable[[Any], str] | None = None


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
