"""Search that begins with models of the same orders instead of from nothing.

A group's recordings each have a model already. Its linear block and maps are where the
group's model is looked for: the screening of linear starts and the relaxing, which make
up most of a fit, are left out.

References
----------
docs/method.md, section "Warm starts".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.maths.model.candidates import Candidate, Experiment, limits_of
from hwid_cli.maths.model.levenberg_marquardt import Search, minimise
from hwid_cli.maths.model.phases import finish, place
from hwid_cli.maths.model.placing import finer, thinned, with_maps
from hwid_cli.maths.model.robust import renewed
from hwid_cli.records.model import FitOptions, HammersteinWiener

# Enough to adapt initial states and offsets, so that starts can be compared.
_SCREENING_ITERATIONS = 4
# Groups are told apart by a threshold: the last tenth of a percent of the deviation is
# not worth half of the time.
_LEAST_GAIN = 1e-3


def warm_search(
    experiments: Sequence[Experiment],
    options: FitOptions,
    starts: Sequence[HammersteinWiener],
) -> Search:
    """Hammerstein-Wiener model found from models that are near it.

    Parameters
    ----------
    experiments : sequence of Experiment
        Scaled to about one.
    options : FitOptions
    starts : sequence of HammersteinWiener
        At least one; in the units of the experiments, with the orders and the kinds of
        maps that the result has.

    Returns
    -------
    Search
        From the start that screens best; of equal ones the first.
    """
    screened = [
        minimise(
            _spread(_starting(one, experiments, options), experiments, options),
            experiments,
            with_positions=False,
            max_iterations=min(_SCREENING_ITERATIONS, options.max_iterations),
        )
        for one in starts
    ]
    experiments = renewed(experiments, [one.candidate for one in screened])
    best = min(screened, key=lambda one: one.cost)
    return finish(
        place(best, experiments, options),
        experiments,
        options,
        least_gain=_LEAST_GAIN,
    )


def _starting(
    model: HammersteinWiener, experiments: Sequence[Experiment], options: FitOptions
) -> Candidate:
    """A model with empty initial states for every experiment."""
    is_estimated = options.initial_state == "estimated"
    n_state = model.orders.n_state if is_estimated else 0
    return Candidate(
        replace(model, free_response=np.zeros(0), initial_state=options.initial_state),
        np.zeros((len(experiments), n_state)),
        limits_of(options),
    )


def _spread(
    candidate: Candidate, experiments: Sequence[Experiment], options: FitOptions
) -> Candidate:
    """Maps whose break-points cover what the experiments reach, not the start's data."""
    fine = with_maps(candidate, experiments, finer)
    return thinned(fine, experiments, options)
