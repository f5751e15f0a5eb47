"""Takes folders of recordings through ``hwid init`` and ``hwid run``, and judges the models.

``python -m tests.folders.run_folders --work DIR [--only WORD] [--seed N]``. Each machine has a
folder of five recordings, as somebody has them who took steps, or sines, or a mixture; the
models are judged on recordings that come later: a sweep, levels and a triangle, all within
the inputs that were recorded. How far off is a share of what the noise-free output moves.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

import click
import numpy as np

from tests.folders.plants import PLANTS, Plant

N, REST, TIME_LIMIT_S = 1000, 40, 900
LATER = ("sweep", "levels", "triangle")
# What the closing block of ``hwid run`` says, and a name with its orders.
_NAME = r"((?:linear:)?[^\s:]+/\d+/\d+)"


def inputs(
    kind: str, number: int, plant: Plant, rng: np.random.Generator
) -> np.ndarray:
    """An input within the plant's range, at its resting level at first."""
    t = np.arange(N - REST) / (N - REST)
    periods = (3, 6, 12, 20, 9)[number % 5]
    if kind == "step":
        share = (1.0, -1.0, 0.4, -0.5, 0.7)[number % 5] * np.ones(t.size)
    elif kind == "sine":
        share = (1.0, 0.5, 0.8, 1.0, 0.3)[number % 5] * np.sin(2 * np.pi * periods * t)
    elif kind == "levels":
        share = np.repeat(rng.uniform(-1, 1, 24), 40)[: t.size]
    elif kind == "sweep":
        share = 0.9 * np.sin(2 * np.pi * (2 * t + 11 * t**2))
    else:
        share = 0.9 * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * 5 * t))
    up, down = plant.high - plant.rest, plant.rest - plant.low
    moved = np.where(share > 0, share * up, share * down)
    return np.r_[np.full(REST, plant.rest), plant.rest + moved]


def write_folder(plant: Plant, folder: Path, seed: int) -> dict[str, tuple]:
    """Write the recordings; give those that come later, input and clean output."""
    rng = np.random.default_rng(seed)
    played = [inputs(kind, n, plant, rng) for n, kind in enumerate(plant.kinds)]
    clean = [plant.simulate(u) for u in played]
    noise = plant.noise * np.ptp(np.concatenate(clean))
    folder.mkdir(parents=True, exist_ok=True)
    for n, (kind, u, y) in enumerate(zip(plant.kinds, played, clean, strict=True)):
        measured = y + noise * np.random.default_rng([seed, n]).standard_normal(N)
        write_csv(folder / f"{kind}_{n + 1}.csv", plant, u, measured)
    later = {kind: inputs(kind, 0, plant, rng) for kind in LATER}
    return {kind: (u, plant.simulate(u)) for kind, u in later.items()}


def write_csv(path: Path, plant: Plant, u: np.ndarray, y: np.ndarray) -> None:
    """Write one recording as a logger does."""
    table = np.column_stack([plant.step_s * np.arange(u.size), u, y])
    np.savetxt(
        path, table, "%.6g", ",", header="time_s,command_V,reading_mm", comments=""
    )


def run(arguments: list[str], folder: Path) -> str:
    """What ``hwid`` says, on both streams."""
    done = subprocess.run(
        [sys.executable, "-m", "hwid_cli", *arguments],
        cwd=folder, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False,
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"{folder}: {' '.join(arguments)}: {done.stderr[-400:]}")
    return done.stdout + done.stderr


def names_in(said: str) -> dict[str, str]:
    """The models that the closing block names: the one to take, the linear and the single one."""
    said = re.sub(r"\s+", " ", said.partition("best model")[2])
    block = re.split(r" orders (?:nb|none)", said)[0]
    taken, *others = re.findall(_NAME, block)
    linear = [one for one in (taken, *others) if one.startswith("linear:")]
    # Of several recordings it is named by their number, and they are those of the other.
    orders = re.findall(r"linear model, of \d+ recordings, orders (\d+/\d+)", block)
    of_all = [f"linear:{taken.split('/')[0]}/{one}" for one in orders]
    single = re.findall(rf"here: {_NAME}, the single model", block)
    return {
        "taken": taken,
        "linear": [*linear, *of_all, ""][0],
        "single": single[0] if single else "",
    }


def off(name: str, plant: Plant, later: dict[str, tuple], folder: Path) -> float:
    """Geometric mean over the later recordings of the RMSD over the standard deviation."""
    if not name:
        return float("nan")
    path = run(["export", "experiment.yaml", "--model", name], folder).split()[0]
    shares = []
    for kind, (u, clean) in later.items():
        write_csv(folder / f"later_{kind}.csv", plant, u, clean)
        start = ["--initial-state", "steady", "--force", "--out", "prediction.csv"]
        run(["predict", path, f"later_{kind}.csv", *start], folder)
        predicted = np.genfromtxt(folder / "prediction.csv", delimiter=",", names=True)
        # Lengths are in metres there.
        predicted = 1e3 * predicted[predicted.dtype.names[2]][: clean.size]
        shares.append(np.sqrt(np.mean((predicted - clean) ** 2)) / np.std(clean))
    return float(np.exp(np.mean(np.log(shares))))


def main() -> None:
    """Run all folders, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--only", default="")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    click.echo("| folder | taken | one recording alone | linear, all recordings |")
    click.echo("|---|---|---|---|")
    rows = []
    for number, (name, plant) in enumerate(PLANTS.items()):
        if given.only not in name:
            continue
        folder = given.work / f"folder_{number}"
        later = write_folder(plant, folder / "data", 100 * given.seed + number)
        run(["init", "data", "--force"], folder)
        names = names_in(run(["run", "experiment.yaml"], folder))
        rows.append(
            [
                off(names[one], plant, later, folder)
                for one in ("taken", "single", "linear")
            ]
        )
        cells = " | ".join(f"{one:.3f}" for one in rows[-1])
        click.echo(f"| {name} | {cells} |")
    both = np.array(rows)
    for column, what in ((1, "one recording alone"), (2, "linear")):
        known = np.isfinite(both[:, [0, column]]).all(axis=1)
        ratio = np.exp(np.mean(np.log(both[known, 0] / both[known, column])))
        click.echo(
            f"\ntaken over {what}: {ratio:.2f} (geometric mean of {known.sum()})"
        )


if __name__ == "__main__":
    main()
