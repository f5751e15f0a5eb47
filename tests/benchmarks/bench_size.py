"""A folder of many recordings of which two are identified: processor time of a first run.

``make bench-size`` makes 10 000 files of 400 samples. What a recording costs before any
model is looked for is reading, checking, hashing and storing it; ``calls_each`` counts
the calls of Python functions for that, which no other program on the machine changes.
"""

import argparse
import cProfile
import os
import pstats
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from hwid_cli.config.load import load_experiment
from hwid_cli.data.recordings import read_recordings
from hwid_cli.stages.calibrate import calibrate_all, calibration_key
from hwid_cli.store.result_files import Provenance
from hwid_cli.store.results import write_calibrated

SAMPLES = 400
CONFIG = """
name: many
recordings:
  files: raw/*.csv
  columns: {time: time_s, input: current_A, output: displacement_m}
orders: {nb: [1, 2], nk: [1, 2]}
fit: {units: 3, starts: 1, max_iterations: 4}
identify: {recordings: [step_00000, step_00001]}
"""


def write_folder(folder: Path, count: int) -> Path:
    """Write recordings of a second-order plant and their configuration; gives its path."""
    (folder / "raw").mkdir(parents=True)
    rng = np.random.default_rng(1)
    for number in range(count):
        u = np.where(np.arange(SAMPLES) < 40, 0.0, 1.0 + rng.uniform())
        u += 0.1 * rng.standard_normal(SAMPLES)
        y = np.zeros(SAMPLES)
        for k in range(2, SAMPLES):
            y[k] = 1.6 * y[k - 1] - 0.65 * y[k - 2] + 0.05 * np.tanh(u[k - 1])
        rows = "\n".join(
            f"{k * 1e-3:.3f},{u[k]:.6f},{y[k]:.6f}" for k in range(SAMPLES)
        )
        text = f"time_s,current_A,displacement_m\n{rows}\n"
        (folder / "raw" / f"step_{number:05d}.csv").write_text(text)
    path = folder / "many.yaml"
    path.write_text(CONFIG)
    return path


def calls_each(folder: Path, count: int) -> float:
    """Calls of Python functions for each recording that is read, keyed and stored."""
    experiment = load_experiment(write_folder(folder, count))

    def measure() -> None:
        raws = read_recordings(experiment, folder)
        done = calibrate_all(raws, None)
        key = calibration_key(raws, None)
        write_calibrated(folder / "calibrated.h5", *done, Provenance(key))

    # What is loaded and kept at the first time is no cost of a recording.
    measure()
    profile = cProfile.Profile()
    profile.runcall(measure)
    return pstats.Stats(profile).total_calls / count


def cpu_seconds(config: Path, out: Path) -> float:
    """Processor time of ``hwid identify`` by one process, [s]."""
    words = [sys.executable, "-m", "hwid_cli", "identify", config, "--out", out]
    process = subprocess.Popen([*words, "--jobs", "1", "--quiet"])
    _, status, used = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"hwid identify ended with {status}")
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Show processor time for few and for many recordings."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000)
    count = parser.parse_args().count
    print(f"\n{'recordings':>12}{'cpu s':>9}")
    for number in (2, count // 10, count):
        with tempfile.TemporaryDirectory() as folder:
            config = write_folder(Path(folder) / "in", number)
            print(f"{number:12}{cpu_seconds(config, Path(folder) / 'out'):9.1f}")
    with tempfile.TemporaryDirectory() as folder:
        print(
            f"calls of Python functions a recording: {calls_each(Path(folder), 50):.0f}"
        )


if __name__ == "__main__":
    main()
