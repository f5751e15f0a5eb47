"""Write docs/real_diagnosis.md from the diagnoses of real measurements.

    python tools/real_diagnosis.py results > docs/real_diagnosis.md

reads ``results/diagnose_NAME`` of the names below; ``make real`` runs all of it. The
force-level errors of the EMPS need its files below ``HWID_REALDATA``.
"""

import csv
import json
import os
import sys
from pathlib import Path

import numpy as np
from scipy import io, signal

from hwid_cli.stages.diagnose import STAGE_VERSION

NAMES = (
    "emps", "silverbox", "ffwheel", "hsm150", "shaking_table", "pick_place", "rack_drive"
)  # fmt: skip
PUBLISHED_MV = {
    "test_multisine": ("6.96", "0.36"),
    "test_arrow_full": ("14.4", "0.26"),
    "test_arrow_no_extrap": ("6.58", "0.32"),
}
HEAD = """# Diagnoses of real measurements

Written by `make real` (needs the data, see [configs/README.md](../configs/README.md)); the configurations are
`configs/diagnose_*.yaml`. Each simulation is deliberately poor: inertia and viscous friction, or a linear oscillator. The table says
which effects are named, with which parameters, and how far the error falls on held-out recordings (stage version {version}). The
seconds are those of this run, with whatever else the machine did. Where nothing is named, the sentence below the table has the best lead:
"""


def main() -> None:
    """Print the document."""
    results = Path(sys.argv[1])
    found = {name: read(results / f"diagnose_{name}") for name in NAMES}
    out = [HEAD.format(version=STAGE_VERSION), overview(found)]
    if found["emps"] is not None:
        out.append(emps(found["emps"]))
    if found["silverbox"] is not None:
        out.append(silverbox(results / "diagnose_silverbox"))
    if found["hsm150"] is not None:
        out.append(recordings("HSM150", results / "diagnose_hsm150", "rad"))
    if found["ffwheel"] is not None:
        out.append(recordings("ffwheel", results / "diagnose_ffwheel", "-"))
    for name, title in (
        ("shaking_table", "Shaking table"),
        ("pick_place", "Pick and place"),
    ):
        if found[name] is not None:
            out.append(recordings(title, results / f"diagnose_{name}", "m"))
    sys.stdout.write("\n".join(out))


def read(folder: Path) -> dict | None:
    """Diagnosis below a folder; None where there is none."""
    path = folder / "diagnosis.json"
    return json.loads(path.read_text()) if path.is_file() else None


def overview(found: dict[str, dict | None]) -> str:
    """Table with one row for each data set."""
    lines = [
        "",
        "| data | verdict | effects with parameters (95 % interval) | held-out RMS before | after | noise | explained | seconds |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, one in found.items():
        if one is None:
            lines.append(f"| {name} | no results | | | | | | |")
            continue
        verdict = one["verdict"]
        if verdict == "named":
            verdict += ", complete" if one["complete"] else ", something remains"
        gap = one["gap"]
        lines.append(
            f"| {name} | {verdict} | {effects(one)} "
            f"| {number(gap['before']['held_out_rms'])} {gap['unit']} "
            f"| {number(gap['after']['held_out_rms'])} | {gap['noise_rms']:.2g} "
            f"| {number(gap['explained_share'], '.0%')} | {one['seconds']:.0f} |"
        )
    lines.append("")
    for name, one in found.items():
        if one is not None:
            lines += [
                f"- **{name}**: {one['summary']} Where: {one['where'][0]['sentence']}."
            ]
    return "\n".join([*lines, ""])


def number(value: float | None, form: str = ".3g") -> str:
    """A number; a dash where there is none, as where nothing was named."""
    return "-" if value is None else format(value, form)


def effects(found: dict) -> str:
    """What was named, in one cell: effects with their parameters, or the formula."""
    if found["verdict"] == "law":
        formula = found["law"]["formula"].replace("|", "\\|")
        return f"{found['law']['acts_on']}: `{formula}`"
    return "; ".join(effect(item) for item in found["effects"]) or "-"


def effect(item: dict) -> str:
    """Name and parameters in one cell."""
    cells = []
    for name, value in item["parameters"].items():
        if isinstance(value["value"], str):
            cells.append(f"{name} {value['value']}")
            continue
        low, high = value["ci95"] or (None, None)
        text = f"{name} {value['value']:.4g}"
        if low is not None and high is not None:
            text += f" ({low:.3g} to {high:.3g})"
        cells.append(text)
    return f"`{item['id']}`: {', '.join(cells)}"


def emps(found: dict) -> str:
    """Force-level errors beside the published ones."""
    base = os.environ.get("HWID_REALDATA", "")
    files = [
        Path(base) / "emps" / f"{name}.mat"
        for name in ("DATA_EMPS", "DATA_EMPS_PULSES")
    ]
    lines = [
        "## EMPS: force level",
        "",
        "Force from the measured drive signal, compared with the force that mass, damping and friction need along the measured path",
        "(position filtered by a zero-phase Butterworth filter of order 4 at 100 Hz, central differences). The parameters are",
        "those of the diagnosis, fitted in closed loop to the first half of `DATA_EMPS`; published ones were fitted on force",
        "level to all of it (Janot, Gautier, Brunot 2019).",
        "",
        "| model | `DATA_EMPS` | `DATA_EMPS_PULSES` |",
        "|---|---|---|",
    ]
    if not all(path.is_file() for path in files):
        return "\n".join([*lines, "| no data below HWID_REALDATA | | |", ""])
    scale = found["base"]["before"]["force_constant_N_per_A"]
    after = found["base"]["after"]
    forces = {
        side: item["value"]
        for one in found["effects"]
        for side, item in one["parameters"].items()
    }
    forward = forces.get("force_forward_N", forces.get("force_N", 0.0))
    backward = forces.get("force_backward_N", forces.get("force_N", 0.0))
    load = forces.get("force_N", 0.0) if "force_forward_N" in forces else 0.0
    gain = scale / after["force_constant_N_per_A"]
    rows = {
        "viscous friction only, fitted": [],
        "diagnosed": [],
        "published": ["4.08 %", "5.98 %"],
    }
    for path in files:
        data = {
            key: np.ravel(value)
            for key, value in io.loadmat(path).items()
            if key[0] != "_"
        }
        force, a, v = along_the_path(data)
        needed = np.column_stack([a, v])
        solved = np.linalg.lstsq(needed, force, rcond=None)[0]
        rows["viscous friction only, fitted"].append(
            relative(force - needed @ solved, force)
        )
        dry = np.where(v > 0, forward, -backward) * (np.abs(v) > 1e-4)
        model = gain * (95.109 * a + after["damping_N_s_per_m"] * v + dry - load)
        rows["diagnosed"].append(relative(force - model, force))
    lines += [f"| {name} | {' | '.join(cells)} |" for name, cells in rows.items()]
    friction = 0.5 * (forward + backward)
    offset = 0.5 * (forward - backward)
    return "\n".join(
        [
            *lines,
            "",
            f"Mean dry friction {friction:.2f} N (published 20.39 N); half the difference of the two directions {offset:.2f} N "
            "(published as an offset of -3.165 N; in sliding motion the two cannot be distinguished); viscous friction "
            f"{after['damping_N_s_per_m']:.1f} N s/m (published 203.5).",
            "",
        ]
    )


def along_the_path(data: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, acceleration and velocity along the measured path."""
    step = float(np.median(np.diff(data["t"])))
    b, a = signal.butter(4, 100 * 2 * step)
    position = signal.filtfilt(b, a, data["qm"])
    velocity = np.gradient(position, step)
    acceleration = np.gradient(velocity, step)
    force = signal.filtfilt(b, a, data["gtau"][0] * data["vir"])
    inside = slice(100, -100)
    # Every tenth sample, low-pass filtered alike on both sides, as in the publication.
    columns = [
        signal.decimate(one[inside], 10) for one in (force, acceleration, velocity)
    ]
    return columns[0], columns[1], columns[2]


def relative(error: np.ndarray, force: np.ndarray) -> str:
    """Norm of an error over that of the force."""
    return f"{np.linalg.norm(error) / np.linalg.norm(force):.2%}"


def silverbox(folder: Path) -> str:
    """RMSE on the official splits beside the published ones."""
    lines = [
        "## Silverbox: free-run simulation error on the official splits",
        "",
        "| split | linear, mV | with the effects, mV | published linear | best published |",
        "|---|---|---|---|---|",
    ]
    for row in rows_of(folder):
        if row["recording"] in PUBLISHED_MV:
            linear, best = PUBLISHED_MV[row["recording"]]
            lines.append(
                f"| {row['recording']} | {1e3 * float(row['rms_before']):.2f} "
                f"| {1e3 * float(row['rms_after']):.2f} | {linear} | {best} |"
            )
    return "\n".join([*lines, ""])


def recordings(title: str, folder: Path, unit: str) -> str:
    """RMS of each recording."""
    lines = [
        f"## {title}: each recording",
        "",
        f"| recording | held out | as given, {unit} | re-fitted | with the effects |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['recording']} | {'yes' if row['is_held_out'] in ('1', 'True', 'true') else ''} "
        f"| {float(row['rms_given']):.3g} | {float(row['rms_before']):.3g} | {float(row['rms_after']):.3g} |"
        for row in rows_of(folder)
    ]
    return "\n".join([*lines, ""])


def rows_of(folder: Path) -> list[dict[str, str]]:
    """Rows of gaps.csv."""
    with (folder / "gaps.csv").open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


if __name__ == "__main__":
    main()
