import numpy as np
import pytest

from hwid_cli.stages.report import detail_window

TIME = np.arange(1000)


def step(onset, length):
    return np.clip((TIME - onset) / length, 0.0, 1.0)


def test_the_window_holds_the_whole_way_of_a_step():
    output = step(300, 80)
    first, end = detail_window(output, output, is_periodic=False)

    assert first < 300
    assert end > 380
    assert end - first < 250


def test_the_window_of_a_sine_holds_three_periods():
    sine = np.sin(2 * np.pi * TIME / 100)
    first, end = detail_window(sine, sine, is_periodic=True)

    # The period is found from crossings, which lie between samples.
    assert end - first == pytest.approx(300, abs=2)


def test_the_window_is_at_most_half_of_the_recording():
    drift = TIME / 1000.0
    first, end = detail_window(drift, drift, is_periodic=False)

    assert end - first == 500


def test_a_step_at_the_end_moves_the_window_forward():
    output = step(985, 10)
    first, end = detail_window(output, output, is_periodic=False)

    assert end == 1000
    assert end - first >= 40


@pytest.mark.parametrize("size", [3, 30])
def test_a_short_or_constant_recording_is_shown_as_it_is(size):
    assert detail_window(np.zeros(size), np.ones(size), is_periodic=True) == (0, size)
