"""Effects at the ports that a simulation's own runs choose, whatever its stand-in says.

What acts on the input before the simulation, or on the output behind it, can be put into a
run as it is: no stand-in is needed to say how much it explains.
docs/method_diagnosis.md, eq. (D33).
"""

from collections.abc import Collection, Sequence

import numpy as np

from hwid_cli.diagnosis.candidate import fitted_effects
from hwid_cli.diagnosis.choice import WITHIN_REACH
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.port_effects import (
    PortStart,
    begin_at_port,
    port_effects,
    with_port_effects,
)
from hwid_cli.diagnosis.port_screening import LikelyAtPort, screened_at_ports
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import acts_at_port
from hwid_cli.diagnosis.told_by_runs import TriedEffects
from hwid_cli.diagnosis.turns import Turn, fit_of_run
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.diagnosis import STILL_LARGE

# Effects at its ports that the simulation's runs alone call likely: so many are fitted,
# and up to so many where others are about as likely.
# Those that leave more than three times the noise, this share of the gap, and so many
# times what the stand-in says of another effect wait until that has been tried, [-].
_MOST_BY_RUNS, _MOST_ALIKE, _MOST_OF_GAP, _WORTH_WAITING = 2, 4, 0.25, 2.0
# So many times what the stand-in says, which the others wait for before they are fitted at
# all: the parameters, which are fitted with an effect, take the rest of it, [-].
_FAR_ABOVE = 8.0
# Mean square over the noise's beside which no further one is begun, unless runs have called
# it likely by nearly the same share.
_NEXT_TO_NOISE, _ALIKE = 2.0, 2.0
# Far from the noise, what another effect at a port, or a richer law of it, leaves of a few
# recordings at most to be fitted to all of them, over what the first one leaves.
_CLEARLY_LESS = 0.5
# Times what the first one leaves by itself, up to which another may be as well.
_AS_LIKELY = 1.2


def at_ports_by_runs_alone(
    tried: TriedEffects, runs: Runs, values: dict[str, float], *, may_pair: bool
) -> None:
    """Try effects at the ports that the simulation calls likely, whatever its stand-in says.

    Those that leave much of a few recordings wait until others have been tried.

    Parameters
    ----------
    values : dict of str to float
        Parameters of the simulation.
    may_pair : bool
        Whether two of them may be tried together.
    """
    if runs.run_tasks.are_spent:
        return
    tried.at_ports = screened_at_ports(tried.findings, runs, values)
    said = _least_said(tried.findings)
    likely = _likeliest(tried.at_ports.likely)
    tried.unbegun = [one for one in likely if _is_far_above(tried.findings, one, said)]
    likely = tuple(one for one in likely if one not in tried.unbegun)
    starts = _begun_at_ports(tried, likely, runs)
    tried.least_begun = min((one.left for one in starts), default=np.inf)
    in_vain = np.inf
    for start in starts:
        if tried.are_nearly_all() or runs.run_tasks.are_spent:
            break
        if tried.is_hopeless(start) or start.left > _CLEARLY_LESS * in_vain:
            tried.given_up.add(start.fit.effects)
            continue
        is_large = start.left > STILL_LARGE**2
        waits = is_large and start.left > _WORTH_WAITING * said
        if is_large and not waits and may_pair:
            tried.keep(_pair_at_ports(tried, start, runs))
            if tried.are_nearly_all():
                alike = [one for one in starts if one is not start
                         and one.left <= _AS_LIKELY * start.left]  # fmt: skip
                tried.keep(_alike_in_pairs(tried, start, alike, runs))
                break
        if waits and start.share > _MOST_OF_GAP:
            tried.later.append(start)
        else:
            tried.keep(through_runs_at_port(tried, start, runs))
            in_vain = start.left if is_large else in_vain
    tried.keep(_with_wider_law(tried, runs))


def _likeliest(likely: Sequence[LikelyAtPort]) -> Sequence[LikelyAtPort]:
    """The first ones, and those that are about as likely.

    A delay, a lag before a simulation and one behind it leave much the same before the
    simulation's parameters have followed each of them.
    """
    alike = [one for one in likely if one.share <= _AS_LIKELY * likely[0].share]
    return likely[: max(_MOST_BY_RUNS, min(len(alike), _MOST_ALIKE))]


def at_ports_later(tried: TriedEffects, runs: Runs) -> None:
    """Try effects at the ports that have waited, where nothing else is all that is missing."""
    for start in tried.later:
        if _may_still_be_all(tried, start.fit, runs) and not tried.is_hopeless(start):
            tried.keep(through_runs_at_port(tried, start, runs))
    for one in tried.unbegun:
        if not _may_still_be_all(tried, one.fit, runs):
            continue
        begun = begin_at_port(tried.findings, one.fit, runs, one.values)
        if begun is not None and not tried.is_hopeless(begun):
            tried.keep(through_runs_at_port(tried, begun, runs))


def _may_still_be_all(tried: TriedEffects, fit: CandidateFit, runs: Runs) -> bool:
    """Whether an effect was not fitted through runs yet, and nothing else is enough."""
    is_done = fit.effects in tried.through_runs
    return not (is_done or runs.run_tasks.are_spent or tried.are_nearly_all())


def _is_far_above(findings: Findings, one: LikelyAtPort, said: float) -> bool:
    """Whether an effect leaves much, and the stand-in says far less of another one.

    Parameters
    ----------
    said : float, [-]
        Mean square over the noise's.
    """
    floor = float(findings.criteria.floors.sum())
    if floor <= 0.0 or one.share <= _MOST_OF_GAP:
        return False
    left = one.share * float(findings.base.sse.sum()) / floor
    return left > max(STILL_LARGE**2, _FAR_ABOVE * said)


def _begun_at_ports(
    tried: TriedEffects, likely: Sequence[LikelyAtPort], runs: Runs
) -> list[PortStart]:
    """Likely effects fitted to a few recordings, those that leave least first."""
    starts: list[PortStart] = []
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


def _pair_at_ports(tried: TriedEffects, first: PortStart, runs: Runs) -> list[Turn]:
    """Best run with a second effect at a port, beside one that takes much and leaves much.

    A dead zone and a delay are each small beside what the other one leaves.
    """
    findings = tried.findings
    known = first.of_effects
    screened = screened_at_ports(findings, runs, first.of_simulation, known)
    found: list[Turn] = []
    begun = _begun_at_ports(tried, _likeliest(screened.likely), runs)
    for start in begun:
        is_clear = start.left <= _NEXT_TO_NOISE
        is_behind = bool(found) and start.left > WITHIN_REACH * begun[0].left
        is_spent = runs.run_tasks.are_spent and not is_clear
        if start.left > _MOST_OF_GAP * first.left or is_behind or is_spent:
            break
        found += through_runs_at_port(tried, start, runs)
    if tried.are_nearly_all(found) and not runs.run_tasks.are_spent:
        found += _second_alone(tried, begun[0], set(known), runs)
    return found


def _alike_in_pairs(
    tried: TriedEffects, first: PortStart, alike: Sequence[PortStart], runs: Runs
) -> list[Turn]:
    """Best runs of a pair that leaves nothing, with others in the place of its first one.

    A lag before a simulation and one behind it leave the same of a few recordings while a
    dead zone beside them is missing.
    """
    pairs = [turn for effects, turn in tried.turns.items() if len(effects) > 1]
    best = min(pairs, key=lambda turn: float(turn.sse.sum()), default=None)
    if best is None:
        return []
    (known,) = first.of_effects
    second = {one: of for one, of in fitted_effects(best.fit).items() if one != known}
    values = best.values_of_run | {
        str(ParameterRef(one, name)): value
        for one, of in second.items()
        for name, value in of.items()
    }
    found: list[Turn] = []
    for other in alike:
        if runs.run_tasks.are_spent or set(other.of_effects) & set(second):
            continue
        fit = port_effects(tried.findings, {**other.of_effects, **second})
        begun = begin_at_port(tried.findings, fit, runs, values)
        if begun is not None and begun.left <= STILL_LARGE**2:
            found += through_runs_at_port(tried, begun, runs)
    return found


def _second_alone(
    tried: TriedEffects, both: PortStart, first: Collection[str], runs: Runs
) -> list[Turn]:
    """Best run with the second effect of two alone, which may be all that is missing."""
    (second,) = set(both.fit.effects) - set(first)
    fit = port_effects(tried.findings, {second: both.of_effects[second]})
    alone = begin_at_port(tried.findings, fit, runs, both.of_simulation)
    if alone is None or alone.left > STILL_LARGE**2:
        return []
    return through_runs_at_port(tried, alone, runs)


def _with_wider_law(tried: TriedEffects, runs: Runs) -> list[Turn]:
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
    if start is None:
        return []
    is_far = start.left > STILL_LARGE**2
    if is_far and start.left > _CLEARLY_LESS * tried.left_of_few(fit):
        return []
    return through_runs_at_port(tried, start, runs)


def through_runs_at_port(
    tried: TriedEffects, start: PortStart, runs: Runs
) -> list[Turn]:
    """Best run with an effect at a port, fitted through runs; none where it leaves more."""
    tried.through_runs.add(start.fit.effects)
    turn = with_port_effects(tried.findings, start, runs)
    return [] if turn is None else [turn]
