"""Re-estimation of the block between the maps of the best model: leaves its minima.

References
----------
docs/method.md, section "The search", step 4.

Where a search may have ended in a poor minimum, and from where to begin again.

The error of a poor minimum is of another shape than noise: it follows itself from sample
to sample, or it is large at few moments. Then a search is restarted without what the
first one took for granted: the input maps that came with the linear starts (where the
output map is not monotonic, least squares on the output see a wrong one), and the maps
that it found around its own block.

References
----------
docs/method.md, section "The search".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, FitData
from hwid_cli.model.circle_starts import circle_starts, lasting_poles
from hwid_cli.model.delays import reestimated_blocks
from hwid_cli.model.distinct import WHEN_FREE, borne_residuals, distinct
from hwid_cli.model.initial_candidates import block_starts
from hwid_cli.model.levenberg_marquardt import Search, minimise
from hwid_cli.model.linear_search import linear_search
from hwid_cli.model.phases import standing
from hwid_cli.model.points import block_signals, point_of
from hwid_cli.model.starts import Start
from hwid_cli.records.model import FitOptions

# Correlation of residuals at some of the first lags, the same in standard deviations of
# what noise shows by chance, and mean fourth power over squared mean square (3 for normal
# noise), from which on residuals are not taken for noise.
_COLOURED, _BY_CHANCE, _LAGS, _PEAKED = 0.25, 4.0, 10, 4.0
# Deviation, as a share of the output's own, below which peaks are let be. Models of too
# few poles can come closer still, by maps that bend for this one record.
_CLOSE = 0.005
# The same share from which on next to nothing has been found, whatever the error's shape.
_FAR = 0.5
# And from which on more blocks are tried than least squares rank first.
_FAR_OFF = 0.01
# Break-points of maps whose shape other kinds take over.
_BREAK_POINTS = 15
_STAND_IN = "piecewise_linear"
# Values by which a start takes over an input map, and an input map of another kind.
_MAP_POINTS, FINE_MAP_POINTS = 12, 200


def leaves_structure(candidate: Candidate, experiments: Sequence[FitData]) -> bool:
    """Tell whether residuals look like the error of a poor minimum.

    Returns
    -------
    bool
        Whether they follow one another more than by chance, are half as large as the output, or are not
        small and large at few moments.
    """
    # Outliers, where they are to be borne, are no error of the model.
    residuals = borne_residuals(candidate, experiments)
    following = max(
        abs(sum(float(one[lag:] @ one[:-lag]) for one in residuals))
        for lag in range(1, _LAGS + 1)
    )
    joined = np.concatenate(residuals)
    power = float(joined @ joined)
    spread = sum(
        float(np.sum((one.output - np.mean(one.output)) ** 2)) for one in experiments
    )
    by_chance = _BY_CHANCE / np.sqrt(joined.size)
    # A drift that is slightly wrong is slow and small.
    drifts = lasting_poles([candidate.model.denominator], experiments).size > 0
    coloured = by_chance if drifts else max(_COLOURED, by_chance)
    if following > coloured * power or power > _FAR**2 * spread:
        return True
    squares = joined * joined
    peaks = joined.size * float(squares @ squares)
    return power > _CLOSE**2 * spread and peaks > _PEAKED * power**2


def is_far(candidate: Candidate, experiments: Sequence[FitData]) -> bool:
    """Tell whether residuals are larger than those of maps that are slightly wrong.

    Returns
    -------
    bool
        Whether the deviation is more than 1 % of the output's own.
    """
    joined = np.concatenate(borne_residuals(candidate, experiments))
    spread = sum(
        float(np.sum((one.output - np.mean(one.output)) ** 2)) for one in experiments
    )
    return bool(joined @ joined > _FAR_OFF**2 * spread)


def starts_without_input_maps(
    starts: Sequence[Start], experiments: Sequence[FitData]
) -> list[Start]:
    """Blocks that came with an input map of their own, without it."""
    return [_straight(one, experiments) for one in starts if one.is_expanded]


def starts_with_new_maps(
    candidate: Candidate,
    experiments: Sequence[FitData],
    n_points: int = _MAP_POINTS,
) -> list[Start]:
    """The block that a search found, to find maps around it again.

    Parameters
    ----------
    n_points : int, [-]
        Values by which a start takes over the input map.

    Returns
    -------
    list of Start
        With its input map at equal distances, and without.
    """
    model = candidate.model
    points = np.linspace(*_range(experiments), n_points)
    found = Start(
        model.numerator,
        model.denominator,
        np.inf,
        points,
        static_map.evaluate(model.input_map, points),
        0.0,
        candidate.free_responses,
        delay=model.delay,
    )
    return [found, _straight(found, experiments)]


def with_break_points(options: FitOptions) -> FitOptions:
    """Options of a model with piecewise linear maps in the place of others.

    Returns
    -------
    FitOptions
        The same where no map is of another kind.
    """
    if _is_replaced(options.input_map):
        options = replace(options, input_map=_STAND_IN, input_units=_BREAK_POINTS)
    if _is_replaced(options.output_map):
        options = replace(options, output_map=_STAND_IN, output_units=_BREAK_POINTS)
    return options


def _is_replaced(kind: str) -> bool:
    # Maps that stand in for others already have as many break-points as were asked for.
    return kind != _STAND_IN and not static_map.RULES[kind].is_identity


def _straight(start: Start, experiments: Sequence[FitData]) -> Start:
    ends = np.array(_range(experiments))
    return replace(start, input_points=ends, input_values=ends)


def _range(experiments: Sequence[FitData]) -> tuple[float, float]:
    lowest = min(float(one.input.min()) for one in experiments)
    return lowest, max(float(one.input.max()) for one in experiments)


_REESTIMATION_ITERATIONS = 8
_REESTIMATED_BLOCKS = 2
# Slopes of the output map below this share of their mean square say too little about x.
_FLAT = 0.1


def reestimate_block(
    best: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
) -> Search:
    """Find the linear block anew between the maps of the best model.

    Returns
    -------
    Search
        With fixed break-points; not to the end, and not always better. The best itself
        where the new blocks come to the same model.
    """
    between = _between_maps(best.candidate, experiments)
    model = best.candidate.model
    starts = reestimated_blocks(
        between,
        model.orders,
        options,
        count=_REESTIMATED_BLOCKS,
        denominator=model.denominator,
    )
    if options.largest_pole_radius >= 1.0:
        lasting = lasting_poles([model.denominator], experiments)
        known = replace(options, input_map="none", output_map="none")
        starts += circle_starts(between, model.orders, known, lasting)
    return _leader(starts, best, experiments, options)


def _leader(
    starts: Sequence[Start],
    best: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
) -> Search:
    """What a few iterations make of other blocks between the maps of the best model."""
    model, no_states = best.candidate.model, best.candidate.free_responses[:, :0]
    has_states = options.initial_state == "estimated"
    entered = [
        standing(
            Candidate(
                replace(
                    model,
                    numerator=one.numerator,
                    denominator=one.denominator,
                    delay=one.delay,
                ),
                one.free_responses if has_states else no_states,
                best.candidate.limits,
            ),
            experiments,
        )
        for one in starts
    ]
    found = [
        minimise(
            one.candidate,
            experiments,
            with_positions=False,
            max_iterations=min(_REESTIMATION_ITERATIONS, options.max_iterations),
        )
        for one in distinct([best, *entered], experiments, WHEN_FREE)
        if one is not best
    ]
    if not found:
        return best
    leader = min(found, key=lambda one: one.cost)
    return replace(leader, iterations=best.iterations + leader.iterations)


def reestimate_lasting_block(
    best: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
) -> Search:
    """The same where a pole hardly settles, from blocks that were fitted to the end.

    A drift that is slightly wrong hides the rest of a block. Maps that may follow it
    hold the search where it is; between maps that stay, a linear model finds both.

    Returns
    -------
    Search
        The best itself where no pole of its block may stand on the unit circle.
    """
    model = best.candidate.model
    lasting = lasting_poles([model.denominator], experiments)
    if lasting.size == 0 or options.largest_pole_radius < 1.0:
        return best
    between = _between_maps(best.candidate, experiments)
    known = replace(options, input_map="none", output_map="none")
    begun = [block_starts(between, model.orders, known)]
    on_circle = circle_starts(between, model.orders, known, lasting)
    begun += [(one,) for one in on_circle]
    found = []
    # Equations without a solution give nothing to start from.
    for starts in filter(None, begun):
        fitted = linear_search(between, known, starts).candidate
        block = fitted.model
        found.append(
            replace(
                starts[0],
                numerator=block.numerator,
                denominator=block.denominator,
                free_responses=fitted.free_responses,
                delay=block.delay,
            )
        )
    return _leader(found, best, experiments, options)


def _between_maps(
    candidate: Candidate, experiments: Sequence[FitData]
) -> list[FitData]:
    """Signals before and after the linear block; the latter corrected by the output.

    The correction is a Gauss-Newton step of x towards the measured output, held back
    where the output map is flat.
    """
    result = []
    point, output_map = point_of(candidate), candidate.model.output_map
    for index, one in enumerate(experiments):
        w, x = block_signals(point, index, one)
        scratch = np.empty((x.size, output_map.parameters.size))
        y, slope = static_map.differentiate(
            output_map, x, scratch, 0, with_positions=True
        )
        held_back = slope**2 + _FLAT * float(np.mean(slope**2)) + 1e-300
        error = np.clip(one.output - y, -one.threshold, one.threshold)
        result.append(FitData(w, x + error * slope / held_back))
    return result
