import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, linalg, signal

from hwid_cli.drive import excitation
from hwid_cli.drive.mechanics import simulate_motion, spring_force
from hwid_cli.records.mechanics import Contact, Friction, Mechanics
from tests.drive.dry_friction import friction_force, sticks

GUN = Mechanics(friction=Friction(2.4, 3.6), contact=Contact(0.33, 250.0))
NO_FRICTION = Friction(0.0, 0.0)
NO_CONTACT = Contact(1.0, 0.0)
LINEAR = replace(GUN, friction=NO_FRICTION, contact=NO_CONTACT)
RUBBING = replace(GUN, contact=NO_CONTACT)
TS = 0.005


def wild_current(n: int = 1500) -> np.ndarray:
    """Return a current that makes the gun slide, reverse, stick and touch."""
    rng = np.random.default_rng(11)
    return excitation.random_levels(
        n, 9.0, shortest_samples=10, longest_samples=60, rng=rng
    ) + excitation.sine(n, 0.5, 0.5)


# Linear motion ------------------------------------------------------------------------


@pytest.mark.parametrize("damping", [0.0, 15.0, 200.0])
def test_linear_motion_agrees_with_scipy(damping):
    mechanics = replace(LINEAR, damping_N_s_per_m=damping)
    current = wild_current()
    position, velocity = simulate_motion(current, mechanics, sample_time_s=TS)
    system = signal.StateSpace(
        [[0.0, 1.0], [-968.0 / 2.0, -damping / 2.0]],
        [[0.0], [48.4 / 2.0]],
        np.eye(2),
        np.zeros((2, 1)),
    )
    expected = signal.lsim(system, current, TS * np.arange(current.size))[1]
    # 1500 steps of rounding, the undamped case resonates.
    np.testing.assert_allclose(position, expected[:, 0], atol=1e-12)
    np.testing.assert_allclose(velocity, expected[:, 1], atol=1e-10)


def test_free_axis_with_damping_approaches_its_final_speed():
    mechanics = replace(LINEAR, stiffness_N_per_m=0.0)
    _, velocity = simulate_motion(np.full(200, 2.0), mechanics, sample_time_s=TS)
    t = TS * np.arange(200)
    expected = 2.0 * 48.4 / 15.0 * (1 - np.exp(-15.0 / 2.0 * t))
    np.testing.assert_allclose(velocity, expected, rtol=1e-12)


def test_mass_that_stops_exactly_at_a_sample_turns_back_at_once():
    mechanics = replace(
        LINEAR,
        mass_kg=1.0,
        damping_N_s_per_m=0.0,
        stiffness_N_per_m=0.0,
        force_constant_N_per_A=1.0,
    )
    force = np.array([1.0, 0.0, -1.0, -1.0])
    position, velocity = simulate_motion(force, mechanics, sample_time_s=0.125)
    # Exact integrals: x gains v h + (2 f0 + f1) h^2 / 6, v gains (f0 + f1) h / 2.
    expected = np.array([0.0, 2.0, 4.0, 1.0]) / 6 * 0.125**2
    np.testing.assert_allclose(position, expected, atol=1e-17)
    np.testing.assert_allclose(velocity, [0.0, 0.0625, 0.0, -0.125], atol=1e-17)


# Friction -----------------------------------------------------------------------------


def test_free_swing_against_friction_loses_four_coulomb_lengths_a_cycle():
    mechanics = replace(
        RUBBING, damping_N_s_per_m=0.0, friction=Friction(2.4, 2.4), mass_kg=2.0
    )
    period = 2 * np.pi * np.sqrt(2.0 / 968.0)
    position, _ = simulate_motion(
        np.zeros(501), mechanics, sample_time_s=period / 100, position_m=0.1
    )
    expected = 0.1 - 4 * 2.4 / 968.0 * np.arange(6)
    # Rounding; every half cycle is pi sqrt(m/k) long, so samples hit the extremes.
    np.testing.assert_allclose(position[::100], expected, atol=1e-12)


def test_free_swing_ends_at_rest_within_the_stiction_band():
    position, velocity = simulate_motion(
        np.zeros(2000), RUBBING, sample_time_s=TS, position_m=0.1
    )
    assert velocity[-1] == 0.0
    assert abs(position[-1]) <= 3.6 / 968.0
    np.testing.assert_array_equal(position[-500:], position[-1])


def test_mass_that_stops_between_both_levels_stays():
    # Half a cycle takes two Coulomb lengths: 0.0225 m to -0.01754 m, pulled with 17 N.
    law = Friction(coulomb_N=2.4, break_away_N=20.0)
    mechanics = replace(RUBBING, damping_N_s_per_m=0.0, friction=law)
    position, velocity = simulate_motion(
        np.zeros(100), mechanics, sample_time_s=TS, position_m=0.0225
    )
    assert position[-1] == pytest.approx(-0.0225 + 2 * 2.4 / 968.0, abs=1e-15)
    np.testing.assert_array_equal(velocity[50:], 0.0)


def test_rubbing_mass_that_stops_exactly_at_a_sample_turns_against_friction():
    mechanics = replace(
        RUBBING,
        mass_kg=1.0,
        damping_N_s_per_m=0.0,
        stiffness_N_per_m=0.0,
        force_constant_N_per_A=1.0,
        friction=Friction(0.25, 0.25),
    )
    # Less friction: 1 to 0 to -1 N while moving forward, then -0.5 N backward.
    force = np.array([1.25, 0.25, -0.75, -0.75])
    position, velocity = simulate_motion(force, mechanics, sample_time_s=0.125)
    assert velocity[2] == 0.0
    expected = position[2] - 0.5 * 0.5 * 0.125**2
    assert position[3] == pytest.approx(expected, abs=1e-17)


@given(force=st.floats(-3.6, 3.6))
@settings(deadline=None)
def test_nothing_moves_within_the_break_away_force(force):
    current = np.concatenate([np.linspace(0, force / 48.4, 20), np.zeros(5)])
    position, velocity = simulate_motion(current, RUBBING, sample_time_s=TS)
    # 3.6 / 48.4 times 48.4 may round to the next number above 3.6.
    np.testing.assert_allclose(position, 0.0, atol=1e-12)
    np.testing.assert_allclose(velocity, 0.0, atol=1e-9)


@pytest.mark.parametrize("direction", [-1.0, 1.0])
@pytest.mark.parametrize("start", [0.0, 0.002])
def test_motion_begins_when_the_force_reaches_break_away(direction, start):
    slope = direction * 7.3
    moves_at = (direction * 3.6 + 968.0 * start) / 48.4 / slope
    n = 40
    current = slope * TS * np.arange(n)
    position, velocity = simulate_motion(
        current, RUBBING, sample_time_s=TS, position_m=start
    )
    t = TS * np.arange(n)
    resting = t <= moves_at
    assert 1 <= resting.sum() < n - 10
    np.testing.assert_array_equal(position[resting], start)
    # From there on the motion is linear, with friction as a constant force.
    system = np.zeros((4, 4))
    system[0, 1] = 1.0
    system[1] = [-968.0 / 2.0, -15.0 / 2.0, 1.0 / 2.0, 0.0]
    system[2, 3] = 1.0
    begin = [start, 0.0, 48.4 * slope * moves_at - direction * 2.4, 48.4 * slope]
    expected = np.array(
        [linalg.expm(system * (time - moves_at)) @ begin for time in t[~resting]]
    )
    np.testing.assert_allclose(position[~resting], expected[:, 0], atol=1e-12)
    np.testing.assert_allclose(velocity[~resting], expected[:, 1], atol=1e-11)


def test_motion_agrees_with_a_general_integrator_that_watches_for_stops():
    current = excitation.sine(160, 2.0, 0.05) + excitation.sine(160, 3.0, 0.31)
    position, velocity = simulate_motion(current, RUBBING, sample_time_s=TS)
    reference = integrate_with_stops(current, RUBBING)
    # The integrator's tolerance, summed over 160 samples and their events.
    np.testing.assert_allclose(position, reference[:, 0], atol=1e-10)
    np.testing.assert_allclose(velocity, reference[:, 1], atol=1e-8)
    assert np.sum(np.diff(np.sign(velocity)) != 0) > 5


def integrate_with_stops(current: np.ndarray, mechanics: Mechanics) -> np.ndarray:
    """Second way: scipy's integrator, restarted at each stop and break-away."""
    state = np.zeros(2)
    states = [state]
    for before, after in itertools.pairwise(current):
        slope = (after - before) / TS
        now = 0.0

        def applied(t, x, before=before, slope=slope):
            push = mechanics.force_constant_N_per_A * (before + slope * t)
            return push - spring_force(x, mechanics)

        while now < TS:
            if state[1] == 0.0 and sticks(applied(now, state[0]), mechanics.friction):
                ahead = np.linspace(now, TS, 20_001)
                free = ~sticks(applied(ahead, state[0]), mechanics.friction)
                if not free.any():
                    break
                now = break_away_root(applied, state[0], ahead, int(np.argmax(free)))
            direction = np.sign(state[1]) or np.sign(applied(now, state[0]))
            state, now = slide(applied, direction, state, now, mechanics)
        states.append(state)
    return np.array(states)


def break_away_root(applied, position, ahead, first) -> float:
    """Return the moment of break-away, by the line through two moments around it."""
    low, high = ahead[first - 1], ahead[first]
    level = np.sign(applied(high, position)) * GUN.friction.break_away_N
    a, b = applied(low, position) - level, applied(high, position) - level
    return low - a * (high - low) / (b - a)


def slide(applied, direction, state, now, mechanics):
    """Integrate to the next stop or to the end of the sample."""

    def rates(t, z):
        force = applied(t, z[0]) - mechanics.damping_N_s_per_m * z[1]
        rubbing = friction_force(np.array(direction), np.array(0.0), mechanics.friction)
        return [z[1], (force + rubbing) / mechanics.mass_kg]

    def stop(_, z):
        return direction * z[1]

    stop.terminal, stop.direction = True, -1
    result = integrate.solve_ivp(
        rates, (now, TS), state, method="DOP853", events=stop, rtol=1e-12, atol=1e-14
    )
    end = result.y[:, -1].copy()
    if result.status == 1:
        end[1] = 0.0
    return end, result.t[-1]


# Contact ------------------------------------------------------------------------------


def test_free_mass_bounces_off_the_contact_in_half_an_oscillation():
    mechanics = replace(
        LINEAR,
        damping_N_s_per_m=0.0,
        stiffness_N_per_m=0.0,
        contact=Contact(0.1, 5000.0),
    )
    touching = np.pi * np.sqrt(2.0 / 5000.0)
    t = TS * np.arange(80)
    position, velocity = simulate_motion(
        np.zeros(80), mechanics, sample_time_s=TS, velocity_m_per_s=0.7
    )
    arrives, leaves = 0.1 / 0.7, 0.1 / 0.7 + touching
    inside = 0.1 + 0.7 * np.sqrt(2.0 / 5000.0) * np.sin(
        np.sqrt(5000.0 / 2.0) * (t - arrives)
    )
    expected = np.where(
        t < arrives, 0.7 * t, np.where(t < leaves, inside, 0.1 - 0.7 * (t - leaves))
    )
    # Rounding of a motion of 0.3 m.
    np.testing.assert_allclose(position, expected, atol=1e-13)
    assert velocity[-1] == pytest.approx(-0.7, rel=1e-12)


def test_contact_on_one_side_leaves_the_other_side_alone():
    current = -np.abs(wild_current(300))
    touching = simulate_motion(current, GUN, sample_time_s=TS)[0]
    free = simulate_motion(current, RUBBING, sample_time_s=TS)[0]
    below = np.argmax(free > 0.33) or free.size
    np.testing.assert_array_equal(touching[:below], free[:below])
