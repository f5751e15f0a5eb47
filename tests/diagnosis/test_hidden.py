"""Effects behind recordings that do not reach them, and inputs that do."""

import numpy as np
import pytest

from hwid_cli.diagnosis.further_inputs import hidden
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.recordings import Recording
from tests.diagnosis.small_drive import DRIVE, NOISE, STEP_S, N, in_turn, simulation

TIME = STEP_S * np.arange(N)
EFFECTS = ("one_sided_stop", "coulomb_friction", "cubic_stiffness", "sensor_hum")


def step(size):
    return size * np.interp(TIME, [0.04, 0.05, 0.24, 0.25], [0, 1, 1, 0])


INPUTS = (step(4.0), step(-4.0), step(-0.2))


def found_behind(sizes, inputs=INPUTS, seed=1):
    """What may hide behind steps there and back of a drive that lacks nothing."""
    rng = np.random.default_rng(seed)
    recordings = []
    for number, size in enumerate(sizes):
        motion = simulate_drive(step(size), DRIVE, sample_time_s=STEP_S)
        read = motion.output + NOISE * rng.standard_normal(N)
        recordings.append(Recording(f"step_{number}", step(size), read, STEP_S))
    options = DiagnoseOptions(effects=EFFECTS, max_effects=1)
    told = hidden(recordings, simulation(), options, inputs, in_turn, lambda *_: None)
    return {one.effect: one for one in told}


@pytest.fixture(scope="module")
def to_one_side():
    return found_behind((1.0, 2.0, 3.0, 4.0))


def test_a_stop_on_the_side_that_nobody_went_to_may_hide(to_one_side):
    stop = to_one_side["one_sided_stop"]

    assert stop.may_hide
    to_where_all_went, to_the_other_side, not_far = stop.shares.mean(axis=0)
    assert to_the_other_side > 0.3
    assert to_where_all_went < 0.05
    assert not_far < 0.05


def test_what_every_recording_shows_is_excluded(to_one_side):
    assert not to_one_side["coulomb_friction"].may_hide
    # A few standard errors of 1600 samples, in 400 others.
    assert to_one_side["coulomb_friction"].ratios.max() < 0.2


def test_a_recording_there_excludes_it():
    both = found_behind((1.0, 2.0, 3.0, 4.0, -4.0))

    assert not both["one_sided_stop"].may_hide


def test_a_spring_that_hardens_hides_behind_small_motions_only(to_one_side):
    small = found_behind((0.2, 0.3, 0.4))

    assert small["cubic_stiffness"].may_hide
    assert not to_one_side["cubic_stiffness"].may_hide


def test_no_input_tells_what_only_the_error_could_suggest(to_one_side):
    hum = to_one_side["sensor_hum"]

    assert not hum.is_told
    assert not hum.may_hide


def test_no_ratio_is_larger_than_the_whole_effect_makes(to_one_side):
    # The stiffest stop of the search, at its nearest, by a simulation of its own.
    stop = to_one_side["one_sided_stop"]
    free = simulate_drive(INPUTS[1], DRIVE, sample_time_s=STEP_S).output
    most = np.sqrt(np.mean(free**2)) / NOISE

    assert 0.0 < stop.ratios[:, 1].max() < most


def test_a_stop_further_out_than_anybody_went_may_hide():
    near = found_behind((1.0, -1.0, 0.7, -0.7), (step(1.0), step(4.0)))[
        "one_sided_stop"
    ]

    assert near.may_hide
    as_far, further = near.shares.mean(axis=0)
    assert as_far < 0.05
    assert further > 0.2
