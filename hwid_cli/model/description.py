"""What is said about the model that a search ended with.

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
from hwid_cli.model.held_directions import offset_is_shared
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.linear_block import poles
from hwid_cli.model.normalise import normalise, with_zero_at_zero
from hwid_cli.model.placing import reaching, with_maps
from hwid_cli.model.problem import FitProblem, joined
from hwid_cli.model.turning_points import turning_points
from hwid_cli.model.uncertainty import NOT_WORKED_OUT, parameter_statistics
from hwid_cli.records.model import Fit, FitOptions
from hwid_cli.records.recordings import Recording

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
