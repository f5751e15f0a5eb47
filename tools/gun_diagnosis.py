"""Write docs/gun_diagnosis.md: what is found in the virtual gun, and what it contains.

    python tools/gun_diagnosis.py results/diagnose_gun > docs/gun_diagnosis.md

``make gun`` runs all of it.
"""

import csv
import json
import sys
from pathlib import Path

# Run as a file, Python looks for modules beside it and not in the project.
sys.path.insert(0, str(Path(__file__).parents[1]))

from tools.real_diagnosis import effect, rows_of

INSIDE = (
    ("dry friction", "4.8 N sliding, 7.2 N to break away"),
    ("contact on one side", "1000 N/m beyond 0.33 m"),
    ("limit of the current", "9.5 A"),
    ("stiffness differs between recordings", "by up to 10 % in 7 of 10"),
    ("mass", "2.0 kg (given)"),
    ("damping", "15 N s/m (given as 20)"),
    ("stiffness", "968 N/m (given as 1100)"),
    ("force constant", "48.4 N/A (given as 45)"),
)


def main() -> None:
    """Print the document."""
    folder = Path(sys.argv[1])
    found = json.loads((folder / "diagnosis.json").read_text())
    parts = [head(), verdict(found), inside(), candidates(folder), gaps(folder)]
    sys.stdout.write("\n".join(line for part in parts for line in part))


def head() -> list[str]:
    """What is diagnosed."""
    return [
        "# The virtual gun, diagnosed with a plain mass-spring-damper",
        "",
        "`make gun` writes this page. `hwid diagnose` compares the 38 steps and sines of chapter 3 at full size (7500 samples each) with a",
        "simulation that has wrong parameters and no effects (`configs/diagnose_gun.yaml`).",
        "",
    ]


def inside() -> list[str]:
    """What is really there."""
    rows = [f"| {name} | {value} |" for name, value in INSIDE]
    return [
        "## What the gun contains",
        "",
        "The diagnosis knows only the recordings. *Given* is the value that its simulation starts from.",
        "",
        "| effect or parameter | value |",
        "|---|---|",
        *rows,
        "",
    ]


def verdict(found: dict) -> list[str]:
    """What is said, and the parameters beside it."""
    gap, after = found["gap"], found["base"]["after"]
    lines = ["## What is found", "", found["summary"], ""]
    lines += [f"- {effect(one)}" for one in found["effects"]]
    values = ", ".join(f"{name} {value:.4g}" for name, value in after.items())
    noise = gap["noise_rms"]
    ratios = [gap[side]["held_out_rms"] / noise for side in ("before", "after")]
    return [
        *lines,
        f"- parameters of the simulation after the fit: {values}",
        f"- RMS error on held-out recordings: {ratios[0]:.1f} times the noise before, {ratios[1]:.1f} after; "
        f"the effects explain {gap['explained_share']:.0%} of the excess over the noise",
        f"- computing time: {found['seconds']:.0f} s",
        "",
        "Where the error is before any effect is added (all parameters fitted):",
        "",
        *(f"- {one['sentence']}" for one in found["where"][:6]),
        "",
    ]


def candidates(folder: Path) -> list[str]:
    """Sets of effects that explain most, whether they were named or not."""
    with (folder / "ranking.csv").open(encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["is_fitted"] == "1"]
    rows.sort(key=lambda row: -float(row["explained_share"]))
    lines = [
        "## Candidates that explain most",
        "",
        "Each row is a set of effects that was added to the simulation and fitted. *Explained* is the share of the excess over the noise, on",
        "held-out recordings, that the set removes. A larger set is named only where each of its effects is needed",
        '([method_diagnosis.md](method_diagnosis.md), "Which candidate").',
        "",
        "| effects added | explained |",
        "|---|---|",
    ]
    lines += [
        f"| {row['effects']} | {float(row['explained_share']):.1%} |"
        for row in rows[:8]
    ]
    return [*lines, ""]


def gaps(folder: Path) -> list[str]:
    """RMS of each recording, the worst first."""
    rows = sorted(rows_of(folder), key=lambda row: -float(row["rms_after"]))
    lines = [
        "## Recordings, the worst first",
        "",
        "RMS error of each recording. The re-fitted base is the simulation without effects, with its own parameters fitted.",
        "",
        "| recording | held out | re-fitted base, m | with the effects, m |",
        "|---|---|---|---|",
    ]
    for row in rows:
        held = "yes" if row["is_held_out"] in ("1", "True", "true") else ""
        before, after = float(row["rms_before"]), float(row["rms_after"])
        lines.append(f"| {row['recording']} | {held} | {before:.3g} | {after:.3g} |")
    return [*lines, ""]


if __name__ == "__main__":
    main()
