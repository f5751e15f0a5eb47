"""A force that is curved beside a motor, a part or a circuit that is faster than a sample.

The second way is scipy's solver with equations of its own, or the same command in samples
so short that nothing turns far within one.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.drive.drive_cases import (
    BRISTLES,
    COGGING,
    CONTACT,
    CORNER_TIMES_S,
    CORNERS,
    COULOMB,
    CUBIC,
    DELAY,
    END_STOP,
    HYSTERESIS,
    PRELOAD,
    SAMPLE_TIME_S,
    STRIBECK,
    TIMES_S,
    rms,
    tool,
)

MASS, DAMPING, STIFFNESS, CONSTANT = 0.3, 15.1, 1184.0, 5.0
# It swings at 3000 rad/s, half a turn in a sample.
SHARE, COUPLING, RATIO = 0.03, 8e4, 0.05
LIGHT = {
    "elastic_coupling": {
        "sensor": "load",
        "stiffness_N_per_m": COUPLING,
        "motor_share": SHARE,
        "damping_ratio": RATIO,
    }
}
HEAVY = {"elastic_coupling": LIGHT["elastic_coupling"] | {"motor_share": 0.6}}
PART = {"second_mode": {"mass_kg": 0.02, "frequency_Hz": 400.0, "damping_ratio": 0.02}}
BOTH = LIGHT | PART
DRAG = {"quadratic_drag": {"drag_N_s2_per_m2": 20.0}}
CIRCUIT = {"resistance_ohm": 0.5, "inductance_H": 5e-5, "back_emf_V_s_per_m": 5.0}


def in_short_samples(effects, times, **drive):
    """The motion of the same straight lines of command, ``times`` samples for one."""
    return tool(effects, sample_time=SAMPLE_TIME_S / times, **drive).position[::times]


def solved(resisting):
    """Positions of the load, from corner to corner of the command."""
    motor, load = SHARE * MASS, (1 - SHARE) * MASS
    damping = 2 * RATIO * np.sqrt(COUPLING * motor * load / MASS)

    def rate(t, z):
        push = CONSTANT * np.interp(t, CORNER_TIMES_S, CORNERS)
        pull = COUPLING * (z[0] - z[2]) + damping * (z[1] - z[3])
        held = STIFFNESS * z[2] + DAMPING * z[3] + resisting(z[2], z[3])
        return [z[1], (push - pull) / motor, z[3], (pull - held) / load]

    state, found = np.zeros(4), [np.zeros(1)]
    for begin, end in pairwise(CORNER_TIMES_S):
        inside = TIMES_S[(TIMES_S - begin > 1e-9) & (end - TIMES_S > 1e-9)]
        done = solve_ivp(
            rate, (begin, end), state, "DOP853", rtol=1e-11, atol=1e-14,
            t_eval=[*inside, end],
        )  # fmt: skip
        found.append(done.y[2])
        state = done.y[:, -1]
    return np.concatenate(found)


@pytest.mark.parametrize(
    ("effects", "resisting"),
    [
        (CUBIC, lambda x, v: 5e5 * x**3),
        (DRAG, lambda x, v: 20.0 * v * abs(v)),
        (
            COGGING,
            lambda x, v: -0.5 * (np.sin(2 * np.pi * x / 5e-3 + 0.3) - np.sin(0.3)),
        ),
    ],
    ids=["cubic", "drag", "cogging"],
)
def test_a_curved_force_behind_a_light_motor_follows_the_solver(effects, resisting):
    # Twice what is left; the solver's own error is some 1e-11 m.
    assert rms(tool(effects | LIGHT).position - solved(resisting)) < 1e-8


@pytest.mark.parametrize("inner", [LIGHT, HEAVY, PART, BOTH], ids=str)
@pytest.mark.parametrize(
    "effects",
    [
        CUBIC,
        COULOMB,
        CUBIC | COULOMB,
        CUBIC | END_STOP,
        CUBIC | DELAY,
        HYSTERESIS,
        PRELOAD | CUBIC,
        COULOMB | END_STOP,
    ],
    ids="+".join,
)
def test_long_steps_lead_where_short_ones_do(effects, inner):
    short = in_short_samples(effects | inner, 16)
    assert rms(tool(effects | inner).position - short) < 2e-8


# Friction that falls with the speed amplifies what a step leaves; a contact with a dashpot
# lets go within one.
@pytest.mark.parametrize("inner", [LIGHT, PART], ids=str)
@pytest.mark.parametrize("effects", [STRIBECK, BRISTLES, CONTACT], ids="+".join)
def test_long_steps_through_friction_that_falls(effects, inner):
    short = in_short_samples(effects | inner, 16)
    assert rms(tool(effects | inner).position - short) < 6e-7


@pytest.mark.parametrize("inner", [LIGHT, HEAVY, PART], ids=str)
def test_the_error_falls_with_the_fourth_power_of_the_step(inner):
    exact = in_short_samples(CUBIC | inner, 64)
    one, half = (
        rms(in_short_samples(CUBIC | inner, times) - exact) for times in (1, 2)
    )
    assert one / half > 10.0


@pytest.mark.parametrize("effects", [CUBIC, CUBIC | COULOMB, DRAG], ids="+".join)
def test_a_curved_force_behind_a_quick_coil(effects):
    short = in_short_samples(effects, 16, **CIRCUIT)
    assert rms(tool(effects, **CIRCUIT).position - short) < 2e-7


# The load hangs on a heavy motor, which swings it back and forth within a sample.
SWINGING = {
    "elastic_coupling": {
        "sensor": "load",
        "stiffness_N_per_m": 3e5,
        "motor_share": 0.6,
        "damping_ratio": 0.0005,
    }
}


# Levels among which some turn the load twice within a sample: 1 to 3 um if that is missed.
@pytest.mark.parametrize("seed", [7, 9, 10])
def test_a_load_that_turns_twice_within_a_sample_is_followed(seed):
    levels = np.repeat(np.random.default_rng(seed).uniform(-1.5, 1.5, 40), 25)
    count = 32 * (levels.size - 1) + 1
    command = np.interp(np.arange(count) / 32, np.arange(levels.size), levels)
    effects = COULOMB | SWINGING
    short = tool(effects, command, sample_time=SAMPLE_TIME_S / 32).position[::32]
    assert np.abs(tool(effects, levels).position - short).max() < 1e-10
