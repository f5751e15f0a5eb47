"""Multistart screening: many starts, a few iterations each, the best go on.

A linear block alone does not tell on which side of it a nonlinearity lies, so every block
starts twice: with what it says of the input map, and with the output map that its own
output asks for.

References
----------
docs/method.md, section "The search".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, FitData, limits_of, thinned
from hwid_cli.model.derivative_rows import local_sums
from hwid_cli.model.distinct import WHILE_FIXED, distinct
from hwid_cli.model.levenberg_marquardt import Search, minimise
from hwid_cli.model.linear_block import as_loops_take_it
from hwid_cli.model.maps.piecewise_linear import hat_functions
from hwid_cli.model.points import ModelPoint, Signals, all_signals
from hwid_cli.model.sensitivities import compared
from hwid_cli.model.starts import Start
from hwid_cli.records.model import FitOptions, HammersteinWiener, StaticMap

# Iterations of each round, and how many candidates go on after it.
Rounds = tuple[tuple[int, int], ...]
THOROUGH: Rounds = ((2, 3), (4, 2))
# For a restart, where that has found no good minimum: every start is kept.
LONG: Rounds = ((6, 5), (15, 2))
# For one of many fits that help each other.
SHORT: Rounds = ((0, 4), (2, 1), (3, 1))
# Samples that count in a round; enough to tell candidates apart.
SCREENING_ROWS = 1000
# Knots of the output map that a block's output asks for, and how stiff it is: the
# weight of its second differences as a share of the mean number of samples at a knot.
_CURVE_POINTS, _STIFFNESS = 12, 1e-2
_SECOND = np.diff(np.eye(_CURVE_POINTS), 2, axis=0)
_BENDING = _SECOND.T @ _SECOND
_NO_MAP = StaticMap("none", np.zeros(0))
# Cost from which on a candidate is pruned, as a multiple of the best's.
_PRUNING_LIMIT = 3.0


@dataclass(frozen=True, eq=False)
class _Screened:
    """A candidate of the screening and the kind of start that it came from."""

    family: tuple[bool, ...]
    search: Search


def screen(
    experiments: Sequence[FitData],
    starts: Sequence[Start],
    options: FitOptions,
    *,
    rounds: Rounds = THOROUGH,
) -> list[Search]:
    """Let all starts run a few iterations; those far behind are pruned.

    Parameters
    ----------
    experiments : sequence of FitData
        Scaled to about one.
    rounds : tuple of (int, int)
        Iterations of each round, and how many candidates go on after it.

    Returns
    -------
    list of Search
        The best, those of different kinds of starts first.
    """
    experiments = thinned(experiments, SCREENING_ROWS)
    running = []
    for start in starts:
        kind = (start.is_given, start.is_expanded)
        for candidate, signals in starting_candidates(experiments, start, options):
            running.append(_unscreened((*kind, False), candidate, signals, experiments))
            if static_map.has_free_shape(options.output_map):
                curved = _with_output_curve(candidate, signals, experiments, options)
                running.append(_unscreened((*kind, True), curved, signals, experiments))
    if rounds != LONG:
        running = _leaders(running, options.starts)
    for iterations, count in rounds:
        if iterations:
            running = [_iterated(one, experiments, iterations) for one in running]
        running = _leaders(running, count, _PRUNING_LIMIT)
        kept = distinct([one.search for one in running], experiments, WHILE_FIXED)
        running = [one for one in running if one.search in kept]
    return [one.search for one in running]


def starting_candidates(
    experiments: Sequence[FitData],
    start: Start,
    options: FitOptions,
) -> list[tuple[Candidate, Signals]]:
    """Models that begin with one linear block, one for each pair of starting maps.

    Returns
    -------
    list of (Candidate, Signals)
        Each with its signals before and after the linear block.
    """
    inputs = np.concatenate([one.input for one in experiments])
    is_estimated = options.initial_state == "estimated"
    states = start.free_responses if is_estimated else np.zeros((len(experiments), 0))
    candidates = []
    for input_map in static_map.starting_maps(
        options.input_map,
        options.of_input,
        inputs.min(),
        inputs.max(),
        shape=lambda u: np.interp(u, start.input_points, start.input_values),
    ):
        point = ModelPoint(
            input_map,
            as_loops_take_it(start.numerator),
            as_loops_take_it(start.denominator),
            start.delay,
            _NO_MAP,
            as_loops_take_it(states),
            options.initial_state == "steady",
        )
        signals = all_signals(point, experiments)
        x = np.concatenate([x for _, x in signals])
        for output_map in static_map.starting_maps(
            options.output_map,
            options.of_output,
            x.min(),
            x.max(),
            shape=lambda x: x + start.offset,
        ):
            model = HammersteinWiener(
                input_map,
                start.numerator,
                start.denominator,
                start.delay,
                output_map,
                sample_time_s=1.0,
                initial_state=options.initial_state,
            )
            candidates.append((Candidate(model, states, limits_of(options)), signals))
    return candidates


def _with_output_curve(
    candidate: Candidate,
    signals: Signals,
    experiments: Sequence[FitData],
    options: FitOptions,
) -> Candidate:
    """Candidate with the output map that comes closest for what reaches it."""
    x = np.concatenate([x for _, x in signals])
    measured = np.concatenate([one.output for one in experiments])
    points = np.linspace(x.min(), x.max(), _CURVE_POINTS)
    if not points[0] < points[-1]:
        return candidate
    first, shares = hat_functions(x, points)
    matrix, vector = local_sums(first, shares, measured[:, None], points.size)
    matrix += _STIFFNESS * x.size / points.size * _BENDING
    values = np.linalg.solve(matrix, vector[:, 0])
    maps = static_map.starting_maps(
        options.output_map,
        options.of_output,
        points[0],
        points[-1],
        shape=lambda v: np.interp(v, points, values),
    )
    return replace(candidate, model=replace(candidate.model, output_map=maps[0]))


def _unscreened(
    family: tuple[bool, ...],
    candidate: Candidate,
    signals: Signals,
    experiments: Sequence[FitData],
) -> _Screened:
    cost = compared(candidate.model.output_map, signals, experiments).cost
    return _Screened(family, Search(candidate, cost, 0, "iteration_limit", ""))


def _iterated(
    one: _Screened, experiments: Sequence[FitData], iterations: int
) -> _Screened:
    found = minimise(
        one.search.candidate,
        experiments,
        with_positions=False,
        max_iterations=iterations,
    )
    total = one.search.iterations + found.iterations
    return replace(one, search=replace(found, iterations=total))


def _leaders(
    running: Sequence[_Screened], count: int, pruning_limit: float = np.inf
) -> list[_Screened]:
    """Best of each family that is not pruned, then the best of the rest."""
    ordered = sorted(running, key=lambda one: one.search.cost)
    limit = pruning_limit * ordered[0].search.cost
    ordered = [one for one in ordered if one.search.cost <= limit] or ordered
    families = [one.family for one in ordered]
    firsts = sorted({families.index(family) for family in set(families)})
    rest = [number for number in range(len(ordered)) if number not in firsts]
    return [ordered[number] for number in (firsts + rest)[:count]]
