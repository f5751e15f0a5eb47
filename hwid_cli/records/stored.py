"""What a record tells those who store it."""

from types import MappingProxyType

# Metadata of a field that files of earlier versions lack: they are read with its default.
ADDED_LATER = MappingProxyType({"added_later": True})
