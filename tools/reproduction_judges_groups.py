"""Claims about groups: what happens from level to level and along a chain.

Each function is one definition, sharp enough to fail; the second paragraph of its
docstring is printed beside the verdict.
"""

import numpy as np

from tools.reproduction_evidence import Counts, Matrix
from tools.reproduction_markdown import group_label, short_number
from tools.reproduction_verdict import IN_PART, Verdict, graded, not_judged

# Coverage of Combination Model 2 in the thesis, 23 of 38, and how near is near.
REACHED = 23 / 38
NEAR, NEAR_IN_PART = 0.1, 0.2
MOST = 0.75


def judge_grouping_raises(found: Counts) -> Verdict:
    """Whether joining recordings raises the coverage.

    Holds: some later level covers more than the first one. In part: the first level
    covers all already.

    Parameters
    ----------
    found : Counts
        Level by level.

    Returns
    -------
    Verdict
    """
    if len(found.values) < 2:
        return not_judged("There is only one level.")
    first, best = found.values[0], max(found.values[1:])
    if first == found.of:
        why = "The first level covers all: there is nothing to gain."
    elif best > first:
        why = f"From {first} to {best} of {found.of}."
    else:
        why = f"No later level covers more than the {first} of the first."
    why += _recount(found)
    numbers = {"first": first, "best": best, "of": found.of}
    answer = graded(best > first, first == found.of)
    return Verdict(answer, _growth(found), why, numbers)


def judge_saturates(found: Counts) -> Verdict:
    """Whether the coverage stops growing before everything is covered.

    Holds: the last level covers no more than the one before, and not all. In part: it
    stops because nothing is left to cover.

    Parameters
    ----------
    found : Counts
        Level by level.

    Returns
    -------
    Verdict
    """
    if len(found.values) < 2:
        return not_judged("There is only one level.")
    before, last = found.values[-2:]
    all_covered = last == found.of
    if all_covered:
        why = "It ends with all covered: nothing was left to gain."
    elif last > before:
        why = f"The last level still gains: {before} to {last}."
    else:
        why = f"The last level covers {last} after {before}, and not all {found.of}."
    why += _recount(found)
    numbers = {"before": before, "last": last, "of": found.of}
    answer = graded(last <= before and not all_covered, all_covered)
    return Verdict(answer, _growth(found), why, numbers)


def judge_reaches_share(found: Counts) -> Verdict:
    """Whether the whole chain ends near 23 of 38 recordings.

    Holds: the share that its last model covers differs from 23/38 by at most a tenth of
    all recordings. In part: by at most two tenths.

    Parameters
    ----------
    found : Counts
        Level by level.

    Returns
    -------
    Verdict
    """
    last = found.values[-1]
    share = last / found.of
    gap = abs(share - REACHED)
    # Shares are ratios of small integers; this only forgives their last bit.
    answer = graded(gap <= NEAR + 1e-9, gap <= NEAR_IN_PART + 1e-9)
    why = f"The last model covers {100 * share:.0f} %, against {100 * REACHED:.0f} %."
    why += _recount(found)
    numbers = {"last": last, "of": found.of, "share": share}
    return Verdict(answer, _growth(found), why, numbers)


def judge_test_rmsd_falls(found: Matrix) -> Verdict:
    """Whether the RMSD on each test recording falls along the chain.

    Holds: it falls from every level to the next on every test recording. In part: its
    mean over the test recordings is lower at the last level than at the first.

    Parameters
    ----------
    found : Matrix
        The chain, level by level, on the test recordings.

    Returns
    -------
    Verdict
    """
    falls = (found.rmsd[1:] < found.rmsd[:-1]).all(axis=0)
    means = found.rmsd.mean(axis=1)
    rises = [
        f"{group_label(name)} from {short_number(column[0], 4)} to "
        f"{short_number(column[-1], 4)}"
        for name, column in zip(found.recordings, found.rmsd.T, strict=True)
        if not column[-1] < column[0]
    ]
    n_all = len(found.recordings)
    why = (
        f"It falls at every level on {int(falls.sum())} of {n_all} test recordings; "
        f"their mean goes {_numbers(means)}; higher at the end than at the start: "
        f"{'; '.join(rises) or 'none'}."
    )
    numbers = {
        "monotone": int(falls.sum()),
        "of": n_all,
        "first": float(means[0]),
        "last": float(means[-1]),
    }
    answer = graded(bool(falls.all()), bool(means[-1] < means[0]))
    figure = f"mean {short_number(means[0])} -> {short_number(means[-1])}"
    return Verdict(answer, figure, why, numbers)


def judge_test_coverage_rises(found: Matrix) -> Verdict:
    """Whether grouping widens the coverage of recordings that it has not seen.

    Holds: the chain's last model covers more test recordings than its first. In part: as
    many, because the first covers all of them.

    Parameters
    ----------
    found : Matrix
        The chain, level by level, on the test recordings.

    Returns
    -------
    Verdict
    """
    counts = found.counts
    first, last = counts.values[0], counts.values[-1]
    all_along = first == last == counts.of
    if last > first:
        why = f"The last model covers {last - first} more of {counts.of}."
    elif all_along:
        why = "The first model covers all: there is nothing to gain."
    else:
        why = f"The last model covers {last} of {counts.of}, the first {first}."
    numbers = {"first": first, "last": last, "of": counts.of}
    return Verdict(graded(last > first, all_along), _growth(counts), why, numbers)


def judge_accuracy_is_traded(found: Matrix) -> Verdict:
    """Whether recordings that were covered first pay for the coverage of others.

    Holds: from the chain's first model to its last the number of covered recordings
    grows, and the RMSD grows on more than half of those that the first one covered. In
    part: only one of the two.

    Parameters
    ----------
    found : Matrix
        The chain, level by level, on all recordings.

    Returns
    -------
    Verdict
    """
    known = _known(found)
    payers = found.covered[0] & known
    if not payers.any():
        return not_judged("The first model covers nothing.")
    worse = int(np.sum(found.rmsd[-1, payers] > found.rmsd[0, payers]))
    n_first = int(payers.sum())
    counts = found.counts.values
    grows, pays = counts[-1] > counts[0], worse > n_first / 2
    why = (
        f"The RMSD grows on {worse} of the {n_first} recordings that the first model "
        f"covers, while the coverage goes from {counts[0]} to {counts[-1]} of "
        f"{len(found.recordings)}."
    )
    numbers = {
        "worse": worse,
        "covered_first": n_first,
        "first": counts[0],
        "last": counts[-1],
    }
    figure = f"worse on {worse} of {n_first}"
    return Verdict(graded(grows and pays, grows or pays), figure, why, numbers)


def judge_uncovered_gain(found: Matrix) -> Verdict:
    """Whether recordings that the first model does not cover gain from grouping.

    Holds: from the chain's first model to its last the RMSD falls on at least three
    quarters of the recordings that the first one does not cover. In part: on more than
    half of them.

    Parameters
    ----------
    found : Matrix
        The chain, level by level, on all recordings.

    Returns
    -------
    Verdict
    """
    rest = ~found.covered[0] & _known(found)
    if not rest.any():
        return not_judged("The first model covers all.")
    better = int(np.sum(found.rmsd[-1, rest] < found.rmsd[0, rest]))
    n_rest = int(rest.sum())
    share = better / n_rest
    why = (
        f"The RMSD falls on {better} of the {n_rest} recordings that the first model "
        "does not cover."
    )
    numbers = {"better": better, "uncovered_first": n_rest}
    figure = f"better on {better} of {n_rest}"
    return Verdict(graded(share >= MOST, share > 0.5), figure, why, numbers)


def judge_accuracy_grows(found: Matrix) -> Verdict:
    """Whether each further recording makes the model more accurate over all of them.

    The median over all recordings is taken, because one diverging model would decide a
    mean. Holds: the median RMSD falls from every level to the next. In part: it is lower
    at the last level than at the first.

    Parameters
    ----------
    found : Matrix
        The chain, level by level, on all recordings.

    Returns
    -------
    Verdict
    """
    known = _known(found)
    if not known.any():
        return not_judged("No recording is known at every level.")
    medians = np.median(found.rmsd[:, known], axis=1)
    falls = bool((medians[1:] < medians[:-1]).all())
    answer = graded(falls, bool(medians[-1] < medians[0]))
    why = f"The median RMSD over {int(known.sum())} recordings goes {_numbers(medians)}"
    why += "; it does not fall at every level." if answer == IN_PART else "."
    numbers = {"first": float(medians[0]), "last": float(medians[-1])}
    figure = f"{short_number(medians[0])} -> {short_number(medians[-1])}"
    return Verdict(answer, figure, why, numbers)


def _recount(found: Counts) -> str:
    """Say so where another table counts otherwise."""
    if not found.recount or found.recount == found.values:
        return ""
    values = " ".join(str(value) for value in found.recount)
    return f" Counted in the table of what is covered it is {values}."


def _known(found: Matrix) -> np.ndarray:
    """Recordings whose RMSD is known at every level."""
    return ~np.isnan(found.rmsd).any(axis=0)


def _numbers(values: np.ndarray) -> str:
    return ", ".join(short_number(float(value)) for value in values)


def _growth(found: Counts) -> str:
    return f"{' '.join(str(value) for value in found.values)} of {found.of}"
