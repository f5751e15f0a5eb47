"""Keys of cached tasks, and what a cache must be able to do.

A key is a hash of everything that a task's result depends on: the stage and its
version, the settings and the arrays. Names of recordings are no part of it, so a
renamed file is not fitted again.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, is_dataclass
from typing import Any, Protocol, TypeVar

import numpy as np

Record = TypeVar("Record")


class Store(Protocol):
    """Results of tasks by key."""

    def get(self, key: str, record_type: type[Record]) -> Record | None:
        """Look a result up.

        Parameters
        ----------
        key : str
        record_type : type
            The dataclass that was put.

        Returns
        -------
        Record or None
            None if there is none that can be used.
        """

    def put(self, key: str, record: object) -> None:
        """Keep a result, replacing what was kept under the same key.

        Parameters
        ----------
        key : str
        record : dataclass instance
        """

    @property
    def pack(self) -> Callable[[str, Any], Any]:
        """Turns key and result into what ``put_packed`` keeps; may run in a worker."""

    def put_packed(self, key: str, packed: Any) -> None:
        """Keep a result that was packed, which takes the least time.

        Parameters
        ----------
        key : str
        packed : object
            As ``pack`` gives it for the same key.
        """


class MemoryStore:
    """A store that forgets everything when the program ends."""

    def __init__(self) -> None:
        self._records: dict[str, object] = {}

    def get(self, key: str, record_type: type[Record]) -> Record | None:
        """Look a result up.

        Parameters
        ----------
        key : str
        record_type : type
            The dataclass that was put.

        Returns
        -------
        Record or None
        """
        record = self._records.get(key)
        return record if isinstance(record, record_type) else None

    def put(self, key: str, record: object) -> None:
        """Keep a result.

        Parameters
        ----------
        key : str
        record : dataclass instance
        """
        self._records[key] = record

    @property
    def pack(self) -> Callable[[str, Any], Any]:
        """Nothing to do."""
        return _as_it_is

    def put_packed(self, key: str, packed: Any) -> None:
        """Keep a result.

        Parameters
        ----------
        key : str
        packed : dataclass instance
        """
        self.put(key, packed)


def _as_it_is(_: str, record: Any) -> Any:
    return record


def task_key(
    stage: str, version: int, settings: Any, arrays: Iterable[np.ndarray]
) -> str:
    """Make the key under which a task's result is kept.

    Parameters
    ----------
    stage : str
        Such as ``identify``.
    version : int
        The stage's ``STAGE_VERSION``; raised when a formula changes.
    settings : object
        Dataclasses, mappings with text keys, sequences and scalars, nested at will.
    arrays : iterable of ndarray
        Their type, shape and bytes count, and their order.

    Returns
    -------
    str
        SHA-256, hexadecimal.

    Raises
    ------
    TypeError
        If a setting or an array has no definite bytes.
    ValueError
        If a setting is not finite.

    Examples
    --------
    >>> task_key("identify", 1, {"units": 10}, [np.zeros(3)])[:8]
    '5ee4a332'
    """
    header = {"stage": stage, "version": int(version), "settings": _plain(settings)}
    digest = hashlib.sha256(_canonical(header))
    for array in arrays:
        if array.dtype.hasobject:
            raise TypeError(f"an array of {array.dtype} has no definite bytes")
        digest.update(_canonical({"dtype": array.dtype.str, "shape": array.shape}))
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _canonical(data: Any) -> bytes:
    """Bytes of plain data, the same for equal data; a line end closes them."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return text.encode() + b"\n"


def _plain(value: Any) -> Any:
    """Settings as JSON can hold them."""
    if is_dataclass(value) and not isinstance(value, type):
        return _plain(asdict(value))
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value):
            raise TypeError(f"settings need text as keys, got {list(value)!r}")
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise TypeError(f"a setting of type {type(value).__name__} has no definite bytes")
