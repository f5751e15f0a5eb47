"""Fit a Hammerstein-Wiener model to recordings by their free-run simulation error.

The data are scaled to about one, searched (`search`), and the winner is brought back to
their units (`normalise`). Whatever goes wrong ends in `Fit.status`, never in an
exception: a campaign counts failures, it does not stop at them.

References
----------
docs/method.md, sections "The fit" and "The search".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.maths import scores
from hwid_cli.maths.model import sensitivities, static_map
from hwid_cli.maths.model.candidates import Candidate, Experiment
from hwid_cli.maths.model.contained import enlarged
from hwid_cli.maths.model.levenberg_marquardt import Search
from hwid_cli.maths.model.linear_block import is_stable, poles
from hwid_cli.maths.model.normalise import normalise, rescaled
from hwid_cli.maths.model.placing import with_maps
from hwid_cli.maths.model.problem import Problem, joined, rmsd, scaled
from hwid_cli.maths.model.robust import rejudged, renewed, settled, winsorised
from hwid_cli.maths.model.search import (
    linear_search,
    nonlinear_search,
    search_beyond,
)
from hwid_cli.maths.model.starts import Start, linear_starts
from hwid_cli.maths.model.static_map import has_free_shape
from hwid_cli.maths.model.uncertainty import judged_parameters
from hwid_cli.maths.model.warm_start import warm_search
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording

_DEFAULTS = FitOptions()


def fit(
    recordings: Sequence[Recording],
    orders: Orders,
    options: FitOptions = _DEFAULTS,
    *,
    starts: Sequence[HammersteinWiener] = (),
    contained: Sequence[HammersteinWiener] = (),
) -> Fit:
    """Fit one model to one or several recordings.

    Parameters
    ----------
    recordings : sequence of Recording
        Of one sample time. Joined as ``options.join`` says.
    orders : Orders
    options : FitOptions
    starts : sequence of HammersteinWiener
        Models of the same orders and kinds of maps to begin with, such as those of the
        single recordings of a group; several times faster than a search from nothing,
        which is what happens without a stable one or where theirs ends without a model.
    contained : sequence of HammersteinWiener
        Models of smaller orders fitted to the same recordings with the same options: the
        result is not worse in training than any of them.

    Returns
    -------
    Fit
        With ``status`` ``failed`` and a reason where no usable model was found.

    Raises
    ------
    ValueError
        If there is no recording, the sample times differ, or a start has other orders
        or kinds of maps.

    References
    ----------
    docs/method.md, sections "The fit" and "The search".

    Examples
    --------
    >>> from scipy.signal import lfilter
    >>> u = np.random.default_rng(1).standard_normal(300)
    >>> recording = Recording("r1", u, lfilter([0.0, 0.2], [1.0, -0.8], u), 1e-3)
    >>> linear = FitOptions(input_map="none", output_map="none")
    >>> result = fit([recording], Orders(nb=1, nf=1, nk=1), linear)
    >>> result.status, np.round(result.model.denominator, 6)
    ('converged', array([ 1. , -0.8]))
    """
    if not recordings:
        raise ValueError("fit needs at least one recording")
    if len({one.sample_time_s for one in recordings}) > 1:
        raise ValueError("recordings of one fit must share their sample time")
    kinds = (options.input_map, options.output_map)
    for start in starts:
        if (start.input_map.kind, start.output_map.kind) != kinds or (
            start.orders != orders
        ):
            raise ValueError(f"a start must have the orders {orders} and maps {kinds}")
    names = tuple(one.name for one in recordings)
    blank = Fit(names, orders, options, None, "failed", "")
    reason = _reason_not_to_fit(recordings, orders, options)
    if reason:
        return replace(blank, message=reason)
    problem = scaled(recordings, options)
    options = options.in_units(problem.input_scale, problem.output_scale)
    linear_rmsd = float("nan")
    try:
        search = _warm_search(problem, options, starts)
        if search is None:
            starts_found, linear = _linear(problem, orders, options)
            linear_rmsd = rmsd(linear, problem)
            problem = _with_threshold(problem, linear)
            known = _contained(problem, orders, options, contained)
            found = (starts_found, linear, known)
            search = _search(problem, orders, options, found)
            search = _again(search, problem, orders, options, found)
        search, experiments = settled(search, problem.experiments, options)
    except np.linalg.LinAlgError as error:
        return replace(blank, message=f"linear algebra failed: {error}")
    if not np.isfinite(search.cost) or not is_stable(
        search.candidate.model.denominator
    ):
        return replace(
            blank, message="no start gave a stable model", linear_rmsd=linear_rmsd
        )
    return _described(
        replace(blank, linear_rmsd=linear_rmsd),
        search,
        recordings,
        replace(problem, experiments=tuple(experiments)),
    )


def _warm_search(
    problem: Problem, options: FitOptions, starts: Sequence[HammersteinWiener]
) -> Search | None:
    """Search near the starts; None where none is stable or no model came of them."""
    scaled = [
        rescaled(one, 1.0 / problem.input_scale, 1.0 / problem.output_scale)
        for one in starts
        if is_stable(one.denominator)
    ]
    if not scaled:
        return None
    try:
        search = warm_search(problem.experiments, options, scaled)
    except np.linalg.LinAlgError:
        return None
    is_usable = np.isfinite(search.cost) and is_stable(
        search.candidate.model.denominator
    )
    return search if is_usable else None


def _search(
    problem: Problem,
    orders: Orders,
    options: FitOptions,
    found: tuple[tuple[Start, ...], Search, list[Candidate]],
) -> Search:
    """Search from nothing but linear models and models of smaller orders."""
    starts, linear, known = found
    if _is_linear(options):
        return linear
    if known:
        return search_beyond(
            known, problem.experiments, orders, options, starts, linear
        )
    return nonlinear_search(problem.experiments, orders, options, starts, linear)


def _contained(
    problem: Problem,
    orders: Orders,
    options: FitOptions,
    models: Sequence[HammersteinWiener],
) -> list[Candidate]:
    """Models of smaller orders as candidates; of several experiments, of the first."""
    count = len(problem.experiments)
    is_estimated = options.initial_state == "estimated"
    n_state = orders.n_state if is_estimated else 0
    candidates = []
    for model in models:
        larger = enlarged(
            rescaled(model, 1.0 / problem.input_scale, 1.0 / problem.output_scale),
            orders,
        )
        states = np.zeros((count, n_state))
        states[0] = larger.free_response[:n_state] if n_state else 0.0
        candidates.append(Candidate(replace(larger, free_response=np.zeros(0)), states))
    return candidates


def _again(
    first: Search,
    problem: Problem,
    orders: Orders,
    options: FitOptions,
    found: tuple[tuple[Start, ...], Search, list[Candidate]],
) -> Search:
    """The better of a search and a second one that knows which samples are outliers."""
    if options.loss == "squared" or _is_linear(options):
        return first
    first, experiments = settled(first, problem.experiments, options)
    starts = _starts(winsorised(first, experiments), orders, options)
    second = _search(problem, orders, options, (starts, *found[1:]))
    second, experiments = settled(second, problem.experiments, options)
    first = rejudged(first, experiments)
    return min(first, rejudged(second, experiments), key=lambda one: one.cost)


def _with_threshold(problem: Problem, search: Search) -> Problem:
    """Problem with the threshold that a search's residuals ask for."""
    experiments = renewed(problem.experiments, [search.candidate])
    return replace(problem, experiments=tuple(experiments))


def _linear(
    problem: Problem, orders: Orders, options: FitOptions
) -> tuple[tuple[Start, ...], Search]:
    """Linear starts and linear model; found again where outliers were in the way."""
    experiments: Sequence[Experiment] = problem.experiments
    starts = _starts(experiments, orders, options)
    linear = linear_search(experiments, orders, options, starts)
    if options.loss == "squared":
        return starts, linear
    starts = _starts(winsorised(linear, experiments), orders, options)
    experiments = renewed(experiments, [linear.candidate])
    again = linear_search(experiments, orders, options, starts)
    linear = rejudged(linear, experiments)
    return starts, min(linear, again, key=lambda one: one.cost)


def _starts(
    experiments: Sequence[Experiment], orders: Orders, options: FitOptions
) -> tuple[Start, ...]:
    return linear_starts(
        experiments,
        orders,
        options=options,
        sees_input_map=has_free_shape(options.input_map),
        count=options.starts,
    )


def _is_linear(options: FitOptions) -> bool:
    return options.input_map == "none" and options.output_map == "none"


def _reason_not_to_fit(
    recordings: Sequence[Recording], orders: Orders, options: FitOptions
) -> str:
    """Why these data cannot determine a model; empty if they can."""
    total = sum(one.n_samples for one in recordings)
    needed = _least_parameters(orders, options) + orders.n_state
    if total <= needed:
        return f"{total} samples cannot determine a model that needs more than {needed}"
    inputs = np.concatenate([one.input for one in recordings])
    if np.ptp(inputs) == 0.0:
        return f"the input is constant at {inputs[0]:g}"
    outputs = np.concatenate([one.output for one in recordings])
    if np.ptp(outputs) == 0.0:
        return f"the output is constant at {outputs[0]:g}"
    return ""


def _least_parameters(orders: Orders, options: FitOptions) -> int:
    """Parameters of a model, each shared gain counted once."""
    maps = (
        static_map.identity(one.kind, one, np.array([0.0, 1.0]))
        for one in (options.of_input, options.of_output)
    )
    return orders.nb + orders.nf + sum(one.parameters.size for one in maps)


def _described(
    blank: Fit, search: Search, recordings: Sequence[Recording], problem: Problem
) -> Fit:
    """The winner in the units of the data, with all that is said about it."""
    candidate = with_maps(search.candidate, problem.experiments, static_map.with_domain)
    candidate = _in_units(candidate, problem, recordings[0])
    experiments = joined(recordings, blank.options)
    simulated = np.concatenate(sensitivities.simulated_outputs(candidate, experiments))
    measured = np.concatenate([one.output for one in experiments])
    first = candidate.free_responses[0]
    threshold = problem.experiments[0].threshold * problem.output_scale
    uncertainty, information = judged_parameters(
        candidate,
        [replace(one, threshold=threshold) for one in experiments],
        free_break_points=blank.options.free_break_points,
    )
    return replace(
        blank,
        model=replace(candidate.model, free_response=first),
        status=search.status,
        message=search.message,
        iterations=search.iterations,
        rmsd=scores.rmsd(measured, simulated),
        fit_percent=scores.fit_percent(measured, simulated),
        poles=poles(candidate.model.denominator),
        is_stable=True,
        uncertainty=uncertainty,
        information=information,
    )


def _in_units(candidate: Candidate, problem: Problem, like: Recording) -> Candidate:
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
    model = normalise(rescaled(scaled, problem.input_scale, problem.output_scale))
    return Candidate(model, model.free_response.reshape(states.shape))
