"""Options of compiled functions that only other compiled functions call."""

from typing import Any

from numba.core.options import DefaultOptions

_BOTH: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    # Without entries for Python and C they compile a fifth faster.
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
_COUNTS = hasattr(DefaultOptions, "_nrt")
# Those that make no arrays need not count who holds one: twice to five times as fast.
# One that makes an array after all does not compile.
INNER = {**_BOTH, "_nrt": False} if _COUNTS else _BOTH
# Those that make arrays; said of each, or they would do as the one that calls them.
MAKING = {**_BOTH, "_nrt": True} if _COUNTS else _BOTH
