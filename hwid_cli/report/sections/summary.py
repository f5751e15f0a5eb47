"""What stands first on the page: one answer for each question that the results settle."""

from collections.abc import Sequence
from dataclasses import replace

from hwid_cli.records.report import ReportContents
from hwid_cli.report.formats import counted
from hwid_cli.report.page import Answer, Section


def summary_section(contents: ReportContents, answers: Sequence[Answer]) -> Section:
    """Show the answers, or say what is there while nothing is answered yet."""
    shown = tuple(replace(one, is_small=len(answers) > 1) for one in answers)
    blocks = shown or (_open_question(contents),)
    return Section("summary", "", "Answer", blocks)


def _open_question(contents: ReportContents) -> Answer:
    """What has been done so far, and what to run."""
    recordings = contents.stored.recordings
    if not recordings:
        return Answer(
            "What is here?",
            "No results yet.",
            is_settled=False,
            next_steps=(("Run all stages:", "hwid run CONFIG"),),
        )
    repaired = sum(
        len(one.repaired_input) + len(one.repaired_output)
        for one in contents.stored.logs
    )
    seconds = sum(one.n_samples * one.sample_time_s for one in recordings)
    damage = f"; {counted(repaired, 'damaged sample')} replaced" if repaired else ""
    return Answer(
        "Which model describes the drive?",
        "No model yet: the recordings are calibrated, and nothing is fitted.",
        is_settled=False,
        details=(
            f"{counted(len(recordings), 'recording')}, {seconds:.3g} s in all{damage}. "
            "Look at the recordings below before you fit models: what was cut, and what the input does.",
        ),
        next_steps=(
            ("Fit models to them:", "hwid identify CONFIG"),
            ("All stages at once:", "hwid run CONFIG"),
        ),
    )
