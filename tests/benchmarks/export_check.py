"""Every format of an exported model against ``hwid predict``: the largest deviations.

``make export-check`` prints the table that docs/export.md shows. A deviation is the
largest difference over a whole recording, over the largest output.
"""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.signal import lfilter

from hwid_cli import FitOptions, HammersteinWiener, Orders, Recording, fit
from hwid_cli.export.c_drive import drive_source
from hwid_cli.export.formats import write_exported
from hwid_cli.export.json_reader import read_exported
from hwid_cli.export.predict import predict
from tests.export import test_c_drive as drives
from tests.export.fmu_runs import answered
from tests.export.model_examples import (
    KINDS,
    STARTS,
    c_output,
    c_program,
    compiled,
    deviation,
    example_input,
    example_model,
    exported_of,
)
from tests.export.test_mat import RUN, interp1

RULES = ("zero", "steady", "estimated")
OCTAVE = shutil.which("octave-cli")
STEP = 1e-3
DRIVE_SAMPLES, FIT_SAMPLES = 4000, 3000


def json_deviation(folder, exported, u):
    path = write_exported(folder, exported, "json")[-1]
    read = read_exported(path)
    return max(
        deviation(
            predict(read, u, initial_state=start),
            predict(exported, u, initial_state=start),
        )
        for start in STARTS
    )


def c_deviation(folder, exported, u):
    program = c_program(folder, exported)
    return max(
        deviation(
            c_output(program, u, start), predict(exported, u, initial_state=start)
        )
        for start in STARTS
    )


def octave_deviation(folder, exported, u):
    script = write_exported(folder, exported, "mat")[0]
    np.savetxt(folder / "u.txt", u, fmt="%.17g")
    subprocess.run(
        [OCTAVE, "--quiet", "--norc", "--eval", RUN.format(name=script.stem)],
        cwd=folder,
        check=True,
        capture_output=True,
    )
    found = np.fromfile(folder / "y.bin").reshape(3, -1)
    return max(
        deviation(y, predict(exported, u, initial_state=start))
        for start, y in zip(STARTS, found, strict=True)
    )


def scipy_deviation(folder, exported, u):
    """The MAT file with lfilter and linear interpolation; default maps only."""
    m = loadmat(write_exported(folder, exported, "mat")[-1], simplify_cells=True)
    maps = m["input_map"], m["output_map"]
    if any(one["kind"] != "piecewise_linear" for one in maps):
        return np.nan
    w = interp1(maps[0]["break_points"], maps[0]["values"], u)
    x = lfilter(np.atleast_1d(m["B"]), np.atleast_1d(m["F"]), w)
    pulse = np.zeros(u.size)
    pulse[0] = 1.0
    if np.size(m["C"]):
        x += lfilter(np.atleast_1d(m["C"]), np.atleast_1d(m["F"]), pulse)
    y = interp1(maps[1]["break_points"], maps[1]["values"], x)
    return deviation(y, predict(exported, u))


def fmu_deviation(folder, exported, u):
    unit = write_exported(folder, exported, "fmu")[-1]
    return deviation(answered(unit, u, exported.sample_time_s), predict(exported, u))


CHECKS: dict[str, Callable] = {
    "JSON, `hwid predict`": json_deviation,
    "C, cc -std=c99": c_deviation,
    "MAT, Octave": octave_deviation,
    "MAT, scipy lfilter": scipy_deviation,
    "FMU, FMPy": fmu_deviation,
}


def random_models() -> Iterator[tuple[str, HammersteinWiener, np.ndarray]]:
    """All maps at input and output, orders 1 to 10, delays 0 to 5, all rules."""
    for place, kind in enumerate(KINDS):
        for turn in range(3):
            model = example_model(
                10 * place + turn,
                kinds=(kind, KINDS[(place + 3 * turn) % len(KINDS)]),
                nb=1 + (place + 3 * turn) % 10,
                nf=1 + (place + 4 * turn) % 10,
                nk=(place + turn) % 6,
                rule=RULES[turn],
            )
            yield "random models, all maps", model, example_input(place)


def fitted_models() -> Iterator[tuple[str, HammersteinWiener, np.ndarray]]:
    """Fits of a fast-sampled drive: with high orders its poles lie close together."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-2.0, 2.0, FIT_SAMPLES // 100), 100)
    u = lfilter([0.1], [1.0, -0.9], u)
    y = np.tanh(lfilter([0.0, 1e-3], [1.0, -1.97, 0.9712], np.clip(u, -1.5, 1.5)))
    y += 1e-3 * rng.normal(size=u.size)
    for kind in ("piecewise_linear", "sigmoid_network"):
        for order in (2, 5, 10):
            options = FitOptions(input_map=kind, output_map=kind, max_iterations=15)
            given = Recording("r", u, y, sample_time_s=STEP)
            model = fit([given], Orders(order, order, 1), options).model
            if model is not None:
                yield f"fits, {kind}, orders [{order} {order} 1]", model, u


def drive_rows(folder: Path) -> Iterator[tuple[str, str, float]]:
    """The physics simulation with every effect, alone and together."""
    every = drives.ALONE + drives.TOGETHER + drives.MACHINES
    for number, (effects, values) in enumerate(every):
        exported = drives.exported_drive(effects, **values)
        scale = 0.004 if "controller" in values else 1.0
        u = drives.example_command(DRIVE_SAMPLES, scale)
        here = folder / str(number)
        program = compiled(here, drive_source(exported), drives.ONE_START)
        found = deviation(c_output(program, u), predict(exported, u))
        yield f"drive simulation, {len(every)} cases", "C, cc -std=c99", found
        if number % 8 == 0:
            found = fmu_deviation(here, exported, u[:500])
            yield f"drive simulation, {len(every)} cases", "FMU, FMPy", found


def model_rows(folder: Path) -> Iterator[tuple[str, str, float]]:
    number = 0
    for models in (random_models(), fitted_models()):
        for about, model, u in models:
            exported = exported_of(model)
            for name, check in CHECKS.items():
                if check is octave_deviation and OCTAVE is None:
                    continue
                number += 1
                here = folder / f"m{number}"
                here.mkdir()
                yield about, name, check(here, exported, u)


def print_table(worst: dict[tuple[str, str], float]) -> None:
    names = list(CHECKS)
    print(
        "| " + " | ".join(["what", *names]) + " |\n" + "|---" * (len(names) + 1) + "|"
    )
    for about in dict.fromkeys(about for about, _ in worst):
        cells = [about]
        for name in names:
            found = worst.get((about, name))
            cells.append("-" if found is None else f"{found:.1e}" if found else "0")
        print(f"| {' | '.join(cells)} |")


def main() -> int:
    worst: dict[tuple[str, str], float] = {}
    with tempfile.TemporaryDirectory() as folder:
        for rows in (model_rows(Path(folder)), drive_rows(Path(folder))):
            for about, name, found in rows:
                if not np.isnan(found):
                    key = (about, name)
                    worst[key] = max(found, worst.get(key, 0.0))
    print_table(worst)
    return 0


if __name__ == "__main__":
    sys.exit(main())
