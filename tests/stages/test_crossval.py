import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.model.simulate import simulate
from hwid_cli.records.experiment import CrossvalOptions, OrdersOptions
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders, StaticMap
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.crossval import cross_validate, crossval_tasks
from hwid_cli.stages.trust import validation_bands_task
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers
from hwid_cli.trust.judged import (
    calibrated,
    judgement,
    own_trust,
    recording_trust,
)

NONE = StaticMap("none", np.zeros(0))
GRID = OrdersOptions(nb=(1, 2), nk=(1, 2))


def model_of(gain, pole=0.5):
    return HammersteinWiener(
        NONE, np.array([gain]), np.array([1.0, -pole]), 1, NONE, 1e-3, output_unit="rad"
    )


def fit_of(name, gain, **changes):
    model = model_of(gain, **changes)
    return Fit(
        (name,), Orders(1, 1, 1), FitOptions(), model, "converged", "", rmsd=gain
    )


def failed(name):
    return Fit((name,), Orders(1, 1, 1), FitOptions(), None, "failed", "no start")


def recording_of(name, seed, n=300):
    u = np.random.default_rng(seed).standard_normal(n)
    # The plant is the model of gain 1.
    return Recording(name, u, simulate(model_of(1.0), u), 1e-3, output_unit="rad")


FITS = tuple(fit_of(name, gain) for name in ("a", "b") for gain in (1.0, 2.0, 3.0, 4.0))
JUDGES = tuple(recording_of(name, seed) for seed, name in enumerate(("a", "b", "c")))


def validate(fits=FITS, judges=JUDGES, jobs=1, store=None, on_done=None):
    settings = RunSettings(store or MemoryStore(), Workers(jobs), on_done=on_done)
    return cross_validate(fits, judges, GRID, CrossvalOptions(), settings)


def test_the_tensor_holds_each_model_on_each_recording_at_its_place():
    result = validate()

    assert result.rmsd.shape == (2, 2, 2, 3)
    assert result.identified_on == ("a", "b")
    assert result.validated_on == ("a", "b", "c")
    assert result.unit == "rad"
    for j, judge in enumerate(JUDGES):
        # The model of gain g is off by g - 1 times the plant's output.
        rms = np.sqrt(np.mean(judge.output**2))
        expected = np.array([[0.0, 1.0], [2.0, 3.0]]) * rms
        # Rounding of 300 filtered samples of size 1.
        np.testing.assert_allclose(result.rmsd[1, :, :, j], expected, atol=1e-13)


@pytest.mark.thorough
def test_the_number_of_workers_changes_no_number():
    np.testing.assert_array_equal(validate(jobs=2).rmsd, validate().rmsd)


def test_a_failed_fit_is_a_missing_value_with_its_reason():
    fits = (*FITS[:3], failed("a"), *FITS[4:])
    result = validate(fits)

    assert np.isnan(result.rmsd[0, 1, 1]).all()
    assert set(result.status[0, 1, 1]) == {"no model"}
    assert np.isfinite(result.rmsd[1]).all()
    assert set(result.status[1].ravel()) == {"ok"}


def test_an_output_that_is_not_finite_is_a_missing_value_with_its_reason():
    fits = (fit_of("a", 1.0, pole=1e30), *FITS[1:])
    result = validate(fits)

    assert np.isnan(result.rmsd[0, 0, 0]).all()
    assert set(result.status[0, 0, 0]) == {"not finite"}


def test_only_what_changed_is_validated_again():
    store, items = MemoryStore(), []
    validate(store=store)
    changed = replace(JUDGES[2], output=JUDGES[2].output + 1.0)
    validate(judges=(*JUDGES[:2], changed), store=store, on_done=items.append)
    assert sorted(i.task.name for i in items if not i.from_cache) == [
        "a on c",
        "b on c",
    ]

    items.clear()
    fits = (fit_of("a", 1.5), *FITS[1:])
    validate(fits, store=store, on_done=items.append)
    assert sorted(i.task.name for i in items if not i.from_cache) == [
        "a on a",
        "a on b",
        "a on c",
    ]


@pytest.mark.parametrize(
    "changes",
    [
        {"numerator": np.array([1.0 + 1e-15])},
        {"delay": 2},
        {"initial_state": "steady"},
        {"sample_time_s": 2e-3},
        {"output_map": StaticMap("saturation", np.array([-1.0, 1.0]))},
        {"input_map": StaticMap("none", np.zeros(0), domain=(0.0, 1.0))},
    ],
    ids=str,
)
def test_every_number_of_a_model_alters_the_key(changes):
    fit = FITS[0]
    other = replace(fit, model=replace(fit.model, **changes))
    before = crossval_tasks((fit, *FITS[1:4]), JUDGES[:1], GRID)
    after = crossval_tasks((other, *FITS[1:4]), JUDGES[:1], GRID)

    assert before[0].key != after[0].key


def test_names_are_no_part_of_the_key():
    renamed = [replace(fit, identified_on=("x",)) for fit in FITS[:4]]
    judge = replace(JUDGES[0], name="y")

    assert (
        crossval_tasks(FITS[:4], JUDGES[:1], GRID)[0].key
        == crossval_tasks(renamed, [judge], GRID)[0].key
    )


def test_simulated_signals_are_not_kept():
    n = 50_000
    judge = recording_of("long", 5, n)
    grid = OrdersOptions(nb=tuple(range(1, 9)), nk=tuple(range(1, 6)))
    fits = [fit_of("a", gain) for gain in np.linspace(1, 2, 40)]
    settings = RunSettings(MemoryStore(), Workers(1), force=True)
    cross_validate(fits, [judge], grid, CrossvalOptions(), settings)
    tracemalloc.start()
    cross_validate(fits, [judge], grid, CrossvalOptions(), settings)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()

    # One model needs about ten signals on its way to the RMSD; to hold those of all 40
    # models would take at least 40.
    assert peak < 20 * n * 8


def test_a_band_is_told_by_the_recordings_of_others():
    # Its own recording is left out; each other one is held by what the others tell.
    fit, judges = FITS[1], [recording_of(f"j{k}", 20 + k) for k in range(3)]
    own = recording_of(fit.name, 1)
    task = validation_bands_task("a/1/1", fit, own, [own, *judges])

    rows = task.function(*task.arguments).rows

    assert [one.recording for one in rows] == ["j0", "j1", "j2"]
    trust = own_trust(fit, [own])
    found = [judgement(fit.model, trust, one) for one in judges]
    known = calibrated(trust, found[1:])
    _, band = recording_trust("a/1/1", outlined_model(fit.model), known, judges[0])
    assert rows[0].width == pytest.approx(np.mean(band.upper - band.lower))
