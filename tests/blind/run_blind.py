"""Run the program on hidden cases and score what it says.

``python tests/blind/run_blind.py --suite full --seeds development --number 2 --work DIR``
writes every case, runs ``hwid diagnose`` on its files, compares ``diagnosis.json`` with
the truth and adds one line to ``DIR/outcomes.jsonl``. Cases that have a line are not run
again, so a run can be stopped and taken up. Of the program only its command is used.
"""

import argparse
import hashlib
import json
import multiprocessing
import os
import shutil
import sys
import time
from pathlib import Path

from click.testing import CliRunner

PROJECT = Path(__file__).resolve().parents[2]
# Run as a file, Python looks for modules beside it and not in the project.
if str(PROJECT) not in sys.path:
    sys.path.insert(0, str(PROJECT))

from hwid_cli.cli.main import main as hwid  # noqa: E402
from tests.blind.campaign import measured_case  # noqa: E402
from tests.blind.cases import SEEDS, SUITES, cases_of  # noqa: E402
from tests.blind.document import document, read_outcomes, summary_lines  # noqa: E402
from tests.blind.score import score  # noqa: E402
from tests.blind.write_case import write_case  # noqa: E402


def program_state():
    """Short hash of the program's sources: which state an outcome belongs to."""
    digest = hashlib.sha256()
    for path in sorted((PROJECT / "hwid_cli").rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def diagnose(config, out):
    """Run ``hwid diagnose``; the diagnosis, or None and what went wrong."""
    arguments = ["diagnose", str(config), "--out", str(out), "--jobs", "1", "-q"]
    done = CliRunner().invoke(hwid, arguments)
    file = Path(out) / "diagnosis.json"
    if done.exit_code != 0 or not file.is_file():
        return None, f"exit {done.exit_code}: {done.exception!r} {done.output[-500:]}"
    return json.loads(file.read_text(encoding="utf-8")), ""


def run_case(case, work, *, keep=False, max_effects=3):
    """Write, diagnose and score one case."""
    folder, out = Path(work) / "cases" / case.name, Path(work) / "out" / case.name
    truth_file = Path(work) / "truth" / f"{case.name}.json"
    config, truth = write_case(case, folder, truth_file, max_effects)
    started = time.perf_counter()
    diagnosis, failure = diagnose(config, out)
    outcome = score(truth, diagnosis)
    outcome["wall_seconds"] = time.perf_counter() - started
    outcome["failure"] = failure
    if diagnosis is not None:
        saved = Path(work) / "diagnoses" / f"{case.name}.json"
        saved.parent.mkdir(parents=True, exist_ok=True)
        saved.write_text(json.dumps(diagnosis), encoding="utf-8")
    if not keep:
        shutil.rmtree(folder)
        shutil.rmtree(out, ignore_errors=True)
    return outcome


def score_of(cases, work, max_effects=3):
    """Outcomes of some cases in this process, whatever the program is at the moment.

    A test of the tests changes one equation of the catalogue before it calls this, and
    expects fewer right names than without the change.
    """
    return [run_case(case, work, max_effects=max_effects) for case in cases]


def _run(task):
    case, work, keep = task
    return run_case(case, work, keep=keep)


def run_all(cases, work, *, seeds, jobs, keep):
    """Run what has no line yet; add every outcome to the file at once."""
    file = Path(work) / "outcomes.jsonl"
    file.parent.mkdir(parents=True, exist_ok=True)
    done = read_outcomes(file) if file.is_file() else []
    strangers = {one["seeds"] for one in done} - {seeds}
    if strangers:
        raise SystemExit(f"{file}: holds {strangers} seeds; take another --work")
    # A case where the program failed is run again: its newer line takes the place.
    finished = {one["case"] for one in done if one["result"] != "failed"}
    tasks = [(case, work, keep) for case in cases if case.name not in finished]
    state = program_state()
    # One case a process: threads of the linear algebra would fight over the cores.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with (
        multiprocessing.get_context("spawn").Pool(jobs) as pool,
        file.open("a", encoding="utf-8") as lines,
    ):
        for n, outcome in enumerate(pool.imap_unordered(_run, tasks), 1):
            outcome |= {"seeds": seeds, "program": state}
            lines.write(json.dumps(outcome) + "\n")
            lines.flush()
            sys.stdout.write(
                f"{n}/{len(tasks)} {outcome['case']}: {outcome['result']} "
                f"({outcome['verdict']} {'+'.join(outcome['named'])}) "
                f"{outcome['wall_seconds']:.1f} s {outcome['failure']}\n"
            )
            sys.stdout.flush()


def show_gaps(cases):
    """Print how much of the motion each hidden effect leaves after a re-fit."""
    for case in cases:
        _, truth = measured_case(case)
        gap = truth["gap"]
        sys.stdout.write(
            f"{case.name}: {gap['share_of_motion']:.2%} of the motion, "
            f"{gap['to_noise']:.2f} of the noise\n"
        )


def main(arguments=None):
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(description="Blind test of hwid diagnose.")
    parser.add_argument("--suite", choices=list(SUITES), action="append")
    parser.add_argument("--seeds", choices=list(SEEDS), default="development")
    parser.add_argument("--number", type=int, default=1, help="cases of every kind")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--only", help="only this hidden effect or nuisance")
    parser.add_argument("--noise", type=float, help="only this noise, in percent")
    parser.add_argument("--keep", action="store_true", help="keep files of the cases")
    parser.add_argument("--gaps", action="store_true", help="only show sizes")
    parser.add_argument("--table", action="store_true", help="only show the table")
    parser.add_argument("--write", type=Path, help="write the document here")
    chosen = parser.parse_args(arguments)
    suites = chosen.suite or list(SUITES)
    cases = [
        case
        for suite in suites
        for case in cases_of(suite, chosen.seeds, chosen.number, chosen.only)
        if chosen.noise is None or case.noise_percent == chosen.noise
    ]
    if chosen.gaps:
        show_gaps(cases)
        return
    if not chosen.table:
        run_all(
            cases,
            chosen.work,
            seeds=chosen.seeds,
            jobs=chosen.jobs,
            keep=chosen.keep,
        )
    outcomes = read_outcomes(chosen.work / "outcomes.jsonl")
    sys.stdout.write("\n".join(summary_lines(outcomes)) + "\n")
    if chosen.write:
        chosen.write.write_text(document(outcomes), encoding="utf-8")


if __name__ == "__main__":
    main()
