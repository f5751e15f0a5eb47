"""The drive that stands for another simulation, and the force that makes it move so."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter, lsim

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.stand_in import (
    change_between,
    corrected,
    derived,
    error_of,
    force_along,
    force_of_change,
    force_of_motion,
    in_newtons,
    moved_from,
    moved_plainly,
    standing_for,
    starts_in_balance,
    with_change,
)
from hwid_cli.diagnosis.stand_in_fit import (
    _no_faster_than_seen,
    fit_beside_integral,
    fit_stand_in,
    fit_to_push,
    gain_beside_friction,
)
from hwid_cli.drive.simulation import parameter_vector, run
from hwid_cli.records.drive import Drive, StandIn
from hwid_cli.records.programs import SimulatorRun
from tests.black_boxes.plants import HARDENING, PENDULUM, integrate

STEP_S, N = 1e-3, 600
TIME = STEP_S * np.arange(N)
INPUTS = [
    size * np.sin(2 * np.pi * frequency * (TIME - 0.05)) * (TIME > 0.05)
    for size, frequency in ((2.0, 3.0), (1.0, 8.0))
]
MASS, DAMPING, STIFFNESS, GAIN = 0.8, 11.0, 2100.0, 9.0
NOTHING = np.zeros(0)


def signals(command):
    return Signals("r", "sine", command, 0 * command, command, 0 * command, STEP_S)


def linear(force):
    return lsim(([1.0], [MASS, DAMPING, STIFFNESS]), force, TIME)[1]


@pytest.fixture(scope="module")
def given():
    return [signals(one) for one in INPUTS]


@pytest.mark.parametrize("has_velocity", [False, True])
def test_derivatives_are_exact_where_a_run_leaves_its_rest(has_velocity):
    # A cart that is pushed from the first sample on, against its damper: m = d = F = 1.
    time = 0.05 * np.arange(60)
    way, speed = time + np.exp(-time) - 1, 1 - np.exp(-time)
    run_from_rest = SimulatorRun(way, speed if has_velocity else NOTHING)
    moved = derived(run_from_rest, 0.05)
    np.testing.assert_allclose(moved.velocity[:5], speed[:5], atol=2e-3)
    np.testing.assert_allclose(moved.acceleration[:5], np.exp(-time[:5]), atol=0.04)


def test_a_corner_at_the_first_sample_is_no_velocity():
    # A drive that rests in balance, until a held and noisy input moves it.
    rng = np.random.default_rng(1)
    force = np.r_[0.0, 0.0, rng.standard_normal(N - 2)]
    way = lsim(([1.0], [MASS, DAMPING, STIFFNESS]), force, TIME)[1]
    moved = derived(SimulatorRun(way, NOTHING), STEP_S)
    assert abs(moved.velocity[0]) < 1e-3 * np.abs(moved.velocity).max()
    assert abs(MASS * moved.acceleration[0]) < 0.1


def test_a_correction_takes_up_what_the_last_one_has_left():
    """Effects do not see an offset: it must not grow from turn to turn."""
    drive = StandIn(MASS, DAMPING, STIFFNESS, GAIN)
    one = signals(INPUTS[0])
    left = 1e-4 * np.sin(2 * np.pi * 5 * TIME) * np.minimum(TIME / 0.05, 1.0)
    one = replace(one, force=np.zeros(N), offset=left, own_start=(0.0, 0.0))
    target = linear(GAIN * INPUTS[0]) + left
    found = corrected(one, drive, np.zeros(N), target, np.zeros(N))
    assert np.std(found.offset) < 0.02 * np.std(left)
    there = moved_from((0.0, 0.0), drive, found, found.force)
    assert np.std(there.position - target) < 0.02 * np.std(left)


@pytest.mark.parametrize(
    ("own", "first", "is_in_balance"),
    [((0.0, 0.0), 0.0, False), ((0.0, 0.0), 1e-3, True), (None, 0.0, True)],
)
def test_a_start_that_a_force_moves_is_one_in_balance(own, first, is_in_balance):
    run_with_force = SimulatorRun(np.linspace(first, 1.0, 50), NOTHING)
    one = replace(signals(INPUTS[0]), own_start=own)
    assert starts_in_balance(one, run_with_force) is is_in_balance


@pytest.mark.parametrize("of_curve", [0.0, STIFFNESS])
def test_the_change_between_two_stand_ins_leads_from_one_to_the_other(of_curve):
    before = StandIn(
        MASS, DAMPING, STIFFNESS, GAIN, quadratic_N_per_m2=-30.0,
        cubic_N_per_m3=4e5, one_curve_N_per_m=of_curve,
    )  # fmt: skip
    after = replace(
        before, damping_N_s_per_m=6.0, stiffness_N_per_m=2500.0,
        force_constant_N_per_A=8.0,
    )  # fmt: skip
    change = change_between(before, after)
    assert change.curve == pytest.approx(2500.0 / STIFFNESS if of_curve else 1.0)
    found = with_change(before, change)
    for name in ("damping_N_s_per_m", "stiffness_N_per_m", "force_constant_N_per_A"):
        assert getattr(found, name) == pytest.approx(getattr(after, name))
    assert found.bends == pytest.approx(after.bends)
    assert change_between(before, before).is_none


def test_a_run_that_starts_in_motion_keeps_its_first_velocity():
    way = np.sin(20 * TIME + 0.4)
    moved = derived(SimulatorRun(way, NOTHING), STEP_S)
    assert moved.velocity[0] == pytest.approx(20 * np.cos(0.4), rel=1e-6)


def test_the_stand_in_of_a_linear_drive_is_this_drive(given):
    runs = [SimulatorRun(linear(GAIN * one), NOTHING) for one in INPUTS]
    found = fit_stand_in(given, runs)
    # Forces count in the unit of the input.
    expected = [MASS / GAIN, DAMPING / GAIN, STIFFNESS / GAIN, 1.0]
    values = [
        found.mass_kg, found.damping_N_s_per_m, found.stiffness_N_per_m,
        found.force_constant_N_per_A,
    ]  # fmt: skip
    np.testing.assert_allclose(values, expected, rtol=1e-4)
    assert (found.quadratic_N_per_m2, found.cubic_N_per_m3) == (0.0, 0.0)
    same = in_newtons(found, 1 / GAIN)
    assert same.mass_kg == pytest.approx(MASS, rel=1e-4)
    assert same.force_constant_N_per_A == pytest.approx(GAIN, rel=1e-9)


def test_a_free_axis_has_a_stand_in_without_a_spring(given):
    runs = [
        SimulatorRun(lsim(([GAIN], [MASS, DAMPING, 0.0]), one, TIME)[1], NOTHING)
        for one in INPUTS
    ]
    found = fit_stand_in(given, runs)
    assert found.stiffness_N_per_m == 0.0
    assert found.damping_N_s_per_m == pytest.approx(DAMPING / GAIN, rel=1e-3)


@pytest.mark.parametrize(
    ("rough", "weight"),
    [
        # A rough input leaves a little for a spring, which would be in balance far away.
        (0.05, 0.0),
        # A hovering mass, whose input is never near zero: it fell, and was slowed.
        (0.0, 9.81 * MASS / GAIN),
    ],
)
def test_a_free_axis_that_starts_out_of_balance_has_none_either(rough, weight):
    rng = np.random.default_rng(2)
    moving = [one + rough * rng.standard_normal(TIME.size) for one in INPUTS]
    runs = [
        SimulatorRun(lsim(([GAIN], [MASS, DAMPING, 0.0]), one, TIME)[1], NOTHING)
        for one in moving
    ]
    found = fit_stand_in([signals(one + weight) for one in moving], runs)
    assert found.stiffness_N_per_m == 0.0
    assert found.mass_kg == pytest.approx(MASS / GAIN, rel=1e-2)
    assert found.damping_N_s_per_m == pytest.approx(DAMPING / GAIN, rel=1e-2)


def rubs(force, dry, stiffness=STIFFNESS, finer=20):
    """A drive with dry friction, in small steps of its own."""
    way = speed = 0.0
    found = np.zeros(force.size)
    step = STEP_S / finer
    held = np.repeat(force, finer)
    for row, push in enumerate(held):
        if row % finer == 0:
            found[row // finer] = way
        free = speed + step * (push - DAMPING * speed - stiffness * way) / MASS
        most = step * dry / MASS
        speed = free - min(max(free, -most), most)
        way += step * speed
    return SimulatorRun(found, NOTHING)


@pytest.mark.parametrize("stiffness", [STIFFNESS, 0.0])
def test_friction_in_a_simulation_is_no_damper_of_its_stand_in(stiffness):
    inputs = [3.0 * one for one in INPUTS]
    runs = [rubs(GAIN * one, 6.0, stiffness) for one in inputs]
    found = fit_stand_in([signals(one) for one in inputs], runs)
    assert found.mass_kg == pytest.approx(MASS / GAIN, rel=0.05)
    assert found.damping_N_s_per_m == pytest.approx(DAMPING / GAIN, rel=0.1)
    assert found.stiffness_N_per_m == pytest.approx(stiffness / GAIN, rel=0.02, abs=0.5)


def test_what_a_push_replaces_beside_friction_is_told_by_forces_and_not_by_the_way():
    slow = np.sin(2 * np.pi * 4.0 * TIME)
    command = signals(1.2 * INPUTS[0])
    before = rubs(GAIN * command.driven_by, 6.0, stiffness=0.0)
    there = rubs(GAIN * command.driven_by + slow, 6.0, stiffness=0.0)
    gain, error = gain_beside_friction(command, slow, there)
    assert gain == pytest.approx(1 / GAIN, rel=0.05)
    assert error < 0.05
    # What friction has eaten of the answer:
    free = lsim(([1.0], [MASS, DAMPING, 0.0]), slow, TIME)[1]
    answer = there.output - before.output
    assert not 0.8 < float(answer @ free) / float(free @ free) < 1.2
    # A push that nothing answers tells nothing.
    _, error = gain_beside_friction(command, 1e-4 * slow, before)
    assert error > 1.0


def test_a_loop_that_adds_up_is_told_from_a_negative_damper():
    kp, ki = STIFFNESS, 9.0 * STIFFNESS
    push = np.sin(np.pi * TIME / TIME[-1]) * np.sin(2 * np.pi * 2 * TIME / TIME[-1])
    loop = ([1.0, 0.0], [MASS, DAMPING, kp, ki])
    rest = SimulatorRun(np.zeros(N), NOTHING)
    pushed = SimulatorRun(lsim(loop, push, TIME)[1], NOTHING)
    one = signals(push)
    drive, missed = fit_beside_integral(one, push, (rest, pushed))
    assert missed < 1e-3
    assert drive.mass_kg == pytest.approx(MASS, rel=0.05)
    assert drive.damping_N_s_per_m == pytest.approx(DAMPING, rel=0.05)
    assert drive.stiffness_N_per_m == pytest.approx(kp, rel=0.01)
    assert drive.reset_per_s == pytest.approx(ki / kp, rel=0.01)
    assert fit_to_push(one, push, (rest, pushed)).damping_N_s_per_m < 0.5 * DAMPING
    # Without inertia it gets a mass that samples show.
    slow = SimulatorRun(lsim(([1.0], [DAMPING, kp]), push, TIME)[1], NOTHING)
    light, _ = fit_beside_integral(one, push, (rest, slow))
    assert light.mass_kg >= 0.99 * kp * (STEP_S / 10) ** 2
    # Noise is no drive.
    rng = np.random.default_rng(1)
    rough = SimulatorRun(rng.standard_normal(N), NOTHING)
    assert fit_beside_integral(one, push, (rest, rough))[1] > 0.5


# A loop with an integral part around a mass, of a reference: what it sums up moves it too.
LOOP = StandIn(
    mass_kg=MASS, damping_N_s_per_m=DAMPING, stiffness_N_per_m=STIFFNESS,
    force_constant_N_per_A=STIFFNESS, reset_per_s=9.0,
)  # fmt: skip
LED_BY = ([STIFFNESS, 9.0 * STIFFNESS], [MASS, DAMPING, STIFFNESS, 9.0 * STIFFNESS])


def test_a_stand_in_sums_up_what_drives_it_beside_its_spring():
    reference = 1e-3 * INPUTS[0]
    vector = parameter_vector(LOOP, {})
    expected = lsim(LED_BY, reference, TIME)[1]
    found = run(reference, vector, STEP_S)
    size = float(np.max(np.abs(expected)))
    # It sums up once in a sample.
    assert np.max(np.abs(found.position - expected)) < 0.02 * size
    still = run(reference, parameter_vector(replace(LOOP, reset_per_s=0.0), {}), STEP_S)
    assert np.max(np.abs(still.position - expected)) > 0.1 * size
    # A force is let go of.
    force = np.full(N, 2.0)
    start = run(np.zeros(N), vector, STEP_S, force=force - force[0])
    assert np.max(np.abs(start.position)) == 0
    step = np.where(np.arange(N) < 10, 0.0, 2.0)
    pushed = run(np.zeros(N), vector, STEP_S, force=step)
    answer = lsim(([1.0, 0.0], LED_BY[1]), step, TIME)[1]
    largest = float(np.max(np.abs(answer)))
    assert np.max(np.abs(pushed.position - answer)) < 0.02 * largest
    assert abs(pushed.position[-1]) < 0.2 * largest


def test_a_motion_needs_no_force_beside_what_its_loop_sums_up(given):
    reference = 1e-3 * INPUTS[0]
    one = replace(given[0], driven_by=reference)
    motion = run(reference, parameter_vector(LOOP, {}), STEP_S)
    force = force_of_motion(LOOP, one, motion)
    largest = STIFFNESS * float(np.max(np.abs(motion.position)))
    assert np.max(np.abs(force)) < 2e-3 * largest
    moved = derived(SimulatorRun(motion.position, motion.velocity), STEP_S)
    without = replace(LOOP, reset_per_s=0.0)
    summed_up = np.std(force_along(without, moved, one))
    assert summed_up > 0.03 * largest
    assert np.std(force_along(LOOP, moved, one)) < 0.1 * summed_up
    # A change of the motion is summed up, too.
    more = force_of_change(LOOP, moved, 0.0 * moved.position, STEP_S)
    summed = force_of_change(without, moved, 0.0 * moved.position, STEP_S) - more
    np.testing.assert_allclose(
        summed[1:], -9.0 * STIFFNESS * STEP_S * np.cumsum(moved.position)[:-1]
    )


@pytest.mark.thorough
@pytest.mark.parametrize("lag_s", [0.003, 0.05])
def test_a_simulation_without_inertia_gets_a_mass_that_samples_show(given, lag_s):
    """Its rest of a mass took a thousand steps for a sample: a diagnosis did not end."""
    keeps = np.exp(-STEP_S / lag_s)
    runs = [
        SimulatorRun(lfilter([1 - keeps], [1, -keeps], 1e-3 * one), NOTHING)
        for one in INPUTS
    ]
    found = fit_stand_in(given, runs)
    # No faster than a tenth of a sample, and so far below what a lag of three shows.
    assert found.mass_kg >= 0.099 * STEP_S * found.damping_N_s_per_m
    assert found.mass_kg >= 0.0099 * STEP_S**2 * found.stiffness_N_per_m
    settles = found.damping_N_s_per_m / found.stiffness_N_per_m
    # The filter holds its input, which is half a sample of lag.
    assert settles == pytest.approx(lag_s, abs=STEP_S)
    for one, of_simulation in zip(given, runs, strict=True):
        moved = derived(of_simulation, STEP_S)
        force = force_along(found, moved, one)
        there = standing_for(one, of_simulation, found, force)
        size = float(np.std(of_simulation.output))
        # What the mass adds is made up for by the force along the motion.
        assert float(np.std(there.offset)) < 1e-2 * size


# A drive that is not the simulation, which bends.
ROUGH = Drive(
    mass_kg=0.3, damping_N_s_per_m=8.0, stiffness_N_per_m=1200.0,
    force_constant_N_per_A=5.0,
)  # fmt: skip


def test_with_its_force_the_stand_in_moves_as_a_nonlinear_simulation(given):
    output = integrate(HARDENING, HARDENING.values, INPUTS[0], STEP_S)
    found = SimulatorRun(output, NOTHING)
    moved = derived(found, STEP_S)
    force = force_along(ROUGH, moved, given[0])
    one = standing_for(given[0], found, ROUGH, force)
    plain = moved_plainly(ROUGH, one, force, moved)
    # By straight lines of the force between samples.
    assert np.max(np.abs(one.offset)) < 1e-4 * np.max(np.abs(output))
    np.testing.assert_allclose(plain.position + one.offset, output, atol=1e-15)


def test_the_force_of_a_motion_is_what_an_effect_made(given):
    drive = Drive(
        mass_kg=MASS, damping_N_s_per_m=DAMPING, stiffness_N_per_m=STIFFNESS,
        force_constant_N_per_A=GAIN,
    )  # fmt: skip
    vector = parameter_vector(drive, {"quadratic_drag": {"drag_N_s2_per_m2": 40.0}})
    motion = run(INPUTS[0], vector, STEP_S)
    found = force_of_motion(drive, given[0], motion)
    law = -40.0 * motion.velocity * np.abs(motion.velocity)
    assert np.max(np.abs(found - law)) < 2e-3 * np.max(np.abs(law))


def test_the_force_of_friction_leads_the_plain_drive_the_same_way(given):
    drive = Drive(
        mass_kg=MASS, damping_N_s_per_m=DAMPING, stiffness_N_per_m=STIFFNESS,
        force_constant_N_per_A=GAIN,
    )  # fmt: skip
    vector = parameter_vector(drive, {"coulomb_friction": {"force_N": 3.0}})
    motion = run(INPUTS[0], vector, STEP_S)
    force = force_of_motion(drive, given[0], motion)
    without = linear(GAIN * INPUTS[0])
    again = linear(GAIN * INPUTS[0] + force)
    # Jumps within a sample are spread over it.
    assert np.std(again - motion.position) < 2e-3 * np.std(motion.position - without)


def hardening(command, **values):
    return integrate(HARDENING, {**HARDENING.values, **values}, command, STEP_S)


def test_the_spring_of_a_stand_in_is_curved_where_that_of_the_simulation_is(given):
    outputs = [hardening(one) for one in INPUTS]
    runs = [SimulatorRun(one, NOTHING) for one in outputs]
    found = in_newtons(fit_stand_in(given, runs), 1 / HARDENING.values["kt"])
    bends = (found.stiffness_N_per_m, found.cubic_N_per_m3)
    # Derivatives of a spline at steps of 1 ms.
    assert bends == pytest.approx((900.0, 4e6), rel=0.01)
    plain = moved_plainly(found, given[0], 0 * TIME, derived(runs[0], STEP_S))
    assert np.std(plain.position - outputs[0]) < 1e-2 * np.std(outputs[0])
    straight = fit_stand_in(given, runs, may_curve=False)
    assert straight.cubic_N_per_m3 == 0.0


def swung(command, **values):
    """A pendulum: its spring is a sine, which no stand-in is."""
    return integrate(PENDULUM, {**PENDULUM.values, **values}, command, STEP_S)


SWINGS = [
    size * np.sin(2 * np.pi * frequency * (TIME - 0.05)) * (TIME > 0.05)
    for size, frequency in ((1.2, 2.0), (2.8, 2.0))
]


@pytest.mark.thorough
def test_a_spring_that_would_let_go_beyond_what_was_seen_stays_straight():
    def found(share):
        commands = [share / 2 * one for one in SWINGS]
        runs = [SimulatorRun(swung(one), NOTHING) for one in commands]
        widest = max(np.max(np.abs(one.output)) for one in runs)
        return fit_stand_in([signals(one) for one in commands], runs), widest

    # Beyond a quarter turn it becomes softer, and still pushes back.
    drive, widest = found(4.0)
    assert drive.cubic_N_per_m3 < 0
    assert widest > np.pi / 2
    # Its cubic pushes no more from about 2.7 on.
    drive, widest = found(5.3)
    assert drive.cubic_N_per_m3 == 0.0
    assert 2.7 / 1.2 < widest < 2.7


@pytest.mark.thorough
@pytest.mark.parametrize("share", [0.9, 1.2])
def test_the_error_of_a_stand_in_is_about_what_it_makes_wrong(share):
    # Recordings of a pendulum whose weight is off, by a fit that knows by how much.
    runs = [SimulatorRun(swung(one), NOTHING) for one in SWINGS]
    given = [signals(one) for one in SWINGS]
    found = fit_stand_in(given, runs)
    assert found.cubic_N_per_m3 < 0
    measured = [swung(one, g=share * PENDULUM.values["g"]) for one in SWINGS]
    told = [
        replace(one, output=y, compared=y)
        for one, y in zip(given, measured, strict=True)
    ]
    right = replace(
        found,
        stiffness_N_per_m=share * found.stiffness_N_per_m,
        one_curve_N_per_m=found.stiffness_N_per_m,
    )
    wrong = 0.0
    for one, run_of, y in zip(told, runs, measured, strict=True):
        moved = derived(run_of, STEP_S)
        force = force_along(found, moved, one)
        wrong += float(
            np.sum((moved_plainly(right, one, force, moved).position - y) ** 2)
        )
    # A size, no value: within a factor of four, of what is 100 times less than the gap.
    assert 1 / 16 < error_of(found, told, runs) / wrong < 16
    gap = sum(
        np.sum((y - one.output) ** 2) for y, one in zip(measured, runs, strict=True)
    )
    assert wrong < 1e-4 * gap


@pytest.mark.parametrize("level", [0.0, 20.0])
def test_a_stand_in_of_a_linear_drive_has_no_error(given, level):
    # A room's temperature is 20 times what the input adds to it.
    largest = max(np.ptp(linear(GAIN * one)) for one in INPUTS)
    level *= largest
    runs = [SimulatorRun(level + linear(GAIN * one), NOTHING) for one in INPUTS]
    told = [
        replace(one, output=moved, compared=moved)
        for one, run_of in zip(given, runs, strict=True)
        for moved in [level + 1.5 * (run_of.output - level)]
    ]
    gap = sum(float(np.sum((0.5 * (one.output - level)) ** 2)) for one in runs)
    assert error_of(fit_stand_in(given, runs), told, runs) < 1e-6 * gap


def test_a_spring_that_is_one_curve_changes_as_a_whole():
    alone = StandIn(stiffness_N_per_m=900.0, quadratic_N_per_m2=2e4, cubic_N_per_m3=4e6)
    whole = replace(alone, one_curve_N_per_m=900.0)
    assert alone.bends == whole.bends == (2e4, 4e6)
    assert replace(alone, stiffness_N_per_m=1800.0).bends == (2e4, 4e6)
    assert replace(whole, stiffness_N_per_m=1800.0).bends == (4e4, 8e6)
    # In another unit of the force it is the same curve.
    assert in_newtons(whole, 10.0).bends == pytest.approx((2e3, 4e5))


CURVED = StandIn(
    mass_kg=0.3, damping_N_s_per_m=8.0, stiffness_N_per_m=900.0,
    force_constant_N_per_A=5.0, quadratic_N_per_m2=2e4, cubic_N_per_m3=4e6,
)  # fmt: skip


def test_what_an_effect_made_is_what_a_curved_spring_did_not(given):
    drag = {"quadratic_drag": {"drag_N_s2_per_m2": 40.0}}
    motion = run(INPUTS[0], parameter_vector(CURVED, drag), STEP_S)
    found = force_of_motion(CURVED, given[0], motion)
    law = -40.0 * motion.velocity * np.abs(motion.velocity)
    assert np.max(np.abs(found - law)) < 2e-3 * np.max(np.abs(law))


def test_a_small_further_force_moves_a_curved_stand_in_as_it_says(given):
    push = 0.05 * np.sin(2 * np.pi * 6 * TIME)
    nothing = derived(SimulatorRun(0 * TIME, NOTHING), STEP_S)
    before = moved_plainly(CURVED, given[0], 0 * TIME, nothing).position
    after = moved_plainly(CURVED, given[0], push, nothing).position
    change = derived(SimulatorRun(after - before, NOTHING), STEP_S)
    found = force_of_change(CURVED, change, 0.5 * (before + after), 1.0)
    # Ends of the spline apart.
    assert np.max(np.abs(found - push)[20:-20]) < 0.01 * np.max(push)
    straight = force_of_change(replace(CURVED, cubic_N_per_m3=0.0), change, before, 1.0)
    assert np.max(np.abs(straight - push)[20:-20]) > 0.1 * np.max(push)


def test_what_has_no_spring_is_given_none():
    """A free run shrank it to a rounding error, which any effect then changed manyfold."""
    commands = [one + 0.3 * (TIME > 0.05) for one in INPUTS]
    runs = [
        # A valve that passes a little more than in proportion.
        SimulatorRun(np.cumsum(9.5 * STEP_S * (u + 0.01 * u * abs(u))), NOTHING)
        for u in commands
    ]
    assert fit_stand_in([signals(u) for u in commands], runs).stiffness_N_per_m == 0.0


@pytest.mark.parametrize("stiffness", [0.0, 2.0])
def test_a_coil_beside_a_free_axis_is_no_spring_and_a_weak_spring_is_one(stiffness):
    """A mass and a damper leave a little of the coil, which a spring took up."""
    coil = np.polymul([MASS, DAMPING, stiffness], [0.004, 1.0])
    # From noise on, as a logged input begins.
    rng = np.random.default_rng(1)
    commands = [one + 0.01 * rng.standard_normal(TIME.size) for one in INPUTS]
    runs = [SimulatorRun(lsim(([GAIN], coil), u, TIME)[1], NOTHING) for u in commands]
    found = fit_stand_in([signals(u) for u in commands], runs)
    assert (found.stiffness_N_per_m > 0) == (stiffness > 0)


@pytest.mark.parametrize(
    ("stiffness", "lag_s"),
    [
        # A plate of 200 s, sampled each second: a whole sample is the 200th part.
        (0.6, 1.0),
        # One of 20 s: 0.1 s, and one of 4 s no less than a tenth of a sample.
        (6.0, 0.1),
        (30.0, 0.1),
        # Without a spring nothing lets go: a sample.
        (0.0, 1.0),
    ],
)
def test_what_stands_for_a_slow_process_has_no_short_steps(stiffness, lag_s):
    massless = StandIn(
        mass_kg=1e-9, damping_N_s_per_m=120.0, stiffness_N_per_m=stiffness,
        force_constant_N_per_A=1.0,
    )  # fmt: skip
    found = _no_faster_than_seen(massless, [SimpleNamespace(sample_time_s=1.0)])
    assert found.mass_kg == pytest.approx(120.0 * lag_s, rel=1e-9)


@pytest.mark.parametrize(
    ("own", "first", "is_in_balance"),
    [((3.0, 0.0), 0.0, False), ((3.0, 0.0), 1e-2, True), ((0.0, 0.5), 0.5, False)],
)
def test_a_start_of_a_speed_is_compared_with_the_speed(own, first, is_in_balance):
    run_with_force = SimulatorRun(np.linspace(first, 1.0, 50), NOTHING)
    one = replace(signals(INPUTS[0]), own_start=own, is_velocity=True)
    assert starts_in_balance(one, run_with_force) is is_in_balance
