"""Claims of the thesis put to the test: one function for each, and the verdict it gives.

Each function is one definition, sharp enough to fail; the second paragraph of its
docstring is printed beside the verdict. First models of single recordings and all models
together, then groups: what happens from level to level and along a chain.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tools.reproduction_evidence import Counts, Matrix, SelfRmsd
from tools.reproduction_markdown import counted, group_label, name_list, short_number

HOLDS = "holds"
IN_PART = "in part"
FAILS = "does not hold"
NOT_JUDGED = "not judged"
# The claim "1e-4 to 1e-3 against a threshold of 0.01", as shares of the threshold.
SELF_RANGE = (0.01, 0.1)
SELF_SHARE = 0.9
HALF, HALF_IN_PART = (0.4, 0.6), (0.3, 0.7)
# A recording is hard to cover when fewer than this share of the others' models do.
HARD_SHARE = 0.1
MOST = 0.75
# Coverage of Combination Model 2 in the thesis, 23 of 38, and how near is near.
REACHED = 23 / 38
NEAR, NEAR_IN_PART = 0.1, 0.2


@dataclass(frozen=True)
class Verdict:
    """Whether a claim holds on some evidence.

    Parameters
    ----------
    answer : str
        ``HOLDS``, ``IN_PART``, ``FAILS`` or ``NOT_JUDGED``.
    figure : str
        The number that decides, for a cell of a table.
    why : str
        One sentence that follows from the numbers.
    numbers : mapping of str to float
        What the answer was told from.
    """

    answer: str
    figure: str
    why: str
    numbers: Mapping[str, float] = field(default_factory=dict)


def graded(holds: bool, in_part: bool) -> str:
    """Choose the answer from two tests, the stricter one first.

    Parameters
    ----------
    holds : bool
    in_part : bool

    Returns
    -------
    str
    """
    return HOLDS if holds else IN_PART if in_part else FAILS


def not_judged(why: str) -> Verdict:
    """A claim that the evidence says nothing about.

    Parameters
    ----------
    why : str

    Returns
    -------
    Verdict
    """
    return Verdict(NOT_JUDGED, "-", why)


def judge_self_rmsd(found: SelfRmsd) -> Verdict:
    """Whether models follow their own recording a decade or two below the threshold.

    Holds: the lowest RMSD lies from a hundredth to a tenth of the threshold on at least
    nine in ten recordings, and above that on none. In part: it lies below the threshold
    on all.

    Parameters
    ----------
    found : SelfRmsd

    Returns
    -------
    Verdict
    """
    low, high = (share * found.threshold for share in SELF_RANGE)
    best = found.lowest[:, 0]
    above, below = int(np.sum(best > high)), int(np.sum(best < low))
    inside = len(best) - above - below
    holds = inside >= SELF_SHARE * len(best) and above == 0
    figure = f"{short_number(best.min())} to {short_number(best.max())}"
    why = (
        f"{inside} of {len(best)} best RMSDs lie from {short_number(low)} to "
        f"{short_number(high)}, {below} "
        f"below and {above} above; the largest is {best.max() / found.threshold:.3g} "
        "of the threshold."
    )
    numbers = {"inside": inside, "below": below, "above": above, "of": len(best)}
    in_part = bool(np.all(best < found.threshold))
    return Verdict(graded(holds, in_part), figure, why, numbers)


def judge_none_covers_all(found: Counts) -> Verdict:
    """Whether every model leaves some recording uncovered.

    Holds: the widest model covers fewer recordings than there are.

    Parameters
    ----------
    found : Counts

    Returns
    -------
    Verdict
    """
    widest = max(found.values)
    missed = found.of - widest
    why = f"The widest model covers {widest} of {found.of}"
    if missed == 0:
        why += f", and {found.values.count(widest)} of the models do so."
    elif missed <= 0.1 * found.of:
        why += f" and so misses only {missed}: this machine is close to uniform."
    else:
        why += f" and so misses {missed}."
    numbers = {"widest": widest, "of": found.of}
    return Verdict(graded(missed > 0, False), f"{widest} of {found.of}", why, numbers)


def judge_best_covers_half(found: Counts) -> Verdict:
    """Whether the widest model of a single recording covers about half of them.

    Holds: it covers 40 to 60 % of the recordings. In part: 30 to 70 %.

    Parameters
    ----------
    found : Counts

    Returns
    -------
    Verdict
    """
    widest = max(found.values)
    share = widest / found.of
    answer = graded(
        HALF[0] <= share <= HALF[1], HALF_IN_PART[0] <= share <= HALF_IN_PART[1]
    )
    why = f"It covers {100 * share:.0f} %"
    if share > HALF[1]:
        why += "; the recordings are more alike than the claim has it."
    elif share < HALF[0]:
        why += "; the recordings are less alike than the claim has it."
    else:
        why += "."
    numbers = {"widest": widest, "of": found.of, "share": share}
    return Verdict(answer, f"{widest} of {found.of}", why, numbers)


def judge_one_stands_alone(found: Matrix) -> Verdict:
    """Whether one recording, and only one, is like no other.

    Holds: exactly one recording is covered by no other recording's widest model. In
    part: there are several.

    Parameters
    ----------
    found : Matrix
        Widest model of each recording on these recordings.

    Returns
    -------
    Verdict
    """
    lonely = _covered_by_no_other(found)
    why = f"No widest model of another recording covers: {name_list(lonely)}."
    numbers = {"alone": len(lonely)}
    figure = (
        name_list(lonely) if len(lonely) <= 3 else counted(len(lonely), "recording")
    )
    return Verdict(graded(len(lonely) == 1, len(lonely) > 1), figure, why, numbers)


def judge_some_covered_by_nobody(found: Matrix) -> Verdict:
    """Whether some recordings are out of reach of every model of other recordings.

    Holds: at least one recording is covered by no model, of a single recording or of a
    group, that was not fitted to it.

    Parameters
    ----------
    found : Matrix

    Returns
    -------
    Verdict
    """
    lonely = _covered_by_no_other(found)
    n_all = len(found.recordings)
    why = f"Covered by no model of others: {name_list(lonely)}."
    numbers = {"uncovered": len(lonely), "of": n_all}
    figure = f"{len(lonely)} of {n_all}"
    return Verdict(graded(bool(lonely), False), figure, why, numbers)


def _covered_by_no_other(found: Matrix) -> list[str]:
    reached = (found.covered & ~found.is_own).any(axis=0)
    return [
        name
        for name, is_reached in zip(found.recordings, reached, strict=True)
        if not is_reached
    ]


def judge_hard_ones_cover_little(found: Matrix) -> Verdict:
    """Whether recordings that few models cover also give models that cover little.

    Among models of single recordings, own recordings left out, a recording is hard when
    fewer than a tenth of the others' models cover it. Holds: at least three quarters of
    the hard recordings' own models cover fewer recordings than the median model does. In
    part: more than half of them.

    Parameters
    ----------
    found : Matrix

    Returns
    -------
    Verdict
    """
    singles = found.part(found.singles, found.recordings)
    others = singles.covered & ~singles.is_own
    reach = dict(zip(singles.models, others.sum(axis=1), strict=True))
    n_others = (~singles.is_own).sum(axis=0)
    hard = [
        name
        for name, count, n in zip(
            found.recordings, others.sum(axis=0), n_others, strict=True
        )
        if count < HARD_SHARE * n and name in reach
    ]
    if not hard:
        return not_judged("No recording that has a model of its own is hard to cover.")
    median = float(np.median(list(reach.values())))
    poor = [name for name in hard if reach[name] < median]
    share = len(poor) / len(hard)
    why = (
        f"Hard to cover: {counted(len(hard), 'recording')} ({name_list(hard)}); of these, "
        f"{len(poor)} have models that cover fewer than the median of {median:g}."
    )
    numbers = {"hard": len(hard), "poor": len(poor), "median": median}
    figure = f"{len(poor)} of {len(hard)}"
    return Verdict(graded(share >= MOST, share > 0.5), figure, why, numbers)


def judge_groups_beat_singles(found: Matrix) -> Verdict:
    """Whether a model of a group covers more than any model of a single recording.

    Holds: the widest model of a group covers more of all recordings than the widest of a
    single recording, own recordings counted for both. In part: as many.

    Parameters
    ----------
    found : Matrix

    Returns
    -------
    Verdict
    """
    counts = found.counts.values
    groups = [n for name, n in zip(found.models, counts, strict=True) if "+" in name]
    if not groups or not found.singles:
        return not_judged(
            "There are no models of groups, or none of single recordings."
        )
    single, group = max(counts[row] for row in found.singles), max(groups)
    n_all = found.counts.of
    why = (
        f"The widest group covers {group} of {n_all}, the widest single recording "
        f"{single}."
    )
    numbers = {"single": single, "group": group, "of": n_all}
    answer = graded(group > single, group == single)
    return Verdict(answer, f"{single} -> {group} of {n_all}", why, numbers)


def judge_several_models_needed(machine: Matrix, chosen: Matrix) -> Verdict:
    """Whether several models together describe what no single one does.

    Own recordings count as covered. Holds: the chosen models are at least two, and
    together they cover all recordings, which no model does alone. In part: together
    they cover more than any model alone, but not all.

    Parameters
    ----------
    machine : Matrix
        All models on all recordings.
    chosen : Matrix
        The chosen ones on all recordings.

    Returns
    -------
    Verdict
    """
    alone = max(machine.counts.values)
    reached = np.any(chosen.covered, axis=0).tolist()
    together = sum(reached)
    n_all, n_models = len(machine.recordings), len(chosen.models)
    more = n_models > 1 and together > alone
    missing = [
        name
        for name, is_covered in zip(chosen.recordings, reached, strict=True)
        if not is_covered
    ]
    why = (
        f"{counted(n_models, 'model')} together: {together} of {n_all} covered; the widest "
        f"one alone: {alone}; left out: {name_list(missing)}."
    )
    numbers = {
        "models": n_models,
        "together": together,
        "alone": alone,
        "of": n_all,
    }
    figure = f"{counted(n_models, 'model')}: {together} of {n_all}"
    return Verdict(graded(more and together == n_all, more), figure, why, numbers)


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
