"""Recordings that do not start at rest in balance tell so by their first samples."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from hwid_cli import diagnose
from hwid_cli.diagnosis.found_start import with_found_start
from hwid_cli.diagnosis.problem import prepare
from hwid_cli.records.drive import Controller
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.recordings import Recording
from tests.blind.campaign import measured_case
from tests.blind.cases import make_case
from tests.blind.machine import SAMPLE_TIME_S
from tests.blind.nuisances import NUISANCES
from tests.cli.drive_examples import NOISE, STEP_S, currents, displacement
from tests.diagnosis.small_drive import simulation

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


def found(recordings, given=None, options=REST):
    problem = with_found_start(prepare(recordings, given or simulation(), options, ()))
    return problem.start, problem.start_told_by


def test_sines_that_were_cut_at_their_onset_do_not_start_in_balance():
    start, names = found(with_lead_in(cut=True))
    assert start == "held"
    assert names == ("sine_01", "sine_02", "sine_03", "sine_04")


def test_parameters_that_are_off_alter_nothing():
    wrong = simulation(force_constant_N_per_A=6.0, stiffness_N_per_m=1000.0)
    assert found(with_lead_in(cut=True), wrong)[0] == "held"
    assert found(with_lead_in(cut=False), wrong) == ("rest", ())


@pytest.mark.parametrize(("level", "zero"), [(0.0, 0.0), (0.8, 0.0), (0.0, 1e-3)])
def test_what_keeps_its_rest_starts_in_balance(level, zero):
    assert found(with_lead_in(cut=False, level=level, zero=zero)) == ("rest", ())


@pytest.mark.parametrize("rule", ["held", "estimated"])
def test_a_start_that_is_fitted_stays(rule):
    options = DiagnoseOptions(initial_state=rule)
    assert found(with_lead_in(cut=True), options=options) == (rule, ())


def test_a_controller_and_a_free_axis_are_not_judged():
    cut = with_lead_in(cut=True)
    referred = [replace(one, reference=one.output) for one in cut]
    ruled = simulation(controller=Controller(20.0, 30.0))
    assert found(referred, ruled) == ("rest", ())
    assert found(cut, simulation(stiffness_N_per_m=0.0)) == ("rest", ())


def held_by_friction(starts, *, noise=2e-6, seed=1, fine=20):
    """A mass on a spring whose friction holds it where it starts, by another integrator.

    Half a second of rest, then a step that it follows.
    """
    mass, damping, stiffness, gain, friction = 0.6, 5.5, 2400.0, 14.0, 0.9
    step = 1e-3
    rng = np.random.default_rng(seed)
    recordings = []
    for row, start in enumerate(starts):
        current = np.where(np.arange(1500) < 500, 0.0, 1.2 * (-1.0) ** row)
        x, v, output = start, 0.0, []
        for one in current:
            output.append(x)
            for _ in range(fine):
                push = gain * one - damping * v - stiffness * x
                if v == 0.0 and abs(push) <= friction:
                    continue
                way = np.sign(v) if v else np.sign(push)
                after = v + step / fine * (push - friction * way) / mass
                v = 0.0 if v and after * v <= 0.0 else after
                x += step / fine * v
        read = np.array(output) + noise * rng.standard_normal(len(output))
        recordings.append(Recording(f"step_{row}", current, read, step, kind="step"))
    return recordings


def stage(**changes):
    given = simulation(
        mass_kg=0.55, damping_N_s_per_m=6.4, stiffness_N_per_m=2400.0,
        force_constant_N_per_A=14.8, effects={"coulomb_friction": {"force_N": 0.75}},
    )  # fmt: skip
    return replace(given, **changes)


def test_where_friction_has_left_a_drive_it_is_held():
    start, names = found(held_by_friction((3e-4, 0.0, -2.5e-4)), stage())
    assert (start, names) == ("held", ("step_0", "step_2"))
    assert found(held_by_friction((0.0, 0.0, 0.0)), stage()) == ("rest", ())


def turning(speed, *, noise=0.2, seed=2):
    """A motor under 6 V that turns at a speed when its recording begins."""
    inertia, friction, constant, resistance = 1.9e-4, 2e-4, 0.062, 1.4
    rng = np.random.default_rng(seed)
    time = 1e-3 * np.arange(2000)
    volts = np.where(time < 0.5, 6.0, np.where(time < 1.2, 10.0, 2.0))

    def slope(_, state, given):
        current = (given - constant * state[1]) / resistance
        return [state[1], (constant * current - friction * state[1]) / inertia]

    states = [np.array([0.0, speed])]
    for given in volts[:-1]:
        after = scipy.integrate.solve_ivp(
            slope, (0.0, 1e-3), states[-1], args=(given,), rtol=1e-9, atol=1e-9
        )
        states.append(after.y[:, -1])
    angle, speeds = np.array(states).T
    return volts, angle, speeds + noise * rng.standard_normal(time.size)


@pytest.mark.thorough
@pytest.mark.parametrize("output", ["velocity", "position"])
def test_what_turns_at_first_starts_in_motion(output):
    given = simulation(
        mass_kg=2.2e-4, damping_N_s_per_m=2.4e-4, stiffness_N_per_m=0.0,
        force_constant_N_per_A=0.056, resistance_ohm=1.4, output=output,
    )  # fmt: skip
    recordings = []
    for name, speed in (("from_rest", 0.0), ("running", 84.0)):
        volts, angle, speeds = turning(speed)
        read = speeds if output == "velocity" else angle
        recordings.append(Recording(name, volts, read, 1e-3, input_unit="V"))
    assert found(recordings, given) == ("estimated", ("running",))


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
    recordings = [
        Recording(one.name, one.current_A, one.displacement_m, SAMPLE_TIME_S)
        for one in measured
    ]
    given = simulation(**truth["simulation"])
    assert found(recordings, given) == ("rest", ())
    if "coarse" in case.name:
        # In few samples it shows neither a speed nor a place.
        return
    # Not by luck: without their rest the sines would be.
    cut = [
        replace(one, input=one.input[108:], output=one.output[108:])
        for one in recordings
    ]
    assert found(cut, given)[0] != "rest"


def test_rests_at_several_levels_of_the_input_tell_parameters_and_no_start():
    low, high = (with_lead_in(cut=False, level=one) for one in (-0.8, 0.8))
    wrong = simulation(force_constant_N_per_A=6.0, stiffness_N_per_m=1000.0)
    assert found([*low[:4], *high[4:]], wrong) == ("rest", ())


@pytest.mark.thorough
def test_a_clean_stage_that_friction_has_left_elsewhere_lacks_nothing():
    recordings = held_by_friction((3e-4, 1e-4, -2.5e-4, 0.0), fine=200)
    told = diagnose(
        recordings, stage(hold="zero"), DiagnoseOptions(effects=("spring_preload",))
    )
    assert told.verdict == "parameters"
    assert any("start at rest away from their balance" in one for one in told.warnings)


@pytest.mark.parametrize("cut_at", [46, 60, 265])
def test_a_fast_drive_that_moves_at_its_first_sample_tells_it_by_its_fit(cut_at):
    # 10 Hz at 1 kHz: the speed changes within the samples that would tell it.
    rng = np.random.default_rng(3)
    time_s = 1e-3 * np.arange(400)
    bump = np.interp(time_s, [0.04, 0.05, 0.24, 0.25], [0, 1, 1, 0])
    plant = scipy.signal.StateSpace(
        [[0, 1], [-1184 / 0.3, -15 / 0.3]], [[0], [5 / 0.3]], [[1, 0]], [[0]]
    )
    recordings = []
    for number, size in enumerate((0.5, 1.0, 1.5)):
        first = cut_at if number == 2 else 0
        _, output, _ = scipy.signal.lsim(plant, size * bump, time_s)
        output += 2e-5 * rng.standard_normal(400)
        name = f"step_{number}"
        recordings.append(
            Recording(name, size * bump[first:], output[first:], 1e-3, kind="step")
        )
    found = diagnose(recordings, simulation(), DiagnoseOptions(effects=(), laws=False))
    assert found.verdict in ("none", "parameters")
    assert found.warnings[0].startswith("step_2 starts in motion")
