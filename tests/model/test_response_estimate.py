import numpy as np
import pytest
from scipy import signal

from hwid_cli.model.response_estimate import estimate_response
from hwid_cli.records.recordings import Recording


def levels(n_samples, seed, hold=7):
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-1, 1, n_samples // hold + 1), hold)[:n_samples]


def recording(poles, delay, noise, seed=1, n_samples=1500, bend=np.asarray):
    f = np.real(np.poly(poles))
    u = levels(n_samples, seed)
    y = signal.lfilter(np.append(np.zeros(delay), f.sum()), f, bend(u))
    y = y + noise * np.std(y) * np.random.default_rng(seed + 1).standard_normal(u.size)
    return Recording("r", u, y, 1e-3)


PAIR = 0.93 * np.exp(np.array([0.25j, -0.25j]))


@pytest.mark.parametrize("noise", [0.0, 0.005])
@pytest.mark.parametrize("delay", [0, 1, 4])
@pytest.mark.parametrize("poles", [[0.9], PAIR])
def test_delay_and_poles_of_a_known_plant_are_found(poles, delay, noise):
    found = estimate_response(recording(poles, delay, noise))

    assert found.delay == delay
    assert found.n_poles == len(poles)


def test_a_static_map_does_not_move_the_delay():
    found = estimate_response(recording(PAIR, 3, 0.01, bend=np.tanh))

    assert found.delay == 3


def test_an_output_that_does_not_answer_shows_no_delay():
    noise = np.random.default_rng(0).standard_normal(1500)
    found = estimate_response(Recording("r", levels(1500, 3), noise, 1e-3))

    assert found.delay == -1
    assert found.n_poles == 0


def test_a_short_recording_says_nothing():
    found = estimate_response(recording([0.9], 1, 0.0, n_samples=120))

    assert (found.delay, found.n_poles) == (-1, 0)


def test_hankel_values_of_one_pole_are_one():
    found = estimate_response(recording([0.9], 1, 0.0))

    # A response p^k has a matrix of rank one; the rest is rounding of the estimate.
    assert found.hankel[0] == 1.0
    assert found.hankel[1] < 1e-4
