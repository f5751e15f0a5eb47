"""Further recordings for hidden cases that the diagnosis leaves undecided.

``python tests/blind/run_next.py --work DIR`` diagnoses cases of the blind test with six
short steps in one direction each, after which the answer is `ambiguous` or `unknown` most
often. One case of every effect of the catalogue and every noise is diagnosed; the effects
of which one is undecided are drawn again, in the order of number, noise and catalogue,
until there are ``--undecided`` undecided cases. Nothing else chooses them. For each,
``hwid next`` proposes one recording within the limits of those that are there (goal:
diagnosis), the hidden machine answers it, and the diagnosis is made again; twice at most.
With ``--hidden`` it is the cases in which the diagnosis says ``parameters``, although an
effect hides: what ``hwid next`` proposes is recorded until something else is said or nothing
is proposed, three times at most; ``--nothing N`` adds N cases in which nothing hides. Of the
program only its commands are used. One effect may be added at most, which saves
time: one is hidden. Results are written as they come; the same command goes on where it
was stopped.
"""

import argparse
import json
import shutil
import sys
from itertools import count, cycle
from pathlib import Path

import numpy as np
from click.testing import CliRunner

PROJECT = Path(__file__).resolve().parents[2]
# Run as a file, Python looks for modules beside it and not in the project.
if str(PROJECT) not in sys.path:
    sys.path.insert(0, str(PROJECT))

from hwid_cli.cli.main import main as hwid  # noqa: E402
from tests.blind.campaign import measured_case  # noqa: E402
from tests.blind.cases import SEEDS, make_case  # noqa: E402
from tests.blind.effects import CATALOGUE  # noqa: E402
from tests.blind.score import result_of  # noqa: E402
from tests.blind.write_case import HEADER, write_case  # noqa: E402

PLAN = "few"
NOISE_PERCENT = (3.0, 1.0, 0.3)
UNDECIDED = ("ambiguous", "unknown")
# The base is re-fitted and nothing is named.
HIDING = ("parameters", "none")
MOST_FURTHER, MOST_HIDDEN = 2, 3
# Exit code after SIGTERM.
INTERRUPTED = 143


def command(name, config, out):
    """Run a command of the program; what it printed where it failed."""
    done = CliRunner().invoke(
        hwid, [name, str(config), "--out", str(out), "--jobs", "1", "-q"]
    )
    if done.exit_code == INTERRUPTED:
        # What was stopped is no result: it runs again.
        raise SystemExit(INTERRUPTED)
    return "" if done.exit_code == 0 else f"{done.exception!r} {done.output[-300:]}"


def diagnosed(config, out):
    """The diagnosis, and what went wrong."""
    failed = command("diagnose", config, out)
    if failed:
        return None, failed
    return json.loads((out / "diagnosis.json").read_text(encoding="utf-8")), ""


def add_next(config, recordings, seconds=None):
    """The limits of what was played before, as a section of the configuration.

    ``seconds`` is how long a further recording may be, where not as long as these.
    """
    largest = max(np.abs(one.current_A).max() for one in recordings)
    steps = [
        np.abs(np.diff(one.current_A)).max() / np.median(np.diff(one.time_s))
        for one in recordings
    ]
    seconds = seconds or max(one.time_s[-1] for one in recordings)
    limits = {
        "amplitude": float(largest),
        "rate": float(max(steps)),
        "duration_s": float(seconds),
    }
    text = json.dumps({"goal": "diagnosis", "number": 1, "limits": limits})
    with config.open("a", encoding="utf-8") as file:
        file.write(f"next: {text}\n")


def played(case, folder, out, further):
    """Take the proposed recording from the hidden machine; its name and expected gain."""
    proposals = json.loads((out / "next.json").read_text())["proposals"]
    if not proposals:
        return None
    one = proposals[0]
    values = np.loadtxt(out / one["file"], delimiter=",", skiprows=1)[:, 1]
    further[one["name"]] = values
    recordings, _ = measured_case(case, further)
    taken = next(r for r in recordings if r.name == one["name"])
    rows = np.column_stack([taken.time_s, taken.current_A, taken.displacement_m])
    path = folder / "raw" / f"{one['name']}.csv"
    np.savetxt(path, rows, fmt="%.9e", delimiter=",", header=HEADER, comments="")
    return [one["name"], one["gain"]]


def answer(truth, diagnosis):
    """The verdict, what is named and the rivals, and whether that is right."""
    if diagnosis is None:
        return ["failed", [], [], "failed"]
    named = [one["id"] for one in diagnosis["effects"]]
    rivals = diagnosis["ambiguous_with"]
    return [diagnosis["verdict"], named, rivals, result_of(truth, diagnosis)]


def run_case(case, work, seconds=None, *, goes_on=UNDECIDED, most=MOST_FURTHER):
    """First and later answers of one case, while the verdict is one of some."""
    folder, out = work / case.name, work / f"{case.name}-out"
    # A case that was stopped half way may have left recordings.
    shutil.rmtree(folder, ignore_errors=True)
    config, truth = write_case(case, folder, work / "truth" / f"{case.name}.json", 1)
    add_next(config, measured_case(case)[0], seconds)
    diagnosis, failure = diagnosed(config, out)
    answers, taken, further = [answer(truth, diagnosis)], [], {}
    while answers[-1][0] in goes_on and len(taken) < most:
        failure = command("next", config, out)
        more = None if failure else played(case, folder, out, further)
        if more is None:
            break
        taken.append(more)
        diagnosis, failure = diagnosed(config, out)
        answers.append(answer(truth, diagnosis))
    if answers[0][0] not in goes_on:
        shutil.rmtree(folder)
        shutil.rmtree(out, ignore_errors=True)
    return {"case": case.name, "answers": answers, "taken": taken, "failure": failure}


def cases_of(effects, number, seeds):
    """One case of each effect and noise."""
    return [
        make_case(PLAN, (effect,), number, seeds=seeds, noise=noise, plan=PLAN)
        for noise in NOISE_PERCENT
        for effect in effects
    ]


class Results:
    """Results of cases; what an earlier run has written is not run again."""

    def __init__(self, work, seconds, *, hidden=False):
        self.work, self.seconds = work, seconds
        self.file = work / ("hidden.jsonl" if hidden else "next.jsonl")
        self.loop = {"goes_on": HIDING, "most": MOST_HIDDEN} if hidden else {}
        lines = self.file.read_text().splitlines() if self.file.is_file() else []
        self.known = {one["case"]: one for one in map(json.loads, lines)}

    def of(self, case):
        """The result of a case."""
        if case.name not in self.known:
            found = run_case(case, self.work, self.seconds, **self.loop)
            with self.file.open("a", encoding="utf-8") as file:
                file.write(json.dumps(found) + "\n")
            sys.stdout.write(f"{json.dumps(found)}\n")
            sys.stdout.flush()
            self.known[case.name] = found
        return self.known[case.name]


def is_undecided(one):
    """Whether the recordings that were there at first leave it open."""
    return one["answers"][0][0] in UNDECIDED


def undecided_cases(effects, seeds, least, results):
    """Results of the first undecided cases of some effects, and how many were tried."""
    found, tried = [], 0
    for number in count() if effects else ():
        for case in cases_of(effects, number, seeds):
            tried += 1
            one = results.of(case)
            if is_undecided(one):
                found.append(one)
            if len(found) == least:
                return found, tried
    return found, tried


def is_right_after(one, most):
    """Whether the name is right after so many further recordings or fewer."""
    return one["answers"][: most + 1][-1][-1] == "right"


def table(found):
    """One line for each case, and the shares."""
    lines = [
        "| undecided case | at first | taken (separation over noise) | then |",
        "|---|---|---|---|",
    ]
    for one in found:
        first, *later = (
            " or ".join([*sorted(named), *map(str, rivals)]) or verdict
            for verdict, named, rivals, _ in one["answers"]
        )
        taken = ", ".join(f"{name} ({gain:.2g})" for name, gain in one["taken"])
        then = f"{', then '.join(later)}: {one['answers'][-1][-1]}"
        lines.append(f"| {one['case']} | {first} | {taken} | {then} |")
    for most in range(1, MOST_FURTHER + 1):
        right = sum(is_right_after(one, most) for one in found)
        lines.append(f"right after {most}: {right} of {len(found)}")
    return "\n".join(lines)


def hidden_table(found):
    """A line for each case that begins without a name, and the shares."""
    hiding = [one for one in found if one["answers"][0][0] in HIDING]
    lines = [
        "| case | taken (hidden effects expected to show) | then |",
        "|---|---|---|",
    ]
    for one in hiding:
        taken = ", ".join(f"{name} ({gain:.2g})" for name, gain in one["taken"])
        *_, (verdict, named, rivals, result) = one["answers"]
        then = " or ".join([*sorted(named), *map(str, rivals)]) or verdict
        lines.append(f"| {one['case']} | {taken} | {then}: {result} |")
    for most in range(1, MOST_HIDDEN + 1):
        last = [one["answers"][: most + 1][-1] for one in hiding]
        shows = sum(one[0] not in HIDING for one in last)
        right = sum(one[-1] == "right" for one in last)
        lines.append(
            f"after {most}: something shows in {shows} of {len(hiding)}, right {right}"
        )
    return "\n".join(lines)


def run_hidden(seeds, nothing, results):
    """The cases of one each, in which something or nothing hides."""
    cases = cases_of(CATALOGUE, 0, seeds)
    cases += [
        make_case(PLAN, (), number, seeds=seeds, noise=noise, plan=PLAN)
        for number, noise in zip(range(nothing), cycle(NOISE_PERCENT))
    ]
    return [results.of(case) for case in cases]


def main():
    """Run the cases and count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--undecided", type=int, default=20)
    parser.add_argument("--only", choices=list(CATALOGUE), help="only this effect")
    parser.add_argument("--seconds", type=float, help="longest further recording")
    parser.add_argument("--seeds", choices=list(SEEDS), default="development")
    parser.add_argument("--hidden", action="store_true", help="after `parameters`")
    parser.add_argument(
        "--nothing", type=int, default=6, help="cases without an effect"
    )
    chosen = parser.parse_args()
    chosen.work.mkdir(parents=True, exist_ok=True)
    results = Results(chosen.work, chosen.seconds, hidden=chosen.hidden)
    if chosen.hidden:
        found = run_hidden(chosen.seeds, chosen.nothing, results)
        sys.stdout.write(f"{hidden_table(found)}\n")
        return
    effects = [chosen.only]
    if chosen.only is None:
        first = cases_of(CATALOGUE, 0, chosen.seeds)
        left = {case.effects[0] for case in first if is_undecided(results.of(case))}
        effects = [one for one in CATALOGUE if one in left]
        sys.stdout.write(f"{len(first)} cases tried\n")
    found, tried = undecided_cases(effects, chosen.seeds, chosen.undecided, results)
    sys.stdout.write(
        f"\nof {', '.join(effects)} {tried} cases tried, {len(found)} undecided\n"
        f"{table(found)}\n"
    )


if __name__ == "__main__":
    main()
