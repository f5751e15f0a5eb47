"""Bytes on disk, safely: whole files or none, checksums, locks, limits, plain messages."""
