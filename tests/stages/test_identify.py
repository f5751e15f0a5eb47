from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.experiment import IdentifyOptions, OrdersOptions
from hwid_cli.records.maps import OwnFunction
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages import identify
from hwid_cli.stages.identify import identify_all, identify_key
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers

QUICK = FitOptions(units=3, max_iterations=5, starts=1, initial_state="zero")
GRID = OrdersOptions(nb=(1, 2), nk=(1,))


SOFT_LIMIT = """
import numpy as np
from hwid_cli import MapFunction

soft_limit = MapFunction(
    value=lambda v, p: p[0] * np.tanh(v / p[0]),
    by_argument=lambda v, p: 1.0 - np.tanh(v / p[0]) ** 2,
    by_parameters=lambda v, p: (
        np.tanh(v / p[0]) - v / p[0] * (1.0 - np.tanh(v / p[0]) ** 2)
    )[:, None],
    start=[0.7],
)
"""
OWN = replace(
    QUICK,
    input_map="own_function",
    output_map="cubic_spline",
    input_function=OwnFunction("soft_limit", SOFT_LIMIT),
)


def recording_of(name="r1", seed=1):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, 20), 10)
    y = np.zeros(200)
    for k in range(1, 200):
        y[k] = 0.8 * y[k - 1] + 0.2 * np.tanh(2 * u[k - 1])
    return Recording(name, u, y + 0.001 * rng.standard_normal(200), 1e-3)


RECORDINGS = (recording_of("a", 1), recording_of("b", 2))


def numbers_of(fit):
    model = fit.model
    return np.concatenate(
        [
            model.input_map.parameters,
            model.numerator,
            model.denominator,
            model.output_map.parameters,
            [fit.rmsd, fit.fit_percent, fit.linear_rmsd],
        ]
    )


def test_every_recording_gets_a_fit_for_every_pair_of_orders():
    fits = identify_all(RECORDINGS, GRID, QUICK, RunSettings(MemoryStore(), Workers(1)))

    assert [(fit.name, fit.orders) for fit in fits] == [
        ("a", Orders(1, 1, 1)),
        ("a", Orders(2, 1, 1)),
        ("b", Orders(1, 1, 1)),
        ("b", Orders(2, 1, 1)),
    ]
    assert all(np.isfinite(fit.rmsd) for fit in fits)


@pytest.mark.thorough
@pytest.mark.parametrize("options", [QUICK, OWN], ids=["default", "own_function"])
def test_the_number_of_workers_changes_no_number(options):
    one, two = (
        identify_all(
            RECORDINGS, GRID, options, RunSettings(MemoryStore(), Workers(jobs))
        )
        for jobs in (1, 2)
    )

    for fit, again in zip(one, two, strict=True):
        np.testing.assert_array_equal(numbers_of(fit), numbers_of(again))


@pytest.mark.thorough
def test_a_fit_from_the_cache_is_the_fit_that_was_computed(tmp_path):
    items = []
    settings = RunSettings(Hdf5Store(tmp_path), Workers(1), on_done=items.append)
    first = identify_all(RECORDINGS, GRID, QUICK, settings)
    second = identify_all(RECORDINGS, GRID, QUICK, settings)

    assert [item.from_cache for item in items] == 4 * [False] + 4 * [True]
    for fit, again in zip(first, second, strict=True):
        np.testing.assert_array_equal(numbers_of(fit), numbers_of(again))
        assert (fit.status, fit.message) == (again.status, again.message)


def test_a_renamed_recording_is_not_fitted_again_and_has_its_new_name():
    items = []
    settings = RunSettings(MemoryStore(), Workers(1), on_done=items.append)
    identify_all(RECORDINGS[:1], GRID, QUICK, settings)
    items.clear()
    renamed = replace(RECORDINGS[0], name="c")
    fits = identify_all([renamed], GRID, QUICK, settings)

    assert all(item.from_cache for item in items)
    assert {fit.name for fit in fits} == {"c"}


def test_the_rule_for_joining_does_not_matter_for_single_recordings():
    items = []
    settings = RunSettings(MemoryStore(), Workers(1), on_done=items.append)
    identify_all(RECORDINGS[:1], GRID, QUICK, settings)
    items.clear()
    other = replace(QUICK, join="experiments")
    fits = identify_all(RECORDINGS[:1], GRID, other, settings)

    assert all(item.from_cache for item in items)
    assert {fit.options for fit in fits} == {other}


def keys(recordings=RECORDINGS[:1], grid=GRID, options=QUICK):
    items = []
    settings = RunSettings(MemoryStore(), Workers(1), on_done=items.append)
    identify_all(recordings, grid, options, settings)
    return {item.task.key for item in items}


CHANGED_OUTPUT = np.array(RECORDINGS[0].output)
CHANGED_OUTPUT[7] += 1e-12


@pytest.mark.parametrize(
    "changes",
    [
        {"recordings": [replace(RECORDINGS[0], output=CHANGED_OUTPUT)]},
        {"recordings": [replace(RECORDINGS[0], sample_time_s=2e-3)]},
        {"recordings": [replace(RECORDINGS[0], output_unit="rad")]},
        {"options": replace(QUICK, units=4)},
        {"options": replace(QUICK, initial_state="steady")},
        {"options": replace(QUICK, input_units=4)},
        {"grid": OrdersOptions(nb=(1, 2), nk=(2,))},
        {"grid": OrdersOptions(nb=(1, 2), nk=(0,), nk_role="delay", nf=1)},
    ],
    ids=str,
)
def test_everything_that_a_fit_sees_alters_its_key(changes):
    assert not keys() & keys(**changes)


def test_the_text_of_an_own_function_alters_the_key():
    other = OwnFunction("soft_limit", SOFT_LIMIT + "# changed")
    assert not keys(options=OWN) & keys(options=replace(OWN, input_function=other))


def test_the_two_readings_of_the_second_order_share_their_common_fits():
    poles = keys(grid=OrdersOptions(nb=(1,), nk=(2,)))
    delay = keys(grid=OrdersOptions(nb=(1,), nk=(1,), nk_role="delay", nf=2))

    assert poles == delay


def whole_key(recordings=RECORDINGS, grid=GRID, options=QUICK):
    return identify_key(recordings, grid, options, IdentifyOptions())


def test_the_key_of_the_stage_holds_all_that_its_fits_see():
    whole = whole_key()
    assert whole == whole_key()
    assert whole != whole_key(RECORDINGS[:1])
    assert whole != whole_key(grid=OrdersOptions(nb=(1,), nk=(1,)))
    assert whole != whole_key(options=replace(QUICK, units=4))
    renamed = (replace(RECORDINGS[0], name="c"), RECORDINGS[1])
    assert whole != whole_key(renamed)


@pytest.mark.thorough
def test_more_parameters_never_fit_worse():
    grid = OrdersOptions(nb=(1, 2, 3), nk=(1, 2, 3))
    fits = identify_all(
        RECORDINGS[:1], grid, QUICK, RunSettings(MemoryStore(), Workers(1))
    )
    rmsd = np.array([fit.rmsd for fit in fits]).reshape(3, 3)
    assert np.all(np.diff(rmsd, axis=0) <= 1e-9 * rmsd[0, 0])
    assert np.all(np.diff(rmsd, axis=1) <= 1e-9 * rmsd[0, 0])


def test_more_parameters_never_worsen_the_linear_model_beside_a_fit(monkeypatch):
    """A search that begins anew for all orders may well end in a worse minimum."""
    found = {(1, 1): 3.0, (1, 2): 5.0, (2, 1): 2.0, (2, 2): float("nan")}

    def fit(recordings, orders, options, **how):
        alone = fit_alone(recordings, orders, options, **how)
        return replace(alone, linear_rmsd=found[orders.nb, orders.nf])

    fit_alone = identify.fit
    monkeypatch.setattr(identify, "fit", fit)
    grid = OrdersOptions(nb=(1, 2), nk=(1, 2))
    settings = RunSettings(MemoryStore(), Workers(1))
    fits = identify_all(RECORDINGS[:1], grid, QUICK, settings)
    assert [one.linear_rmsd for one in fits] == [3.0, 3.0, 2.0, 2.0]


def test_a_recording_that_cannot_be_fitted_gives_a_failed_fit_and_no_exception():
    impossible = Recording("flat", np.arange(30.0), np.zeros(30), 1e-3)
    fits = identify_all(
        [impossible], GRID, QUICK, RunSettings(MemoryStore(), Workers(1))
    )

    assert all(fit.status in ("failed", "converged", "stalled") for fit in fits)
