"""Two masses on a spring against scipy's solver, with equations of their own."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

from hwid_cli.drive import slots
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import drive_effects, parameter_vector, run
from hwid_cli.records.drive import Controller, Drive
from tests.drive.drive_cases import (
    CORNER_TIMES_S,
    CORNERS,
    SAMPLE_TIME_S,
    SCALES,
    TIMES_S,
    rms,
    tool,
)

MASS, DAMPING, STIFFNESS, CONSTANT = 0.3, 15.1, 1184.0, 5.0
SHARE, COUPLING, RATIO = 0.3, 2e4, 0.04
VALUES = {"stiffness_N_per_m": COUPLING, "motor_share": SHARE, "damping_ratio": RATIO}
# Of the solver, over 0.4 s; sums of a series leave far less.
SOLVED_M = 1e-10


def coupled(sensor, **values):
    return {"elastic_coupling": VALUES | {"sensor": sensor} | values}


def solved(stiffness=STIFFNESS, start=(0.0, 0.0), rubbing=0.0):
    """States xm, vm, x, v at the samples."""
    motor, load = SHARE * MASS, (1 - SHARE) * MASS
    damping = 2 * RATIO * np.sqrt(COUPLING * motor * load / MASS)

    def rate(t, z):
        push = CONSTANT * np.interp(t, CORNER_TIMES_S, CORNERS)
        pull = COUPLING * (z[0] - z[2]) + damping * (z[1] - z[3])
        held = stiffness * z[2] + (DAMPING - rubbing) * z[3]
        return [
            z[1],
            (push - pull - rubbing * z[1]) / motor,
            z[3],
            (pull - held) / load,
        ]

    state = np.array([start[0], start[1], start[0], start[1]])
    found = [state[:, None]]
    # From corner to corner of the command, where the solution has kinks.
    for begin, end in pairwise(CORNER_TIMES_S):
        since, until = TIMES_S - begin, end - TIMES_S
        inside = TIMES_S[(since > 1e-9) & (until > 1e-9)]
        done = solve_ivp(
            rate, (begin, end), state, "DOP853", rtol=1e-11, atol=1e-14,
            t_eval=[*inside, end],
        )  # fmt: skip
        found.append(done.y)
        state = done.y[:, -1]
    return np.hstack(found)


def test_the_load_follows_two_masses_on_a_spring():
    expected = solved()
    found = tool(coupled("load"))
    assert rms(found.output - expected[2]) < SOLVED_M
    # Per second of a motion of 1 m/s.
    assert rms(found.velocity - expected[3]) < 100 * SOLVED_M


def test_a_part_of_the_damping_may_brake_the_motor():
    expected = solved(rubbing=0.6 * DAMPING)
    found = tool(coupled("motor", motor_damping_share=0.6))
    assert rms(found.output - expected[0]) < SOLVED_M
    assert rms(solved()[0] - expected[0]) > 1e4 * SOLVED_M


def test_the_sensor_may_be_at_the_motor():
    expected = solved()
    found = tool(coupled("motor"))
    assert rms(found.output - expected[0]) < SOLVED_M
    assert rms(found.velocity - expected[1]) < 100 * SOLVED_M


@pytest.mark.parametrize("sensor", ["motor", "load"])
def test_a_free_axis_starts_where_its_sensor_stands(sensor):
    expected = solved(stiffness=0.0, start=(0.004, -0.3))
    found = tool(coupled(sensor), stiffness_N_per_m=0.0, start=(0.004, -0.3)).output
    assert rms(found - expected[0 if sensor == "motor" else 2]) < SOLVED_M


def test_a_held_current_twists_the_coupling():
    found = [tool(coupled(sensor), np.full(50, 2.0)) for sensor in ("motor", "load")]
    motor, load = (one.output for one in found)
    force = 2.0 * CONSTANT
    # At rest from the first sample on: the spring's way, and the coupling's on top.
    np.testing.assert_allclose(load, force / STIFFNESS, rtol=1e-12)
    np.testing.assert_allclose(motor - load, force / COUPLING, rtol=1e-9)


def test_a_given_start_is_that_of_the_measured_place():
    command, start = np.full(50, 2.0), (0.004, 0.0)
    for sensor in ("motor", "load"):
        found = tool(coupled(sensor), command, start=start)
        assert found.output[0] == pytest.approx(0.004, abs=1e-15)


def test_a_gear_without_gap_and_damping_is_a_coupling():
    vector = {}
    for name, effects in {
        "gear": {
            "gear_backlash": {
                "half_gap_m": 1e-15,
                "stiffness_N_per_m": COUPLING,
                "motor_share": SHARE,
            }
        },
        "coupling": coupled("load", damping_ratio=0.0),
    }.items():
        drive = Drive(MASS, DAMPING, STIFFNESS, CONSTANT, effects=effects)
        vector[name] = parameter_vector(drive, drive_effects(drive))
    command = np.interp(TIMES_S, CORNER_TIMES_S, CORNERS)
    gear, coupling = (
        run(command, vector[name], SAMPLE_TIME_S).output for name in vector
    )
    # The gap, and where the gear finds its edges.
    assert rms(gear - coupling) < 1e-11
    assert vector["gear"][slots.IS_COUPLED] == 0.0


def test_a_stiff_coupling_is_one_mass():
    found = tool(coupled("motor", stiffness_N_per_m=1e9, damping_ratio=0.5)).output
    # A motion of 12 mm; the twist is 25 N / 1e9 N/m.
    assert rms(found - tool({}).output) < 1e-7


def test_teeth_and_coupling_are_springs_in_series():
    gear = {"half_gap_m": 2e-4, "stiffness_N_per_m": 3e4, "motor_share": 0.3}
    both = {"gear_backlash": gear} | coupled("load", damping_ratio=0.0)
    softer = 1 / (1 / 3e4 + 1 / COUPLING)
    one = {"gear_backlash": gear | {"stiffness_N_per_m": softer}}
    assert rms(tool(both).output - tool(one).output) < 1e-12


def test_friction_holds_the_load_and_not_the_motor():
    friction = {"coulomb_friction": {"force_N": 8.0}}
    command = np.where(TIMES_S < 0.1, 0.0, 0.6)
    assert np.all(tool(coupled("load") | friction, command).output == 0.0)
    # The motor swings on the coupling alone.
    motor, load = SHARE * MASS, (1 - SHARE) * MASS
    damping = 2 * RATIO * np.sqrt(COUPLING * motor * load / MASS)
    alone = signal.lti([CONSTANT], [motor, damping, COUPLING])
    expected = signal.lsim(alone, command, TIMES_S)[1]
    assert rms(tool(coupled("motor") | friction, command).output - expected) < 1e-14


def test_a_controller_reads_the_sensor_at_the_motor():
    reference = 0.002 * np.minimum(TIMES_S / 0.05, 1.0)
    found = tool(coupled("motor"), reference, controller=Controller(20.0, 30.0))
    wanted = 30.0 * (20.0 * (reference - found.position) - found.velocity)
    np.testing.assert_allclose(found.command, wanted, rtol=1e-12)


def test_the_stiffest_shaft_of_a_search_swings_once_in_two_samples():
    bounds = CATALOGUE["elastic_coupling:load"].parameter("stiffness_N_per_m").bounds
    scales = replace(SCALES, sample_time_s=1e-3)
    low, high = bounds(scales)
    # Of two halves on a spring, in units of their own: half of the mass has to give way.
    stiffness = np.array([[high, -high], [-high, high]]) / (scales.mass_kg / 2)
    fastest = np.sqrt(np.linalg.eigvals(stiffness).max()) / (2 * np.pi)
    assert fastest == pytest.approx(500.0)
    assert low == pytest.approx(0.5 * scales.stiffness_N_per_m)

    # Not where that is too soft to be a shaft, nor stiffer than what counts as one mass.
    assert bounds(replace(scales, sample_time_s=1.0))[1] == pytest.approx(10 * low)
    assert bounds(replace(scales, sample_time_s=5e-8))[1] == pytest.approx(2e5 * low)


def test_no_part_of_a_mass_stops_within_a_tenth_of_a_sample():
    bounds = CATALOGUE["elastic_coupling:load"].parameter("motor_share").bounds
    assert bounds(replace(SCALES, decay_per_s=0.0)) == (0.02, 0.98)
    # Two thirds of a speed are lost in half a sample: in a tenth with a fifth of the mass.
    damped = replace(SCALES, sample_time_s=2.0, decay_per_s=1.0)
    assert bounds(damped) == pytest.approx((0.2, 0.8))
    assert bounds(replace(damped, decay_per_s=50.0)) == pytest.approx((0.4, 0.6))
