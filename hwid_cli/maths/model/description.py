"""What is said about the model that a search ended with.

References
----------
docs/method.md, section "What a fit reports".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.maths import scores
from hwid_cli.maths.model import sensitivities, static_map
from hwid_cli.maths.model.beyond import continued
from hwid_cli.maths.model.candidates import Candidate
from hwid_cli.maths.model.folding import folds
from hwid_cli.maths.model.levenberg_marquardt import Search
from hwid_cli.maths.model.linear_block import poles
from hwid_cli.maths.model.normalise import normalise, rescaled
from hwid_cli.maths.model.placing import with_maps
from hwid_cli.maths.model.points import before_output_map, point_of
from hwid_cli.maths.model.problem import Problem, joined
from hwid_cli.maths.model.uncertainty import NOT_WORKED_OUT, judged_parameters
from hwid_cli.maths.model.unvisited import straightened
from hwid_cli.records.model import Fit, FitOptions
from hwid_cli.records.recordings import Recording

# RMSDs by which an output map must turn back to be called folded: less may be noise.
_TOLD = 2.0
# Share of the samples at either end of a map that says too little about its shape.
_RARE = 0.005


def described(
    blank: Fit,
    search: Search,
    recordings: Sequence[Recording],
    problem: Problem,
    *,
    standard_errors: bool = True,
) -> Fit:
    """Winner of a search in the units of the data, with all that is said about it.

    Parameters
    ----------
    blank : Fit
        With the options in the units of the data.
    search : Search
    recordings : sequence of Recording
    problem : Problem
        With the last threshold of the search.
    standard_errors : bool
        Whether they are worked out, and the criteria too.

    Returns
    -------
    Fit
    """
    candidate = with_maps(search.candidate, problem.experiments, straightened)
    candidate = with_maps(candidate, problem.experiments, static_map.with_domain)
    candidate = _in_units(candidate, problem, recordings[0], blank.options)
    experiments = joined(recordings, blank.options)
    simulated = np.concatenate(sensitivities.simulated_outputs(candidate, experiments))
    measured = np.concatenate([one.output for one in experiments])
    first = candidate.free_responses[0]
    uncertainty, information = NOT_WORKED_OUT
    if standard_errors:
        threshold = problem.experiments[0].threshold * problem.output_scale
        uncertainty, information = judged_parameters(
            candidate,
            [replace(one, threshold=threshold) for one in experiments],
            free_break_points=blank.options.free_break_points,
        )
    deviation = scores.rmsd(measured, simulated)
    x = before_output_map(point_of(candidate), experiments)
    turns = folds(
        candidate.model.output_map, least=_TOLD * deviation, between=_usual_range(x)
    )
    return replace(
        blank,
        orders=candidate.model.orders,
        model=continued(replace(candidate.model, free_response=first)),
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
    candidate: Candidate, problem: Problem, like: Recording, options: FitOptions
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
    model = normalise(
        rescaled(scaled, problem.input_scale, problem.output_scale),
        keeps_block=options.keeps_block,
    )
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
