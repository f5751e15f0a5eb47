"""Recordings whose rest a cut takes away, or that it begins in motion."""

from pathlib import Path

import numpy as np
import pytest

from hwid_cli.records.experiment import CalibrateOptions, DiagnoseOptions
from hwid_cli.records.recordings import RawRecording
from hwid_cli.stages.calibrate import calibrate_all
from hwid_cli.stages.diagnosis_starts import (
    moving_sentence,
    moving_starts,
    with_rests,
)
from tests.cli.drive_examples import NOISE, STEP_S, displacement
from tests.diagnosis.small_drive import simulation
from tests.diagnosis.test_found_start import LEAD_IN, with_lead_in

CONFIGS = Path(__file__).parents[2] / "configs"
REST = DiagnoseOptions()


def random_after_a_rest():
    """A random current whose beginning looks like a rest of its own, and what moves."""
    rng = np.random.default_rng(4)
    steps = rng.standard_normal(600)
    steps[50:] *= 5.0
    current = np.r_[np.zeros(LEAD_IN), np.cumsum(steps * 0.95)]
    output = displacement(current) + NOISE * rng.standard_normal(current.size)
    return RawRecording("random_1", current, output, STEP_S, kind="random")


@pytest.mark.parametrize("rule", ["rest", "held"])
def test_a_random_signal_that_is_cut_in_mid_motion_is_named(rule):
    options = DiagnoseOptions(initial_state=rule)
    cut, logs = calibrate_all(
        [random_after_a_rest()], CalibrateOptions(random=("cut",))
    )[:2]
    assert logs[0].first_sample > LEAD_IN + 20

    assert moving_starts(cut, logs, simulation(), options) == ("random_1",)
    text = moving_sentence(("random_1",), cut)
    for words in ("random_1", "in mid-motion", "calibrate.random", "estimated"):
        assert words in text
    assert moving_sentence((), cut) == ""

    fitted = DiagnoseOptions(initial_state="estimated")
    assert moving_starts(cut, logs, simulation(), fitted) == ()


def test_a_random_signal_that_keeps_its_rest_is_not_in_motion():
    whole, logs = calibrate_all([random_after_a_rest()], CalibrateOptions())[:2]
    assert moving_starts(whole, logs, simulation(), REST) == ()


def test_a_slow_drive_that_is_cut_in_motion_is_about_in_equilibrium():
    # A sine of 60 s: its spring is never farther from its equilibrium than noise. The
    # noise of the logged current hides its onset.
    time = np.r_[np.zeros(LEAD_IN), STEP_S * np.arange(15000)]
    current = 4.0 * np.sin(2 * np.pi * time / 60.0)
    rng = np.random.default_rng(1)
    output = displacement(current) + NOISE * rng.standard_normal(time.size)
    current = current + 0.04 * rng.standard_normal(time.size)
    raw = RawRecording("slow_1", current, output, STEP_S, kind="step")
    cut, logs = calibrate_all([raw], CalibrateOptions(step=("cut",)))[:2]
    assert logs[0].first_sample > LEAD_IN

    held = DiagnoseOptions(initial_state="held")
    assert moving_starts(cut, logs, simulation(), held) == ()
    # The same motion of a drive that takes a second to settle is none.
    sluggish = simulation(damping_N_s_per_m=1200.0)
    assert moving_starts(cut, logs, sluggish, held) == ("slow_1",)


def sines_after_a_rest():
    """As measured: a zero of 2 A and of the output, sines after a rest."""
    return [
        RawRecording(
            one.name, one.input + 2.0, one.output + 1e-3, STEP_S, kind=one.kind
        )
        for one in with_lead_in(cut=False)
        if one.name.startswith("sine")
    ]


def test_the_rest_that_was_cut_is_given_back_to_a_simulation():
    offsets = CalibrateOptions(sine=("cut", "input_offset"))
    raws = sines_after_a_rest()
    cut, logs = calibrate_all(raws, offsets)[:2]
    given = with_rests(cut, logs)
    for raw, before, one, log in zip(raws, cut, given, logs, strict=True):
        assert one.n_samples == before.n_samples + 40
        first = log.first_sample - 40
        assert one.input == pytest.approx(raw.input[first:] - log.input_offset)
        assert one.output == pytest.approx(raw.output[first:])
        assert one.input[:38] == pytest.approx(np.full(38, 2.0 - log.input_offset))
    assert moving_starts(given, logs, simulation(), REST) == ()


def test_what_was_cut_in_mid_motion_or_not_at_all_stays_as_it_is():
    cut, logs = calibrate_all(
        [random_after_a_rest()], CalibrateOptions(random=("cut",))
    )[:2]
    assert with_rests(cut, logs) == list(cut)
    whole, logs = calibrate_all(sines_after_a_rest(), CalibrateOptions())[:2]
    assert with_rests(whole, logs) == list(whole)
    assert with_rests(whole, ()) == list(whole)
