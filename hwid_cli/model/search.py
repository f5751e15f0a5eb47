"""The phases of a fit, from linear starts to free break-points.

1. *Screen*: every start runs a few iterations with fixed break-points.
2. *Place*: the best of each family goes on, its maps get many equally spaced
   break-points, and those that matter most stay. Break-points moved from an equally
   spaced coarse grid stop in poor minima far more often.
3. *Free*: break-points move.
4. *Re-estimate*: with the maps of the best model taken as known, new linear blocks are found by
   least squares and continue from there; this leaves minima of the linear block.

The best candidate seen wins. docs/method.md, section "The search".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, FitData
from hwid_cli.model.initial_candidates import LinearCandidates, block_starts
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.phases import converge, finish, place, refine, standing
from hwid_cli.model.placing import reaching
from hwid_cli.model.restart import (
    FINE_MAP_POINTS,
    is_far,
    leaves_structure,
    reestimate_block,
    reestimate_lasting_block,
    starts_with_new_maps,
    starts_without_input_maps,
    with_break_points,
)
from hwid_cli.model.robust import renewed, rescored
from hwid_cli.model.screening import LONG, SHORT, screen
from hwid_cli.model.starts import Start
from hwid_cli.records.model import FitOptions

# Cost that a re-estimated block must reach, as a share of the best so far, to be finished;
# nearer to it the search has only come back to where it was.
_WORTH_GOING_ON = 0.995
# Restarts that follow a search whose residuals are not noise, and the share of the cost that
# one must reach for another to follow it.
_MOST_RESTARTS, _WORTH_RESTARTING = 3, 0.9
# Linear starts of such a search: more than least squares pass on the way.
_MORE_STARTS = 30
# Share of the cost that a step must gain where larger models go on from the result.
_SMALL_GAIN = 1e-3
# Factor on the cost, 1 % of the deviation, that a linear model may have where limits that
# gain no more are taken for noise.
_AS_GOOD = 1.01**2


def nonlinear_search(
    experiments: Sequence[FitData],
    options: FitOptions,
    begun: LinearCandidates,
) -> Search:
    """Hammerstein-Wiener model of given orders and kinds of maps.

    Parameters
    ----------
    experiments : sequence of FitData
        Scaled to about one.
    begun : LinearCandidates
        Its linear model is, with maps that pass everything on, a model of every kind,
        and the result is never worse.

    Returns
    -------
    Search
        Its iterations are those of the winning chain.
    """
    finalists = screen(experiments, begun.starts, options)
    experiments = renewed(experiments, [one.candidate for one in finalists])
    best = finish(_best(place(finalists, experiments, options)), experiments, options)
    if not options.keeps_block:
        best = _with_reestimated_block(best, experiments, options)
    is_poor = leaves_structure(best.candidate, experiments)
    added = begun.with_circle if is_poor else begun.beside(best)
    best = _from_added_starts(best, experiments, options, (begun, added))
    begun = added
    best = _restarted(best, experiments, options, begun.starts)
    if not options.keeps_block:
        best = _with_lasting_block(best, experiments, options)
    best = _from_break_points(best, experiments, options, begun)
    best = _not_worse_than(begun.linear, best, experiments, options)
    return _without_needless_limits(begun.linear, best, experiments, options)


def _from_added_starts(
    best: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
    begun: tuple[LinearCandidates, LinearCandidates],
) -> Search:
    """The best so far, or what comes of starts that were added since."""
    before, now = begun
    added = now.starts[len(before.starts) :]
    if not added:
        return best
    finalists = screen(experiments, added, options)
    again = finish(_best(place(finalists, experiments, options)), experiments, options)
    again = _with_reestimated_block(again, experiments, options)
    again = _with_lasting_block(again, experiments, options)
    if leaves_structure(again.candidate, experiments):
        again = _restarted(again, experiments, options, now.starts)
        again = _with_lasting_block(again, experiments, options)
    return _best([best, again])


def _with_reestimated_block(
    best: Search, experiments: Sequence[FitData], options: FitOptions
) -> Search:
    """The best so far, or what comes of another block between its maps."""
    reestimated = reestimate_block(best, experiments, options)
    return _finished_where_better(reestimated, best, experiments, options)


def _with_lasting_block(
    best: Search, experiments: Sequence[FitData], options: FitOptions
) -> Search:
    """The best so far, or what comes of blocks that hardly settle between its maps."""
    lasting = reestimate_lasting_block(best, experiments, options)
    return _finished_where_better(lasting, best, experiments, options)


def _finished_where_better(
    near: Search, best: Search, experiments: Sequence[FitData], options: FitOptions
) -> Search:
    """The best so far, or the end of a search that is already better."""
    if near.cost >= _WORTH_GOING_ON * best.cost:
        return best
    return _best([best, finish(near, experiments, options)])


def _restarted(
    best: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
    starts: Sequence[Start],
) -> Search:
    """The best so far, or what longer screenings find where its residuals are not noise."""
    best = _refined(best, experiments, options)
    if not leaves_structure(best.candidate, experiments):
        return best
    if not options.keeps_block and is_far(best.candidate, experiments):
        at = best.candidate.model.orders
        more = replace(options, starts=_MORE_STARTS)
        starts = [*starts, *block_starts(experiments, at, more)]
    entered = [*starts, *starts_without_input_maps(starts, experiments)]
    for _ in range(_MOST_RESTARTS):
        if not leaves_structure(best.candidate, experiments):
            break
        entered += starts_with_new_maps(best.candidate, experiments)
        found = screen(experiments, entered, options, rounds=LONG)
        placed = place(found, experiments, options)
        again = finish(_best(placed), experiments, options)
        gained = again.cost < _WORTH_RESTARTING * best.cost
        best, entered = _best([best, again]), []
        if not gained:
            break
    return _refined(best, experiments, options)


def _from_break_points(
    best: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
    begun: LinearCandidates,
) -> Search:
    """The best so far, or what comes of piecewise linear maps where it is not noise.

    Those are placed where maps bend, which other kinds cannot find by themselves.
    """
    bent = with_break_points(options)
    if bent == options or not leaves_structure(best.candidate, experiments):
        return best
    found = nonlinear_search(experiments, bent, begun)
    if found.cost > _WORTH_RESTARTING * best.cost:
        return best
    entered = starts_with_new_maps(found.candidate, experiments, FINE_MAP_POINTS)
    placed = place(
        screen(experiments, entered, options, rounds=LONG), experiments, options
    )
    return _best([best, finish(_best(placed), experiments, options)])


def _refined(
    best: Search, experiments: Sequence[FitData], options: FitOptions
) -> Search:
    """The same with break-points nearer to where maps bend, if residuals are not noise."""
    if not leaves_structure(best.candidate, experiments):
        return best
    return refine(best, experiments, options)


def continue_nested(
    nested: Sequence[Candidate],
    experiments: Sequence[FitData],
    options: FitOptions,
    begun: LinearCandidates,
) -> Search:
    """Continue from the best of the nested models of smaller orders.

    Parameters
    ----------
    nested : sequence of Candidate
        Of the orders and kinds of maps asked for.

    Returns
    -------
    Search
        Never worse than any of the nested models, nor than the linear one.
    """
    experiments = renewed(experiments, nested)
    known = _best([standing(one, experiments) for one in nested])
    near = converge(known, experiments, options, least_gain=_SMALL_GAIN)
    linear = begun.beside(near).linear
    best = _not_worse_than(linear, _best([known, near]), experiments, options)
    return _without_needless_limits(linear, best, experiments, options, known.cost)


def search_beside_nested(
    nested: Sequence[Candidate],
    experiments: Sequence[FitData],
    options: FitOptions,
    begun: LinearCandidates,
) -> Search:
    """The better of a model that goes on from smaller orders and one found anew.

    Parameters
    ----------
    nested : sequence of Candidate
        Of the orders and kinds of maps asked for.

    Returns
    -------
    Search
        Never worse than any of the nested models, nor than the linear one. The search
        anew is a shorter one than `nonlinear_search`.
    """
    near = continue_nested(nested, experiments, options, begun)
    begun = begun.beside(near)
    experiments = renewed(experiments, nested)
    leaders = screen(experiments, begun.starts, options, rounds=SHORT)
    (placed,) = place(leaders, experiments, options)
    anew = finish(placed, experiments, options, least_gain=_SMALL_GAIN)
    best = _best([near, anew])
    # Only between known maps are delays told apart safely.
    if len(options.delays) > 1:
        best = _with_reestimated_block(best, experiments, options)
    least = min(standing(one, experiments).cost for one in nested)
    return _without_needless_limits(begun.linear, best, experiments, options, least)


def _not_worse_than(
    linear: Search,
    best: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
) -> Search:
    """The best so far, or what comes of the linear model where that is better."""
    linear = rescored(linear, experiments)
    if linear.cost >= best.cost:
        return best
    linear = finish(linear, experiments, options)
    passing = standing(_passing(linear, experiments, options), experiments)
    passing = replace(passing, iterations=linear.iterations)
    return _best([best, passing, finish(passing, experiments, options)])


def _without_needless_limits(
    linear: Search,
    best: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
    largest_cost: float = np.inf,
) -> Search:
    """The best so far, or the linear model where limits gain next to nothing.

    Where a record rests on two levels, limits between them or inside their noise fit it
    as well as none, and are wrong on every other record. They stay where they gain more
    than 1 % of the deviation, or more than their model's parameters weigh, or where the
    linear model costs more than `largest_cost`, that of a model which it would replace.
    """
    kinds = (options.input_map, options.output_map)
    if not any(static_map.RULES[kind].has_limits for kind in kinds):
        return best
    linear = rescored(linear, experiments)
    if linear.cost > min(_AS_GOOD * best.cost, largest_cost):
        return best
    linear = finish(linear, experiments, options)
    passing = _passing(linear, experiments, options)
    model = passing.model
    added = model.input_map.parameters.size + model.output_map.parameters.size
    n = sum(one.output.size for one in experiments)
    # Schwarz (1978): each parameter weighs the logarithm of the number of samples.
    if linear.cost > best.cost * np.exp(added * np.log(n) / n):
        return best
    return replace(standing(passing, experiments), iterations=linear.iterations)


def _passing(
    linear: Search, experiments: Sequence[FitData], options: FitOptions
) -> Candidate:
    """Linear model with maps of the kinds asked for that pass everything on."""
    candidate = linear.candidate
    u, x = reaching(candidate, experiments)
    model = replace(
        candidate.model,
        input_map=static_map.identity(options.input_map, options.of_input, u),
        output_map=static_map.identity(options.output_map, options.of_output, x),
    )
    return replace(candidate, model=model)


def _best(searches: Sequence[Search]) -> Search:
    return min(searches, key=lambda one: one.cost)
