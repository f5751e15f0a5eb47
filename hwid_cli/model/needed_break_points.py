"""As many break-points as the data ask for.

A search needs more break-points than its result: few of them miss where a map bends. What
is left over follows the noise of one recording where the machine has no bend, and is wrong
on every other. Where the size of a piecewise linear map is left to the data, straight maps
are tried first, then maps of fewer break-points; what costs less than the parameters that
it saves weigh, stays.

References
----------
Schwarz (1978). docs/method.md, eq. (14b).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, FitData
from hwid_cli.model.levenberg_marquardt import Search, minimise
from hwid_cli.model.maps.piecewise_linear import N_ENDS
from hwid_cli.model.phases import converge, standing
from hwid_cli.model.placing import thinner, with_maps
from hwid_cli.model.robust import CORNER, renewed, rescored
from hwid_cli.records.maps import MapOptions, StaticMap
from hwid_cli.records.model import FitOptions

# A break-point is a position and a value.
_PER_POINT = 2
# Iterations of a first look at smaller maps, the factor on the cost allowed beyond which
# it is the last one, and the share of the cost that a step must gain.
_LOOK, _FAR, _LEAST_GAIN = 4, 3.0, 1e-3
# Factor on the cost of a model that is the same, written with fewer break-points.
_SAME = 1.0 + 1e-9

# Break-points of the input map and of the output map.
_Sizes = tuple[int, int]


@dataclass(frozen=True, eq=False)
class _Given:
    """What all attempts share."""

    experiments: Sequence[FitData]
    options: FitOptions
    largest_cost: float

    def allowed(self, cost: float, fewer: int) -> float:
        """Cost at which a model of so many break-points fewer is as good (Schwarz 1978)."""
        n = sum(one.output.size for one in self.experiments)
        # Beyond the threshold losses are those of outliers, not of the noise.
        variance = min(cost / n, (self.experiments[0].threshold / CORNER) ** 2)
        weighed = float(np.expm1(_PER_POINT * fewer * np.log(n) / n))
        return min(self.largest_cost, cost + n * variance * weighed)


def with_needed_break_points(
    best: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
    contained: Sequence[Candidate] = (),
) -> Search:
    """The same model with as few break-points as its data ask for.

    Parameters
    ----------
    best : Search
        To the end.
    contained : sequence of Candidate
        Models that the result may not cost more than.

    Returns
    -------
    Search
        Itself where the sizes of the maps are given, or all of them are needed.
    """
    model = best.candidate.model
    may = [
        _is_open(one, asked) and _count(one) > 0
        for one, asked in (
            (model.input_map, options.of_input),
            (model.output_map, options.of_output),
        )
    ]
    if not any(may):
        return best
    known, experiments = experiments, renewed(experiments, [best.candidate])
    best = rescored(best, experiments)
    costs = (standing(one, experiments).cost for one in contained)
    given = _Given(experiments, options, min(costs, default=np.inf))
    for chosen in ((True, True), (True, False), (False, True)):
        if all(m for m, c in zip(may, chosen, strict=True) if c):
            size = _sizes(best)
            straight = tuple(0 if c else k for c, k in zip(chosen, size, strict=True))
            found = _attempt(best, straight, given)
            if found is not None:
                best = found
                break
    for side in (0, 1):
        if may[side]:
            best = _with_fewer(best, side, given)
    return rescored(best, known)


def _with_fewer(best: Search, side: int, given: _Given) -> Search:
    """The smallest map of one side that is worth it, by bisection."""
    least, most = 0, _sizes(best)[side]
    while most - least > 1:
        count = (least + most) // 2
        size = list(_sizes(best))
        size[side] = count
        found = _attempt(best, (size[0], size[1]), given)
        if found is None:
            least = count
        else:
            best, most = found, count
    return best


def _attempt(best: Search, sizes: _Sizes, given: _Given) -> Search | None:
    """The model with smaller maps; None where that is not worth it."""
    experiments, options = given.experiments, given.options
    fewer = sum(_sizes(best)) - sum(sizes)
    allowed = given.allowed(best.cost, fewer)
    smaller = with_maps(best.candidate, experiments, *map(_to, sizes))
    same = standing(smaller, experiments)
    if same.cost <= min(allowed, _SAME * best.cost):
        return replace(best, candidate=smaller, cost=same.cost)
    look = minimise(
        smaller,
        experiments,
        with_positions=options.free_break_points,
        max_iterations=min(_LOOK, options.max_iterations),
        least_gain=_LEAST_GAIN,
    )
    found = replace(look, iterations=best.iterations + look.iterations)
    if allowed < found.cost <= _FAR * allowed:
        found = converge(found, experiments, options, least_gain=_LEAST_GAIN)
    return found if found.cost <= allowed else None


def _to(count: int) -> Callable[[StaticMap, np.ndarray], StaticMap]:
    """Change of a map to so many break-points."""

    def change(one: StaticMap, argument: np.ndarray) -> StaticMap:
        if count >= _count(one):
            return one
        return thinner(one, argument, count) if count else _line(one, argument)

    return change


def _line(one: StaticMap, argument: np.ndarray) -> StaticMap:
    """The straight line through what a map makes of its samples."""
    ends = np.array([argument.min(), argument.max()])
    if not ends[0] < ends[1]:
        return one
    slope, offset = np.polyfit(argument, static_map.evaluate(one, argument), 1)
    values = slope * ends + offset
    domain = (float(ends[0]), float(ends[1]))
    return replace(one, parameters=np.concatenate([ends, values]), domain=domain)


def _is_open(one: StaticMap, asked: MapOptions) -> bool:
    return asked.is_most and one.kind == "piecewise_linear"


def _sizes(search: Search) -> _Sizes:
    model = search.candidate.model
    return _count(model.input_map), _count(model.output_map)


def _count(one: StaticMap) -> int:
    """Break-points between the ends of a piecewise linear map."""
    return one.parameters.size // 2 - N_ENDS
