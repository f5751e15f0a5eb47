"""Which recordings are held out."""

import numpy as np
import pytest

from hwid_cli.diagnosis.held_out import held_out_names
from hwid_cli.records.recordings import Recording

TIME = 1e-3 * np.arange(400)


def recording(name, current, kind="step"):
    return Recording(name, current, np.zeros(current.size), 1e-3, kind=kind)


def step(name, size, ramp=0.05):
    return recording(name, size * np.interp(TIME, [0.1, 0.1 + ramp], [0, 1]))


def sine(name, size, frequency):
    current = size * np.sin(2 * np.pi * frequency * TIME)
    return recording(name, current, "sine")


def table():
    """Every size with every speed."""
    return [
        step(f"{size}_{ramp}", size, ramp)
        for size in (1.0, 2.0, 3.0)
        for ramp in (0.005, 0.02, 0.1)
    ]


def test_every_third_of_a_table_is_held_out():
    assert len(held_out_names(table())) == 3


def test_every_size_and_every_speed_is_on_both_sides():
    held = held_out_names(table())
    sizes = {name.split("_")[0] for name in held}
    speeds = {name.split("_")[1] for name in held}
    assert (len(sizes), len(speeds)) == (3, 3)


def test_repeats_are_on_both_sides():
    repeats = [step(f"r{k}", 2.0) for k in range(3)]
    assert len(held_out_names(repeats)) == 1


def test_repeats_of_a_noisy_current_are_still_repeats():
    rng = np.random.default_rng(3)
    repeats = [
        recording(f"r{k}", step("", 2.0).input + 1e-3 * rng.standard_normal(400))
        for k in range(6)
    ]
    assert len(held_out_names(repeats)) == 2


def test_every_kind_is_on_both_sides():
    given = [
        *(step(f"step_{k}", k) for k in (1, 2, 3)),
        *(sine(f"sine_{k}", 2.0, k) for k in (2, 5, 9)),
    ]
    held = held_out_names(given)
    assert {name.split("_")[0] for name in held} == {"step", "sine"}
    assert len(held) == 2


def test_a_lone_recording_of_a_kind_trains():
    given = [*(step(f"step_{k}", k) for k in (1, 2, 3)), sine("sine", 2.0, 5)]
    assert "sine" not in held_out_names(given)


def test_of_two_recordings_one_is_held_out():
    assert len(held_out_names([step("a", 1.0), step("b", 2.0)])) == 1
    assert len(held_out_names([step("a", 1.0), sine("b", 2.0, 5)])) == 1


def test_of_few_recordings_at_most_half_are_held_out_small_and_large_ones():
    rng = np.random.default_rng(0)
    for _ in range(40):
        sizes, speeds = rng.uniform(0.5, 3, 9), rng.uniform(0.5, 6, 9)
        n = int(rng.integers(3, 10))
        pairs = list(zip(sizes, speeds, strict=True))[:n]
        given = [sine(f"r{row}", *one) for row, one in enumerate(pairs)]
        held = [int(name[1:]) for name in held_out_names(given)]
        assert 1 <= len(held) <= n / 2
        # Where many are, they are of several sizes.
        if len(held) > 2:
            assert np.ptp(sizes[held]) > 0.3 * np.ptp(sizes[:n])


def test_a_single_recording_is_not_held_out():
    assert held_out_names([step("a", 1.0)]) == ()


def test_names_are_in_the_order_of_the_recordings():
    given = table()
    names = [one.name for one in given]
    held = held_out_names(given)
    assert list(held) == [name for name in names if name in held]


@pytest.mark.parametrize("n", range(2, 13))
def test_both_sides_always_have_a_recording(n):
    rng = np.random.default_rng(n)
    given = [
        sine(f"r{k}", size, frequency)
        for k, (size, frequency) in enumerate(rng.uniform(1, 20, (n, 2)))
    ]
    assert 1 <= len(held_out_names(given)) < n


def test_at_least_a_quarter_is_held_out_and_training_sees_all_of_the_range():
    rng = np.random.default_rng(1)
    for _ in range(200):
        n = int(rng.integers(8, 14))
        sizes, speeds = rng.uniform(0.5, 3, n), rng.uniform(0.5, 6, n)
        pairs = zip(sizes, speeds, strict=True)
        given = [sine(f"r{row}", *one) for row, one in enumerate(pairs)]
        held = [int(name[1:]) for name in held_out_names(given)]
        assert len(held) >= n // 4
        assert np.delete(sizes, held).max() >= 0.95 * sizes.max()
