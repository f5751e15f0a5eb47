import numpy as np
import pytest

from hwid_cli.data import column_signs as signs


@pytest.fixture
def plant():
    """An input that holds its levels, and what a slow plant makes of it."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.uniform(-1, 1, 60), 10)
    y = np.zeros(600)
    for k in range(1, 600):
        y[k] = 0.9 * y[k - 1] + 0.1 * u[k - 1]
    return u, y + 1e-3 * rng.standard_normal(600)


def test_the_answer_is_told_from_its_cause(plant):
    u, y = plant
    assert signs.answers(u, y) > 0.5
    assert signs.answers(y, u) < -0.5


def test_a_clock_may_jitter_and_a_signal_is_none():
    rng = np.random.default_rng(1)
    time = 0.01 * np.arange(200) + 1e-3 * rng.uniform(-1, 1, 200)
    found = signs.clock_of(time)

    assert found.step == pytest.approx(0.01, rel=0.1)
    assert 0.01 < found.jitter < 0.25
    assert signs.clock_of(rng.standard_normal(200)) is None
    assert signs.clock_of(-time) is None
    assert signs.clock_of(np.r_[time, np.nan]) is None


def test_a_column_in_other_units_is_the_same_one(plant):
    u, y = plant
    assert signs.are_same(y, 3.0 - 1e3 * y)
    assert not signs.are_same(u, y)


@pytest.mark.parametrize(
    ("signal", "stepwise", "sine"),
    [
        (lambda t: np.where(t > 0.1, 3.0, 0.0), True, False),
        (lambda t: np.sin(2 * np.pi * 5 * t), False, True),
        (lambda t: np.sin(2 * np.pi * 5 * np.maximum(t - 0.2, 0.0)), False, True),
        (lambda t: np.random.default_rng(2).standard_normal(t.size), False, False),
        (lambda t: np.interp(t, [0.1, 0.105, 0.9, 0.905], [0, 3, 3, 0]), True, False),
        (lambda t: np.sign(np.sin(2 * np.pi * 10 * t)), False, False),
    ],
    ids=["step", "sine", "sine after a rest", "noise", "slow flanks", "square wave"],
)
def test_kinds_of_inputs_are_told_from_their_numbers(signal, stepwise, sine):
    values = signal(np.arange(1000) / 1000)
    assert signs.is_stepwise(values) is stepwise
    assert signs.is_sine(values) is sine


def test_memory_is_the_time_constant_of_a_lag():
    rng = np.random.default_rng(3)
    y = np.zeros(20_000)
    for k in range(1, y.size):
        y[k] = 0.98 * y[k - 1] + rng.standard_normal()
    # Theory: 1 / -log(0.98) = 49.5; the estimate from 20 000 samples scatters by 10 %.
    assert signs.memory_samples(y) == pytest.approx(49.5, rel=0.2)


def test_an_integrator_runs_away_and_its_rate_does_not():
    speed = 1.0 - np.exp(-np.arange(2000) / 100)
    assert signs.runs_away(np.cumsum(speed))
    assert not signs.runs_away(speed)


def test_a_clock_may_say_a_few_times_twice():
    ticks = 0.5 * np.arange(400)
    twice = np.insert(ticks, [100, 300], ticks[[100, 300]])
    assert signs.clock_of(twice) == signs.clock_of(ticks)
    assert signs.clock_of(np.repeat(ticks, 2)) is None
