"""The motion of the blind test's machine against that of another integrator."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.blind.inputs import sine
from tests.blind.machine import SAMPLE_TIME_S, Machine
from tests.blind.machine import move as moved

BASE = Machine()
COMMAND = sine(5.0, 7.0)[60:310]
TIMES = np.arange(len(COMMAND)) * SAMPLE_TIME_S
# Kinks in a force inside a step of 50 us cost up to 2e-8 m; the motion is 0.025 m and
# the smallest noise of a case 2e-5 m.
KINKED_M = 5e-8
SMOOTH_M = 1e-9


_APPENDAGE = ("appendage_kg", "appendage_N_per_m", "appendage_N_s_per_m")


def current_at(t):
    return float(np.interp(t, TIMES, COMMAND))


def plain_force(t, x, v, current=None):
    i = current_at(t) if current is None else current
    return 5.0 * i - 15.1 * v - 1184.0 * x


def reference(rates, states=2):
    """Positions by another integrator, from sample to sample: the current has kinks."""
    state, found = np.zeros(states), [0.0]
    for start, end in itertools.pairwise(TIMES):
        part = solve_ivp(
            rates, (start, end), state, method="DOP853", rtol=1e-9, atol=1e-13
        )
        state = part.y[:, -1]
        found.append(state[0])
    return np.array(found)


def one_mass(force):
    return lambda t, s: [s[1], force(t, s[0], s[1]) / 0.3]


def distance(machine, expected):
    return np.abs(moved(machine, COMMAND, steps=20).position_m - expected).max()


def gap_spring(x, gap):
    return math.copysign(max(abs(x) - gap, 0.0), x)


ONE_MASS = {
    "drag": (
        {"drag": 12.0},
        lambda t, x, v: plain_force(t, x, v) - 12.0 * v * abs(v),
        KINKED_M,
    ),
    "cubic": (
        {"cubic_N_per_m3": 6e5},
        lambda t, x, v: plain_force(t, x, v) - 6e5 * x**3,
        SMOOTH_M,
    ),
    "quadratic": (
        {"quadratic_N_per_m2": -5e3},
        lambda t, x, v: plain_force(t, x, v) + 5e3 * x**2,
        SMOOTH_M,
    ),
    "upper stop": (
        {"upper_stop_m": 0.015, "stop_N_per_m": 5e3},
        lambda t, x, v: plain_force(t, x, v) - 5e3 * max(x - 0.015, 0.0),
        KINKED_M,
    ),
    "spring gap": (
        {"spring_gap_m": 0.001},
        lambda t, x, v: plain_force(t, x, v) + 1184.0 * (x - gap_spring(x, 0.001)),
        KINKED_M,
    ),
    "cogging": (
        {"cogging_N": 1.5, "cogging_period_m": 0.005, "cogging_phase": 1.0},
        lambda t, x, v: (
            plain_force(t, x, v)
            - 1.5 * (math.sin(2 * math.pi * x / 0.005 + 1.0) - math.sin(1.0))
        ),
        SMOOTH_M,
    ),
    "saturation": (
        {"limit_A": 3.5},
        lambda t, x, v: plain_force(t, x, v, max(min(current_at(t), 3.5), -3.5)),
        KINKED_M,
    ),
    "dead zone": (
        {"dead_zone_up_A": 0.3, "dead_zone_down_A": 0.2},
        lambda t, x, v: plain_force(
            t, x, v, max(current_at(t) - 0.3, 0.0) - max(-current_at(t) - 0.2, 0.0)
        ),
        KINKED_M,
    ),
    "sag": (
        {"linear_loss": 0.3},
        lambda t, x, v: plain_force(
            t, x, v, current_at(t) * (1 - 0.3 * abs(current_at(t)) / 5)
        ),
        SMOOTH_M,
    ),
    "saturated constant": (
        {"square_loss": 0.3},
        lambda t, x, v: plain_force(
            t, x, v, current_at(t) * (1 - 0.3 * (current_at(t) / 5) ** 2)
        ),
        SMOOTH_M,
    ),
    "voltage limit": (
        {"voltage_limit_A": 4.5, "voltage_slope_A_s_per_m": 4.0},
        lambda t, x, v: plain_force(
            t, x, v, max(min(current_at(t), 4.5 - 4 * v), -4.5 - 4 * v)
        ),
        KINKED_M,
    ),
}


@pytest.mark.parametrize("name", ONE_MASS)
def test_a_force_law_gives_the_motion_of_another_integrator(name):
    fields, force, tolerance = ONE_MASS[name]

    expected = reference(one_mass(force))

    assert distance(BASE._replace(**fields), expected) < tolerance
    # The law is at work: without it the motion is a thousand times further off.
    assert distance(BASE, expected) > 1000 * tolerance


@pytest.mark.thorough
def test_further_states_give_the_motion_of_another_integrator():
    stiffness, damping = 0.05 * (2 * math.pi * 30) ** 2, 2 * 0.05 * 0.05 * 188.5

    def appendage(t, s):
        x, v, r, w = s
        pull = stiffness * (r - x) + damping * (w - v)
        return [v, (plain_force(t, x, v) + pull) / 0.3, w, -pull / 0.05]

    def hysteresis(t, s):
        x, v, z = s
        yielded = v * (1 - z * np.sign(v)) / 0.002
        return [v, (plain_force(t, x, v) - 2 * z) / 0.3, yielded]

    def heated(t, s):
        x, v, heat = s
        current = current_at(t)
        force = plain_force(t, x, v, current * (1 - 0.3 * heat))
        return [v, force / 0.3, ((current / 5) ** 2 - heat) / 0.5]

    def lagged(t, s):
        x, v, current = s
        force = plain_force(t, x, v, current)
        return [v, force / 0.3, (current_at(t) - current) / 0.005]

    def creeping(t, s):
        x, v, slow = s
        force = plain_force(t, x, v) - 200 * (x - slow)
        return [v, force / 0.3, (x - slow) / 0.7]

    trials = (
        (appendage, 4, dict(zip(_APPENDAGE, (0.05, stiffness, damping), strict=True))),
        (hysteresis, 3, {"hysteresis_N": 2.0, "yield_m": 0.002}),
        (heated, 3, {"heat_loss": 0.3, "heat_time_s": 0.5}),
        (lagged, 3, {"lag_s": 0.005}),
        (creeping, 3, {"creep_N_per_m": 200.0, "creep_time_s": 0.7}),
    )
    for rates, states, fields in trials:
        expected = reference(rates, states)
        assert distance(BASE._replace(**fields), expected) < KINKED_M, rates.__name__
        assert distance(BASE, expected) > 1000 * KINKED_M, rates.__name__


@pytest.mark.thorough
def test_gear_and_bristles_give_the_motion_of_another_integrator():
    def gear(t, s):
        x, v, xm, vm = s
        twist = gap_spring(xm - x, 3e-4)
        force = 6e4 * twist + 30 * (vm - v) if twist else 0.0
        force = max(force, 0.0) if twist > 0 else min(force, 0.0)
        load = force - 15.1 * v - 1184 * x
        return [v, load / 0.2, vm, (5 * current_at(t) - force) / 0.1]

    def bristles(t, s):
        x, v, z = s
        level = 1.5 + 0.5 * math.exp(-((v / 0.04) ** 2))
        rate = v - 5000 * abs(v) * z / level
        return [v, (plain_force(t, x, v) - 5000 * z - 2 * rate) / 0.3, rate]

    geared = BASE._replace(
        motor_kg=0.1, gear_half_gap_m=3e-4, gear_N_per_m=6e4, gear_N_s_per_m=30.0
    )
    rubbing = BASE._replace(
        bristle_N_per_m=5000.0,
        bristle_N=1.5,
        bristle_excess_N=0.5,
        stribeck_m_per_s=0.04,
        bristle_damping_N_s_per_m=2.0,
    )

    # Every contact of the teeth is a jump of the damping force inside a step: 1e-6 m,
    # 5 % of the smallest noise of a case.
    assert distance(geared, reference(gear, 4)) < 1e-6
    assert distance(rubbing, reference(bristles, 3)) < KINKED_M
    assert distance(BASE, reference(gear, 4)) > 1e-4


def friction_reference(level, break_away):
    """Sliding by ``solve_ivp`` with an event at rest, sticking by a fine search."""
    t, x = 0.0, 0.0
    expected = np.zeros(len(TIMES))

    def stopped(t, s):
        return s[1]

    stopped.terminal = True
    fine = np.arange(0.0, TIMES[-1], 1e-6)
    pulls = 5.0 * np.interp(fine, TIMES, COMMAND)
    while t < TIMES[-1]:
        waiting = np.abs(pulls - 1184.0 * x) > break_away
        waiting[fine < t] = False
        if not waiting.any():
            expected[t <= TIMES] = x
            break
        # A reversal at speed goes on at once; a later break-away is found to 1 us.
        pull = abs(5.0 * current_at(t) - 1184.0 * x)
        start = t if pull > break_away else fine[waiting.argmax()]
        expected[(t <= TIMES) & (start >= TIMES)] = x
        way = np.sign(plain_force(start, x, 0.0))
        stopped.direction = -way
        found = solve_ivp(
            lambda t, s, way=way: [
                s[1],
                (plain_force(t, *s) - way * level(s[1])) / 0.3,
            ],
            (start, TIMES[-1]),
            # A push of 1e-12 m/s off rest: the event at the start is no stop.
            [x, way * 1e-12],
            method="DOP853",
            dense_output=True,
            rtol=1e-10,
            atol=1e-13,
            max_step=SAMPLE_TIME_S,
            events=stopped,
        )
        inside = (start <= TIMES) & (found.t[-1] >= TIMES)
        expected[inside] = found.sol(TIMES[inside])[0]
        t, x = found.t[-1], found.y[0, -1]
    return expected


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("excess", "speed"), [(0.0, 1.0), (1.0, 0.05)], ids=["coulomb", "stribeck"]
)
def test_dry_friction_gives_the_motion_with_located_events(excess, speed):
    machine = BASE._replace(
        forward_N=1.5,
        backward_N=1.5,
        static_excess_N=excess,
        stribeck_m_per_s=speed,
    )

    expected = friction_reference(
        lambda v: 1.5 + excess * math.exp(-((v / speed) ** 2)), 1.5 + excess
    )

    # Break-away is looked for in steps of 1 us in the reference.
    assert distance(machine, expected) < KINKED_M
    assert distance(BASE, expected) > 1000 * KINKED_M
