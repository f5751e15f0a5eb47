import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.drive.sensors import DAMAGE_DISTANCE, damage_samples, read_sensor


def read(true, seed=1, *, offset=0.0, noise=0.0, resolution=0.0):
    return read_sensor(
        true,
        offset=offset,
        noise=noise,
        resolution=resolution,
        rng=np.random.default_rng(seed),
    )


def test_ideal_sensor_shows_the_truth():
    true = np.linspace(-1, 1, 11)
    np.testing.assert_array_equal(read(true), true)


def test_noise_and_offset_have_the_stated_size():
    reading = read(np.zeros(40_000), offset=0.5, noise=0.1)
    # Three standard errors: of a mean 0.1 / 200, of a deviation 0.1 / sqrt(80000).
    assert abs(np.mean(reading) - 0.5) < 3 * 0.0005
    assert abs(np.std(reading) - 0.1) < 3 * 0.00036


def test_readings_are_multiples_of_the_resolution_nearest_to_the_signal():
    true = np.linspace(-0.01, 0.01, 1000)
    reading = read(true, resolution=1e-4)
    counts = reading / 1e-4
    # Division by the resolution rounds once.
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-12)
    assert np.max(np.abs(reading - true)) <= 0.5e-4 * (1 + 1e-9)


@given(seed=st.integers(0, 10_000), n=st.integers(0, 400), most=st.integers(0, 5))
def test_damaged_samples_are_few_single_visible_and_listed(seed, n, most):
    damaged, indices = damage_samples(
        np.zeros(n), most, 8.0, np.random.default_rng(seed)
    )
    np.testing.assert_array_equal(np.flatnonzero(damaged), indices)
    assert len(indices) <= most
    assert all(4.0 <= abs(damaged[index]) <= 8.0 for index in indices)


def test_damaged_samples_keep_their_distance_from_each_other_and_the_ends():
    for seed in range(300):
        rng = np.random.default_rng(seed)
        _, indices = damage_samples(np.zeros(400), 5, 8.0, rng)
        assert np.min(np.diff([0, *indices, 399])) >= DAMAGE_DISTANCE


def test_every_count_up_to_the_largest_occurs():
    counts = {
        len(damage_samples(np.zeros(1000), 3, 1.0, np.random.default_rng(seed))[1])
        for seed in range(60)
    }
    assert counts == {0, 1, 2, 3}


def test_damage_leaves_the_given_reading_alone():
    reading = np.zeros(1000)
    damage_samples(reading, 3, 1.0, np.random.default_rng(0))
    np.testing.assert_array_equal(reading, 0.0)
