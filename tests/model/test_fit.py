import os
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from hwid_cli.model import scores
from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.model.plants import ORDERS, POLES, measured, options, plant

PAIRS = [
    ("none", "none"),
    ("saturation", "none"),
    ("none", "saturation"),
    ("dead_zone", "none"),
    ("dead_zone", "saturation"),
    ("polynomial", "none"),
    ("polynomial", "polynomial"),
    ("piecewise_linear", "none"),
    ("piecewise_linear", "piecewise_linear"),
]


# Each pair of maps once; the other rules of the initial state are slow.
RULES = ("zero", "steady", "estimated")


@pytest.mark.parametrize(
    ("input_map", "output_map", "initial_state"),
    [
        pytest.param(*pair, rule, marks=pytest.mark.slow if (row + k) % 3 else ())
        for row, pair in enumerate(PAIRS)
        for k, rule in enumerate(RULES)
    ],
)
def test_known_model_is_recovered_from_noise_free_data(
    input_map, output_map, initial_state
):
    recording = measured(plant(input_map, output_map, initial_state))
    result = fit([recording], ORDERS, options(input_map, output_map, initial_state))
    assert result.status == "converged"
    assert result.rmsd < 1e-6 * np.std(recording.output)
    np.testing.assert_allclose(
        np.sort_complex(result.poles), np.sort_complex(POLES), atol=1e-6
    )


@pytest.mark.parametrize(
    ("input_map", "output_map"),
    [
        ("none", "none"),
        pytest.param("saturation", "none", marks=pytest.mark.slow),
        ("dead_zone", "saturation"),
    ],
)
def test_noisy_estimates_lie_within_three_standard_errors(input_map, output_map):
    true = plant(input_map, output_map)
    deviations = []
    for seed in range(12):
        recording = measured(true, seed=seed, noise=0.05)
        result = fit([recording], ORDERS, options(input_map, output_map))
        uncertainty = result.uncertainty
        assert uncertainty.reason == ""
        got = np.concatenate(
            [
                result.model.input_map.parameters,
                result.model.output_map.parameters,
                result.model.numerator,
                result.model.denominator[1:],
            ]
        )
        expected = np.concatenate(
            [
                true.input_map.parameters,
                true.output_map.parameters,
                true.numerator,
                true.denominator[1:],
            ]
        )
        deviations.append((got - expected) / uncertainty.standard_errors)
    deviations = np.array(deviations)
    # Of a normal variable 0.27 % lies beyond three; four hold for every one of the
    # hundred drawn here.
    assert np.abs(deviations).max() < 4.0
    assert np.mean(np.abs(deviations) < 3.0) > 0.97
    # Standard errors that are far too large would pass the bounds above.
    assert 0.7 < np.sqrt(np.mean(deviations**2)) < 1.3


def test_noisy_fit_comes_down_to_the_noise():
    recording = measured(plant("piecewise_linear", "polynomial"), noise=0.02)
    result = fit([recording], ORDERS, FitOptions(initial_state="zero"))
    noise = 0.02 * np.std(recording.output)
    # 44 parameters of 1500 samples take 1.5 % off the residual, a map between straight
    # lines adds a little.
    assert result.rmsd == pytest.approx(noise, rel=0.1)


def test_linear_special_case_is_scipys_filter():
    rng = np.random.default_rng(5)
    b, f = [0.0, 0.2, 0.1], [1.0, -1.2, 0.5]
    u = rng.standard_normal(800)
    recording = Recording("r", u, signal.lfilter(b, f, u), 1e-3)
    result = fit([recording], Orders(2, 2, 1), options("none", "none"))
    np.testing.assert_allclose(result.model.numerator, b[1:], atol=1e-9)
    np.testing.assert_allclose(result.model.denominator, f, atol=1e-9)
    # Both are rounding error, computed in scaled and in true units.
    assert max(result.linear_rmsd, result.rmsd) < 1e-12


@pytest.mark.parametrize(
    ("orders", "b", "f"),
    [
        (Orders(3, 0, 1), [0.0, 0.5, 0.2, 0.1], [1.0]),
        (Orders(1, 0, 0), [2.0], [1.0]),
        (Orders(2, 1, 0), [0.5, 0.3], [1.0, -0.7]),
        (Orders(1, 3, 5), [0.0] * 5 + [0.3], [1.0, -0.5, 0.2, -0.1]),
    ],
)
@pytest.mark.parametrize("initial_state", ["zero", "estimated"])
def test_orders_at_their_lower_ends_are_fitted(orders, b, f, initial_state):
    u = np.random.default_rng(0).standard_normal(400)
    recording = Recording("r", u, signal.lfilter(b, f, u), 1e-3)
    result = fit([recording], orders, options("none", "none", initial_state))
    assert result.rmsd < 1e-9
    assert result.poles.size == orders.nf


@pytest.fixture(scope="module")
def recording():
    return measured(plant("dead_zone", "polynomial"), noise=0.02)


@pytest.fixture(scope="module")
def result(recording):
    return fit([recording], ORDERS, FitOptions(units=5))


def test_rmsd_and_fit_percent_are_those_of_the_returned_model(recording, result):
    simulated = simulate(result.model, recording.input)
    # The same model in other units: rounding.
    assert result.rmsd == pytest.approx(scores.rmsd(recording.output, simulated), 1e-9)
    assert result.fit_percent == pytest.approx(
        scores.fit_percent(recording.output, simulated), rel=1e-9
    )


@pytest.mark.parametrize("scale", [1e-9, 1e6])
def test_units_of_the_data_do_not_change_the_fit(recording, result, scale):
    scaled = Recording("r", recording.input, recording.output * scale, 1e-3)
    second = fit([scaled], ORDERS, FitOptions(units=5))
    # Scaling rounds the data, and the search ends within 1e-5 of the optimum's cost.
    assert second.rmsd == pytest.approx(result.rmsd * scale, rel=1e-4)


def test_same_data_give_the_same_numbers(recording, result):
    again = fit([recording], ORDERS, FitOptions(units=5))
    assert again.rmsd == result.rmsd
    np.testing.assert_array_equal(again.model.denominator, result.model.denominator)


@pytest.mark.parametrize("kind", ["dead_zone", "saturation", "polynomial"])
def test_a_map_that_is_not_there_never_makes_the_fit_worse(kind):
    u = np.repeat(np.random.default_rng(0).standard_normal(20), 20)
    y = signal.lfilter([0, 0, 0, 0.2], [1.0, -0.8], np.clip(u, -0.5, 0.4))
    recording = Recording("r", u, y, 1e-3)
    without = fit([recording], Orders(1, 1, 3), options("none", "none"))
    with_map = fit([recording], Orders(1, 1, 3), options(kind, "none"))
    assert with_map.rmsd <= without.rmsd * (1.0 + 1e-12)


def test_search_that_ends_at_the_noise_says_converged():
    u = np.repeat(np.random.default_rng(3).standard_normal(20), 20)
    noise = 1e-3 * np.random.default_rng(4).standard_normal(400)
    y = signal.lfilter([0, 0, 0, 0.2], [1.0, -0.8], u) + 0.5 + noise
    kind = FitOptions(input_map="none", output_map="polynomial", degree=1)
    result = fit([Recording("r", u, y, 1e-3)], Orders(1, 1, 3), kind)
    assert result.rmsd == pytest.approx(1e-3, rel=0.1)
    assert result.status == "converged"


def constant(value):
    return np.full(200, value)


@pytest.mark.parametrize(
    ("u", "y", "reason"),
    [
        (np.arange(30.0), np.arange(30.0), "30 samples cannot determine"),
        (constant(2.0), np.arange(200.0), "the input is constant at 2"),
        (np.arange(200.0), constant(3.0), "the output is constant at 3"),
    ],
)
def test_data_that_cannot_determine_a_model_give_a_failed_fit(u, y, reason):
    result = fit([Recording("r", u, y, 1.0)], ORDERS, FitOptions())
    assert result.status == "failed"
    assert result.model is None
    assert np.isnan(result.rmsd)
    assert reason in result.message


def test_delays_that_leave_nothing_give_a_failed_fit():
    rng = np.random.default_rng(0)
    pair = [Recording(name, *rng.standard_normal((2, 300)), 1.0) for name in "ab"]
    asked = FitOptions("none", "none", delays=(350, 900), join="experiments")
    alone = fit(pair[:1], Orders(1, 1, 1), asked)
    joined = fit(pair, Orders(1, 1, 1), asked)

    assert "300 samples cannot determine a model that needs more than" in alone.message
    assert "a delay of 350 samples leaves nothing of a record of 300" in joined.message


@pytest.mark.thorough
def test_fit_of_pure_noise_is_a_value_and_stable():
    rng = np.random.default_rng(0)
    recording = Recording("r", *rng.standard_normal((2, 300)), 1.0)
    result = fit([recording], Orders(4, 6, 1), FitOptions(units=5))
    assert result.status in ("converged", "iteration_limit", "stalled")
    assert (np.abs(result.poles) < 1.0).all()
    assert result.is_stable


def test_undetermined_parameters_have_no_standard_error_and_the_reason_names_them():
    # The input never leaves one segment of the true map and one of a fitted map of two.
    rng = np.random.default_rng(0)
    u = np.where(rng.random(600) < 0.5, 1.0, 2.0)
    y = signal.lfilter([0.0, 0.5], [1.0, -0.5], u) + 1e-3 * rng.standard_normal(600)
    result = fit(
        [Recording("r", u, y, 1.0)],
        Orders(1, 1, 1),
        options("piecewise_linear", "none", free_break_points=False),
    )
    inner = [result.uncertainty.names.index(f"input_map.value[{i}]") for i in (1, 2)]
    assert np.isnan(result.uncertainty.standard_errors[inner]).all()
    assert "input_map.value[1]" in result.uncertainty.reason


def test_recordings_of_one_fit_must_share_their_sample_time():
    u = np.arange(200.0)
    with pytest.raises(ValueError, match="share their sample time"):
        fit(
            [Recording("a", u, u, 1.0), Recording("b", u, u, 2.0)], ORDERS, FitOptions()
        )


def public_suite() -> Path:
    """Benchmark plants beside the project, if they are there."""
    data = Path(os.environ.get("HWID_REALDATA", "../shared/realdata"))
    return data.parent / "peers" / "hw_suite.npz"


@pytest.mark.skipif(
    not public_suite().exists(),
    reason="hw_suite.npz not found: put it into a folder peers beside HWID_REALDATA",
)
@pytest.mark.slow
def test_random_plants_reach_their_noise_floor():
    suite = np.load(public_suite())
    percent = []
    for k in range(20):
        nb, nf, nk, *_ = suite[f"meta_{k}"].astype(int)
        recording = Recording("r", suite[f"u_train_{k}"], suite[f"y_train_{k}"], 1.0)
        result = fit([recording], Orders(nb, nf, nk), FitOptions())
        simulated = simulate(result.model, suite[f"u_test_{k}"])
        percent.append(scores.fit_percent(suite[f"y_test_{k}"], simulated))
    # The noise floor is 99.00 % on each.
    assert np.median(percent) > 98.9
    assert np.min(percent) > 98.0


@pytest.mark.parametrize("seed", [0, 7, 9])
def test_dead_zones_that_swallow_a_start_cost_no_fit(seed):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 1.0, 60), rng.integers(5, 40, 60))[:300]
    f = np.poly([0.92 + 0.1j, 0.92 - 0.1j]).real
    b = np.array([0.0, 1.0, 0.6]) / 1.6 * f.sum()
    x = signal.lfilter(b, f, u - np.clip(u, -0.1, 0.2))
    y = x - np.clip(x, -0.1, 0.1) + 0.003 * rng.standard_normal(u.size)
    # Far from zero: starts whose output never leaves the zone.
    recording = Recording("r", u + 30.0, y, 1e-3)
    result = fit([recording], Orders(2, 2, 1), FitOptions("dead_zone", "dead_zone"))

    assert result.rmsd < 1.2 * 0.003
