"""Claims about models of single recordings and about all models together.

Each function is one definition, sharp enough to fail; the second paragraph of its
docstring is printed beside the verdict.
"""

import numpy as np

from tools.reproduction_evidence import Counts, Matrix, SelfRmsd
from tools.reproduction_markdown import counted, name_list, short_number
from tools.reproduction_verdict import Verdict, graded, not_judged

# The claim "1e-4 to 1e-3 against a threshold of 0.01", as shares of the threshold.
SELF_RANGE = (0.01, 0.1)
SELF_SHARE = 0.9
HALF, HALF_IN_PART = (0.4, 0.6), (0.3, 0.7)
# A recording is hard to cover when fewer than this share of the others' models do.
HARD_SHARE = 0.1
MOST = 0.75


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
