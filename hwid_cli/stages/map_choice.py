"""Which maps to take, and of which size: the smallest that predict as well as the best.

References
----------
docs/method.md, section "Which maps".
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from hwid_cli.records.experiment import OrderOptions
from hwid_cli.records.maps import MAP_KINDS
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.order import MapAdvice, MapCandidate
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.candidate_selection import scored, smallest_good
from hwid_cli.stages.crossval import deviation_tasks
from hwid_cli.stages.identify import fit_task
from hwid_cli.stages.outliers import without_outliers
from hwid_cli.tasks.cache import recording_key
from hwid_cli.tasks.runner import RunSettings, run_tasks


def candidate_maps(fit: FitOptions, options: OrderOptions) -> tuple[FitOptions, ...]:
    """List the pairs of maps to compare, that of the configuration first.

    Returns
    -------
    tuple of FitOptions
        Just one where ``order`` names neither maps nor units.

    Examples
    --------
    >>> fit = FitOptions(output_map="none")
    >>> [one.input_units for one in candidate_maps(fit, OrderOptions(units=(3, 5)))]
    [10, 3, 5]
    """
    sides = [
        [
            (kind, units)
            for kind in dict.fromkeys((own.kind, *options.maps))
            for units in dict.fromkeys((own.units, *options.units))
            if _has_units(kind) or units == own.units
        ]
        for own in (fit.of_input, fit.of_output)
    ]
    return tuple(
        replace(
            fit,
            input_map=input_map,
            input_units=input_units,
            output_map=output_map,
            output_units=output_units,
        )
        for (input_map, input_units), (output_map, output_units) in product(*sides)
    )


def fit_maps(
    recordings: Sequence[Recording],
    orders: Orders,
    candidates: Sequence[FitOptions],
    settings: RunSettings,
) -> tuple[tuple[Fit, ...], ...]:
    """Fit every recording with every pair of maps, each from nothing.

    Parameters
    ----------
    orders : Orders
        Of all models.

    Returns
    -------
    tuple of tuple of Fit
        For each recording those of the candidates.
    """
    # A rule for joining recordings does nothing to one and is no part of its fit.
    alone = [replace(one, join=FitOptions().join) for one in candidates]
    contents = [recording_key(recording) for recording in recordings]
    tasks = [
        fit_task(
            f"{recording.name}, {options.input_map} and {options.output_map}",
            (recording, content),
            orders,
            options,
        )
        for recording, content in zip(recordings, contents, strict=True)
        for options in alone
    ]
    done = [one.result for one in run_tasks(tasks, settings)]
    firsts = range(0, len(done), len(alone))
    return tuple(tuple(done[first : first + len(alone)]) for first in firsts)


def recommend_maps(
    fits: Sequence[Sequence[Fit]],
    recordings: Sequence[Recording],
    validation: Sequence[Recording],
    tolerance: float,
    settings: RunSettings,
) -> MapAdvice | None:
    """Score maps on recordings that others were fitted to, and recommend a pair.

    Parameters
    ----------
    fits : sequence of sequence of Fit
        As `fit_maps` gives them; the first ones are those of the configuration's maps.
    recordings : sequence of Recording
        Those of the fits.
    tolerance : float, [-]

    Returns
    -------
    MapAdvice or None
        None where no model could be scored.

    References
    ----------
    docs/method.md, section "Which maps".
    """
    rmsd, n_outliers = validation_rmsd(fits, recordings, validation, settings)
    found = scored(
        rmsd,
        [one.name for one in recordings],
        [one.name for one in validation],
        (*recordings, *validation),
        n_outliers,
    )
    if found is None:
        return None
    columns = list(zip(*fits, strict=True))
    sizes = [max(one.information.n_parameters for one in each) for each in columns]
    bic = [_known(sum(one.information.bic for one in each)) for each in columns]
    verdict = smallest_good(found, np.array(sizes), tolerance)
    chosen = verdict.chosen if verdict.evidence.n_validation else int(np.argmin(bic))
    known = [
        MapCandidate(
            *_named(each[0].options),
            n_parameters=sizes[number],
            rmsd=float(verdict.rmsd[number]),
            factor=float(verdict.factors[number]),
            bic=bic[number],
        )
        for number, each in enumerate(columns)
    ]
    orders = fits[0][0].orders
    return MapAdvice(
        orders=(orders.nb, orders.nf, orders.nk),
        candidates=tuple(sorted(known, key=lambda one: one.factor)),
        chosen=known[chosen],
        given=known[0],
        evidence=verdict.evidence,
        tolerance=tolerance,
        unit=validation[0].output_unit,
    )


def validation_rmsd(
    fits: Sequence[Sequence[Fit]],
    recordings: Sequence[Recording],
    validation: Sequence[Recording],
    settings: RunSettings,
) -> tuple[np.ndarray, tuple[int, ...]]:
    """RMSDs, shape (n_recordings, n_candidates, n_validation), and the outliers left out."""
    rmsd = _deviations(fits, recordings, validation, settings)
    if fits[0][0].options.loss == "squared":
        return rmsd, ()
    models = [one.model for each in fits for one in each]
    shape = (len(models), len(validation))
    table, n_outliers = without_outliers(
        models,
        rmsd.reshape(shape),
        validation,
        lambda some: _deviations(fits, recordings, some, settings).reshape(shape),
    )
    return table.reshape(rmsd.shape), n_outliers


def _deviations(
    fits: Sequence[Sequence[Fit]],
    recordings: Sequence[Recording],
    validation: Sequence[Recording],
    settings: RunSettings,
) -> np.ndarray:
    """RMSDs, shape (n_recordings, n_candidates, n_validation)."""
    contents = [recording_key(one) for one in validation]
    tasks = [
        task
        for each, recording in zip(fits, recordings, strict=True)
        for task in deviation_tasks(
            [one.model for one in each], validation, contents, recording.name
        )
    ]
    values = np.array([one.result.rmsd for one in run_tasks(tasks, settings)])
    return np.moveaxis(values.reshape(len(fits), len(validation), -1), 1, 2)


def _named(options: FitOptions) -> tuple[str, int, str, int]:
    """Both maps, each with its size; 0 where its kind has none."""
    return (*options.of_input.kind_and_units, *options.of_output.kind_and_units)


def _has_units(kind: str) -> bool:
    return MAP_KINDS[kind].least_units is not None


def _known(criterion: float) -> float:
    return float("inf") if np.isnan(criterion) else float(criterion)
