"""Search that begins with models of the same orders instead of from nothing.

A group's recordings each have a model already. Its linear block and maps are where the
group's model is looked for: the screening of linear starts and the re-estimation of the
block, which make up most of a fit, are left out.

References
----------
docs/method.md, section "Warm starts".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model.candidates import Candidate, FitData, limits_of, thinned
from hwid_cli.model.levenberg_marquardt import Search, minimise
from hwid_cli.model.phases import converge, finish, place, standing
from hwid_cli.model.placing import coarser, finer, with_maps
from hwid_cli.records.model import (
    FitOptions,
    HammersteinWiener,
)

# Samples that count where starts are compared, and iterations of the best: enough to
# adapt initial states and offsets.
_ROWS, _SCREENING_ITERATIONS = 1000, 3
# Groups are told apart by a threshold: the last tenth of a percent of the deviation is
# not worth half of the time.
_LEAST_GAIN = 1e-3
# Smaller gains in a row that end the continuation of a nested model: the next orders go
# on from here again.
_PATIENCE = 1


def warm_search(
    experiments: Sequence[FitData],
    options: FitOptions,
    starts: Sequence[HammersteinWiener],
    nested: Sequence[Candidate] = (),
    *,
    search_anew: bool = True,
) -> Search:
    """Hammerstein-Wiener model found from models that are near it.

    Parameters
    ----------
    experiments : sequence of FitData
        Scaled to about one.
    starts : sequence of HammersteinWiener
        At least one; in the units of the experiments, with the orders and the kinds of
        maps that the result has.
    nested : sequence of Candidate
        Models of smaller orders, written with those of the result, which is not worse
        than any of them.
    search_anew : bool
        Whether the starts are tried beside nested models.

    Returns
    -------
    Search
        From the start that is best for these experiments; of equal ones the first.
    """
    found = []
    if nested:
        known = min(
            (standing(one, experiments) for one in nested), key=lambda one: one.cost
        )
        near = converge(
            known,
            experiments,
            options,
            least_gain=_LEAST_GAIN,
            patience=_PATIENCE,
        )
        found = [known, near]
    if search_anew or not nested:
        screened = _screened(experiments, options, starts)
        (placed,) = place([screened], experiments, options)
        found.append(finish(placed, experiments, options, least_gain=_LEAST_GAIN))
    return min(found, key=lambda one: one.cost)


def _screened(
    experiments: Sequence[FitData],
    options: FitOptions,
    starts: Sequence[HammersteinWiener],
) -> Search:
    """The start that is best for these experiments, after a few iterations."""
    few = thinned(experiments, _ROWS)
    best = min(
        (standing(_starting(one, experiments, options), few) for one in starts),
        key=lambda one: one.cost,
    )
    return minimise(
        _spread(best.candidate, experiments, options),
        few,
        with_positions=False,
        max_iterations=min(_SCREENING_ITERATIONS, options.max_iterations),
    )


def _starting(
    model: HammersteinWiener, experiments: Sequence[FitData], options: FitOptions
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
    candidate: Candidate, experiments: Sequence[FitData], options: FitOptions
) -> Candidate:
    """Maps whose break-points cover what the experiments reach, not the start's data."""
    fine = with_maps(candidate, experiments, finer)
    return coarser(fine, experiments, options)
