"""Single effects in the simulation itself: its runs choose among the likely ones.

Where a simulation is not linear, what the stand-in leaves of a large effect is its own
error as well: sets of effects would be found that make up for it.
docs/method_diagnosis.md, eq. (D33).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hwid_cli.diagnosis.candidate import fitted_effects
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.intervals import unclear_effects
from hwid_cli.diagnosis.own_base import is_beyond_factors, judged_by_own_base
from hwid_cli.diagnosis.port_effects import (
    PortStart,
    begin_at_port,
    moving_most,
    port_effects,
    with_port_effects,
)
from hwid_cli.diagnosis.port_screening import AtPorts, screened_at_ports
from hwid_cli.diagnosis.selection import (
    LEAST_EXPLAINED,
    LEAST_GAIN,
    WITHIN_REACH,
    count,
    is_part_of,
    select_best,
    with_best_so_far,
)
from hwid_cli.diagnosis.settling import settled
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import acts_at_port, changes_input
from hwid_cli.diagnosis.tasks import OnRound
from hwid_cli.diagnosis.through_runs import MOST_LEFT, followed
from hwid_cli.diagnosis.turns import Turn, best_turn, fit_of_run
from hwid_cli.diagnosis.verdict import decide
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import STILL_LARGE

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
# Effects at its ports that the simulation's runs alone call likely: so many are fitted.
# Those that leave more than three times the noise, this share of the gap, and so many
# times what the stand-in says of another effect wait until that has been tried, [-].
_MOST_BY_RUNS, _MOST_OF_GAP, _WORTH_WAITING = 2, 0.25, 2.0
# A run that leaves little more than noise may turn on after the others have used up theirs.
_TO_SETTLE = 1.5
# Times the noise that a run leaves at most to be followed before others are tried.
_NEARLY = 3.0
# Mean square over the noise's beside which no further one is begun, unless runs have called
# it likely by nearly the same share.
_NEXT_TO_NOISE, _ALIKE = 2.0, 2.0
# Squares over those that another effect's run leaves of the same recordings, from which on an
# effect at a port is not fitted to the others.
_FAR_BEHIND = 4.0


@dataclass(frozen=True, eq=False)
class ToldByRuns:
    """What runs of the simulation with effects in it tell.

    Parameters
    ----------
    findings : Findings or None
        Of the run that decides; None where none may be named.
    values : dict of str to float
        Parameters of the simulation at that run; without one, at the best run of an effect
        that explains most, which the parameters may have imitated.
    is_all : bool
        Whether that run leaves so little that a further effect could not be named.
    fits : mapping of tuple of str to CandidateFit
        What runs with single effects left.
    """

    findings: Findings | None
    values: dict[str, float]
    is_all: bool
    fits: Mapping[tuple[str, ...], CandidateFit] = field(default_factory=dict)


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
    tried = _Tried(findings)
    likely = _likely(findings)
    criteria, base = findings.criteria, findings.base
    are_open = not any(criteria.is_nearly_all(one, base) for one in likely)
    if are_open and tried.ports_are_exact:
        _at_ports_by_runs_alone(tried, runs, values, may_pair=may_pair)
    _try_likely(tried, likely, runs, values, on_round)
    _at_ports_later(tried, runs)
    _follow(tried, runs, at_most=MOST_LEFT)
    tried.keep(_twins_in_simulation(findings, runs, tried.turns, tried.fits))
    decided = decided_by_runs(findings, tried.turns, tried.fits)
    if decided is not None:
        told, moved = decided
        is_all = criteria.is_nearly_all(told.verdict.chosen, base)
        return ToldByRuns(told, moved, is_all)
    moved = _moved_by_best(findings, tried.turns, tried.fits, values)
    return ToldByRuns(None, moved, is_all=False, fits=tried.fits)


class _Tried:
    """Best runs of the simulation with each effect, and what they left."""

    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        self.turns: dict[tuple[str, ...], Turn] = {}
        self.fits: dict[tuple[str, ...], CandidateFit] = {}
        # Effects at the ports that were fitted through runs, those begun that are hopeless,
        # what was asked before, and which of them wait.
        self.through_runs: set[tuple[str, ...]] = set()
        self.given_up: set[tuple[str, ...]] = set()
        self.at_ports = AtPorts()
        self.later: list[PortStart] = []
        # Mean square over the noise's that the best of those begun leaves.
        self.least_begun = np.inf
        # Whose runs were followed to their end.
        self.followed: set[tuple[str, ...]] = set()

    @property
    def ports_are_exact(self) -> bool:
        """Whether a run shows an effect at a port as it is.

        The forces of an effect that is there already would have to go with its motion.
        """
        present = drive_effects(self.findings.problem.drive)
        return not present or acts_at_port(tuple(present))

    def is_known(self, one: CandidateFit) -> bool:
        """Whether runs have said what an effect leaves, whatever a stand-in says.

        It was fitted through runs or given up; or they leave nothing with another effect at
        a port, and much with this one.
        """
        is_exact = one.effects in self.through_runs and one.effects in self.fits
        if is_exact or one.effects in self.given_up:
            return True
        criteria, (effect,) = self.findings.criteria, one.effects
        return any(
            criteria.is_complete(fit) and self.at_ports.is_behind(effect, *fit.effects)
            for fit in self.fits.values()
            if len(fit.effects) == 1
        )

    def are_nearly_all(self, turns: Sequence[Turn] | None = None) -> bool:
        """Whether one of some runs, or of all, leaves nothing that could be named."""
        criteria, base = self.findings.criteria, self.findings.base
        fits = list(self.fits.values())
        if turns is not None:
            fits = [fit_of_run(self.findings, turn) for turn in turns]
        return any(criteria.is_nearly_all(fit, base) for fit in fits)

    def is_hopeless(self, start: PortStart) -> bool:
        """Whether a start leaves much, and another effect nothing or far less."""
        if start.left <= STILL_LARGE**2:
            return False
        if self.are_nearly_all():
            return True
        of_runs = map(self._left_of_few, self.fits.values())
        return start.left > _FAR_BEHIND * min([self.least_begun, *of_runs])

    def _left_of_few(self, fit: CandidateFit) -> float:
        """Mean square over the noise's of the recordings that starts are fitted to."""
        problem, floors = self.findings.problem, self.findings.criteria.floors
        few = {one.name for one in moving_most(problem.signals)}
        rows = [n for n, one in enumerate(problem.signals) if one.name in few]
        floor = float(floors[rows].sum())
        return float(fit.sse[rows].sum()) / floor if floor > 0 else np.inf

    def keep(self, turns: Sequence[Turn]) -> None:
        """Keep runs that leave less than those before with the same effect."""
        for turn in turns:
            fit = fit_of_run(self.findings, turn)
            before = self.fits.get(fit.effects)
            if before is None or fit.sse.sum() < before.sse.sum():
                self.turns[fit.effects], self.fits[fit.effects] = turn, fit


def _try_likely(
    tried: _Tried,
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
        (effect,) = one.effects
        what = f"single effects in the simulation, {place} of {len(likely)}"
        what = f"{what}, {public_id(effect)}"
        on_round(with_best_so_far(what, findings.criteria, fits, findings.base), 0)
        tried.keep(_in_simulation(tried, one, runs, values))
        _follow(tried, runs, at_most=_NEARLY)


def _in_simulation(
    tried: _Tried, one: CandidateFit, runs: Runs, values: dict[str, float]
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
            found = _through_runs(tried, start, runs)
        if tried.are_nearly_all(found) or runs.run_tasks.are_spent:
            return found
    rival = min((fit.sse.sum() for fit in tried.fits.values()), default=np.inf)
    turn = settled(findings, one, runs, values, float(rival))
    return found if turn is None else [*found, turn]


def _follow(tried: _Tried, runs: Runs, *, at_most: float) -> None:
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


def _at_ports_by_runs_alone(
    tried: _Tried, runs: Runs, values: dict[str, float], *, may_pair: bool
) -> None:
    """Effects at the ports that the simulation calls likely, whatever its stand-in says.

    Those that leave much of a few recordings wait until others have been tried.
    """
    if runs.run_tasks.are_spent:
        return
    tried.at_ports = screened_at_ports(tried.findings, runs, values)
    said = _least_said(tried.findings)
    starts = _begun_at_ports(tried, tried.at_ports, runs)
    tried.least_begun = min((one.left for one in starts), default=np.inf)
    for start in starts:
        if tried.are_nearly_all() or runs.run_tasks.are_spent:
            break
        if tried.is_hopeless(start):
            tried.given_up.add(start.fit.effects)
            continue
        is_large = start.left > STILL_LARGE**2
        waits = is_large and start.left > _WORTH_WAITING * said
        if is_large and not waits and may_pair:
            tried.keep(_pair_at_ports(tried, start, runs))
            if tried.are_nearly_all():
                break
        if waits and start.share > _MOST_OF_GAP:
            tried.later.append(start)
        else:
            tried.keep(_through_runs(tried, start, runs))
    tried.keep(_with_wider_law(tried, runs))


def _begun_at_ports(tried: _Tried, at_ports: AtPorts, runs: Runs) -> list[PortStart]:
    """Likely effects fitted to a few recordings, those that leave least first."""
    starts: list[PortStart] = []
    likely = at_ports.likely[:_MOST_BY_RUNS]
    for one in likely:
        are_clear = any(start.left <= _NEXT_TO_NOISE for start in starts)
        if runs.run_tasks.are_spent:
            break
        if are_clear and one.share > _ALIKE * likely[0].share:
            break
        begun = begin_at_port(tried.findings, one.fit, runs, one.values)
        starts += [] if begun is None else [begun]
    return sorted(starts, key=lambda one: one.left)


def _least_said(findings: Findings) -> float:
    """Mean square that the stand-in leaves at best of all recordings, over the noise's."""
    squares = [float(one.sse.sum()) for one in findings.found.fits.values()
               if one.is_usable]  # fmt: skip
    floor = float(findings.criteria.floors.sum())
    return min(squares, default=0.0) / floor if floor > 0 else 0.0


def _pair_at_ports(tried: _Tried, first: PortStart, runs: Runs) -> list[Turn]:
    """Best run with a second effect at a port, beside one that takes much and leaves much.

    A dead zone and a delay are each small beside what the other one leaves.
    """
    findings = tried.findings
    known = first.of_effects
    screened = screened_at_ports(findings, runs, first.of_simulation, known)
    found: list[Turn] = []
    begun = _begun_at_ports(tried, screened, runs)
    for start in begun:
        is_clear = start.left <= _NEXT_TO_NOISE
        is_behind = bool(found) and start.left > WITHIN_REACH * begun[0].left
        is_spent = runs.run_tasks.are_spent and not is_clear
        if start.left > _MOST_OF_GAP * first.left or is_behind or is_spent:
            break
        found += _through_runs(tried, start, runs)
    if tried.are_nearly_all(found) and not runs.run_tasks.are_spent:
        found += _second_alone(tried, begun[0], set(known), runs)
    return found


def _second_alone(
    tried: _Tried, both: PortStart, first: Collection[str], runs: Runs
) -> list[Turn]:
    """Best run with the second effect of two alone, which may be all that is missing."""
    (second,) = set(both.fit.effects) - set(first)
    fit = port_effects(tried.findings, {second: both.of_effects[second]})
    alone = begin_at_port(tried.findings, fit, runs, both.of_simulation)
    if alone is None or alone.left > STILL_LARGE**2:
        return []
    return _through_runs(tried, alone, runs)


def _at_ports_later(tried: _Tried, runs: Runs) -> None:
    """Effects at the ports that have waited, where nothing else is all that is missing."""
    for start in tried.later:
        is_done = start.fit.effects in tried.through_runs
        if is_done or runs.run_tasks.are_spent or tried.are_nearly_all():
            continue
        if not tried.is_hopeless(start):
            tried.keep(_through_runs(tried, start, runs))


def _with_wider_law(tried: _Tried, runs: Runs) -> list[Turn]:
    """Run with a richer law of the effect that leaves least, if that is still too much.

    A lag of first order leaves most of what one of second order has: without the latter
    others that leave no less would be as likely.
    """
    findings = tried.findings
    if tried.are_nearly_all() or runs.run_tasks.are_spent:
        return []
    turns = [one for one in tried.turns.values() if len(one.fit.effects) == 1]
    if not turns:
        return []
    best = min(turns, key=lambda turn: float(turn.sse.sum()))
    fit = fit_of_run(findings, best)
    (effect,) = fit.effects
    wider = (
        one
        for one, entry in CATALOGUE.items()
        if effect in entry.contains and public_id(one) == public_id(effect)
        if (one,) in findings.found.shares and acts_at_port((one,))
    )
    wide = next(wider, None)
    if wide is None:
        return []
    values = CATALOGUE[wide].starts(findings.scales)[0] | fitted_effects(fit)[effect]
    of_wide = port_effects(findings, {wide: values})
    start = begin_at_port(findings, of_wide, runs, best.values_of_run)
    return [] if start is None else _through_runs(tried, start, runs)


def _through_runs(tried: _Tried, start: PortStart, runs: Runs) -> list[Turn]:
    """Best run with an effect at a port, fitted through runs; none where it leaves more."""
    tried.through_runs.add(start.fit.effects)
    turn = with_port_effects(tried.findings, start, runs)
    return [] if turn is None else [turn]


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

    def order(one: CandidateFit) -> tuple[bool, int, int]:
        is_all = criteria.is_nearly_all(one, base)
        return not is_all, -_n_including(one, near), count(one)

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


def _is_near(
    findings: Findings, one: CandidateFit, done: Sequence[CandidateFit]
) -> bool:
    """Whether the stand-in takes an effect for about as good as one that is enough."""
    said, excess = findings.found.fits, findings.criteria.excess
    # Of what runs alone called likely, the stand-in may have said nothing.
    known = [excess(said[fit.effects]) for fit in done if fit.effects in said]
    return excess(one) <= WITHIN_REACH * min(known, default=0.0)


def decided_by_runs(
    findings: Findings,
    tried: Mapping[tuple[str, ...], Turn],
    fits: Mapping[tuple[str, ...], CandidateFit],
) -> tuple[Findings, dict[str, float]] | None:
    """The verdict by runs of the simulation, if effects of one of them may be named.

    Parameters
    ----------
    tried : mapping of tuple of str to Turn
        Best run with each effect, or set of effects.
    fits : mapping of tuple of str to CandidateFit
        What these runs left, and what the stand-in leaves with parts of the sets.

    Returns
    -------
    Findings
        With that verdict.
    dict of str to float
        Parameters of the simulation at that run.
    """
    criteria, rival = findings.criteria, findings
    findings = judged_by_own_base(findings)
    base, best = findings.base, list[CandidateFit]()
    for size in sorted({len(one) for one in tried}):
        same = [fits[one] for one in tried if len(one) == size]
        one = select_best(criteria, same, base)
        best += [] if one is None else [one]
    if not best:
        return None

    def unclear(one: CandidateFit) -> tuple[str, ...]:
        problem = replace(tried[one.effects].problem, known={})
        return unclear_effects(problem, one, findings.scales)

    verdict = decide(criteria, findings.given_sse, base, fits, best, unclear)
    chosen = verdict.chosen
    if chosen.effects not in tried or not is_beyond_factors(rival, chosen):
        return None
    turn = tried[verdict.chosen.effects]
    found = replace(findings.found, fits={**findings.found.fits, **fits})
    problem = replace(turn.problem, known={})
    told = replace(findings, problem=problem, verdict=verdict, found=found)
    return told, turn.values_of_run
