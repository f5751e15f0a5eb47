import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording

ORDERS = Orders(1, 2, 1)
TEN = FitOptions(units=10)


def response(u, f, g):
    return g(lfilter([0.0, 0.3], [1.0, -1.2, 0.5], f(u)))


def recording(f, g, *, noise, seed=0, samples=1000):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-2.0, 2.0, samples // 10), 10)
    y = response(u, f, g)
    return Recording("r", u, y + noise * rng.standard_normal(u.size), 1.0)


def same(v):
    return v


def limited(v):
    return np.clip(v, -1.0, 0.8)


def n_bends(static_map):
    return static_map.parameters.size // 2 - 2


def test_maps_of_a_linear_plant_are_straight():
    model = fit([recording(same, same, noise=0.02)], ORDERS).model

    assert (n_bends(model.input_map), n_bends(model.output_map)) == (0, 0)


@pytest.mark.parametrize(
    ("f", "g", "straight", "bent"),
    [
        (limited, same, "output_map", "input_map"),
        (same, np.tanh, "input_map", "output_map"),
    ],
)
def test_only_the_side_that_bends_has_break_points(f, g, straight, bent):
    model = fit([recording(f, g, noise=0.01)], ORDERS).model

    assert n_bends(getattr(model, straight)) == 0
    assert n_bends(getattr(model, bent)) >= 1


def test_limits_need_two_break_points_and_few_more():
    model = fit([recording(limited, same, noise=0.01)], ORDERS).model

    assert 2 <= n_bends(model.input_map) <= 4
    # At the corners: between the levels of 100 draws there are 0.04 on average.
    points = model.input_map.parameters[: n_bends(model.input_map) + 2]
    for corner in (-1.0, 0.8):
        assert np.min(np.abs(points - corner)) < 0.15


def test_a_size_that_is_given_stays():
    one = recording(same, same, noise=0.02)
    model = fit([one], ORDERS, TEN).model
    half = fit([one], ORDERS, FitOptions(input_units=3)).model

    assert (n_bends(model.input_map), n_bends(model.output_map)) == (10, 10)
    assert n_bends(half.input_map) == 3
    assert n_bends(half.output_map) == 0


def test_what_is_left_out_costs_less_than_its_parameters_weigh():
    one = recording(np.tanh, limited, noise=0.02)
    full, found = (fit([one], ORDERS, options) for options in (TEN, FitOptions()))
    maps = (found.model.input_map, found.model.output_map)
    fewer = 20 - sum(map(n_bends, maps))
    n = one.n_samples

    assert fewer > 5
    # Both are of the same search: what the smaller maps cost is weighed step by step.
    assert found.rmsd**2 < full.rmsd**2 * np.exp(2.0 * fewer * np.log(n) / n)


def test_fewer_break_points_predict_new_inputs_better():
    rng = np.random.default_rng(99)
    u = np.repeat(rng.uniform(-2.0, 2.0, 200), 10)
    ratios = []
    for seed in range(8):
        one = recording(limited, same, noise=0.05, seed=seed, samples=400)
        errors = [
            np.std(
                simulate(fit([one], ORDERS, options).model, u)
                - response(u, limited, same)
            )
            for options in (FitOptions(), TEN)
        ]
        ratios.append(errors[0] / errors[1])

    # Geometric mean of eight draws.
    assert np.exp(np.mean(np.log(ratios))) < 0.9


def test_data_without_noise_keep_what_they_tell():
    one = recording(limited, np.tanh, noise=0.0)
    full, found = (fit([one], ORDERS, options) for options in (TEN, FitOptions()))

    # Schwarz's weight of all twenty break-points is a factor of 1.15 on the deviation.
    assert found.rmsd < 1.15 * full.rmsd


def test_outliers_do_not_make_a_map_simpler():
    clean = recording(limited, np.tanh, noise=0.01)
    rng = np.random.default_rng(4)
    y = clean.output + 3.0 * (rng.random(clean.n_samples) < 0.05)
    robust = FitOptions(loss="huber")
    found = fit([Recording("gross", clean.input, y, 1.0)], ORDERS, robust).model

    # Weighed against the losses of outliers, even the limits would not be worth it.
    assert n_bends(found.input_map) >= 2
    assert n_bends(found.output_map) >= 2


def test_larger_orders_stay_as_good_as_those_they_contain():
    one = recording(limited, np.tanh, noise=0.02)
    small = fit([one], Orders(1, 1, 1))
    large = fit([one], ORDERS, contained=[small.model])

    assert large.rmsd <= small.rmsd
