"""Keys of cached tasks, and what a cache must be able to do.

A key is a hash of everything that a task's result depends on: the stage and its
version, the settings and the arrays. Names of recordings are no part of it, so a
renamed file is not fitted again.

Keys of what tasks are given: recordings and models, by their content.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from typing import Any, Protocol, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from hwid_cli.errors import CacheError
from hwid_cli.records.maps import Extrapolation
from hwid_cli.records.model import HammersteinWiener, StaticMap
from hwid_cli.records.recordings import Recording

Record = TypeVar("Record")
Keyed = TypeVar("Keyed", Recording, HammersteinWiener)


class Store(Protocol):
    """Results of tasks by key."""

    def get(self, key: str, record_type: type[Record]) -> Record | None:
        """Look a result up.

        Parameters
        ----------
        record_type : type
            The dataclass that was put.

        Returns
        -------
        Record or None
            None if there is none that can be used.
        """

    def put(self, key: str, record: object) -> None:
        """Keep a result, replacing what was kept under the same key."""

    @property
    def pack(self) -> Callable[[str, Any], Any]:
        """Turns key and result into what ``put_packed`` keeps; may run in a worker."""

    def put_packed(self, key: str, packed: Any) -> None:
        """Keep a result that was packed, which takes the least time.

        Parameters
        ----------
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
        record_type : type
            The dataclass that was put.
        """
        record = self._records.get(key)
        return record if isinstance(record, record_type) else None

    def put(self, key: str, record: object) -> None:
        """Keep a result."""
        self._records[key] = record

    @property
    def pack(self) -> Callable[[str, Any], Any]:
        """Nothing to do."""
        return _as_it_is

    def put_packed(self, key: str, packed: Any) -> None:
        """Keep a result."""
        self.put(key, packed)


def remembered(
    store: Store, key: str, record_type: type[Record], compute: Callable[[], Record]
) -> Record:
    """Look up what a table or a sentence shows beside stored results, or compute it.

    Where it cannot be stored it is computed each time: it is nothing that may be lost.

    Parameters
    ----------
    key : str
        As ``task_key`` gives it.
    compute : callable
        Gives the record.
    """
    found = store.get(key, record_type)
    if found is None:
        found = compute()
        with suppress(CacheError):
            store.put(key, found)
    return found


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
        return {item.name: _plain(getattr(value, item.name)) for item in fields(value)}
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


# Keys by the record: its arrays are read-only, and the same one is asked for many times.
_known_keys: WeakKeyDictionary[Recording | HammersteinWiener, str] = WeakKeyDictionary()


def recording_key(recording: Recording) -> str:
    """Content key of a recording: what a fit sees of it."""
    return _key_once(recording, _recording_key)


def _key_once(record: Keyed, key_of: Callable[[Keyed], str]) -> str:
    key = _known_keys.get(record)
    if key is None:
        key = _known_keys[record] = key_of(record)
    return key


def _recording_key(recording: Recording) -> str:
    settings = {
        "sample_time_s": recording.sample_time_s,
        "input_unit": recording.input_unit,
        "output_unit": recording.output_unit,
    }
    return task_key("recording", 1, settings, [recording.input, recording.output])


def model_key(model: HammersteinWiener) -> str:
    """Content key of a model: every number and word that it consists of."""
    return _key_once(model, _model_key)


def _model_key(model: HammersteinWiener) -> str:
    settings, arrays = _content(model, "")
    return task_key("model", 1, settings, arrays)


def _content(
    part: HammersteinWiener | StaticMap | Extrapolation, prefix: str
) -> tuple[dict[str, object], list[np.ndarray]]:
    settings: dict[str, object] = {}
    arrays: list[np.ndarray] = []
    for item in fields(part):
        value, name = getattr(part, item.name), prefix + item.name
        if isinstance(value, StaticMap | Extrapolation):
            inner_settings, inner_arrays = _content(value, f"{name}.")
            settings |= inner_settings
            arrays += inner_arrays
        elif isinstance(value, np.ndarray):
            arrays.append(value)
        else:
            settings[name] = value
    return settings, arrays
