"""The machine of the blind test against closed forms, limits and conservation."""

import numpy as np
import pytest

from tests.blind.effects import CATALOGUE, RANGES, draw, hide
from tests.blind.inputs import plan, returning_step, sine
from tests.blind.machine import Machine, current_through, half_steps
from tests.blind.machine import move as moved
from tests.blind.refit import linear_response

BASE = Machine()
COMMAND = sine(5.0, 7.0)[60:460]
_APPENDAGE = ("appendage_kg", "appendage_N_per_m", "appendage_N_s_per_m")


def test_the_plain_drive_moves_as_the_exact_linear_solution():
    commands = (sine(5.0, 12.0), returning_step(-5.0, 0.005))
    exact = linear_response(0.3, 15.1, 1184.0, 5.0, commands)
    for command, expected in zip(commands, exact, strict=True):
        # Fourth order at 50 us; rounding of the filter over 1200 samples.
        found = moved(BASE, command, steps=20).position_m
        assert np.abs(found - expected).max() < 1e-11


def test_friction_holds_the_mass_exactly_below_its_level():
    machine = BASE._replace(forward_N=2.6, backward_N=2.6)

    assert not moved(machine, returning_step(0.5, 0.05)).position_m.any()
    assert moved(machine, returning_step(0.6, 0.05)).position_m.any()


def test_friction_in_one_direction_only_slows_that_direction():
    slow = moved(BASE._replace(forward_N=2.0), returning_step(3.0, 0.2))
    free = moved(BASE, returning_step(3.0, 0.2))

    # In the hold it rests where friction carries up to 2 N of 15 N, upwards only.
    assert free.position_m[740] == pytest.approx(15 / 1184, abs=1e-6)
    assert 13 / 1184 <= slow.position_m[740] < 14.9 / 1184
    assert not slow.velocity_m_per_s[740]


def test_energy_only_falls_once_the_current_is_off():
    machine = BASE._replace(forward_N=3.0, backward_N=3.0, damping_N_s_per_m=0.0)
    found = moved(machine, returning_step(5.0, 0.005))

    energy = 0.15 * found.velocity_m_per_s**2 + 592.0 * found.position_m**2
    off = energy[760:]

    # Rounding of one step, relative to the energy at the start.
    assert np.diff(off).max() <= 1e-12 * off[0]
    # Friction of 3 N has taken what the mass had: it rests where the spring is weaker.
    assert not found.velocity_m_per_s[-1]
    assert 1184.0 * abs(found.position_m[-1]) <= 3.0


def test_limits_lead_back_to_the_plain_drive():
    plain = moved(BASE, COMMAND).position_m
    limits = {
        "stiff gear without a gap": {
            "motor_kg": 0.1,
            "gear_N_per_m": 1e7,
            "gear_N_s_per_m": 300.0,
        },
        "light appendage": dict(zip(_APPENDAGE, (1e-6, 0.04, 1e-6), strict=True)),
        "slow heating": {"heat_loss": 0.3, "heat_time_s": 1e6},
        "short lag": {"lag_s": 1e-7},
        "fast rate": {"rate_A_per_s": 1e6},
        "wide stop": {"upper_stop_m": 1.0, "stop_N_per_m": 1e4},
    }
    for name, fields in limits.items():
        # Each limit is approached, not reached: 1e-5 m of a motion of 0.025 m.
        found = moved(BASE._replace(**fields), COMMAND).position_m
        assert np.abs(found - plain).max() < 1e-5, name


def test_a_yield_distance_beyond_the_travel_makes_hysteresis_a_spring():
    loose = moved(BASE._replace(hysteresis_N=1e5, yield_m=1e3), COMMAND).position_m
    spring = moved(BASE._replace(stiffness_N_per_m=1284.0), COMMAND).position_m

    # z stays below 3e-5, which is the relative error of the force.
    assert np.abs(loose - spring).max() < 1e-6


def test_play_follows_the_path_between_the_samples():
    found = moved(BASE._replace(play_half_gap_m=0.002), sine(5.0, 3.0))

    lag = found.position_m - found.behind_play_m
    # It is pushed from both sides, each half gap away.
    assert lag.max() == pytest.approx(0.002, rel=1e-9)
    assert lag.min() == pytest.approx(-0.002, rel=1e-9)
    assert found.behind_play_m[:100].tolist() == [0.0] * 100
    # At the turn the follower stays at the largest position less the half gap.
    # That lies between two samples, up to a (dt / 2)^2 / 2 = 2e-6 m above both.
    beyond_samples = found.behind_play_m.max() - (found.position_m.max() - 0.002)
    assert 0 < beyond_samples < 2e-6


def test_the_command_is_shifted_limited_in_rate_and_held_linearly():
    command = np.r_[np.zeros(10), np.full(40, 3.0)]
    times = half_steps(len(command), 20)

    late = current_through(BASE._replace(delay_s=0.0042), command, times)
    slow = current_through(BASE._replace(rate_A_per_s=200.0), command, times)

    assert late == pytest.approx(np.clip(3000 * (times - 0.0132), 0, 3), abs=1e-9)
    assert slow == pytest.approx(np.clip(200 * (times - 0.009), 0, 3), abs=1e-9)


def test_a_rate_limited_current_meets_its_target_between_two_steps():
    triangle = np.interp(np.arange(60), [0, 20, 60], [0.0, 4.0, -4.0])
    times = half_steps(len(triangle), 20)

    found = current_through(BASE._replace(rate_A_per_s=150.0), triangle, times)

    # Up at 150 A/s until it meets the falling target 8 - 200 t, then down at 150 A/s.
    meets = 8.0 / 350.0
    expected = np.where(times < meets, 150 * times, 150 * (2 * meets - times))
    assert found == pytest.approx(expected, abs=5e-3 * 0.75)
    assert found[-1] == pytest.approx(expected[-1], abs=1e-12)


def test_a_load_is_in_equilibrium_from_the_first_sample():
    machine = BASE._replace(load_N=2.0, cubic_N_per_m3=5e5, spring_gap_m=1e-3)

    found = moved(machine, np.zeros(50)).position_m

    assert found[0] > 1e-3
    # The bisection of the rest position ends at rounding of the forces.
    assert np.abs(found - found[0]).max() < 1e-15
    assert 1184 * (found[0] - 1e-3) + 5e5 * found[0] ** 3 == pytest.approx(2.0)


@pytest.mark.parametrize("name", ["full", "poor", "short"])
def test_every_recording_of_a_plan_starts_at_rest(name):
    commands = plan(name, np.random.default_rng(0))

    assert len(commands) == {"full": 27, "poor": 15, "short": 10}[name]
    for command in commands.values():
        assert not command[:100].any()
        assert 0 < np.abs(command).max() <= 5.0
    assert name != "full" or sum(map(len, commands.values())) == 39000


def test_every_effect_changes_the_machine_and_less_so_when_small():
    outside_machine = {
        "sensor_quadratic",
        "sensor_cubic",
        "sensor_drift",
        "periodic_force",
        "parameter_change",
        "settled_periodic_force",
        "varying_stiffness",
        "random_force",
    }
    for effect in RANGES:
        whole = draw(effect, BASE, np.random.default_rng(1))
        again = draw(effect, BASE, np.random.default_rng(1))

        assert whole == again, effect
        if effect in CATALOGUE:
            assert draw(effect, BASE, np.random.default_rng(1), 0.2) != whole, effect
        is_inside = hide(effect, whole, BASE) != BASE
        assert is_inside == (effect not in outside_machine), effect
