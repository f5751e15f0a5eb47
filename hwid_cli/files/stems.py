"""Names of files that every disk takes, however long the name of a model is."""

from hashlib import sha256

# A joint model has the names of all its recordings; disks take 255 bytes with the ending.
_MOST_BYTES, _FIRST, _LAST = 200, 140, 40
# Digits of a hash that tell apart what has the same ends.
_MARK = 8


def shortened_stem(stem: str) -> str:
    """Cut the middle out of a file's name that is too long, and mark it by a hash.

    Examples
    --------
    >>> shortened_stem("step_06+step_09_3_7")
    'step_06+step_09_3_7'
    >>> len(shortened_stem("+".join(f"2026-11-30_axis_run_{n:02}" for n in range(20))))
    190
    """
    raw = stem.encode()
    if len(raw) <= _MOST_BYTES:
        return stem
    first, last = (
        part.decode(errors="ignore") for part in (raw[:_FIRST], raw[-_LAST:])
    )
    # The orders at the end tell models of the same recordings apart.
    return f"{first}_{sha256(raw).hexdigest()[:_MARK]}_{last}"
