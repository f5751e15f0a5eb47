"""The thesis's claims: what it says, where, and who judges it on which evidence."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass

from tools.reproduction_evidence import Evidence
from tools.reproduction_verdicts import (
    Verdict,
    judge_accuracy_grows,
    judge_accuracy_is_traded,
    judge_best_covers_half,
    judge_grouping_raises,
    judge_groups_beat_singles,
    judge_hard_ones_cover_little,
    judge_none_covers_all,
    judge_one_stands_alone,
    judge_reaches_share,
    judge_saturates,
    judge_self_rmsd,
    judge_several_models_needed,
    judge_some_covered_by_nobody,
    judge_test_coverage_rises,
    judge_test_rmsd_falls,
    judge_uncovered_gain,
    not_judged,
)


@dataclass(frozen=True)
class Claim:
    """One claim of the thesis.

    Parameters
    ----------
    text : str
    where : str
        Section or table.
    figure : str
        What the thesis says, as a number where it gives one.
    judge : callable
        From evidence to a Verdict; its docstring holds the definition.
    needs : tuple of str
        Fields of ``Evidence`` that it is called with.
    """

    text: str
    where: str
    figure: str
    judge: Callable[..., Verdict]
    needs: tuple[str, ...]


CLAIMS = (
    Claim(
        "Models follow their own step at 1e-4 to 1e-3",
        "T3.2.2-1",
        "0.9e-4 to 5.6e-4",
        judge_self_rmsd,
        ("self_rmsd",),
    ),
    Claim(
        "No model of one step covers all steps",
        "3.2.2 point 3",
        "at most 7 of 15",
        judge_none_covers_all,
        ("singles",),
    ),
    Claim(
        "The best one covers about half",
        "T3.2.2.2-2",
        "7 of 15",
        judge_best_covers_half,
        ("singles",),
    ),
    Claim(
        "One step is like no other",
        "3.2.2 point 1",
        "step 15",
        judge_one_stands_alone,
        ("widest",),
    ),
    Claim(
        "Grouping raises the coverage",
        "3.3.3.1-3",
        "7 to 8 of 12",
        judge_grouping_raises,
        ("levels",),
    ),
    Claim(
        "The best coverage saturates",
        "3.3.3.3",
        "7 8 8 8 of 12",
        judge_saturates,
        ("levels",),
    ),
    Claim(
        "RMSD on the test steps falls along the chain",
        "3.3.3.4",
        "decreasing trend",
        judge_test_rmsd_falls,
        ("chain_tests",),
    ),
    Claim(
        "Grouping widens coverage on the test steps",
        "3.3.3.4 end",
        "largely",
        judge_test_coverage_rises,
        ("chain_tests",),
    ),
    Claim(
        "Model 1: coverage grows along the chain",
        "T3.4.1-1",
        "6 7 8 8",
        judge_grouping_raises,
        ("growth_1",),
    ),
    Claim(
        "Model 1: and saturates",
        "T3.4.1-1",
        "6 7 8 8",
        judge_saturates,
        ("growth_1",),
    ),
    Claim(
        "Model 1: the first ones pay with accuracy",
        "3.4.1, 3.4.3",
        "step 6, 14",
        judge_accuracy_is_traded,
        ("chain_1",),
    ),
    Claim(
        "Model 1: uncovered recordings gain accuracy",
        "3.4.3 point 2",
        "-",
        judge_uncovered_gain,
        ("chain_1",),
    ),
    Claim(
        "Model 2: steps and sines reach 23 of 38",
        "T3.4.2-1",
        "23 of 38",
        judge_reaches_share,
        ("growth_2",),
    ),
    Claim(
        "Model 2: coverage grows along the chain",
        "3.4.2 point 1",
        "14 18 19 21 23",
        judge_grouping_raises,
        ("growth_2",),
    ),
    Claim(
        "Model 2: and saturates",
        "3.4.2 point 2",
        "14 18 19 21 23",
        judge_saturates,
        ("growth_2",),
    ),
    Claim(
        "Model 2: the first ones pay with accuracy",
        "3.4.2 point 3",
        "-",
        judge_accuracy_is_traded,
        ("chain_2",),
    ),
    Claim(
        "Model 2: uncovered recordings gain accuracy",
        "3.4.2 point 3",
        "step 5, 9",
        judge_uncovered_gain,
        ("chain_2",),
    ),
    Claim(
        "Groups cover more than single recordings",
        "3.4.3 point 1",
        "-",
        judge_groups_beat_singles,
        ("machine",),
    ),
    Claim(
        "Some recordings are covered by nobody",
        "3.4.3 point 3",
        "-",
        judge_some_covered_by_nobody,
        ("machine",),
    ),
    Claim(
        "Hard recordings give narrow models",
        "3.4.3",
        "10 of 15",
        judge_hard_ones_cover_little,
        ("machine",),
    ),
    Claim(
        "No model at all covers everything",
        "3.4.3 point 3",
        "-",
        judge_none_covers_all,
        ("machine_counts",),
    ),
    Claim(
        "Several models together describe the machine",
        "T3.4.3-2",
        "6 models",
        judge_several_models_needed,
        ("machine", "chosen"),
    ),
    Claim(
        "More recordings, more accuracy (Model 1)",
        "4 point 3",
        "-",
        judge_accuracy_grows,
        ("chain_1",),
    ),
    Claim(
        "More recordings, more accuracy (Model 2)",
        "4 point 3",
        "-",
        judge_accuracy_grows,
        ("chain_2",),
    ),
)


def judge(claim: Claim, evidence: Evidence) -> Verdict:
    """Judge a claim.

    Parameters
    ----------
    claim : Claim
    evidence : Evidence

    Returns
    -------
    Verdict
        ``NOT_JUDGED`` where the evidence is missing.
    """
    found = [getattr(evidence, name) for name in claim.needs]
    if any(item is None for item in found):
        return not_judged("There are no results for it.")
    return claim.judge(*found)


def definition(claim: Claim) -> str:
    """What exactly has to be so for a claim to hold.

    Parameters
    ----------
    claim : Claim

    Returns
    -------
    str
        Second paragraph of the judge's docstring, as one line.
    """
    text = inspect.getdoc(claim.judge) or ""
    return " ".join(text.split("\n\n")[1].split())
