import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.outliers import find_outliers, replace_outliers

PAIR = 0.95 * np.exp(1j * np.array([0.2, -0.2]))


def noise(count, seed=0):
    return np.random.default_rng(seed).standard_normal(count)


def moving(count, seed=0, poles=PAIR, hold=50):
    """Output of a block at levels that it is held at."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 1.0, count // hold + 1), hold)[:count]
    f = np.real(np.poly(poles))
    return 100.0 * lfilter([0.0, f.sum()], f, u)


@pytest.mark.parametrize("length", [1, 5])
def test_spikes_and_short_bursts_stand_out_and_nothing_else(length):
    simulated, residual = 0.3 * moving(4000), noise(4000)
    firsts = np.arange(50, 3900, 200)
    places = (firsts[:, np.newaxis] + np.arange(length)).ravel()
    residual[places] += 20.0 * np.repeat(np.where(firsts % 400 < 200, 1, -1), length)

    found = find_outliers(simulated + residual, simulated)
    assert np.flatnonzero(found).tolist() == places.tolist()


def test_a_fifth_of_all_samples_may_stand_out():
    simulated, residual = moving(3000), noise(3000)
    is_bad = np.random.default_rng(1).random(3000) < 0.2
    residual[is_bad] += 100.0 * np.sign(residual[is_bad])
    found = find_outliers(simulated + residual, simulated)

    # Here and there half of the samples nearby are bad, and then nobody can tell.
    assert np.mean(found[is_bad]) > 0.9
    assert np.mean(found[~is_bad]) < 0.01


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("radius", [0.95, 0.6, 0.3])
def test_what_a_model_leaves_of_a_response_is_no_outlier(radius, seed):
    """Rests of nothing but noise, and transients a thousand times as large."""
    poles = radius / 0.95 * PAIR
    simulated = moving(2000, seed, poles, hold=80)
    misfit = 0.2 * (moving(2000, seed, 0.9 * poles, hold=80) - simulated)
    misfit += 1e-3 * np.max(np.abs(misfit)) * noise(2000, seed)

    assert np.sum(find_outliers(simulated + misfit, simulated)) <= 2


def test_a_stepped_sensor_flickers_without_being_an_outlier():
    exact = moving(3000, poles=[0.5])
    output = np.round(exact + 0.3 * noise(3000))

    assert not find_outliers(output, exact).any()
    output[1234] += 8.0
    assert np.flatnonzero(find_outliers(output, exact)).tolist() == [1234]


@pytest.mark.parametrize("count", [1, 2, 15, 100])
def test_short_records_and_perfect_models_have_no_outlier(count):
    output = noise(count)

    assert not find_outliers(output, output).any()
    assert not find_outliers(np.zeros(count), np.zeros(count)).any()


def test_outliers_are_replaced_by_the_model_and_what_it_leaves_nearby():
    simulated = np.sin(0.01 * np.arange(2000))
    clean = simulated + 0.3 + 0.01 * noise(2000)
    output = clean.copy()
    output[[7, 700, 1999]] += [5.0, -5.0, 5.0]
    repaired, count = replace_outliers(output, simulated)

    assert count == 3
    assert np.max(np.abs(repaired - clean)) < 0.05
    assert np.sum(repaired != output) == 3


def test_a_simulation_that_is_not_finite_tells_nothing():
    output = noise(100)
    repaired, count = replace_outliers(output, np.full(100, np.nan))

    assert count == 0
    assert repaired is output
