"""Recordings that start elsewhere than a simulation, which always starts at one place."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.run_starts import (
    begin,
    starts_above,
    starts_sentence,
    with_starts,
)
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.diagnosis.standing import its_own, prepare
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import Capabilities, SimulatorRun
from hwid_cli.records.recordings import Recording
from tests.diagnosis.test_foreign import Count

STEP_S, N = 0.004, 500
TIME = STEP_S * np.arange(N)
INPUTS = [
    np.where(TIME > 0.08, size * np.sin(2 * np.pi * hertz * TIME), 0.0)
    for size, hertz in ((2.0, 1.0), (3.0, 2.0), (1.5, 0.7))
]
STARTS = (-1.2, 0.3, 2.0)
NOTHING = np.zeros(0)
ABLE = Capabilities(run=True, force=True)


def axis(command, stiffness=0.0):
    """0.5 kg behind 4 N/A and a damper of 2 N s/m."""
    return lsim(([4.0], [0.5, 2.0, stiffness]), command, TIME)[1]


def simulate(request, stiffness=0.0):
    force = request.force / 4.0 if request.force.size else 0.0
    return SimulatorRun(axis(request.input + force, stiffness), NOTHING)


def signals(row, output):
    command = INPUTS[row]
    return Signals(f"r{row}", "", command, output, command, output, STEP_S)


def runs(gain=1.0, stiffness=0.0):
    return [SimulatorRun(gain * axis(one, stiffness), NOTHING) for one in INPUTS]


def measured(starts, gain=1.0, stiffness=0.0):
    pairs = zip(runs(gain, stiffness), starts, strict=True)
    rng = np.random.default_rng(4)
    return [
        signals(row, one.output + start + 1e-3 * rng.standard_normal(N))
        for row, (one, start) in enumerate(pairs)
    ]


def test_starts_are_found_from_the_rest_before_the_motion():
    found = starts_above(measured(STARTS, gain=1.2), runs(), is_said=False)
    # A mean of 20 samples of rest.
    assert list(found.values()) == pytest.approx(STARTS, abs=1e-3)


@pytest.mark.parametrize(
    ("starts", "changed"),
    [
        # All alike: a load, or a sensor's offset, is what an effect may say.
        ((0.4, 0.4, 0.4), {}),
        # Hardly apart beside the motion.
        ((0.0, 1e-3, -1e-3), {}),
        # Most of the gap is a gain.
        ((0.0, 0.05, -0.05), {"gain": 3.0}),
    ],
)
def test_starts_that_are_no_gap_of_their_own_stay(starts, changed):
    assert starts_above(measured(starts, **changed), runs(), is_said=False) == {}
    assert starts_above(measured(starts, **changed), runs(), is_said=True) != {}


def test_a_drive_that_comes_back_from_where_it_starts_is_not_lowered():
    given = [SimulatorRun(axis(one, 50.0), NOTHING) for one in INPUTS]
    swung = [
        signals(row, one.output + start * np.exp(-TIME / 0.15))
        for row, (one, start) in enumerate(zip(given, STARTS, strict=True))
    ]
    assert starts_above(swung, given, is_said=False) == {}


def test_a_simulation_that_knows_its_starts_is_left_alone():
    given = [
        replace(one, output=one.output + start)
        for one, start in zip(runs(), STARTS, strict=True)
    ]
    apart = measured((0.0, 0.0, 0.0))
    assert starts_above(apart, given, is_said=False) == {}


def recordings(starts, stiffness=0.0):
    return [
        Recording(one.name, one.input, one.output, STEP_S)
        for one in measured(starts, stiffness=stiffness)
    ]


@pytest.mark.parametrize(("stiffness", "are_places"), [(0.0, True), (80.0, False)])
def test_a_free_axis_runs_from_its_start_and_a_spring_has_a_sensor_with_a_zero(
    stiffness, are_places
):
    def run(request):
        return simulate(request, stiffness)

    simulator, options = Simulator(ABLE, run, {}, {}, {}), DiagnoseOptions()
    found = recordings(STARTS, stiffness)
    problem = prepare(found, its_own(simulator), options, ())
    begun = begin(problem, simulator, options, Count())
    assert begun.starts.are_places == are_places
    firsts = [one.output[0] for one in begun.given]
    assert firsts == pytest.approx(STARTS if are_places else (0.0, 0.0, 0.0), abs=1e-3)
    for one, given in zip(begun.problem.signals, begun.given, strict=True):
        assert np.std(one.compared - given.output) < 2e-3
        assert abs(np.mean(one.compared - given.output)) < 1e-3
    for one in begun.lowered:
        assert one.compared[0] == pytest.approx(0.0, abs=5e-3)
    # Later runs as well, and what is shown beside the recordings as they were measured.
    again = begun.runs.of(begun.problem.signals, {})
    assert [one.output[0] for one in again] == pytest.approx(firsts)
    shown = begun.beside_recordings([one.output for one in begun.given])
    for one in found:
        assert abs(np.mean(one.output - shown[one.name])) < 1e-3


@pytest.mark.parametrize(("stiffness", "are_places"), [(0.0, True), (80.0, False)])
def test_starts_that_wrong_parameters_hide_show_beside_right_ones(
    stiffness, are_places
):
    def with_gain(request):
        gain = request.parameters["gain"]
        return SimulatorRun(gain * axis(request.input, stiffness), NOTHING)

    simulator = Simulator(Capabilities(run=True), with_gain, values={"gain": 3.0})
    small = [0.05 * one for one in STARTS]
    problem = prepare(
        recordings(small, stiffness), its_own(simulator), DiagnoseOptions(), ()
    )
    begun = begin(problem, simulator, DiagnoseOptions(), Count())
    assert begun.starts.above == {}
    right = begun.runs.of(begun.problem.signals, {"gain": 1.0})
    later = with_starts(begun, right)
    assert list(later.starts.above.values()) == pytest.approx(small, abs=2e-3)
    assert later.starts.are_places == are_places
    # What the given parameters leave is counted from there, too.
    firsts = [one.output[0] for one in later.given]
    assert firsts == pytest.approx(small if are_places else [0.0] * 3, abs=2e-3)
    assert with_starts(later, right) is later


def test_what_was_done_about_starts_is_said_with_its_unit():
    said = starts_sentence({"a": -1.25, "b": 2.0}, "rad")
    assert "start -1.25 to 2 rad from where the simulation does" in said
    assert starts_sentence({}, "rad") == starts_sentence({"a": 0.0}, "rad") == ""


@pytest.mark.parametrize("size", [0.2, 0.6, 1.0, 1.6, 3.0])
def test_starts_count_where_half_of_the_squares_go_with_them(size):
    apart = measured([0.25 * size * one for one in STARTS], gain=1.5)
    given = runs()
    pairs = list(zip(apart, given, strict=True))
    before = sum(np.sum((one.output - run.output) ** 2) for one, run in pairs)
    after = sum(
        np.sum((one.output - run.output - 0.25 * size * start) ** 2)
        for (one, run), start in zip(pairs, STARTS, strict=True)
    )
    found = starts_above(apart, given, is_said=False)
    assert bool(found) == (after <= 0.5 * before)


def test_of_speeds_a_start_is_the_zero_of_the_sensor():
    """A speed says nothing of the place that effects may go with."""

    def run(request):
        return simulate(request, 0.0)

    simulator = Simulator(ABLE, run, {}, {}, {}, output="velocity")
    problem = prepare(
        recordings(STARTS),
        its_own(simulator),
        DiagnoseOptions(initial_state="held"),
        (),
    )
    begun = begin(problem, simulator, DiagnoseOptions(initial_state="held"), Count())
    assert begun.starts.above
    assert not begun.starts.are_places
