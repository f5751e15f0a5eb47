import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from hwid_cli.model import linear_block

NUMERATOR = np.array([0.4, -0.1, 0.2])
DENOMINATOR = np.real(np.poly([0.9, 0.5 + 0.3j, 0.5 - 0.3j]))


def white(n, seed=0):
    return np.random.default_rng(seed).standard_normal(n)


def test_filter_agrees_with_scipy():
    u = white(300)
    expected = signal.lfilter(np.r_[np.zeros(2), NUMERATOR], DENOMINATOR, u)
    got = linear_block.filtered(u, NUMERATOR, DENOMINATOR, 2)
    # Same recursion, other order of the sums.
    np.testing.assert_allclose(got, expected, atol=1e-13)


def test_first_order_step_response_has_its_closed_form():
    t = np.arange(30)
    got = linear_block.filtered(np.ones(30), np.array([0.2]), np.array([1, -0.8]), 1)
    np.testing.assert_allclose(got, 1.0 - 0.8**t, rtol=1e-13)


@given(delay=st.integers(0, 12))
def test_nk_delays_by_nk_samples(delay):
    u = white(40)
    undelayed = linear_block.filtered(u, NUMERATOR, DENOMINATOR, 0)
    delayed = linear_block.filtered(u, NUMERATOR, DENOMINATOR, delay)
    np.testing.assert_array_equal(delayed[:delay], 0.0)
    np.testing.assert_array_equal(delayed[delay:], undelayed[: 40 - delay])


def test_steady_start_answers_a_constant_with_its_static_gain():
    gain = linear_block.static_gain(NUMERATOR, DENOMINATOR)
    got = linear_block.filtered(
        np.full(20, 3.0), NUMERATOR, DENOMINATOR, 2, steady=True
    )
    np.testing.assert_allclose(got, 3.0 * gain, rtol=1e-12)


def test_steady_start_equals_a_long_wait_at_the_first_value():
    u = white(50) + 2.0
    waited = linear_block.filtered(
        np.r_[np.full(2000, u[0]), u], NUMERATOR, DENOMINATOR, 1
    )
    got = linear_block.filtered(u, NUMERATOR, DENOMINATOR, 1, steady=True)
    # The slowest pole, 0.9, leaves 0.9^2000 of the transient: nothing.
    np.testing.assert_allclose(got, waited[2000:], atol=1e-12)


def test_free_response_reproduces_any_past():
    past, u = white(60, seed=1), white(80, seed=2)
    order = 3
    through = linear_block.filtered(np.r_[past, u], NUMERATOR, DENOMINATOR, 1)[60:]
    forced = linear_block.filtered(u, NUMERATOR, DENOMINATOR, 1)
    # C follows from the first samples of the difference: C = F * difference.
    coefficients = np.convolve(DENOMINATOR, (through - forced)[:order])[:order]
    free = linear_block.free_response(coefficients, DENOMINATOR, 80)
    np.testing.assert_allclose(forced + free, through, atol=1e-12)


def test_poles_are_sorted_and_scipy_agrees():
    _, expected, _ = signal.tf2zpk(NUMERATOR, DENOMINATOR)
    got = linear_block.poles(DENOMINATOR)
    assert (np.diff(np.abs(got)) <= 1e-12).all()
    np.testing.assert_allclose(np.sort_complex(got), np.sort_complex(expected))


@given(
    radii=st.lists(st.floats(0.05, 1.6), min_size=1, max_size=6),
    angles=st.lists(st.floats(0.0, 3.1), min_size=6, max_size=6),
)
def test_stability_test_agrees_with_the_roots(radii, angles):
    found = []
    for radius, angle in zip(radii, angles, strict=False):
        # A pole on the unit circle itself may fall on either side by rounding.
        radius = radius if abs(radius - 1.0) > 1e-3 else 0.9
        found += [radius * np.exp(1j * angle), radius * np.exp(-1j * angle)]
    denominator = np.real(np.poly(found))
    assert linear_block.is_stable(denominator) == (np.abs(found).max() < 1.0)


def test_reflection_makes_a_block_stable_and_keeps_stable_poles():
    unstable = np.real(np.poly([1.25, 0.5]))
    got = np.roots(linear_block.reflected(unstable, 0.99))
    np.testing.assert_allclose(np.sort(got), [0.5, 0.8], rtol=1e-12)
    far = linear_block.reflected(np.array([1.0, -1.0]), 0.99)
    np.testing.assert_allclose(far, [1.0, -0.99])


def test_static_gain_is_infinite_for_an_integrator():
    assert linear_block.static_gain(np.ones(1), np.array([1.0, -1.0])) == np.inf


@pytest.mark.parametrize("count", [0, 1, 4, 10])
def test_difference_basis_turns_powers_of_differences_into_delays(count):
    matrix = linear_block.difference_basis(count)
    for j in range(count):
        expected = np.zeros(count)
        power = np.array([1.0])
        for _ in range(j):
            power = np.convolve(power, [1.0, -1.0])
        expected[: j + 1] = power
        np.testing.assert_array_equal(matrix[:, j], expected)
