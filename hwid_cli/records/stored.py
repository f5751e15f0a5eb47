"""What a record tells those who store it."""

from types import MappingProxyType
from typing import Any

# Metadata of a field that files of earlier versions lack: they are read with its default.
ADDED_LATER = MappingProxyType({"added_later": True})


def check_lengths(record: Any, *names: str) -> None:
    """Refuse a record whose arrays of some names differ in their shapes.

    Raises
    ------
    ValueError
    """
    shapes = {name: getattr(record, name).shape for name in names}
    if len(set(shapes.values())) > 1:
        told = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"{told} must have one shape")
