"""A checksum behind the end of an HDF5 file, where readers of HDF5 do not look.

A flipped bit would else be read as a number; and HDF5's library crashes the interpreter
on some damaged files.
"""

import hashlib
from pathlib import Path

_MARK = b"\nhwid sha256 "
_DIGEST_BYTES = hashlib.sha256().digest_size
_SEAL_BYTES = len(_MARK) + _DIGEST_BYTES
_PIECE_BYTES = 2**20


def sealed(image: bytes) -> bytes:
    """Add the checksum.

    Parameters
    ----------
    image : bytes
        Of an HDF5 file.

    Returns
    -------
    bytes
    """
    return image + _MARK + hashlib.sha256(image).digest()


def unsealed(content: bytes) -> bytes:
    """Take the checksum off; a file without one comes from an earlier version.

    Parameters
    ----------
    content : bytes

    Returns
    -------
    bytes
    """
    is_sealed = content[-_SEAL_BYTES:].startswith(_MARK)
    return content[:-_SEAL_BYTES] if is_sealed else content


def check_seal(path: Path) -> None:
    """Refuse a file that was changed or damaged since it was written.

    Parameters
    ----------
    path : Path
        A file without a checksum passes: it comes from an earlier version, or another
        program has changed it.

    Raises
    ------
    OSError
        If it cannot be read.
    ValueError
        If content and checksum do not match.
    """
    # Opening a pipe would wait for somebody to write into it.
    if path.exists() and not path.is_file():
        raise ValueError("is no plain file")
    with path.open("rb") as file:
        left = max(file.seek(0, 2) - _SEAL_BYTES, 0)
        file.seek(left)
        seal = file.read()
        if not seal.startswith(_MARK):
            return
        file.seek(0)
        digest = hashlib.sha256()
        while left:
            piece = file.read(min(left, _PIECE_BYTES))
            digest.update(piece)
            left -= len(piece)
    if seal != _MARK + digest.digest():
        raise ValueError("content and checksum do not match")
