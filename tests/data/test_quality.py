import numpy as np
import pytest

from hwid_cli.data.doubtful import doubts
from hwid_cli.data.quality import longest_run, quality_notes, stuck_note
from hwid_cli.records.recordings import RawRecording

T = np.arange(1000) / 1000
WAVE = np.sin(2 * np.pi * 3 * T) + 0.01 * np.random.default_rng(1).standard_normal(1000)


def test_a_sound_signal_has_nothing_odd():
    assert quality_notes(WAVE) == ()


def test_a_held_input_has_nothing_odd():
    assert quality_notes(np.where(T > 0.3, 2.0, 0.0)) == ()


def test_limits_on_both_sides_are_named():
    notes = quality_notes(np.clip(WAVE, -0.7, 0.9))
    assert len(notes) == 2
    assert notes[0].startswith("at its largest value 0.9 for")
    assert notes[1].startswith("at its smallest value -0.7 for")


@pytest.mark.parametrize(("first", "notes"), [(0, 0), (400, 1)])
def test_a_rest_before_the_motion_is_no_limit(first, notes):
    """An encoder reads one value until the drive moves."""
    swing = np.maximum(np.sin(2 * np.pi * 3 * T), 0.0) + 1e-6 * np.arange(1000)
    swing = np.concatenate([swing[:first], np.zeros(150), 0.01 + swing[first:]])
    swing[first : first + 150] = swing.min() - 0.1
    found = [one for one in quality_notes(swing) if "smallest" in one]
    assert len(found) == notes


def test_a_sensor_that_stands_still_is_named():
    stuck = WAVE.copy()
    stuck[400:500] = stuck[400]
    assert quality_notes(stuck) == ("does not change for 100 samples in a row",)
    assert quality_notes(stuck, may_hold=True) == ()


def test_damaged_samples_are_counted():
    damaged = WAVE.copy()
    damaged[300] += 5.0
    assert quality_notes(damaged) == ("1 sample looks damaged",)


def test_a_signal_far_from_zero_is_named():
    (note,) = quality_notes(293.0 + 0.5 * WAVE)
    assert "standard deviations from zero: models with" in note
    assert quality_notes(3.0 + WAVE) == ()


@pytest.mark.parametrize("level", [0.9, 0.6, 0.3])
def test_a_sine_that_is_cut_on_both_sides_is_named_however_much_is_lost(level):
    sine = np.sin(2 * np.pi * 5 * np.arange(2000) / 2000)
    notes = quality_notes(np.clip(sine, -level, level), may_hold=True)
    assert [note.split(" for ")[0] for note in notes] == [
        f"at its largest value {level}",
        f"at its smallest value -{level}",
    ]


@pytest.mark.parametrize(
    "values",
    [
        # Trapezoids, a square wave, a staircase, a move that begins and ends at rest.
        np.clip(3 * np.abs((np.arange(2000) % 400) / 200 - 1) - 1, 0, 1),
        np.sign(np.sin(np.arange(2000) / 50)),
        np.repeat(np.arange(20.0) % 7, 100),
        np.clip((np.arange(2000) - 700) / 500, 0, 1) ** 2,
    ],
    ids=["trapezoids", "square", "staircase", "one move"],
)
def test_what_holds_its_levels_on_purpose_is_not_called_cut(values):
    assert not any("clipped" in note for note in quality_notes(values, may_hold=True))


def test_flicker_of_the_last_bit_is_no_damage_and_a_spike_is():
    """Eight bits, of which the signal takes sixty steps, on three levels."""
    rng = np.random.default_rng(4)
    level = np.repeat([0.0, 40.0, -20.0], 300)
    flicker = level + (rng.random(900) < 0.05) * rng.choice([-1.0, 1.0], 900)
    assert quality_notes(0.04 * flicker, may_hold=True) == ()
    flicker[450] += 5.0
    assert quality_notes(0.04 * flicker, may_hold=True) == ("1 sample looks damaged",)


@pytest.mark.parametrize("turns", [1.6, 4.2, -3.3])
def test_an_angle_that_begins_again_after_a_turn_is_named(turns):
    rng = np.random.default_rng(2)
    angle = 360 * turns * np.linspace(0, 1, 900) + 0.02 * rng.standard_normal(900)
    (note,) = quality_notes(np.mod(angle + 20, 360))
    times = int(abs(turns) + (0.06 if turns > 0 else 0.94))
    said = "once" if times == 1 else f"{times} times"
    assert f"jumps over its whole range {said}:" in note
    assert quality_notes(angle) == ()


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_levels_that_change_do_not_begin_again(noise):
    rng = np.random.default_rng(3)
    levels = np.repeat([0.0, 1.0, 0.0, 1.0, 0.0], 180)
    found = quality_notes(levels + noise * rng.standard_normal(900))
    assert not any("begins again" in note for note in found)


@pytest.mark.parametrize("step", [0.001, 0.002, 0.004])
def test_the_peak_of_a_rounded_sine_is_no_limit(step):
    sine = np.sin(np.arange(4000) * 2 * np.pi * 3 / 4000 + 0.3)
    rounded = np.round(sine / step) * step
    assert longest_run(rounded == rounded.max()) >= 5
    assert not [one for one in quality_notes(rounded) if "clipped" in one]
    cut = np.round(np.clip(sine, -0.8, 0.8) / step) * step
    assert len([one for one in quality_notes(cut) if "clipped" in one]) == 2


def sensor(values, step=0.002):
    return np.round(values / step) * step


MOVING = sensor(
    np.sin(np.arange(2000) * 2 * np.pi / 700) + 0.3 * np.sin(np.arange(2000) / 15)
)


@pytest.mark.parametrize(
    "spoilt",
    [
        np.where(np.arange(2000) > 700, 13.0, MOVING),
        np.where(np.arange(2000) > 900, MOVING[900], MOVING),
        sensor(np.clip(MOVING, -0.1, 0.1)),
    ],
    ids=["torn off", "frozen", "cut"],
)
def test_a_sensor_that_stops_at_full_speed_is_named_where_others_move(spoilt):
    def recordings(*outputs):
        inputs = np.arange(2000.0)
        return [RawRecording(f"r{n}", inputs, y, 1e-3) for n, y in enumerate(outputs)]

    found = doubts(recordings(MOVING, MOVING[::-1], spoilt))
    assert list(found) == ["r2"]
    assert found["r2"][0].startswith("the output stops at full speed")
    # Where most do so, or too few tell what is usual, it is meant.
    assert not doubts(recordings(MOVING, spoilt, 2.0 * spoilt))
    assert not doubts(recordings(MOVING, spoilt))


def test_a_motion_that_comes_to_rest_stops_by_itself():
    t = np.arange(2000)
    settled = sensor(np.where(t > 100, 1.0 - np.exp(-(t - 100.0) / 60), 0.0))
    swing = np.exp(-(t - 100.0) / 90) * np.sin(t / 25)
    swung = sensor(settled + np.where(t > 100, swing, 0.0))
    assert [stuck_note(one) for one in (settled, swung, MOVING)] == ["", "", ""]
