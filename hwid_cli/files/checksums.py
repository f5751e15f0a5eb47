"""A checksum behind the content of a file; readers of HDF5 do not look there.

HDF5 itself does not notice a changed number, and some damaged files crash its library.
"""

import hashlib

MARK = b"hwid-sha256:"
_LENGTH = len(MARK) + hashlib.sha256().digest_size


def with_checksum(content: bytes) -> bytes:
    """Add the checksum."""
    return content + MARK + hashlib.sha256(content).digest()


def has_checksum(content: bytes) -> bool:
    """Whether there is a checksum, right or wrong."""
    return content[-_LENGTH:].startswith(MARK)


def without_checksum(content: bytes) -> bytes:
    """Check and take off the checksum where there is one.

    Raises
    ------
    ValueError
        If content and checksum do not match.
    """
    if not has_checksum(content):
        return content
    inner, checksum = content[:-_LENGTH], content[-_LENGTH:]
    if MARK + hashlib.sha256(inner).digest() != checksum:
        raise ValueError("content and checksum do not match")
    return inner
