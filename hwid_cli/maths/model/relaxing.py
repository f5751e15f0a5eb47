"""A new linear block between the maps of the best model: leaves minima of the block.

References
----------
docs/method.md, section "The search", step 4.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.maths.model import static_map
from hwid_cli.maths.model.candidates import Candidate, Experiment
from hwid_cli.maths.model.delays import relaxed_starts
from hwid_cli.maths.model.distinct import WHEN_FREE, distinct
from hwid_cli.maths.model.levenberg_marquardt import Search, minimise
from hwid_cli.maths.model.phases import standing
from hwid_cli.maths.model.points import block_signals, point_of
from hwid_cli.records.model import FitOptions

_RELAXING_ITERATIONS = 8
_RELAXED_BLOCKS = 2
# Slopes of the output map below this share of their mean square say too little about x.
_FLAT = 0.1


def relaxed_search(
    best: Search,
    experiments: Sequence[Experiment],
    options: FitOptions,
) -> Search:
    """Find the linear block anew between the maps of the best model.

    Parameters
    ----------
    best : Search
    experiments : sequence of Experiment
    options : FitOptions

    Returns
    -------
    Search
        With fixed break-points; not to the end, and not always better. The best itself
        where the new blocks come to the same model.
    """
    between = _between_maps(best.candidate, experiments)
    model, no_states = best.candidate.model, best.candidate.free_responses[:, :0]
    has_states = options.initial_state == "estimated"
    starts = relaxed_starts(
        between,
        model.orders,
        options,
        count=_RELAXED_BLOCKS,
        denominator=model.denominator,
    )
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
            max_iterations=min(_RELAXING_ITERATIONS, options.max_iterations),
        )
        for one in distinct([best, *entered], experiments, WHEN_FREE)
        if one is not best
    ]
    if not found:
        return best
    leader = min(found, key=lambda one: one.cost)
    return replace(leader, iterations=best.iterations + leader.iterations)


def _between_maps(
    candidate: Candidate, experiments: Sequence[Experiment]
) -> list[Experiment]:
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
        result.append(Experiment(w, x + error * slope / held_back))
    return result
