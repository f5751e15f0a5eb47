"""Causes of a gap in the measuring chain: repeats, and interpolation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.diagnosis.causes import (
    left_over,
    whiteness_but_for_neighbours,
    without_damage,
    without_repeats,
)
from hwid_cli.diagnosis.sentences import left_out
from hwid_cli.diagnosis.whiteness import whiteness
from hwid_cli.records.drive import Controller
from tests.diagnosis.small_drive import (
    NOISE,
    STEP_S,
    N,
    problem,
    recordings,
    white,
)


def repeated(values, rows):
    """Values in which some samples repeat the one before."""
    found = values.copy()
    found[rows] = found[rows - 1]
    return found


# Far enough apart that none follows another.
ROWS = np.arange(57, 380, 37)


def test_single_repeats_of_the_output_are_not_evaluated():
    (given, *_) = recordings()
    of = problem([replace(given, output=repeated(given.output, ROWS))])
    (found,) = without_repeats(of).signals
    assert found.n_evaluated == N - ROWS.size
    np.testing.assert_array_equal(np.setdiff1d(np.arange(N), found.evaluated), ROWS)
    np.testing.assert_array_equal(found.driven_by, given.input)


def test_single_repeats_of_the_input_are_the_middle_of_their_neighbours():
    given = recordings()[5]
    of = problem([replace(given, input=repeated(given.input, ROWS))])
    (found,) = without_repeats(of).signals
    assert found.n_evaluated == N
    expected = given.input.copy()
    expected[ROWS] = 0.5 * (given.input[ROWS - 1] + given.input[ROWS + 1])
    np.testing.assert_array_equal(found.driven_by, expected)


def moving():
    """A recording whose input and output change with every sample."""
    time = STEP_S * np.arange(N)
    (given, *_) = recordings()
    return replace(given, input=np.sin(40 * time + 0.1), output=np.cos(31 * time + 0.2))


@pytest.mark.parametrize("hold", [2, 3, 10])
def test_an_input_that_is_held_over_samples_is_left_alone(hold):
    given = moving()
    held = np.repeat(given.input[::hold], hold)[:N]
    of = problem([replace(given, input=held)])
    assert without_repeats(of).signals == of.signals


@pytest.mark.parametrize("levels", [20, 60, 150])
def test_a_quantised_output_is_left_alone(levels):
    given = moving()
    steps = np.round(given.output * levels) / levels
    assert np.count_nonzero(np.diff(steps) == 0) > 10
    of = problem([replace(given, output=steps)])
    assert without_repeats(of).signals == of.signals


def test_a_rest_of_the_input_is_no_damage():
    of = problem(recordings())
    assert without_repeats(of).signals == of.signals


def test_one_repeat_in_thousands_of_samples_may_be_chance():
    rng = np.random.default_rng(1)
    long = replace(moving(), input=rng.random(5000), output=rng.random(5000))
    of = problem([replace(long, output=repeated(long.output, np.array([2500])))])
    assert without_repeats(of).signals == of.signals


# Eleven of 600 such signals have more repeats than moves by one step; these are three.
@pytest.mark.parametrize("seed", [67, 95, 152])
def test_repeats_of_a_noisy_signal_on_a_grid_may_be_chance(seed):
    noise = np.random.default_rng(seed).standard_normal(1200)
    read = np.round(10 * np.sin(0.02 * np.arange(1200)) + 0.3 * noise, 2)
    of = problem([replace(moving(), input=read, output=noise)])
    assert without_repeats(of).signals == of.signals


@pytest.fixture(scope="module")
def of():
    return problem()


def linked(seed, share=1.0):
    """White noise, read between uneven samples by straight lines."""
    rng = np.random.default_rng(seed)
    parts = []
    for _ in range(9):
        noise = NOISE * rng.standard_normal(N + 2)
        late = share * rng.uniform(-0.5, 0.5, N)
        beside = np.where(late > 0, noise[2:], noise[:-2])
        parts.append((1 - np.abs(late)) * noise[1:-1] + np.abs(late) * beside)
    return parts


@pytest.mark.parametrize("seed", range(4))
def test_noise_that_interpolation_has_linked_is_noise(of, seed):
    parts = linked(seed)
    noise = white()
    assert whiteness(parts, noise) > 1
    left, cause = left_over(parts, of, [of.drive] * len(of.signals), noise)
    assert (left < 1, cause) == (True, "interpolation")


@pytest.mark.parametrize(
    "taps",
    [
        # Neighbours go together more than interpolation makes them.
        [1.0, 1.0],
        # Differences: neighbours go apart.
        [1.0, -0.3],
        # Slow noise: so do samples further apart.
        [1.0, 0.3, 0.3],
        # Nothing between neighbours, but between others.
        [1.0, 0, 0, 0, 0.3],
    ],
)
def test_noise_that_is_linked_otherwise_is_something(of, taps):
    rng = np.random.default_rng(7)
    parts = [lfilter(taps, [1.0], NOISE * rng.standard_normal(N)) for _ in range(9)]
    left, cause = left_over(parts, of, [of.drive] * len(of.signals), white())
    assert (left > 1, cause) == (True, "")


def test_where_the_noise_is_coloured_already_nothing_is_linked():
    coloured = replace(white(), is_coloured=True, whitening=(1.0, -0.3))
    assert whiteness_but_for_neighbours(linked(1), coloured) == np.inf


def test_samples_that_stand_out_alone_do_not_count():
    (given, *_) = recordings()
    output, current = given.output.copy(), given.input.copy()
    output[[90, 213]] += 40 * NOISE
    current[300] += 5.0
    quiet = recordings()[1]
    found = without_damage(
        problem([replace(given, output=output, input=current), quiet])
    )
    one, other = found.signals
    np.testing.assert_array_equal(np.setdiff1d(np.arange(N), one.evaluated), [90, 213])
    assert (found.n_damaged, found.damaged) == (2, (given.name,))
    np.testing.assert_allclose(one.driven_by, given.input, atol=0.05)
    assert other.n_evaluated == N
    assert left_out(found)[0].startswith(f"2 samples of {given.name} stand out alone")
    assert left_out(without_damage(problem([quiet]))) == ()


def test_under_a_controller_damage_is_in_the_command_and_counts():
    (given, *_) = recordings()
    current = given.input.copy()
    current[300] += 5.0
    given = replace(given, input=current, reference=given.output)
    of = problem([given], controller=Controller(20.0, 30.0))
    assert without_damage(of) is of


def messages(seed, n=4000):
    """Moves with long rests between, of a noisy encoder whose steps are half its noise.

    At rest a third of the readings repeat the one before.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(n)
    moves = np.where((t // 500) % 2 == 1, np.sin(np.pi * (t % 500) / 500), 0.0)
    position = 2e-4 * np.cumsum(moves)
    reading = 1e-6 * np.round((position + 1e-6 * rng.standard_normal(n)) / 1e-6)
    current = 1e-3 * np.round((moves + 4e-3 * rng.standard_normal(n)) / 1e-3)
    lost = np.sort(rng.choice(np.arange(10, n - 10, 3), 24, replace=False))
    return current, reading, lost


def of_messages(current, reading):
    given = recordings()[0]
    return problem([replace(given, input=current, output=reading)])


@pytest.mark.parametrize("seed", range(4))
def test_messages_that_a_bus_has_lost_are_found_by_the_motion(seed):
    current, reading, lost = messages(seed)
    of = of_messages(repeated(current, lost), repeated(reading, lost))
    (found,) = without_repeats(of).signals
    unused = np.setdiff1d(np.arange(reading.size), found.evaluated)
    moving = lost[np.abs(reading[lost + 1] - reading[lost - 1]) > 4e-5]

    assert moving.size >= 5
    assert set(moving) <= set(unused) <= set(lost)
    # Where it moves, a current that was lost with the message is a straight line.
    middle = 0.5 * (current[moving - 1] + current[moving + 1])
    np.testing.assert_allclose(found.driven_by[moving], middle, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_a_bus_that_loses_nothing_is_taken_as_it_is(seed):
    current, reading, _ = messages(seed)
    of = of_messages(current, reading)
    assert without_repeats(of).signals == of.signals


def test_a_machine_that_sticks_for_a_sample_has_lost_none():
    """It does not make up for what it has not moved."""
    n = 3000
    speed = 1e-4 * (1.2 + np.sin(np.arange(n) / 200))
    speed[np.arange(100, n - 100, 150)] = 0.0
    reading = np.cumsum(speed) + 1e-6 * np.sin(np.arange(n) ** 2)
    for row in np.arange(100, n - 100, 150):
        reading[row] = reading[row - 1]
    of = of_messages(np.sin(np.arange(n) / 200.0), reading)
    (found,) = without_repeats(of).signals
    assert found.n_evaluated == n
