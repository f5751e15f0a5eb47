import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.trust.designs import around_level, designs, working_level


@pytest.mark.thorough
@given(
    st.floats(1e-3, 1e3),
    st.floats(1.0, 1e4),
    st.floats(0.1, 20.0),
    st.sampled_from([1e-3, 5e-3, 0.02]),
    st.sampled_from([-1, 0, 1]),
)
def test_no_design_leaves_its_limits(
    amplitude, relative_rate, duration_s, step_s, side
):
    rate = amplitude * relative_rate
    for one in designs(amplitude, rate, duration_s, step_s, "A", side=side):
        assert side == 0 or (side * one.values >= -1e-12 * amplitude).all()
        # Sums of a few thousand rounded steps.
        assert np.abs(one.values).max() <= amplitude * (1 + 1e-9)
        assert np.abs(np.diff(one.values)).max() <= rate * step_s * (1 + 1e-9)
        assert one.values.size == round(duration_s / step_s)


def test_all_kinds_are_designed_and_named_once():
    found = designs(6.0, 50.0, 7.5, 1e-3, "A")
    names = [one.name for one in found]

    assert len(set(names)) == len(names)
    assert {name.split("_")[0] for name in names} == {
        "step", "levels", "multisine", "sweep"
    }  # fmt: skip


def test_designs_stay_below_a_tenth_of_the_sample_rate():
    # A rate that limits nothing.
    for one in designs(6.0, 1e9, 7.5, 1e-3, "A"):
        if one.name.startswith(("multisine", "sweep")):
            power = np.abs(np.fft.rfft(one.values * np.hanning(one.values.size))) ** 2
            fast = np.fft.rfftfreq(one.values.size, 1e-3) > 101.0
            assert power[fast].sum() < 1e-3 * power.sum(), one.name


@pytest.mark.parametrize("side", [-1, 1])
def test_inputs_of_one_sign_visit_their_range(side):
    """A heater cannot cool."""
    found = designs(6.0, 50.0, 7.5, 1e-3, "A", side=side)
    kinds = {one.name.split("_")[0] for one in found}
    assert kinds == {"step", "levels", "multisine", "sweep"}
    for one in found:
        assert (side * one.values >= 0.0).all(), one.name
        # Nothing of the other half is designed twice as large.
        assert np.abs(one.values).max() <= 6.0 * (1 + 1e-9)
    (sweep,) = [one for one in found if one.name == "sweep_100"]
    inner = side * sweep.values[2000:5500]
    assert inner.min() < 0.3
    assert inner.max() > 5.5


@pytest.mark.parametrize("side", [0, 1])
def test_designs_begin_and_end_at_rest(side):
    for one in designs(6.0, 50.0, 7.5, 1e-3, "A", side=side):
        assert np.abs(one.values[[0, -1]]).max() < 1e-9


def test_a_sweep_ends_where_its_slope_is_the_rate():
    (sweep,) = [
        one for one in designs(2.0, 50.0, 10.0, 1e-3, "A") if one.name == "sweep_100"
    ]

    # 50 / (2 pi 2) Hz, but for the window at its end.
    assert "to 3.98 Hz" in sweep.words
    assert 0.6 * 50.0 < np.abs(np.diff(sweep.values)).max() / 1e-3 <= 50.0


@pytest.mark.parametrize("limits", [(6.0, 50.0, 0.04), (6.0, 1e-3, 5.0)])
def test_limits_within_which_nothing_moves_have_no_designs(limits):
    assert designs(*limits, 1e-3, "A") == ()


def test_every_call_makes_the_same_inputs():
    first, second = (designs(6.0, 50.0, 2.0, 1e-3, "A") for _ in range(2))

    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one.values, other.values)


def test_inputs_around_a_level_begin_and_end_there_and_move_as_those_around_zero():
    plain = designs(6.0, 50.0, 7.5, 1e-3, "mA")
    moved = around_level(plain, 12.0, "mA")
    assert [one.name for one in moved] == [one.name for one in plain]
    for one, other in zip(plain, moved, strict=True):
        assert other.values[0] == other.values[-1] == 12.0
        assert np.allclose(other.values - 12.0, one.values)
        assert other.words.endswith("around 12 mA")
    assert min(one.values.min() for one in moved) == pytest.approx(6.0)
    assert around_level(plain, 0.0, "mA") == plain


@pytest.mark.parametrize(
    ("inputs", "level"),
    [
        ([[12.0, 5.0, 18.0], [12.5, 19.0], [np.nan, 13.0]], 12.5),
        ([[-12.0, -5.0], [-12.0, -18.0]], -12.0),
        # A heater that is off at times, a drive, and a noisy zero.
        ([[12.0, 0.1, 18.0]], 0.0),
        ([[1.0, -2.0]], 0.0),
        ([[0.01, 3.0]], 0.0),
    ],
)
def test_what_a_machine_works_around_is_where_inputs_begin_that_stay_away_from_zero(
    inputs, level
):
    assert working_level([np.array(one) for one in inputs]) == level
