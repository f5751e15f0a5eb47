"""Single effects in the simulation itself: its runs choose among the likely ones.

Where a simulation is not linear, what the stand-in leaves of a large effect is its own
error as well: sets of effects would be found that make up for it.
docs/method_diagnosis.md, eq. (D33).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.candidate_words import with_best_so_far
from hwid_cli.diagnosis.choice import WITHIN_REACH, select_best
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.fit_facts import count, is_part_of
from hwid_cli.diagnosis.intervals import unclear_effects
from hwid_cli.diagnosis.port_effects import begin_at_port
from hwid_cli.diagnosis.port_search import (
    at_ports_by_runs_alone,
    at_ports_later,
    through_runs_at_port,
)
from hwid_cli.diagnosis.selection import (
    LEAST_EXPLAINED,
    LEAST_EXPLAINED_SET,
    LEAST_GAIN,
)
from hwid_cli.diagnosis.settling import settled
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import acts_at_port, changes_input
from hwid_cli.diagnosis.tasks import OnRound
from hwid_cli.diagnosis.through_runs import MOST_LEFT, followed
from hwid_cli.diagnosis.told_by_runs import ToldByRuns, TriedEffects, decided_by_runs
from hwid_cli.diagnosis.turns import Turn, best_turn, fit_of_run
from hwid_cli.diagnosis.verdict import decide
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import SMALL_REMAINDER, STILL_LARGE

# Single effects that the simulation is run with: at most so many different ones, of those that leave at
# most so many times what the best one leaves beside the stand-in, which counts as at least
# this share of what the base leaves.
_MOST_SINGLES = 4
_LIKELY = 4.0
_LEAST_LEFT = 0.01
# Effects on the input alone beside these, and the share of what the base leaves that each
# of them leaves at most.
_MOST_ON_INPUT = 3
_CLEARLY_LESS = 0.5
# What another effect leaves beside the stand-in at most, over that of one which explains most
# in the simulation itself, to be run as well.
_CLEARLY_BETTER = 0.8
# A run that leaves little more than noise may turn on after the others have used up theirs.
_TO_SETTLE = 1.5
# Times the noise that a run leaves at most to be followed before others are tried.
_NEARLY = 3.0


def single_in_simulation(
    findings: Findings,
    runs: Runs,
    values: dict[str, float],
    on_round: OnRound,
    *,
    may_pair: bool = False,
) -> ToldByRuns:
    """Put the likely single effects into the simulation, and let its runs decide.

    Where the simulation is not linear, what the stand-in leaves of a large effect is its
    own error as well: sets of effects would be found that make up for it.

    Parameters
    ----------
    findings : Findings
        Of single effects.
    may_pair : bool
        Whether two effects at the ports, which runs alone tell, may be tried together.
    """
    if not findings.base.is_usable:
        return ToldByRuns(None, values, is_all=False)
    alone = _base_in_simulation(findings, runs, values)
    if alone is not None:
        return ToldByRuns(*alone, is_all=True)
    tried = TriedEffects(findings)
    likely = _likely(findings)
    criteria, base = findings.criteria, findings.base
    are_open = not any(criteria.is_nearly_all(one, base) for one in likely)
    if are_open and tried.ports_are_exact:
        on_round("effects at the ports of the simulation", 0)
        at_ports_by_runs_alone(tried, runs, values, may_pair=may_pair)
    _try_likely(tried, likely, runs, values, on_round)
    at_ports_later(tried, runs)
    tried.keep(_twins_in_simulation(findings, runs, tried.turns, tried.fits))
    return _told(tried) or to_its_end(_untold(tried, values), runs)


def to_its_end(so_far: ToldByRuns, runs: Runs) -> ToldByRuns:
    """What is told once the run that leaves least was followed to its end.

    That takes many runs: whatever else is looked for comes before.
    """
    tried = so_far.tried
    if tried is None:
        return so_far
    before = dict(tried.fits)
    _follow(tried, runs, at_most=MOST_LEFT)
    if tried.fits == before:
        return so_far
    values = so_far.values
    return _told(tried) or _untold(tried, values)


def _told(tried: TriedEffects) -> ToldByRuns | None:
    """What runs tell of effects; None where none may be named."""
    findings = tried.findings
    decided = decided_by_runs(findings, tried.turns, tried.fits)
    if decided is None:
        return None
    told, moved = decided
    is_all = findings.criteria.is_nearly_all(told.verdict.chosen, findings.base)
    return ToldByRuns(told, moved, is_all, tried=tried)


def _untold(tried: TriedEffects, values: dict[str, float]) -> ToldByRuns:
    moved = _moved_by_best(tried.findings, tried.turns, tried.fits, values)
    return ToldByRuns(None, moved, is_all=False, fits=tried.fits, tried=tried)


def _try_likely(
    tried: TriedEffects,
    likely: Sequence[CandidateFit],
    runs: Runs,
    values: dict[str, float],
    on_round: OnRound,
) -> None:
    """Put effects that are likely beside the stand-in into the simulation, one by one."""
    findings = tried.findings
    for place, one in enumerate(likely, 1):
        fits = list(tried.fits.values())
        if runs.run_tasks.are_spent and (fits or place > 1):
            break
        if tried.is_known(one) or _is_settled_by(findings, one, fits):
            continue
        if _is_behind_most(findings, one, fits):
            continue
        (effect,) = one.effects
        what = f"single effects in the simulation, {place} of {len(likely)}"
        what = f"{what}, {public_id(effect)}"
        on_round(with_best_so_far(what, findings.criteria, fits, findings.base), 0)
        tried.keep(_in_simulation(tried, one, runs, values))
        _follow(tried, runs, at_most=_NEARLY)


def _in_simulation(
    tried: TriedEffects, one: CandidateFit, runs: Runs, values: dict[str, float]
) -> list[Turn]:
    """Best runs with an effect: one at a port through runs first, which are exact."""
    findings, found = tried.findings, list[Turn]()
    is_open = one.effects not in tried.through_runs
    is_exact = acts_at_port(one.effects) and tried.ports_are_exact
    if is_exact and runs.simulator.free and is_open:
        tried.through_runs.add(one.effects)
        waiting = (each for each in tried.later if each.fit.effects == one.effects)
        start = next(waiting, None) or begin_at_port(findings, one, runs, values)
        if start is not None and tried.is_hopeless(start):
            return []
        if start is not None:
            found = through_runs_at_port(tried, start, runs)
        if tried.are_nearly_all(found) or runs.run_tasks.are_spent:
            return found
    rival = min((fit.sse.sum() for fit in tried.fits.values()), default=np.inf)
    turn = settled(findings, one, runs, values, float(rival))
    return found if turn is None else [*found, turn]


def _follow(tried: TriedEffects, runs: Runs, *, at_most: float) -> None:
    """Follow the run that leaves least to its end, once, where that is more than noise.

    Its turns may have ended before they had settled; what it leaves then makes a law look
    no better than its limit case.

    Parameters
    ----------
    at_most : float, [-]
        Times the noise that it leaves, beyond which something else is missing.
    """
    turns, criteria = list(tried.turns.values()), tried.findings.criteria
    if not turns:
        return
    best = min(turns, key=lambda turn: float(turn.sse.sum()))
    fit = fit_of_run(tried.findings, best)
    if fit.effects in tried.followed or criteria.ratio(fit) > at_most:
        return
    tried.followed.add(fit.effects)
    allowed = runs.up_to(_TO_SETTLE)
    # At ports the fit was one through runs.
    is_exact = fit.effects in tried.through_runs and acts_at_port(fit.effects)
    further = best
    if not is_exact:
        further = followed(tried.findings, best, allowed, at_most=at_most)
    may_turn = not criteria.leaves_noise(fit) and criteria.ratio(fit) <= STILL_LARGE
    if further is best and may_turn:
        further = best_turn(tried.findings, best, allowed)
    tried.keep([further])


def _twins_in_simulation(
    findings: Findings,
    runs: Runs,
    tried: Mapping[tuple[str, ...], Turn],
    fits: Mapping[tuple[str, ...], CandidateFit],
) -> list[Turn]:
    """Limit cases with the same parameters, beside effects that leave nothing.

    A lag of the sensor and one of the actuator are the same for a simulation that is
    linear. Beside a stand-in whose parameters are off only one of them may fit.
    """
    done = [
        effects
        for effects, fit in fits.items()
        if len(effects) == 1 and findings.criteria.is_nearly_all(fit, findings.base)
    ]
    found = []
    for effects in done:
        turn = tried[effects]
        for twin in _twins(findings, fits[effects]):
            if twin.effects not in done:
                found.append(settled(findings, twin, runs, turn.values_of_run))
    return [turn for turn in found if turn is not None]


def _twins(findings: Findings, fit: CandidateFit) -> list[CandidateFit]:
    """Effects that another one includes, with its values as they are."""
    (effect,) = fit.effects

    def names(one: str) -> list[str]:
        return [each.name for each in CATALOGUE[one].parameters]

    alike = [
        one
        for one in CATALOGUE[effect].contains
        if (one,) in findings.found.shares and names(one) == names(effect)
    ]
    return [
        replace(
            fit,
            effects=(one,),
            names=tuple(
                replace(name, owner=one) if name.owner == effect else name
                for name in fit.names
            ),
        )
        for one in alike
    ]


def _moved_by_best(
    findings: Findings,
    tried: Mapping[tuple[str, ...], Turn],
    fits: Mapping[tuple[str, ...], CandidateFit],
    values: dict[str, float],
) -> dict[str, float]:
    """Parameters at the best run, where its effect explains most; the given ones else."""
    best = select_best(findings.criteria, list(fits.values()), findings.base)
    if best is None:
        return values
    explained = findings.criteria.evidence(best, findings.base).explained
    return tried[best.effects].values_of_run if explained >= LEAST_EXPLAINED else values


def _base_in_simulation(
    findings: Findings, runs: Runs, values: dict[str, float]
) -> tuple[Findings, dict[str, float]] | None:
    """The changed base of the stand-in, put into a simulation without parameters.

    The simulation answers in its own way to a gain that has changed: what the stand-in
    leaves then is its own error.
    """
    if runs.simulator.free:
        return None
    turn = settled(findings, findings.base, runs, values)
    base = None if turn is None else fit_of_run(findings, turn)
    if turn is None or base is None or not findings.criteria.is_complete(base):
        return None
    criteria = findings.criteria
    verdict = decide(criteria, findings.given_sse, base, {}, (), lambda _: ())
    problem = replace(turn.problem, known={})
    told = replace(findings, problem=problem, base=base, verdict=verdict)
    return told, turn.values_of_run


def _likely(findings: Findings) -> list[CandidateFit]:
    """Single effects that leave least beside the stand-in, limit cases and simple ones first.

    What leaves nothing there comes before: others then need few turns to be far behind.
    """
    criteria, base = findings.criteria, findings.base
    # What changes the input alone is put into the simulation, not into its stand-in: it
    # may have taken the stand-in's base anywhere.
    usable = [one for one in findings.found.fits.values()
              if one.is_usable and len(one.effects) == 1
              and (changes_input(one.effects) or not criteria.replaces(one))]  # fmt: skip
    usable.sort(key=criteria.excess)
    if not usable:
        return []
    least = max(
        criteria.excess(usable[0]), _LEAST_LEFT * criteria.excess(findings.base)
    )
    near = [one for one in usable if criteria.excess(one) <= _LIKELY * least]
    first = _of_different_families(_one_of_each(near), near)[:_MOST_SINGLES]
    first += _on_the_input(findings, usable, first)
    # What leaves little more with fewer parameters may be all of it.
    limits = [one for one in near if one not in first
              and any(is_part_of(one, wide) for wide in first)]  # fmt: skip

    def order(one: CandidateFit) -> tuple[bool, bool, int, int]:
        # What may as well not be there, such as play without a gap, is something else.
        is_null = bool(unclear_effects(findings.problem, one, findings.scales))
        is_all = criteria.is_nearly_all(one, base)
        return is_null, not is_all, -_n_including(one, near), count(one)

    return sorted([*first, *limits], key=order)


def _on_the_input(
    findings: Findings, usable: Sequence[CandidateFit], first: Sequence[CandidateFit]
) -> list[CandidateFit]:
    """Effects on the input alone that leave clearly less than the base.

    The simulation itself says how much: the rest is what its stand-in errs by.
    """
    criteria = findings.criteria
    most = _CLEARLY_LESS * criteria.excess(findings.base)
    further = [one for one in usable if changes_input(one.effects) and one not in first]
    clear = [one for one in further if criteria.excess(one) <= most]
    return clear[:_MOST_ON_INPUT]


def _one_of_each(near: Sequence[CandidateFit]) -> list[CandidateFit]:
    """The first variant of each effect: others of its kind take no place of another."""
    found: dict[tuple[str, ...], CandidateFit] = {}
    for one in near:
        found.setdefault(tuple(public_id(each) for each in one.effects), one)
    return list(found.values())


def _of_different_families(
    each: Sequence[CandidateFit], near: Sequence[CandidateFit]
) -> list[CandidateFit]:
    """The best of each family first: all kinds of friction would take every place.

    A family has a limit case in common.
    """
    first: dict[tuple[str, ...], CandidateFit] = {}
    for one in each:
        limits = [other for other in near if is_part_of(other, one)]
        root = min([one, *limits], key=count)
        first.setdefault(root.effects, one)
    leading = list(first.values())
    return [*leading, *(one for one in each if one not in leading)]


def _n_including(one: CandidateFit, others: Sequence[CandidateFit]) -> int:
    """Of how many others an effect is a limit case."""
    return sum(is_part_of(one, other) for other in others if other is not one)


def _is_settled_by(
    findings: Findings, one: CandidateFit, fits: Sequence[CandidateFit]
) -> bool:
    """Whether runs with other effects leave nothing that an effect could explain.

    Of effects with fewer parameters the simulation itself decides: what the stand-in leaves
    of them more than of others may be its own error.
    """
    criteria = findings.criteria
    if any(criteria.is_complete(fit) and is_part_of(fit, one) for fit in fits):
        return True
    done = [fit for fit in fits if criteria.is_nearly_all(fit, findings.base)]
    if not done:
        return False
    if any(
        count(one) > count(fit)
        and criteria.is_complete(fit)
        and criteria.gain(one, fit) < LEAST_GAIN
        for fit in done
    ):
        # Even beside the stand-in, which it may suit, it leaves no less.
        return True
    is_simpler = any(is_part_of(one, fit) or count(one) < count(fit) for fit in done)
    # A stand-in tells a delay from a lag by its own error.
    is_alike = changes_input(one.effects) and any(
        changes_input(f.effects) for f in done
    )
    return not (is_simpler or is_alike or _is_near(findings, one, done))


def _is_behind_most(
    findings: Findings, one: CandidateFit, fits: Sequence[CandidateFit]
) -> bool:
    """Whether runs leave little beside another effect that the stand-in prefers, too.

    What is left is then of a second effect, which the runs are kept for. What changes the
    input alone no stand-in ranks.
    """
    criteria, said = findings.criteria, findings.found.fits
    best = select_best(criteria, fits, findings.base)
    if best is None or best.effects not in said or changes_input(one.effects):
        return False
    if criteria.ratio(best) <= SMALL_REMAINDER:
        # It may be another effect altogether, of which this one is a likeness.
        return False
    explained = criteria.evidence(best, findings.base).explained
    least = _CLEARLY_BETTER * criteria.excess(said[best.effects])
    return explained >= LEAST_EXPLAINED_SET and criteria.excess(one) > least


def _is_near(
    findings: Findings, one: CandidateFit, done: Sequence[CandidateFit]
) -> bool:
    """Whether the stand-in takes an effect for about as good as one that is enough."""
    said, excess = findings.found.fits, findings.criteria.excess
    # Of what runs alone called likely, the stand-in may have said nothing.
    known = [excess(said[fit.effects]) for fit in done if fit.effects in said]
    return excess(one) <= WITHIN_REACH * min(known, default=0.0)
