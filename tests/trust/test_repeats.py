"""How well the spread of repeats is known, by machines whose spread is known here."""

import numpy as np
import pytest
from scipy.stats import t

from hwid_cli.trust.repeats import (
    is_as_planned,
    repeat_spread,
    same_inputs,
    with_repeats,
)

N = 500
SHAPE = np.sin(np.arange(N) / 30.0)


def repeats(rng, count, machine, noise):
    """A machine whose gain differs, by `machine`, from recording to recording."""
    gains = 1.0 + machine * rng.standard_normal(count)
    return [g * SHAPE + noise * rng.standard_normal(N) for g in gains]


def test_spread_of_two_repeats_is_that_of_textbooks():
    one, other = SHAPE, SHAPE + 0.2

    found = repeat_spread([[one, other]])

    assert found.spread == pytest.approx(np.std([0.0, 0.2], ddof=1))
    assert found.noise == pytest.approx(0.0, abs=1e-12)
    # One repeat: Student's quantile of one degree of freedom, 6.3.
    assert found.half_width == pytest.approx(t.ppf(0.95, 1) * found.spread)


def test_spread_of_several_repeats_is_pooled_as_in_textbooks():
    rng = np.random.default_rng(1)
    groups = [rng.standard_normal((k, N)) + 5.0 * k for k in (3, 1, 4)]

    found = repeat_spread(groups)

    squares = sum(((g - g.mean(axis=0)) ** 2).sum() / N for g in groups)
    assert found.n_repeats == 5
    assert found.spread == pytest.approx(np.sqrt(squares / 5))


def test_where_noise_is_all_one_repeat_is_enough():
    found = repeat_spread([repeats(np.random.default_rng(2), 2, 0.0, 0.1)])

    # Five hundred samples tell a standard deviation to 5 %; so they do both here.
    assert found.spread == pytest.approx(0.1, rel=0.15)
    assert found.noise == pytest.approx(0.1, rel=0.15)
    assert with_repeats(found, 1).half_width > 0.8 * found.half_width


def test_band_of_so_many_repeats_holds_a_further_recording_in_nine_of_ten():
    rng = np.random.default_rng(3)
    held = []
    for _ in range(600):
        *known, new = repeats(rng, 5, 0.2, 0.01)
        band = repeat_spread([known])
        # Around the true mean, whose own error the band does not count.
        at = np.argmax(np.abs(SHAPE))
        width = band.half_width * np.abs(SHAPE[at]) / np.sqrt(np.mean(SHAPE**2))
        held.append(np.abs(new[at] - SHAPE[at]) < width)

    # 600 trials: a standard error of 0.012.
    assert np.mean(held) == pytest.approx(0.9, abs=0.04)


def test_more_repeats_let_the_band_shrink_by_less_and_less():
    found = repeat_spread([repeats(np.random.default_rng(4), 2, 0.2, 0.01)])

    widths = np.array([with_repeats(found, more).half_width for more in range(6)])

    assert np.all(np.diff(-np.log(widths)) > 0)
    assert np.all(np.diff(np.diff(-np.log(widths))) < 0)


def test_no_repeats_tell_nothing():
    assert repeat_spread([[SHAPE], [2.0 * SHAPE]]) is None


def test_equal_outputs_differ_by_nothing():
    found = repeat_spread([[SHAPE, SHAPE]])

    assert (found.spread, found.noise, found.half_width) == (0.0, 0.0, 0.0)


def test_inputs_of_another_size_length_or_none_at_all_are_no_repeats():
    inputs = [SHAPE, 1.03 * SHAPE, SHAPE[:-3], 1.01 * SHAPE[:-1], 0 * SHAPE, 0 * SHAPE]

    assert same_inputs(inputs) == [[0, 3], [1], [2], [4], [5]]


def test_a_measured_input_is_a_planned_one_however_noisy_and_a_little_late():
    rng = np.random.default_rng(4)
    step = np.where(np.arange(2000) < 100, 0.0, 3.0)
    noise = 6.0 * rng.standard_normal(2000)

    assert is_as_planned(step + noise, step)
    assert is_as_planned(np.roll(step, 20), step)
    assert is_as_planned(step[:1900], step)


@pytest.mark.parametrize("factor", [0.4, 1.6, -1.0])
def test_another_level_is_another_input(factor):
    step = np.where(np.arange(2000) < 100, 0.0, 3.0)

    assert not is_as_planned(factor * step, step)


def test_another_shape_is_another_input():
    time = np.arange(2000)
    sweep = 3.0 * np.sin(1e-5 * time**2)

    assert not is_as_planned(np.where(time < 100, 0.0, 3.0), sweep)
    assert not is_as_planned(sweep[::-1], sweep)
    assert not is_as_planned(np.zeros(2000), sweep)
