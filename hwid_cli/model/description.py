"""What is said about the model that a search ended with.

References
----------
docs/method.md, section "What a fit reports".

Where a static map is not monotonic: turns back, so that two arguments give one value.

Such a map is legitimate, such as that of a sensor that rectifies, but the position
can no longer be told from the output, and no controller can invert it.

References
----------
docs/method.md, section "What a fit reports".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model import scores, sensitivities, static_map
from hwid_cli.model.candidates import Candidate, columns
from hwid_cli.model.extrapolation import extrapolated
from hwid_cli.model.identifiability import offset_is_shared
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.linear_block import poles
from hwid_cli.model.map_curve import map_curve
from hwid_cli.model.normalise import normalise, with_zero_at_zero
from hwid_cli.model.placing import reaching, with_maps
from hwid_cli.model.problem import FitProblem, joined
from hwid_cli.model.uncertainty import NOT_WORKED_OUT, parameter_statistics
from hwid_cli.records.model import Fit, FitOptions, StaticMap
from hwid_cli.records.recordings import Recording

# Share of a map's range by which it must turn back; less is the shape of a flat part.
_LEAST_DEPTH = 0.02


def turning_points(
    one: StaticMap,
    *,
    least: float = 0.0,
    between: tuple[float, float] | None = None,
) -> np.ndarray:
    """Arguments at which a map turns back.

    Parameters
    ----------
    least : float
        Turning back by less than this, in the unit of the value, does not count, nor does
        less than 2 % of the map's range.
    between : tuple of float, optional
        Range of the argument that counts; the domain unless given.

    Returns
    -------
    ndarray, shape (n_turns,)
        Rising; empty for a map that is monotonic.

    Examples
    --------
    >>> turning_points(StaticMap("polynomial", np.array([0.5, 0.0, 0.5]), (-1.0, 1.0)))
    array([0.])
    """
    curve = map_curve(one)
    low, high = one.domain if between is None else between
    inside = (curve.argument >= low) & (curve.argument <= high)
    argument, value = curve.argument[inside], curve.value[inside]
    if value.size < 3 or not np.isfinite(value).all() or _is_monotonic(value):
        return np.zeros(0)
    depth = max(_LEAST_DEPTH * float(np.ptp(value)), least)
    return argument[_turns(value, depth)]


def _is_monotonic(value: np.ndarray) -> bool:
    steps = np.diff(value)
    return bool((steps >= 0.0).all() or (steps <= 0.0).all())


def _turns(value: np.ndarray, depth: float) -> list[int]:
    """Places of the extremes from which a curve goes back by a depth on both sides."""
    turns: list[int] = []
    highest = lowest = 0
    rising: bool | None = None
    for place, here in enumerate(value):
        if here > value[highest]:
            highest = place
        if here < value[lowest]:
            lowest = place
        if rising is not False and here < value[highest] - depth:
            if rising:
                turns.append(highest)
            rising, lowest = False, place
        elif rising is not True and here > value[lowest] + depth:
            if rising is False:
                turns.append(lowest)
            rising, highest = True, place
    return turns


# RMSDs by which an output map must turn back to be called non-monotonic: less may be noise.
_TOLD = 2.0
# Share of the samples at either end of a map that says too little about its shape.
_RARE = 0.005


def described(
    blank: Fit,
    search: Search,
    recordings: Sequence[Recording],
    problem: FitProblem,
    *,
    standard_errors: bool = True,
) -> Fit:
    """Winner of a search in the units of the data, with all that is said about it.

    Parameters
    ----------
    blank : Fit
        With the options in the units of the data.
    problem : FitProblem
        With the last threshold of the search.
    standard_errors : bool
        Whether they are worked out, and the criteria too.
    """
    candidate = with_maps(
        search.candidate, problem.experiments, static_map.straightened
    )
    candidate = with_maps(candidate, problem.experiments, static_map.with_domain)
    candidate = _in_units(candidate, problem, recordings[0], blank.options)
    experiments = joined(recordings, blank.options)
    simulated = np.concatenate(sensitivities.simulated_outputs(candidate, experiments))
    measured = np.concatenate([one.output for one in experiments])
    first = candidate.free_responses[0]
    uncertainty, information = NOT_WORKED_OUT
    if standard_errors:
        threshold = problem.experiments[0].threshold * problem.output_scale
        uncertainty, information = parameter_statistics(
            candidate,
            [replace(one, threshold=threshold) for one in experiments],
            free_break_points=blank.options.free_break_points,
        )
    deviation = scores.rmsd(measured, simulated)
    u, x = reaching(candidate, experiments)
    model = extrapolated(replace(candidate.model, free_response=first), u, x)
    turns = turning_points(
        model.output_map, least=_TOLD * deviation, between=_usual_range(x)
    )
    return replace(
        blank,
        orders=candidate.model.orders,
        model=model,
        status=search.status,
        message=search.message,
        iterations=search.iterations,
        rmsd=deviation,
        fit_percent=scores.fit_percent(measured, simulated),
        poles=poles(candidate.model.denominator),
        is_stable=True,
        uncertainty=uncertainty,
        information=information,
        output_folds=tuple(float(x) for x in turns),
    )


def _usual_range(signal: np.ndarray) -> tuple[float, float]:
    """Range of a signal without its rarest samples."""
    rare = int(_RARE * signal.size)
    ordered = np.partition(signal, [rare, signal.size - 1 - rare])
    return float(ordered[rare]), float(ordered[-1 - rare])


def _in_units(
    candidate: Candidate, problem: FitProblem, like: Recording, options: FitOptions
) -> Candidate:
    """Normalised candidate for the data as they are."""
    states = candidate.free_responses
    # The initial states of all experiments change their unit together with the model.
    scaled = replace(
        candidate.model,
        free_response=states.ravel(),
        sample_time_s=like.sample_time_s,
        input_unit=like.input_unit,
        output_unit=like.output_unit,
    )
    in_units = problem.of_data(scaled)
    if in_units is None:
        raise ValueError("no model of these maps has the offsets of the recordings")
    model = normalise(in_units, keeps_block=options.keeps_block)
    place = columns(candidate, with_positions=options.free_break_points)
    if offset_is_shared(replace(candidate, model=model), place):
        model = with_zero_at_zero(model)
    if options.keeps_block and options.linear_block is not None:
        # Scaling to and fro rounds; what is given stays bit by bit.
        model = replace(
            model,
            numerator=np.array(options.linear_block.numerator),
            denominator=np.array(options.linear_block.denominator),
        )
    return replace(
        candidate,
        model=model,
        free_responses=model.free_response.reshape(states.shape),
    )
