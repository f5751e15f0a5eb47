"""Small text files read under a limit: no pipe to wait for, no endless device."""

import errno
import stat
from pathlib import Path

# The largest configuration of the examples has 4 kB; YAML takes a second for 100 kB.
MOST_TEXT_BYTES = 256 * 1024


def read_small_file(path: Path, *, most_bytes: int = MOST_TEXT_BYTES) -> bytes:
    """Read a file that people write: a configuration, a function, a plan.

    Parameters
    ----------
    most_bytes : int, [bytes]

    Raises
    ------
    OSError
        If it cannot be read, is no plain file, or is larger.
    """
    # Before it is opened: that would wait for somebody to write into a pipe.
    if not stat.S_ISREG(path.stat().st_mode):
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, "Is a directory")
        raise OSError(errno.EINVAL, "Is no plain file")
    with path.open("rb") as file:
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        raise OSError(errno.EFBIG, f"Is larger than {most_bytes // 1024} kB")
    return content
