"""The files that hold results: their provenance, and how a stage is replaced in one.

Which stages have left results: absent ones are told from ones that are damaged.
"""

import json
import logging
import math
import platform
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from hwid_cli import __version__
from hwid_cli.errors import CacheError, UntrustedFunctionError
from hwid_cli.files.atomic import check_format, replaced_hdf5
from hwid_cli.files.checksums import has_checksum, with_checksum, without_checksum
from hwid_cli.files.plain_files import refuse_unless_plain
from hwid_cli.store.hdf5_values import read_array, write_array

Result = TypeVar("Result")

RESULTS_FORMAT = "hwid-results"
CALIBRATED_FORMAT = "hwid-calibrated"
RESULTS = "results.h5"
# Stages whose results are a file of their own; every other has a group in RESULTS.
_OWN_FILES = {"calibrate": ("calibrated.h5", CALIBRATED_FORMAT)}
SCHEMA_VERSION = 1
# Root attribute of files with a checksum behind them; earlier versions had none.
HAS_CHECKSUM = "sealed"

_log = logging.getLogger(__name__)

# Packages whose version can move a number or change a file.
_PACKAGES = ("numpy", "scipy", "numba", "h5py")


@dataclass(frozen=True)
class Provenance:
    """What a stage's results came from; stored with them.

    Parameters
    ----------
    key : str
        Hash of everything that the stage depends on, see ``tasks.cache.task_key``.
    config : mapping
        Resolved configuration, see ``config.load.describe_experiment``.
    inputs : mapping of str to str
        SHA-256 of each recording's file by the recording's name.
    seconds : float, [s]
        Time that the run of the stage took which gave the results; NaN unknown.
    versions : mapping of str to str
        What computed them, see ``current_versions``; empty unknown.
    """

    key: str
    config: Mapping[str, Any] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    seconds: float = float("nan")
    versions: Mapping[str, str] = field(default_factory=dict)


def results_file(stage: str) -> str:
    """Name of the file, below the folder of the results, that holds those of a stage."""
    return _OWN_FILES.get(stage, (RESULTS, RESULTS_FORMAT))[0]


def _group_of(file: h5py.File, stage: str) -> h5py.Group:
    return file if stage in _OWN_FILES else file[stage]


def current_versions() -> dict[str, str]:
    """Versions of the program, of Python and of what computes and stores.

    Returns
    -------
    dict of str to str
        Without packages that are not installed.
    """
    versions = {"hwid": __version__, "python": platform.python_version()}
    for package in _PACKAGES:
        with suppress(PackageNotFoundError):
            versions[package] = version(package)
    return versions


def read_stage_key(path: Path, stage: str) -> str | None:
    """Read the key of a stage's stored results.

    Parameters
    ----------
    path : Path
        The stage's ``results_file``.

    Returns
    -------
    str or None
        None if there are no results of that stage, or none that can be read.
    """
    try:
        with _opened(path, stage) as file:
            return str(_group_of(file, stage).attrs["key"])
    except (CacheError, KeyError, OSError):
        return None


def write_provenance(group: h5py.Group, provenance: Provenance) -> None:
    """Write where results came from into their group.

    Parameters
    ----------
    group : h5py.Group
    """
    group.attrs["key"] = provenance.key
    inner = group.create_group("provenance")
    inner.attrs["package_version"] = __version__
    config = json.dumps(provenance.config, indent=1, sort_keys=True)
    write_array(inner, "config", np.array(config, dtype=object))
    names = sorted(provenance.inputs)
    hashes = [provenance.inputs[name] for name in names]
    write_array(inner, "input_names", np.array(names, dtype=object))
    write_array(inner, "input_sha256", np.array(hashes, dtype=object))
    inner.attrs["seconds"] = provenance.seconds
    versions = inner.create_group("versions")
    for name, number in provenance.versions.items():
        versions.attrs[name] = number


def read_provenance(path: Path, stage: str) -> Provenance:
    """Read where a stage's stored results came from.

    Parameters
    ----------
    path : Path
        The stage's ``results_file``.

    Returns
    -------
    Provenance
        Seconds are NaN and versions empty where an older program did not store them.

    Raises
    ------
    CacheError
        If there are no results of that stage, or none that can be read.
    """

    def read(file: h5py.File) -> Provenance:
        group = _group_of(file, stage)
        inner = group["provenance"]
        names = read_array(inner, "input_names").tolist()
        hashes = read_array(inner, "input_sha256").tolist()
        stored = inner["versions"].attrs if "versions" in inner else {}
        return Provenance(
            key=str(group.attrs["key"]),
            config=_config(str(read_array(inner, "config"))),
            inputs=dict(zip(names, hashes, strict=True)),
            seconds=float(inner.attrs.get("seconds", math.nan)),
            versions={str(name): str(number) for name, number in stored.items()},
        )

    return read_results(path, stage, read)


def _config(text: str) -> dict[str, Any]:
    config = json.loads(text)
    if not isinstance(config, dict):
        raise ValueError(f"the configuration is a {type(config).__name__}")
    return config


@contextmanager
def replaced_stage(
    path: Path, stage: str, provenance: Provenance
) -> Iterator[h5py.Group]:
    """Give the empty group of a stage in a new ``results.h5`` with all other stages.

    Yields
    ------
    h5py.Group
        The file on disk is replaced when the block ends.

    Raises
    ------
    CacheError
        If the new file cannot be written; the old one is untouched then.
    """
    with replaced_hdf5(
        path,
        format_name=RESULTS_FORMAT,
        version=SCHEMA_VERSION,
        start=_readable_bytes(path, stage),
        checksum=with_checksum,
        is_lasting=True,
    ) as file:
        file.attrs[HAS_CHECKSUM] = True
        if stage in file:
            # HDF5 gives the room to what is written before the file is closed.
            del file[stage]
        group = file.create_group(stage)
        write_provenance(group, provenance)
        yield group


def _readable_bytes(path: Path, stage: str) -> bytes:
    """Content of a results file; one that cannot be read is set aside."""
    refuse_unless_plain(path)
    if not path.exists():
        return b""
    try:
        content = path.read_bytes()
    except OSError as error:
        # What cannot be read now may be whole: only a content that is wrong is damage.
        raise CacheError(
            f"{path}: cannot be read ({error.strerror}); expected a file that may be "
            "read and replaced; mend the disk, or choose another folder with --out"
        ) from error
    try:
        with _faults_of(path, stage):
            # Of what was read: a disk that fails at a second look says nothing of it.
            image = without_checksum(content)
            with h5py.File(h5py.h5f.open_file_image(image), "r") as file:
                _check(file, stage, content)
                # Damage below the root shows only where it is looked at.
                file.visititems(_look_at)
            return image
    except CacheError:
        aside = path.with_name(f"{path.name}.bad")
        try:
            path.replace(aside)
        except OSError as error:
            raise CacheError(
                f"{path}: damaged, and cannot be set aside ({error.strerror}); expected "
                "a folder that may be written; mend it or choose another with --out"
            ) from error
        _log.warning(
            "%s: cannot be read; set aside as %s; other stages than %s come back from "
            "the cache when they are run",
            path,
            aside.name,
            stage,
        )
        return b""


def _look_at(_: str, item: h5py.Group | h5py.Dataset) -> None:
    """Read an item's header; going on needs None."""
    dict(item.attrs)


def read_results(path: Path, stage: str, read: Callable[[h5py.File], Result]) -> Result:
    """Read a stage's results; every fault is one line that says what to do.

    Parameters
    ----------
    path : Path
        The stage's ``results_file``.
    read : callable
        From the open file to the results.

    Raises
    ------
    CacheError
        If the file or the stage is missing, or cannot be read.
    """
    if not path.is_file():
        raise CacheError(
            f"{path}: no such file; expected the results of {stage}; run 'hwid {stage}'"
        )
    with _opened(path, stage) as file:
        if stage not in _OWN_FILES and stage not in file:
            raise CacheError(
                f"{path}: holds {', '.join(file) or 'nothing'}; expected the results "
                f"of {stage}; run 'hwid {stage}'"
            )
        return read(file)


@contextmanager
def _opened(path: Path, stage: str) -> Iterator[h5py.File]:
    """Give an open results file; faults in it become errors that a user can act on."""
    with _faults_of(path, stage):
        if not path.is_file():
            raise ValueError("it is no plain file")
        content = path.read_bytes()
        without_checksum(content)
        # File systems without locks exist; a file that is replaced as a whole needs none.
        with h5py.File(path, "r", locking=False) as file:
            _check(file, stage, content)
            del content
            yield file


def _check(file: h5py.File, stage: str, content: bytes) -> None:
    """Refuse a file of another format, or one that has lost its checksum."""
    _, format_name = _OWN_FILES.get(stage, (RESULTS, RESULTS_FORMAT))
    check_format(file, format_name=format_name, version=SCHEMA_VERSION)
    if HAS_CHECKSUM in file.attrs and not has_checksum(content):
        raise ValueError("its checksum is gone: cut off, or changed since")


@contextmanager
def _faults_of(path: Path, stage: str) -> Iterator[None]:
    """What is wrong with a results file, as an error that a user can act on."""
    try:
        yield
    except UntrustedFunctionError as error:
        raise UntrustedFunctionError(f"{path}: {stage}: {error}") from error
    except (LookupError, OSError, RuntimeError, TypeError, ValueError) as error:
        said = " ".join(str(error).split())
        raise CacheError(
            f"{path}: cannot be read ({said}); expected the results of {stage}; "
            f"move the file away and run 'hwid {stage}' again"
        ) from error


def has_left_results(path: Path, stage: str) -> bool:
    """Whether a stage has left results, be they readable or not.

    Parameters
    ----------
    path : Path
        The stage's ``results_file``.

    Returns
    -------
    bool
        False only where the file, or the stage in it, is surely absent. A file that
        cannot be opened counts as results: reading them says what is wrong with it.
    """
    if not path.exists():
        return False
    if not path.is_file():
        return True
    try:
        without_checksum(path.read_bytes())
        with h5py.File(path, "r", locking=False) as file:
            is_whole = stage in _OWN_FILES or "format" not in file.attrs
            return is_whole or stage in file
    except (KeyError, OSError, RuntimeError, ValueError):
        return True
