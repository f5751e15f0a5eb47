"""Figures that say themselves whether they are whole, and what they were drawn from.

A PNG carries the SHA-256 of its content and of what it shows as a text chunk before its
end, where programs that show pictures pass it over. A figure that is empty, half,
changed, of another recording or of earlier results is told from one that may stay.
"""

import hashlib
import struct
import zlib
from pathlib import Path

from hwid_cli.files.atomic import replace_file

_KEYWORD = b"hwid-sha256\0"
_DIGITS = 2 * hashlib.sha256().digest_size
# Length, name, text and sum of the chunk; and the chunk that ends every PNG.
_CHUNK = 4 + 4 + len(_KEYWORD) + _DIGITS + 4
_END = 12


def write_figure(path: Path, png: bytes, about: str) -> None:
    """Put a figure into a file in one step, unless it is there already.

    Parameters
    ----------
    png : bytes
        As it was drawn.
    about : str
        What it shows: the key of the results, and whatever tells it from other figures.

    Raises
    ------
    CacheError
        If the disk or the folder refuses.
    """
    content = png[:-_END] + _chunk(png, about) + png[-_END:]
    if not (path.is_file() and path.read_bytes() == content):
        replace_file(path, content)


def read_figure(path: Path, about: str) -> bytes | None:
    """Read a figure that ``write_figure`` wrote.

    Returns
    -------
    bytes or None
        None where there is none, or one that is damaged, changed or shows something
        else: it should be drawn again.
    """
    try:
        content = path.read_bytes() if path.is_file() else b""
    except OSError:
        return None
    at = len(content) - _CHUNK - _END
    png = content[: max(at, 0)] + content[-_END:]
    is_whole = at > 0 and content[at:-_END] == _chunk(png, about)
    return content if is_whole else None


def _chunk(png: bytes, about: str) -> bytes:
    digest = hashlib.sha256(about.encode() + b"\0" + png).hexdigest()
    body = b"tEXt" + _KEYWORD + digest.encode()
    return struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
