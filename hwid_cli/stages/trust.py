"""What is known of a model's errors, with the recordings of an experiment."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.model import Fit
from hwid_cli.records.recordings import Recording
from hwid_cli.records.trust import ModelTrust, ShownBand, TrustOnTests
from hwid_cli.tasks.cache import model_key, recording_key, task_key
from hwid_cli.tasks.runner import Task
from hwid_cli.trust.judged import (
    judgement,
    left_out_bands,
    model_trust,
    own_trust,
    recording_trust,
    trust_row,
)

# Of what is known of a model's errors, whichever stage asks for it.
TRUST_VERSION = 3


def trust_of(
    fit: Fit, recordings: Sequence[Recording], tested: Sequence[str]
) -> ModelTrust:
    """What is known of the errors of a model.

    Parameters
    ----------
    recordings : sequence of Recording
        All of the experiment.
    tested : sequence of str
        Recordings for the test, which never judge.
    """
    by_name = {one.name: one for one in recordings}
    kept = {*fit.identified_on, *tested}
    others = [one for one in recordings if one.name not in kept]
    return model_trust(fit, [by_name[name] for name in fit.identified_on], others)


def kept_for_test(experiment: Experiment) -> tuple[str, ...]:
    """Recordings that are kept for the test."""
    return () if experiment.test is None else experiment.test.recordings


def validation_bands_task(
    name: str, fit: Fit, own: Recording, recordings: Sequence[Recording]
) -> Task:
    """Task that tells how a model's bands do on the recordings that validate it.

    Parameters
    ----------
    name : str
        Of the model.
    fit : Fit
        That has one.
    own : Recording
        Of the fit.
    recordings : sequence of Recording
        Each band is told by the other ones; that of the fit does not count.

    Returns
    -------
    Task
        Gives ``TrustOnTests``.
    """
    settings = {
        **_numbers_of(name, fit),
        "own": recording_key(own),
        "validated_on": {one.name: recording_key(one) for one in recordings},
    }
    return Task(
        key=task_key("validation bands", TRUST_VERSION, settings, []),
        name=f"bands of {name}",
        function=_validation_bands,
        arguments=(name, fit, own, tuple(recordings)),
        result_type=TrustOnTests,
    )


def _validation_bands(
    name: str, fit: Fit, own: Recording, recordings: Sequence[Recording]
) -> TrustOnTests:
    if fit.model is None:
        return TrustOnTests()
    trust, others = own_trust(fit, [own]), [r for r in recordings if r.name != own.name]
    found = [judgement(fit.model, trust, one) for one in others]
    return TrustOnTests(
        tuple(
            trust_row((name, one.name, own.output_unit), one.measured, band)
            for one, band in left_out_bands(trust, found)
        )
    )


def trust_task(
    name: str, fit: Fit, recordings: Sequence[Recording], tested: Sequence[str]
) -> Task:
    """Task that tells how far a model may be trusted on the test recordings.

    Parameters
    ----------
    name : str
        Of the model.
    fit : Fit
        That has one.
    recordings : sequence of Recording
        All of the experiment.

    Returns
    -------
    Task
        Gives ``TrustOnTests``.
    """
    settings = {
        **_numbers_of(name, fit),
        "identified_on": fit.identified_on,
        "recordings": {one.name: recording_key(one) for one in recordings},
        "tested_on": tested,
    }
    return Task(
        key=task_key("trust", TRUST_VERSION, settings, []),
        name=f"trust of {name}",
        function=_trust_on_tests,
        arguments=(name, fit, tuple(recordings), tuple(tested)),
        result_type=TrustOnTests,
    )


def _numbers_of(name: str, fit: Fit) -> dict[str, object]:
    """What a fit is, for a key."""
    return {
        "model": name,
        "numbers": None if fit.model is None else model_key(fit.model),
        "orders": fit.orders,
        "options": fit.options,
    }


def _trust_on_tests(
    name: str, fit: Fit, recordings: Sequence[Recording], tested: Sequence[str]
) -> TrustOnTests:
    if fit.model is None:
        return TrustOnTests()
    trust, model = trust_of(fit, recordings, tested), outlined_model(fit.model)
    found = [
        (*recording_trust(name, model, trust, one), one)
        for one in recordings
        if one.name in tested
    ]
    if not found:
        return TrustOnTests()
    worst, band, shown = min(found, key=lambda item: item[0].coverage)
    return TrustOnTests(
        tuple(row for row, *_ in found),
        ShownBand(
            name,
            worst.recording,
            shown.sample_time_s * np.arange(shown.n_samples),
            shown.output,
            band.output,
            band.lower,
            band.upper,
            band.inside.all,
            shown.output_unit,
        ),
    )
