"""Seconds until something happens: the command's help, and the first fit ever.

Each is a process of its own. The first fit compiles every loop that it needs; later ones
load them from the cache, here an empty temporary folder.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
REPEATS, FIRST_FITS = 10, 3
FIT = """
import numpy as np
from hwid_cli import Orders, Recording, fit
u = np.sin(np.arange(300) ** 1.3)
fit([Recording("r", u, np.tanh(np.convolve(u, [0, 0.5, 0.3])[:300]), 1.0)], Orders(2, 1, 1))
"""


def seconds_of(*arguments, **variables) -> float:
    """Wall seconds of one Python process."""
    begun = time.perf_counter()
    subprocess.run(
        [sys.executable, *arguments],
        check=True,
        cwd=PROJECT,
        env={**os.environ, **variables},
        stdout=subprocess.DEVNULL,
    )
    return time.perf_counter() - begun


def show(name: str, seconds: list[float]) -> None:
    """Print one row."""
    print(
        f"{name:44}{statistics.median(seconds):9.2f}{min(seconds):9.2f}"
        f"{max(seconds):9.2f}{len(seconds):6d}"
    )


def main() -> None:
    """Start everything several times."""
    print(f"\n{'start':44}{'median s':>9}{'least':>9}{'most':>9}{'runs':>6}")
    show("python -c pass", [seconds_of("-c", "pass") for _ in range(REPEATS)])
    helped = [seconds_of("-m", "hwid_cli", "--help") for _ in range(REPEATS)]
    show("hwid --help", helped)
    first, later = [], []
    for _ in range(FIRST_FITS):
        with tempfile.TemporaryDirectory() as empty:
            cache = {"NUMBA_CACHE_DIR": empty}
            first.append(seconds_of("-c", FIT, **cache))
            later += [seconds_of("-c", FIT, **cache) for _ in range(2)]
    show("a fit of 300 samples, loops not compiled", first)
    show("the same later, loops from the cache", later)


if __name__ == "__main__":
    main()
