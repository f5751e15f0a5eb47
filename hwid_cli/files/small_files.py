"""Small text files read under a limit: no pipe to wait for, no endless device."""

import errno
import stat
from pathlib import Path

# The largest configuration of the examples has 4 kB; YAML takes a second for 100 kB.
MOST_TEXT_BYTES = 256 * 1024


def read_small_file(path: Path) -> bytes:
    """Read a file that people write: a configuration, a function, a plan.

    Raises
    ------
    OSError
        If it cannot be read, is no plain file, or is larger than ``MOST_TEXT_BYTES``.
    """
    # Before it is opened: that would wait for somebody to write into a pipe.
    if not stat.S_ISREG(path.stat().st_mode):
        is_folder = path.is_dir()
        raise OSError(
            errno.EINVAL, "Is a directory" if is_folder else "Is no plain file"
        )
    with path.open("rb") as file:
        content = file.read(MOST_TEXT_BYTES + 1)
    if len(content) > MOST_TEXT_BYTES:
        raise OSError(errno.EFBIG, f"Is larger than {MOST_TEXT_BYTES // 1024} kB")
    return content
