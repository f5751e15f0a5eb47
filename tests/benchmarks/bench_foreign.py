"""Time that a diagnosis takes beside what the user's own simulation takes.

``python -m tests.benchmarks.bench_foreign [PLANT/EFFECT ...]``; one process, whole catalogue,
nine recordings of 2222 samples (20 000 together). The simulation notes its own seconds.
"""

import os
import sys
import tempfile
import time
from pathlib import Path
from unittest.mock import patch

import numpy as np

from tests.black_boxes import run_boxes
from tests.black_boxes.plants import PLANTS, hidden_in

N = 2222
NOTED = """

import time as _time

_plain = simulate


def simulate(*arguments):
    began = _time.perf_counter()
    found = _plain(*arguments)
    with open(__file__ + ".seconds", "a") as file:
        file.write(f"{_time.perf_counter() - began}\\n")
    return found
"""
DEFAULT = ("stage/coulomb", "hardening/coulomb", "pendulum/delay")


def timed(folder, plant, effect):
    """Verdict, runs, and wall seconds of all and of the simulation alone."""
    with patch.object(run_boxes, "N", N):
        run_boxes.write_case(
            folder, plant, effect, access="python", noise=0.005, seed=4
        )
    source = folder / "plant.py"
    source.write_text(source.read_text() + NOTED)
    began = time.perf_counter()
    found, _ = run_boxes.diagnose(folder, 1)
    wall = time.perf_counter() - began
    own = np.loadtxt(folder / "plant.py.seconds", ndmin=1)
    return found, own.size, wall, float(own.sum())


def main():
    """Time the boxes that were named."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    print("box                                verdict   runs  wall s  own s  beside s")
    for label in sys.argv[1:] or DEFAULT:
        name, effect = label.split("/")
        if effect not in hidden_in(PLANTS[name], 1.0, 1.0):
            raise SystemExit(f"{label}: no such box")
        with tempfile.TemporaryDirectory() as folder:
            found, runs, wall, own = timed(Path(folder) / "box", PLANTS[name], effect)
        named = "+".join(one["id"] for one in found.get("effects", []))
        print(
            f"{label:34s} {found['verdict']} {named} {runs:5d} {wall:7.1f} {own:6.1f} "
            f"{wall - own:8.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
