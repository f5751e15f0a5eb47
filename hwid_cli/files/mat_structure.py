"""The structure of a MAT file of level 5, checked before scipy reads it.

scipy's reader is compiled and takes the file's word for types and classes: a damaged
file was seen to crash the interpreter. And what is packed may unpack to any size.

References
----------
MathWorks, "MAT-File Format": tags, types and classes of level 5.
"""

import struct
import zlib
from pathlib import Path

from hwid_cli.files.array_bounds import MOST_BYTES, check_declared

_HEADER_BYTES, _TAG_BYTES = 128, 8
_MATRIX, _COMPRESSED = 14, 15
# Types of plain data: integers, floats and texts.
_PLAIN = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18}
_CLASSES = set(range(1, 18))
# Parts behind flags, dimensions and name: text, sparse tables, arrays of numbers. The
# imaginary part of complex numbers is one more.
_DATA_PARTS = {4: 1, 5: 3, **dict.fromkeys(range(6, 16), 1)}
_FIRST_PARTS = 3
_IS_COMPLEX = 0x0800
_FLAGS_TYPE, _FLAGS_BYTES = 6, 8
_PIECE_BYTES = 2**20
_MOST_DEPTH = 50


def check_mat(path: Path) -> None:
    """Refuse a MAT file of level 5 that is damaged or unpacks to too much.

    Parameters
    ----------
    path : Path
        Of another level: nothing in it is packed, so nothing is checked.

    Raises
    ------
    ValueError
    """
    content = path.read_bytes()
    order = {b"IM": "<", b"MI": ">"}.get(content[126:_HEADER_BYTES])
    if order is None or 0 in content[:4]:
        return
    room = MOST_BYTES
    for kind, body in _elements(memoryview(content)[_HEADER_BYTES:], order):
        if kind == _COMPRESSED:
            unpacked = _unpacked(body, room)
            room -= len(unpacked)
            for inner_kind, inner in _elements(memoryview(unpacked), order):
                _check_matrix(inner_kind, inner, order)
        else:
            _check_matrix(kind, body, order)


def _elements(data: memoryview, order: str) -> list[tuple[int, memoryview]]:
    """Types and contents of the elements that lie one after the other."""
    found = []
    at = 0
    while at < len(data):
        if len(data) - at < _TAG_BYTES:
            raise ValueError("an element is cut off")
        kind, size = struct.unpack_from(f"{order}II", data, at)
        # Up to four bytes may lie in the tag itself, their number in its upper half.
        is_small = kind >> 16 != 0
        start = at + (4 if is_small else _TAG_BYTES)
        if is_small:
            kind, size = kind & 0xFFFF, kind >> 16
        room = 4 if is_small else len(data) - start
        if size > room:
            raise ValueError("an element is longer than the file")
        found.append((kind, data[start : start + size]))
        # Packed elements end where they end, others at the next multiple of 8.
        packed = kind == _COMPRESSED
        at = (
            at + _TAG_BYTES if is_small else start + size + (0 if packed else -size % 8)
        )
    return found


def _check_matrix(kind: int, body: memoryview, order: str, depth: int = 0) -> None:
    """Refuse a variable of an unknown class, or with parts of unknown types."""
    if kind != _MATRIX or depth > _MOST_DEPTH:
        raise ValueError("an element is no variable, or nested too deeply")
    parts = _elements(body, order)
    if not parts:
        return
    flags_kind, flags = parts[0]
    if flags_kind != _FLAGS_TYPE or len(flags) != _FLAGS_BYTES:
        raise ValueError("a variable begins without its flags")
    flag = struct.unpack(f"{order}I", flags[:4])[0]
    if flag & 0xFF not in _CLASSES:
        raise ValueError("a variable is of an unknown class")
    expected = _DATA_PARTS.get(flag & 0xFF)
    if expected is not None:
        expected += _FIRST_PARTS + bool(flag & _IS_COMPLEX)
        kinds = {part_kind for part_kind, _ in parts}
        if len(parts) != expected or _MATRIX in kinds:
            raise ValueError(f"a variable has {len(parts)} parts, not {expected}")
    for part_kind, part in parts[1:]:
        if part_kind == _MATRIX:
            _check_matrix(part_kind, part, order, depth + 1)
        elif part_kind not in _PLAIN:
            raise ValueError(f"a variable holds data of an unknown type, {part_kind}")


def _unpacked(packed: memoryview, room: int) -> bytes:
    unpacker = zlib.decompressobj()
    pieces, size = [], 0
    left = bytes(packed)
    while left and not unpacker.eof:
        pieces.append(unpacker.decompress(left, _PIECE_BYTES))
        left = unpacker.unconsumed_tail
        size += len(pieces[-1])
        if size > room:
            check_declared("variables", MOST_BYTES + 1)
    return b"".join(pieces)
