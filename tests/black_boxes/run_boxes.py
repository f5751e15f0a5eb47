"""Diagnoses every black box and scores the verdicts.

``python -m tests.black_boxes.run_boxes --work DIR [--only PLANT/EFFECT ...] [--access python|outputs]
[--speed] [--pairs] [--no-force] [--noise 0.005] [--log-noise 0.01] [--write FILE.md]``. Rows are appended to the file as they come; boxes that it
holds are not run again.
"""

import argparse
import csv
import json
import subprocess
import sys
import time
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.black_boxes.plants import (
    FAR_PLANTS,
    PLANTS,
    PUSHLESS,
    hidden_in,
    integrate,
    pairs_in,
    with_tachometer,
)

DT, N = 1e-3, 1200
# By how much the given parameters are off.
OFF = 0.15


def inputs(plant, rng):
    """Steps, sines and sums of sines after a rest."""
    t = DT * np.arange(N)
    on = t > 0.1
    for share in (0.4, -0.7, 1.0):
        yield f"step_{share}", plant.size * share * (on & (t < 0.65))
    for frequency, share in ((1.5, 0.9), (3, 0.5), (4, 1.0), (7, 0.8)):
        yield (
            f"sine_{frequency}",
            plant.size * share * np.sin(2 * np.pi * frequency * (t - 0.1)) * on,
        )
    for count in (1, 2):
        waves = sum(
            np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in (1, 2, 4, 6, 9)
        )
        yield f"multi_{count}", 0.35 * plant.size * waves * on


def write_case(folder, plant, effect, *, access, noise, seed, most="", log_noise=0.0):
    """Write recordings, the simulation and the configuration of a case.

    ``log_noise`` is on the recorded input alone, as a share of its RMS.
    """
    rng = np.random.default_rng([seed, zlib.crc32(f"{plant.name}/{effect}".encode())])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "raw").mkdir(exist_ok=True)
    signals = list(inputs(plant, rng))
    x_max = _largest(replace(plant, sees=0), signals)
    y_max = _largest(plant, signals) if plant.sees else x_max
    rates, zero = plant.function(), np.zeros(plant.n_states)
    gain = _force_gain(rates, zero, plant)
    load = gain * float(np.sqrt(np.mean([np.mean(u**2) for _, u in signals])))
    make = pairs_in if "+" in effect else hidden_in
    hidden = make(plant, load, x_max, y_max)[effect]
    given = {
        name: value * (1 + OFF * rng.choice([-1, 1])) if name in plant.free else value
        for name, value in plant.values.items()
    }
    scope = {"__file__": str(folder / "plant.py")}
    exec(plant.text, scope)
    t = DT * np.arange(N)
    for name, u in signals:
        y = integrate(plant, plant.values, u, DT, hidden)
        y = y + noise * y_max * rng.standard_normal(N)
        logged = u
        if log_noise:
            logged = u + log_noise * np.sqrt(np.mean(u**2)) * rng.standard_normal(N)
        columns, head = [t, logged, y], f"time_s,{plant.input},{plant.output}"
        if access == "outputs":
            found = scope["simulate"](t, {plant.input: logged}, given)
            columns.append(found[plant.output])
            head += ",simulated"
        np.savetxt(
            folder / "raw" / f"{name}.csv",
            np.column_stack(columns),
            delimiter=",",
            header=head,
            comments="",
            fmt="%.10g",
        )
    (folder / "plant.py").write_text(plant.text)
    (folder / "runs.txt").unlink(missing_ok=True)
    (folder / "config.yaml").write_text(_config(plant, given, access, most))
    (folder / "truth.json").write_text(json.dumps({"accepted": hidden.accepted}))


def _largest(plant, signals):
    """Largest reading without any effect."""
    found = [integrate(plant, plant.values, u, DT, finer=1) for _, u in signals]
    return max(float(np.max(np.abs(one))) for one in found)


def _force_gain(rates, zero, plant):
    """Force on the mass by a unit of the input, where it has settled."""
    if plant.name == "dc_motor":
        return plant.values["ke"] / plant.values["R"]
    if plant.name == "two_masses":
        return plant.values["kt"]
    if plant.name == "valve":
        return plant.values["kv"]
    return plant.mass * float(rates(zero, 1.0, 0.0, plant.values)[1])


def _config(plant, given, access, most):
    simulated = ", simulated: simulated" if access == "outputs" else ""
    text = f"""name: box
recordings:
  files: raw/*.csv
  columns: {{time: time_s, input: {plant.input}, output: {plant.output}{simulated}}}
  kind: {{step: "step_*", sine: "sine_*", random: "multi_*"}}
simulation:
  kind: {access}
"""
    if access == "python":
        text += f"""  file: plant.py
  input: {plant.input}
  output: {plant.output}
"""
        if plant.has_force:
            text += "  force_input: force\n"
        text += "  parameters:\n"
        for name, value in given.items():
            shown = f"{{value: {value:.6g}}}" if name in plant.free else f"{value:.6g}"
            text += f"    {name}: {shown}\n"
    return text + f"diagnose: {{{most}}}\n"


def diagnose(folder, jobs):
    """Run the command; its result and processor seconds."""
    began = time.process_time()
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "hwid_cli",
            "diagnose",
            "config.yaml",
            "--out",
            "out",
            "--jobs",
            str(jobs),
            "-q",
        ],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=1800,
    )
    found = folder / "out" / "diagnosis.json"
    if done.returncode or not found.is_file():
        return {
            "verdict": "failed",
            "said": done.stderr[-300:],
        }, time.process_time() - began
    return json.loads(found.read_text()), time.process_time() - began


def score(found, truth):
    """One word for what a verdict is worth."""
    accepted = [tuple(one) for one in truth["accepted"]]
    named = tuple(sorted(one["id"] for one in found.get("effects", [])))
    verdict = found["verdict"]
    if () in accepted:
        return (
            "right"
            if verdict in ("none", "parameters")
            else "false alarm"
            if verdict == "named"
            else verdict
        )
    if verdict == "named":
        return "right" if named in accepted else "wrong"
    if verdict == "ambiguous":
        sets = [
            named,
            *[
                tuple(sorted([one] if isinstance(one, str) else one))
                for one in found["ambiguous_with"]
            ],
        ]
        return "right" if any(one in accepted for one in sets) else "wrong"
    return verdict if verdict in ("failed", "law") else "refused"


def place_of_truth(folder, truth):
    """Place of the truth among the single effects of the ranking, from 1; "" for none."""
    path = folder / "out" / "ranking.csv"
    if not path.is_file() or [] in truth["accepted"]:
        return ""
    with path.open() as file:
        names = [row["effects"] for row in csv.DictReader(file)]
    single = list(dict.fromkeys(one for one in names if one and "+" not in one))
    accepted = ["+".join(one) for one in truth["accepted"]]
    return next((n for n, one in enumerate(single, 1) if one in accepted), "")


def runs_of(folder):
    """Runs of the simulation, as the plant's own file counts them."""
    path = folder / "runs.txt"
    return len(path.read_bytes()) if path.is_file() else ""


def main():
    """Run all that was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--only", nargs="+", default=[])
    parser.add_argument("--access", default="python", choices=["python", "outputs"])
    parser.add_argument("--noise", type=float, default=0.005)
    parser.add_argument("--log-noise", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--singles", action="store_true", help="no sets, no laws")
    parser.add_argument("--far", action="store_true", help="plants far from a drive")
    parser.add_argument(
        "--speed", action="store_true", help="its sensor is a tachometer"
    )
    parser.add_argument("--pairs", action="store_true", help="two effects at a time")
    parser.add_argument("--no-force", action="store_true", help="no input for forces")
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    kept = options.write.read_text() if options.write and options.write.exists() else ""
    if options.write and not kept:
        options.write.write_text(HEAD)
    words = []
    plants = FAR_PLANTS if options.far else PUSHLESS if options.no_force else PLANTS
    for name, plant in plants.items():
        make = pairs_in if options.pairs else hidden_in
        for effect in make(plant, 1.0, 1.0):
            label = f"{name}/{effect}"
            if options.only and not any(one in label for one in options.only):
                continue
            if f"| {label} |" in kept:
                continue
            row = run_box(label, plant, effect, options)
            words.append(row[1])
            print(*row, sep=" | ", flush=True)
            if options.write:
                with options.write.open("a") as file:
                    file.write("| " + " | ".join(map(str, row)) + " |\n")
    print({word: words.count(word) for word in sorted(set(words))})


HEAD = (
    "| case | score | verdict | effects | complete | confirmed | given | re-fitted | after "
    "| place | runs | time | |\n" + "|" + "---|" * 13 + "\n"
)


def run_box(label, plant, effect, options):
    """Make a box, have it diagnosed, and score it: a row of the table."""
    plant = with_tachometer(plant) if options.speed else plant
    folder = options.work / plant.name / effect
    write_case(
        folder, plant, effect,
        access=options.access, noise=options.noise, seed=options.seed,
        log_noise=options.log_noise,
        most="max_effects: 1, laws: never" if options.singles else "",
    )  # fmt: skip
    began = time.time()
    found, _ = diagnose(folder, 1)
    truth = json.loads((folder / "truth.json").read_text())
    gap = found.get("gap", {})
    return (
        label,
        score(found, truth),
        found["verdict"],
        "+".join(one["id"] for one in found.get("effects", [])),
        found.get("complete", ""),
        found.get("confirmed", ""),
        *(
            f"{gap[one]['ratio_to_noise']:.3g}" if gap else ""
            for one in ("given", "before", "after")
        ),
        place_of_truth(folder, truth),
        runs_of(folder),
        f"{time.time() - began:.0f} s",
        str(found.get("ambiguous_with", found.get("said", ""))),
    )


if __name__ == "__main__":
    main()
