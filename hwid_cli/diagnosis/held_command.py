"""Whether the command is held between samples, where nobody has said so.

Controllers and D/A converters hold what they send. Simulated as a line between samples,
such a command comes half a sample too early, which looks like a delay or a lag of the
drive. So what the search has found is fitted once more beside a held command, whole and
without each of its effects. docs/method_diagnosis.md, eq. (D23b).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import (
    SearchStart,
    compared_with_fit,
    start_from,
)
from hwid_cli.diagnosis.choice import NEARLY_THE_REST, TIE
from hwid_cli.diagnosis.effect_sets import Effects
from hwid_cli.diagnosis.fit_facts import count
from hwid_cli.diagnosis.growing import is_rugged
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.rounds import RoundsResult
from hwid_cli.diagnosis.selection import LEAST_GAIN
from hwid_cli.diagnosis.set_fits import FAR_BEHIND, Rounds, fit_task, growing_task
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.drive import HELD, LINE

# Sets that are tried beside the best one.
MOST_OTHERS = 4
# Sets that a search beside a held command begins with.
_MOST_LIKELY = 12


@dataclass(frozen=True, eq=False)
class OtherCommand:
    """A set of effects beside the command that was not taken, and does as well.

    Parameters
    ----------
    problem : DiagnosisProblem
        The same recordings, with that command.
    fit : CandidateFit
        Of the same effects.
    """

    problem: DiagnosisProblem
    fit: CandidateFit


def with_held_command(problem: DiagnosisProblem) -> DiagnosisProblem:
    """The same recordings, with a command that is held between samples."""
    return _with_command(problem, HELD)


def other_command(rounds: Rounds, chosen: CandidateFit) -> OtherCommand | None:
    """The chosen set beside the other command, if the recordings do not tell them apart.

    Half a sample changes what is fast, the stiffness of a coupling say: then the values
    beside one command alone are surer than the recordings make them.

    Parameters
    ----------
    chosen : CandidateFit
        Beside the command of the problem.

    References
    ----------
    docs/method_diagnosis.md, eq. (D23b).
    """
    problem = rounds.problem
    if not (problem.may_be_held and chosen.effects and chosen.is_usable):
        return None
    if not _matters(rounds, chosen):
        return None
    other = _with_command(problem, LINE if problem.drive.hold == HELD else HELD)
    rounds.on_round("the other command", 1)
    task = fit_task(
        replace(rounds, problem=other),
        chosen.effects,
        [start_from(problem.drive, chosen)],
        None,
    )
    fits: list[CandidateFit] = rounds.run_tasks([task], keep=True)
    if rounds.criteria.gain(fits[0], chosen) < -TIE:
        return None
    return OtherCommand(other, fits[0])


def _with_command(problem: DiagnosisProblem, hold: str) -> DiagnosisProblem:
    return replace(problem, drive=replace(problem.drive, hold=hold))


def best_of(rounds: Rounds, found: RoundsResult) -> CandidateFit:
    """The largest of the best sets; the base where there is none."""
    return found.best[-1] if found.best else rounds.base


def is_held(rounds: Rounds, found: RoundsResult) -> bool:
    """Whether a held command does better than a line between samples.

    Parameters
    ----------
    found : RoundsResult
        Beside a command that goes on in a line.

    References
    ----------
    docs/method_diagnosis.md, eq. (D23b).
    """
    best = best_of(rounds, found)
    return bool(_better_if_held(rounds, best, _worth_trying(rounds, found, best)))


def most_likely(rounds: Rounds, found: RoundsResult) -> list[CandidateFit]:
    """The sets that a search beside the other command begins with, the best first.

    Half a sample moves all of them alike: what is far behind here is so there as well.
    """
    usable = [one for one in found.fits.values() if one.is_usable]
    usable.sort(key=lambda one: -rounds.criteria.gain(one, rounds.base))
    best = [one for one in found.best if one not in usable[:_MOST_LIKELY]]
    return [*usable[:_MOST_LIKELY], *best]


def does_as_well(rounds: Rounds, held: CandidateFit, line: CandidateFit) -> bool:
    """Whether the best set beside a held command does as well as that beside a line."""
    lead = rounds.criteria.gain(line, held)
    return lead <= (TIE if count(held) < count(line) else 0.0)


def is_settled_if_held(rounds: Rounds, found: RoundsResult) -> bool:
    """Whether next to nothing remains beside a held command, where a line leaves something.

    Larger sets are not worth their time then: they would imitate half a sample.

    Parameters
    ----------
    found : RoundsResult
        Beside a command that goes on in a line.
    """
    best = best_of(rounds, found)
    better = _better_if_held(rounds, best, _worth_trying(rounds, found, best))
    criteria = rounds.criteria
    least = (1 - NEARLY_THE_REST) * criteria.excess(best)
    return any(
        criteria.is_complete(one) or criteria.excess(one) <= least for one in better
    )


def _better_if_held(
    rounds: Rounds, best: CandidateFit, sets: Mapping[Effects, SearchStart]
) -> list[CandidateFit]:
    """Fits of sets beside a held command that do better than a set beside a line."""
    if not (best.is_usable and _matters(rounds, best)):
        return []
    criteria = rounds.criteria
    held = replace(rounds, problem=with_held_command(rounds.problem))
    rounds.on_round("the command held", len(sets))
    tasks = [fit_task(held, ids, [start], None) for ids, start in sets.items()]
    fits: list[CandidateFit] = rounds.run_tasks(tasks, keep=True)
    fits += _grown(held, fits)
    return [
        one
        for one in fits
        # What it does without is a reason of its own: ties go to the simpler set.
        if criteria.gain(one, best)
        >= (-TIE if count(one) < count(best) else LEAST_GAIN)
    ]


def _grown(held: Rounds, fits: list[CandidateFit]) -> list[CandidateFit]:
    """The best rugged set beside a held command, fitted again to growing parts.

    Half a sample is enough for such a fit to end in another valley beside a line, from
    which no further fit leads away.
    """
    criteria = held.criteria
    usable = [one for one in fits if one.is_usable]
    rugged = [one for one in usable if is_rugged(one.effects)]
    if not rugged:
        return []
    least, best = (min(these, key=criteria.excess) for these in (usable, rugged))
    is_far = criteria.excess(best) > FAR_BEHIND * criteria.excess(least)
    if is_far or criteria.is_complete(least):
        return []
    held.on_round("the command held, growing parts", 1)
    task = growing_task(held, best, to_the_end=False)
    found: list[CandidateFit] = held.run_tasks([task], keep=True)
    return found


def _without_each(rounds: Rounds, best: CandidateFit) -> dict[Effects, SearchStart]:
    """A set, and the same without each effect, with starts."""
    start = start_from(rounds.problem.drive, best)
    sets = {best.effects: start}
    for left in best.effects:
        sets[tuple(one for one in best.effects if one != left)] = start
    return sets


def _worth_trying(
    rounds: Rounds, found: RoundsResult, best: CandidateFit
) -> dict[Effects, SearchStart]:
    """The best set, the same without each effect, and the next best ones, with starts."""
    gain, drive = rounds.criteria.gain, rounds.problem.drive
    sets = _without_each(rounds, best)
    near = sorted(found.fits.values(), key=lambda one: -gain(one, best))
    near = [one for one in near if len(one.effects) <= len(best.effects)]
    for one in near[: MOST_OTHERS + 1]:
        sets.setdefault(one.effects, start_from(drive, one))
    return sets


def _matters(rounds: Rounds, best: CandidateFit) -> bool:
    """Whether the two commands lead to motions that the noise does not hide."""
    scales = rounds.baseline.scales
    both = zip(
        compared_with_fit(rounds.problem, best, scales),
        compared_with_fit(with_held_command(rounds.problem), best, scales),
        strict=True,
    )
    apart = sum(float(np.sum((one.residual - two.residual) ** 2)) for one, two in both)
    return apart >= LEAST_GAIN * rounds.baseline.noise.rms**2
