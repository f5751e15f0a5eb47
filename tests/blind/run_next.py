"""Further recordings for hidden cases that the diagnosis leaves undecided.

``python tests/blind/run_next.py --work DIR [--number N]`` diagnoses cases as in the blind
test, with six short steps in one direction each, after which the answer often is
`ambiguous` or `unknown`. Where it is, ``hwid next`` proposes one recording within the
limits of the recordings that are there (goal: diagnosis), the hidden machine answers it,
and the diagnosis is made again; twice at most. Of the program only its commands are used.
One effect may be added at most, which saves time: one is hidden. Results are written as
they come; the same command goes on where it was stopped.
"""

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from click.testing import CliRunner

PROJECT = Path(__file__).resolve().parents[2]
# Run as a file, Python looks for modules beside it and not in the project.
if str(PROJECT) not in sys.path:
    sys.path.insert(0, str(PROJECT))

from hwid_cli.cli.main import main as hwid  # noqa: E402
from tests.blind.campaign import measured_case  # noqa: E402
from tests.blind.cases import make_case  # noqa: E402
from tests.blind.score import result_of  # noqa: E402
from tests.blind.write_case import HEADER, write_case  # noqa: E402

FEW = {"plan": "few"}
# Effects that look like others in one-way steps; every noise in turn.
EFFECTS = (
    "end_stop",
    "input_delay",
    "one_sided_stop",
    "actuator_lag",
    "second_mode",
    "sensor_quadratic",
    "quadratic_stiffness",
    "cubic_stiffness",
    "supply_sag",
    "force_constant_saturation",
    "output_backlash",
    "spring_gap",
    "quadratic_drag",
    "voltage_limit",
)
NOISE_PERCENT = (1.0, 0.1, 3.0)
MOST_FURTHER = 2


def command(name, config, out):
    """Run a command of the program; what it printed where it failed."""
    done = CliRunner().invoke(
        hwid, [name, str(config), "--out", str(out), "--jobs", "1", "-q"]
    )
    return "" if done.exit_code == 0 else f"{done.exception!r} {done.output[-300:]}"


def diagnosed(config, out):
    failed = command("diagnose", config, out)
    if failed:
        return None, failed
    return json.loads((out / "diagnosis.json").read_text(encoding="utf-8")), ""


def add_next(config, recordings):
    """The limits of what was played before, as a section of the configuration."""
    largest = max(np.abs(one.current_A).max() for one in recordings)
    steps = [
        np.abs(np.diff(one.current_A)).max() / np.median(np.diff(one.time_s))
        for one in recordings
    ]
    seconds = max(one.time_s[-1] for one in recordings)
    limits = {
        "amplitude": float(largest),
        "rate": float(max(steps)),
        "duration_s": float(seconds),
    }
    text = json.dumps({"goal": "diagnosis", "number": 1, "limits": limits})
    with config.open("a", encoding="utf-8") as file:
        file.write(f"next: {text}\n")


def played(case, folder, out, further):
    """Take the proposed recording from the hidden machine; its name, or none."""
    proposals = json.loads((out / "next.json").read_text())["proposals"]
    if not proposals:
        return ""
    one = proposals[0]
    values = np.loadtxt(out / one["file"], delimiter=",", skiprows=1)[:, 1]
    further[one["name"]] = values
    recordings, _ = measured_case(case, further)
    taken = next(r for r in recordings if r.name == one["name"])
    rows = np.column_stack([taken.time_s, taken.current_A, taken.displacement_m])
    path = folder / "raw" / f"{one['name']}.csv"
    np.savetxt(path, rows, fmt="%.9e", delimiter=",", header=HEADER, comments="")
    return one["name"]


def run_case(case, work):
    """First and later answers of one case."""
    folder, out = work / case.name, work / f"{case.name}-out"
    config, truth = write_case(case, folder, work / "truth" / f"{case.name}.json", 1)
    add_next(config, measured_case(case)[0])
    diagnosis, failure = diagnosed(config, out)
    answers, taken, further = [], [], {}
    while True:
        verdict = "failed" if diagnosis is None else diagnosis["verdict"]
        answers.append([verdict, result_of(truth, diagnosis)])
        if verdict not in ("ambiguous", "unknown") or len(taken) == MOST_FURTHER:
            break
        failure = command("next", config, out)
        name = "" if failure else played(case, folder, out, further)
        if not name:
            break
        taken.append(name)
        diagnosis, failure = diagnosed(config, out)
    return {"case": case.name, "answers": answers, "taken": taken, "failure": failure}


def main():
    """Run the cases and count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--number", type=int, default=3)
    parser.add_argument("--seeds", default="development")
    chosen = parser.parse_args()
    chosen.work.mkdir(parents=True, exist_ok=True)
    results = chosen.work / "outcomes.jsonl"
    known = {}
    if results.is_file():
        lines = [json.loads(one) for one in results.read_text().splitlines()]
        known = {one["case"]: one for one in lines}
    undecided = Counter()
    for number in range(chosen.number):
        for effect in EFFECTS:
            noise = NOISE_PERCENT[number % len(NOISE_PERCENT)]
            case = make_case(
                "few", (effect,), number, seeds=chosen.seeds, noise=noise, **FEW
            )
            if case.name not in known:
                known[case.name] = run_case(case, chosen.work)
                with results.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(known[case.name]) + "\n")
            found = known[case.name]
            if found["answers"][0][0] in ("ambiguous", "unknown"):
                undecided[found["answers"][-1][1]] += 1
            sys.stdout.write(f"{json.dumps(found)}\n{dict(undecided)}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
