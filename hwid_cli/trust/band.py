"""A band for the output of a model on a new input, and what its width is made of.

The standard deviation of the error at a sample is taken to be

    s = sqrt((parameters + 0.03 continuation + noise^2 + scatter^2)
             (1 + 1.5 octaves + 0.3 values)^2 + gain^2 (output - first output)^2)

parameters: steps of the covariance, passed through the model on this input.
continuation: how far the output moves where the maps go on otherwise beyond the data.
noise: what the model leaves of its own recordings. scatter and gain: the median error on
recordings to which it was not fitted, and the part of it that grows with the output
(`trust.judged`): a machine differs from recording to recording even where the model has
seen everything. octaves and values: 1 where the content
in frequency, or value and rate, lie outside what was visited. How many standard
deviations wide the band is, these recordings say.

References
----------
docs/trust.md, which compares this with other constructions.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.linear_block import filtered, free_response
from hwid_cli.model.parameter_steps import parameter_vector, with_parameters
from hwid_cli.records.model import HammersteinWiener, StaticMap
from hwid_cli.records.trust import Band, Inside, ModelTrust, VisitedPlane
from hwid_cli.trust.visited import inside

# Share of a step of the covariance by which its effect on the output is found.
_SMALL = 1e-3
# Of the signal before the output map, where that is nothing.
_LEAST_STEP = 1e-12
# Share of the range over which the slope at an end is taken, as in `model.extrapolation`.
_OUTER = 1.0 / 8.0
# Chosen on the plants that `make bench-trust` draws with --choose: how much of an even
# spread between continuations counts, and by how much the deviation grows outside.
_CONTINUATION, _OUTSIDE_OCTAVES, _OUTSIDE_VALUES = 0.03, 1.5, 0.3

Law = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class ErrorTerms:
    """A model's output, and what its error may come from, sample by sample.

    Parameters
    ----------
    output : ndarray, shape (n_samples,), [output unit]
    inner : ndarray, shape (n_samples,)
        What reaches the output map.
    parameters, continuation : ndarray, shape (n_samples,)
        Variances [output unit squared].
    """

    output: np.ndarray
    inner: np.ndarray
    parameters: np.ndarray
    continuation: np.ndarray


def prediction_band(
    model: HammersteinWiener,
    trust: ModelTrust,
    values: np.ndarray,
    *,
    state: np.ndarray | None = None,
) -> Band:
    """Output of a model on an input, with a band of 90 %.

    Parameters
    ----------
    model : HammersteinWiener
        As it leaves the program (`model.extrapolation.outlined_model`).
    values : ndarray, shape (n_samples,), [input unit]
    state : ndarray, shape (n_state,), optional
        Coefficients of the free response that come closest to the measured output; the
        model's own unless given.
    """
    terms = error_terms(model, trust, values, state=state)
    return band_of(trust, terms, inside(trust.visited, values, terms.inner))


def band_of(trust: ModelTrust, terms: ErrorTerms, where: Inside) -> Band:
    """Band around an output whose error terms are known."""
    half = trust.scale * standard_deviation(trust, terms, where)
    return Band(terms.output, terms.output - half, terms.output + half, where)


def standard_deviation(
    trust: ModelTrust, terms: ErrorTerms, where: Inside
) -> np.ndarray:
    """Standard deviation of the error at each sample.

    Parameters
    ----------
    trust : ModelTrust
        Its scale does not count.

    Returns
    -------
    ndarray, shape (n_samples,), [output unit]
    """
    variance = terms.parameters + _CONTINUATION * terms.continuation
    variance = variance + trust.noise_rms**2 + trust.scatter**2
    outside = ~where.frequency, ~(where.amplitude & where.rate)
    shares = (_OUTSIDE_OCTAVES, _OUTSIDE_VALUES)
    grows = sum(share * is_out for share, is_out in zip(shares, outside, strict=True))
    by_gain = (trust.gain * level_of(terms)) ** 2
    return np.sqrt(variance * (1.0 + grows) ** 2 + by_gain)


def level_of(terms: ErrorTerms) -> np.ndarray:
    """How far the output is from its first sample, shape (n_samples,), [output unit]."""
    return terms.output - terms.output[0]


def error_terms(
    model: HammersteinWiener,
    trust: ModelTrust,
    values: np.ndarray,
    *,
    state: np.ndarray | None = None,
) -> ErrorTerms:
    """Simulate a model, and what moves its output on this input.

    Parameters
    ----------
    trust : ModelTrust
        Its scale does not count.
    values : ndarray, shape (n_samples,), [input unit]
    state : ndarray, shape (n_state,), optional
        Coefficients of the free response that come closest to the measured output: they
        follow other parameters. The model's own unless given.
    """
    start = model.free_response if state is None else state
    signal = np.ascontiguousarray(values, dtype=float)
    with np.errstate(over="ignore", invalid="ignore"):
        inner, output = inner_and_output(model, signal, start)
        moved = _moved_by_parameters(model, trust, signal, start, output)
        if state is not None:
            moved = _without_starts(model, inner, moved)
        variance = np.sum(moved**2, axis=0)
        continuation = _continuation(model, trust, signal, start, output)
    return ErrorTerms(output, inner, variance, continuation)


def _moved_by_parameters(
    model: HammersteinWiener,
    trust: ModelTrust,
    signal: np.ndarray,
    start: np.ndarray,
    output: np.ndarray,
) -> np.ndarray:
    """How steps of the covariance move the output, shape (n_steps, n_samples)."""
    if not trust.steps.size:
        return np.zeros((0, signal.size))
    base = parameter_vector(model)
    others = (with_parameters(model, base + _SMALL * step) for step in trust.steps)
    moved = [inner_and_output(one, signal, start)[1] for one in others]
    return (np.array(moved) - output) / _SMALL


def _without_starts(
    model: HammersteinWiener, inner: np.ndarray, moved: np.ndarray
) -> np.ndarray:
    """What is left of changes of the output where the start follows the measured one.

    Of a pole at 1 a start that stayed would be all there is.
    """
    n_state = model.orders.n_state
    if n_state == 0 or not (np.isfinite(moved).all() and np.isfinite(inner).all()):
        return moved
    step = _SMALL * max(float(np.ptp(inner)), float(np.abs(inner).max()), _LEAST_STEP)
    ends = [static_map.evaluate(model.output_map, inner + at) for at in (step, -step)]
    slope = (ends[0] - ends[1]) / (2.0 * step)
    units = np.eye(n_state)
    free = [free_response(one, model.denominator, inner.size) for one in units]
    by_start = slope[:, None] * np.array(free).T
    return np.asarray(moved - (by_start @ np.linalg.lstsq(by_start, moved.T)[0]).T)


def inner_and_output(
    model: HammersteinWiener,
    signal: np.ndarray,
    start: np.ndarray,
    laws: tuple[Law | None, Law | None] = (None, None),
) -> tuple[np.ndarray, np.ndarray]:
    """Signal that reaches the output map, and the output.

    Parameters
    ----------
    signal : ndarray, shape (n_samples,), [input unit]
    start : ndarray, shape (n_state,) or (0,)
        Coefficients of the free response.
    laws : tuple of callable or None
        What takes the place of the two maps.

    Returns
    -------
    inner, output : ndarray, shape (n_samples,)
    """
    before, after = laws
    w = (
        static_map.evaluate(model.input_map, signal)
        if before is None
        else before(signal)
    )
    steady = model.initial_state == "steady"
    x = filtered(w, model.numerator, model.denominator, model.delay, steady=steady)
    if np.size(start):
        x = x + free_response(np.asarray(start), model.denominator, x.size)
    y = static_map.evaluate(model.output_map, x) if after is None else after(x)
    return x, y


def _continuation(
    model: HammersteinWiener,
    trust: ModelTrust,
    signal: np.ndarray,
    start: np.ndarray,
    output: np.ndarray,
) -> np.ndarray:
    """Variance of the output over the ways in which the maps may go on.

    Of each map the way that moves the output most counts, as the end of an even spread.
    """
    variance = np.zeros(signal.size)
    planes = (trust.visited.input, trust.visited.inner)
    maps = (model.input_map, model.output_map)
    for place, (one, plane) in enumerate(zip(maps, planes, strict=True)):
        moved = np.zeros(signal.size)
        for law in continuations(one, plane):
            laws = (law, None) if place == 0 else (None, law)
            other = inner_and_output(model, signal, start, laws)[1]
            moved = np.maximum(moved, np.abs(other - output))
        variance += moved**2 / 3.0
    return variance


def continuations(one: StaticMap, plane: VisitedPlane) -> tuple[Law, Law]:
    """Other ways in which a map may go on where no sample was.

    Returns
    -------
    tuple of callable
        The first holds the value of the last sample; the second goes on with the slope
        there for ever, and in a gap holds the value of its other end.
    """
    edges, seen = plane.edges, np.isfinite(plane.lowest_rate)
    low, high = edges[0], edges[-1]
    depth = _OUTER * (high - low)
    at = np.array([low, low + depth, high - depth, high])
    ends = static_map.evaluate(one, at)
    slopes = (ends[1] - ends[0]) / depth, (ends[3] - ends[2]) / depth
    gaps = _gaps(edges, seen)

    def held(argument: np.ndarray) -> np.ndarray:
        limited = np.clip(argument, low, high)
        for first, last in gaps:
            limited[(limited > first) & (limited < last)] = first
        return static_map.evaluate(one, limited)

    def steep(argument: np.ndarray) -> np.ndarray:
        limited = np.clip(argument, low, high)
        for first, last in gaps:
            limited[(limited > first) & (limited < last)] = last
        value = static_map.evaluate(one, limited)
        value = value + slopes[0] * np.minimum(argument - low, 0.0)
        return value + slopes[1] * np.maximum(argument - high, 0.0)

    return held, steep


def _gaps(edges: np.ndarray, seen: np.ndarray) -> list[tuple[float, float]]:
    """Ranges of two and more cells that no sample visited."""
    found, first = [], None
    for cell, is_seen in enumerate(np.append(seen, True)):
        if not is_seen and first is None:
            first = cell
        elif is_seen and first is not None:
            if cell - first >= 2:
                found.append((float(edges[first]), float(edges[cell])))
            first = None
    return found
