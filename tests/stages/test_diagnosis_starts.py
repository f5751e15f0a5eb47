"""Recordings that a diagnosis would start in an equilibrium that they were not in."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hwid_cli.config.load import load_experiment
from hwid_cli.records.drive import Controller
from hwid_cli.records.experiment import CalibrateOptions, DiagnoseOptions
from hwid_cli.records.recordings import RawRecording, Recording
from hwid_cli.stages.calibrate import calibrate_all
from hwid_cli.stages.diagnosis_starts import (
    moving_sentence,
    moving_starts,
    starts_sentence,
    unsettled_starts,
    with_rests,
)
from tests.blind.campaign import measured_case
from tests.blind.cases import make_case
from tests.blind.machine import SAMPLE_TIME_S
from tests.blind.nuisances import NUISANCES
from tests.cli.drive_examples import NOISE, STEP_S, currents, displacement
from tests.diagnosis.small_drive import simulation

CONFIGS = Path(__file__).parents[2] / "configs"
REST = DiagnoseOptions()
LEAD_IN = 100


def with_lead_in(*, cut, level=0.0, zero=0.0):
    """Sines after a rest, the rest cut off or not, and a step that keeps its own."""
    rng = np.random.default_rng(1)
    found = []
    for name, current in currents():
        current = np.r_[np.zeros(LEAD_IN), current] + level
        output = displacement(current - level) + simulation_gain() * level + zero
        output += NOISE * rng.standard_normal(current.size)
        # As calibration does it: from the first sample that is clearly away.
        first = LEAD_IN + 2 if cut and name.startswith("sine") else 0
        kind = name.split("_")[0]
        found.append(
            Recording(name, current[first:], output[first:], STEP_S, kind=kind)
        )
    return found


def simulation_gain():
    return simulation().force_constant_N_per_A / simulation().stiffness_N_per_m


def test_sines_that_were_cut_at_their_onset_do_not_start_in_equilibrium():
    found = unsettled_starts(with_lead_in(cut=True), simulation(), REST)
    assert found == ("sine_01", "sine_02", "sine_03", "sine_04")


def test_parameters_that_are_off_alter_nothing():
    wrong = simulation(force_constant_N_per_A=6.0, stiffness_N_per_m=1000.0)
    assert len(unsettled_starts(with_lead_in(cut=True), wrong, REST)) == 4
    assert unsettled_starts(with_lead_in(cut=False), wrong, REST) == ()


@pytest.mark.parametrize(("level", "zero"), [(0.0, 0.0), (0.8, 0.0), (0.0, 1e-3)])
def test_what_keeps_its_rest_starts_in_equilibrium(level, zero):
    found = with_lead_in(cut=False, level=level, zero=zero)
    assert unsettled_starts(found, simulation(), REST) == ()


@pytest.mark.parametrize("rule", ["held", "estimated"])
def test_a_start_that_is_fitted_is_never_doubtful(rule):
    options = DiagnoseOptions(initial_state=rule)
    assert unsettled_starts(with_lead_in(cut=True), simulation(), options) == ()


def test_a_controller_and_a_free_axis_are_not_judged():
    found = with_lead_in(cut=True)
    ruled = simulation(controller=Controller(20.0, 30.0))
    assert unsettled_starts(found, ruled, REST) == ()
    assert unsettled_starts(found, simulation(stiffness_N_per_m=0.0), REST) == ()


def test_the_sentence_is_one_line_with_the_remedies():
    found = with_lead_in(cut=True)
    names = unsettled_starts(found, simulation(), REST)
    text = starts_sentence(names, found, CalibrateOptions(sine=("cut",)))

    assert "\n" not in text
    for words in ("sine_01", "'held'", "'estimated'", "'cut' out of calibrate.sine"):
        assert words in text
    assert "calibrate" not in starts_sentence(names, found, None)
    assert "and 1 more begin within" in starts_sentence(["a"] * 5, found, None)
    assert starts_sentence((), found, None) == ""


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


def blind_cases():
    """What may make a start look odd: a load, friction, noise of all kinds, offsets."""
    for effect in ("coulomb_friction", "constant_load", "output_backlash"):
        yield make_case("full", (effect,), 0, plan="short")
    for nuisance in NUISANCES:
        yield make_case("nuisance", (), 0, plan="short", nuisance=nuisance)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=case.name, marks=pytest.mark.slow if row % 2 else ())
        for row, case in enumerate(blind_cases())
    ],
)
def test_no_case_of_the_blind_test_is_doubted(case):
    measured, truth = measured_case(case)
    found = [
        Recording(one.name, one.current_A, one.displacement_m, SAMPLE_TIME_S)
        for one in measured
    ]
    given = simulation(**truth["simulation"])
    assert unsettled_starts(found, given, REST) == ()
    # Not by luck: without their rest the sines would be.
    cut = [
        replace(one, input=one.input[108:], output=one.output[108:]) for one in found
    ]
    assert unsettled_starts(cut, given, REST) != ()


def test_the_demo_fits_how_its_recordings_start():
    demo = load_experiment(CONFIGS / "diagnose_demo.yaml")
    cut = with_lead_in(cut=True)
    assert unsettled_starts(cut, simulation(), REST) != ()
    assert unsettled_starts(cut, demo.simulation, demo.diagnose) == ()
