"""``docs/blind_test.md`` from the lines of ``outcomes.jsonl``."""

import json
from pathlib import Path

from tests.blind import tables

_INTRODUCTION = """\
# Blind test of the diagnosis

A generator that shares no code with the program (`tests/blind`: own equations, own
integrator) hides effects in simulated drives and writes recordings and a configuration
whose stiffness, damping and force constant are 10-25 % off. `hwid diagnose` sees these
files only. The truth is compared with its `diagnosis.json`.

Made with `python tests/blind/run_blind.py --seeds {seeds} --number N --work DIR --write
docs/blind_test.md`: {cases} cases, {seeds} seeds, program `{program}` (hash of its
sources). {frozen}

The noise is white, in % of the largest displacement of the case. Intervals are 95 %
Wilson intervals. *Refused* is `ambiguous` without the truth, `unknown`, `none` or
`parameters`; *ambiguous* is `ambiguous` with the truth among the candidates.
"""
_FROZEN = {
    "reporting": (
        "The thresholds of the verdict and everything else in the program were settled "
        "on development seeds and frozen before these seeds were first used."
    ),
    "development": (
        "These are development seeds: thresholds were chosen while looking at them, so "
        "the figures flatter the program."
    ),
}


def read_outcomes(file):
    """Outcomes of a file, one JSON object per line; of each case the last one."""
    lines = Path(file).read_text(encoding="utf-8").splitlines()
    outcomes = [json.loads(line) for line in lines if line.strip()]
    return list({one["case"]: one for one in outcomes}.values())


def document(outcomes):
    """The whole text; outcomes of development and reporting seeds never mix."""
    seeds = {one["seeds"] for one in outcomes}
    if len(seeds) != 1:
        raise ValueError(f"outcomes of {sorted(seeds)} seeds; expected one kind")
    kind = seeds.pop()
    programs = sorted({one["program"] for one in outcomes})
    parts = [
        _INTRODUCTION.format(
            seeds=kind,
            cases=len(outcomes),
            program="`, `".join(programs),
            frozen=_FROZEN[kind],
        )
    ]
    if len(programs) > 1:
        parts.append("The program changed between some of these cases.\n")
    parts += ["## Verdicts\n", tables.verdict_table(outcomes)]
    for title, table in (
        ("Right names by effect", tables.effect_table(outcomes)),
        ("Small effects", tables.small_table(outcomes)),
        ("Gap before and after", tables.gap_table(outcomes)),
        ("Parameters", tables.parameter_table(outcomes)),
        ("Everything that was not right", tables.confusion_table(outcomes)),
        ("Time", tables.time_table(outcomes)),
    ):
        if table:
            parts += [f"## {title}\n", table]
    return "\n".join(parts)


def summary_lines(outcomes):
    """The verdicts as lines for a terminal."""
    return tables.verdict_table(outcomes).splitlines()
