"""Every effect against scipy's solver with events; see ``drive_oracle``.

Where all forces are linear between events the tool sums exactly, and what is left is the
oracle's own error, below 1e-11 m. Curved forces are followed by Runge-Kutta steps of at
most 0.3 rad: a few nm on motions of 12 mm rms. All of it is far below the 1 um that
would be seen in measurements with 0.01 % of noise.
"""

import pytest

from tests.drive.drive_cases import (
    CLIP,
    CORNER_TIMES_S,
    CORNERS,
    COULOMB,
    CUBIC,
    GEAR,
    HEAT,
    LOSS,
    SINGLE,
    TIMES_S,
    TOGETHER,
    TOGETHER_SLOW,
    VARIANTS,
    rms,
    tool,
)
from tests.drive.drive_oracle import simulate
from tests.drive.drive_oracle_machine import Machine

EXACT_M = 1e-10
# What Runge-Kutta steps leave, each with about twice what was measured.
CURVED_M = {
    # Friction that falls with the speed amplifies what a step leaves.
    "stribeck_friction": 1e-7,
    "hysteresis": 6e-9,
    "quadratic_drag": 3e-9,
    "cubic_stiffness": 5e-9,
    "quadratic_stiffness": 5e-9,
    "cogging": 1e-8,
    # |i| i has a kink within a sample where the current changes its sign.
    "supply_sag": 1e-10,
    # Temperature is a straight line within a sample.
    "thermal_gain_loss": 6e-8,
    # The voltage limit lets friction leave within one step.
    "voltage_limit": 2e-10,
    "gravity": 5e-9,
    "position_friction": 5e-9,
    # The friction of a stop that it is pressed against has the stop's stiffness.
    "load_friction": 6e-8,
    # A fifth of the whole force, which repeats every 7 mm.
    "torque_ripple": 1e-7,
}
# Contacts whose force is bent; plain ones are linear.
BENT_M = 4e-9
# A dashpot lets go where its contact would pull: a corner within a Runge-Kutta step.
LETTING_GO_M = 6e-7
# A rattling gear amplifies what both sides leave, the more without a spring.
RATTLING_M = 2e-8
# The same of what Runge-Kutta steps leave.
CURVED_RATTLING_M = 6e-7


def tolerance(effects):
    if "gear_backlash" in effects and set(effects) & set(CURVED_M):
        return CURVED_RATTLING_M
    bent = [BENT_M for one in effects.values() if "exponent" in one]
    if any("damping_N_s_per_m" in one for one in effects.values()):
        return LETTING_GO_M
    return max([EXACT_M, *bent, *(CURVED_M.get(one, 0.0) for one in effects)])


def difference(effects, start=None, **machine):
    oracle = Machine(effects=effects, **machine)
    expected, _ = simulate(oracle, CORNER_TIMES_S, CORNERS, TIMES_S, start)
    names = {
        "resistance": "resistance_ohm",
        "inductance": "inductance_H",
        "back_emf": "back_emf_V_s_per_m",
        "stiffness": "stiffness_N_per_m",
    }
    drive = {names[name]: value for name, value in machine.items()}
    return rms(tool(effects, start=start, **drive).position - expected)


def test_the_base_follows_the_oracle():
    assert difference({}) < EXACT_M


@pytest.mark.parametrize("effect", SINGLE)
def test_each_effect_follows_the_oracle(effect):
    assert difference({effect: SINGLE[effect]}) < tolerance({effect: SINGLE[effect]})


@pytest.mark.parametrize("effects", VARIANTS, ids=str)
def test_variants_and_seconds_follow_the_oracle(effects):
    assert difference(effects) < tolerance(effects)


@pytest.mark.parametrize("effects", TOGETHER, ids="+".join)
def test_effects_together_follow_the_oracle(effects):
    assert difference(effects) < tolerance(effects)


# A stop that turns the drive back within a sample, beside a force that is curved all the
# time: no step may go in and out again. Twice what Runge-Kutta steps leave.
STIFF_M = 3e-7


@pytest.mark.parametrize("stop", ["end_stop", "one_sided_stop"])
@pytest.mark.parametrize(
    "effects", [CUBIC, {"quadratic_drag": SINGLE["quadratic_drag"]}], ids="+".join
)
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_stiff_stops_beside_curved_forces_follow_the_oracle(stop, effects, exponent):
    stiffness = 1.25e7 * 1e-4 ** (1.0 - exponent)
    place = {"position_m": 0.012, "stiffness_N_per_m": stiffness}
    bent = {"exponent": exponent} if exponent != 1.0 else {}
    assert difference({stop: place | bent, **effects}) < STIFF_M


@pytest.mark.parametrize("damping", [10.0, 300.0])
@pytest.mark.parametrize("effects", [{}, CUBIC, COULOMB], ids=["", "cubic", "coulomb"])
@pytest.mark.parametrize("stop", ["end_stop", "one_sided_stop"])
def test_stops_with_a_dashpot_follow_the_oracle(stop, effects, damping):
    place = {"position_m": 0.012, "stiffness_N_per_m": 2e4}
    damped = {stop: place | {"damping_N_s_per_m": damping}, **effects}
    assert difference(damped) < tolerance(damped)


@pytest.mark.slow
@pytest.mark.parametrize("effects", TOGETHER_SLOW, ids="+".join)
def test_effects_of_many_events_together_follow_the_oracle(effects):
    assert difference(effects) < tolerance(effects)


# More damping with friction makes the oracle's events follow each other without end.
@pytest.mark.parametrize(
    ("ratio", "other"),
    [
        pytest.param(0.02, {}, marks=pytest.mark.slow),
        pytest.param(0.3, {}, marks=pytest.mark.slow),
        pytest.param(0.02, COULOMB, marks=pytest.mark.thorough),
    ],
)
def test_teeth_that_are_damped_push_and_never_pull(ratio, other):
    effects = {
        "gear_backlash": {**GEAR["gear_backlash"], "contact_damping_ratio": ratio}
    }
    assert difference(effects | other) < EXACT_M


@pytest.mark.parametrize("inductance", [0.002, 0.0])
@pytest.mark.parametrize(
    "effects", [{}, COULOMB, pytest.param(GEAR, marks=pytest.mark.slow)], ids="+".join
)
def test_a_voltage_drives_through_resistance_and_inductance(effects, inductance):
    circuit = {"resistance": 0.5, "inductance": inductance, "back_emf": 5.0}
    assert difference(effects, **circuit) < EXACT_M


@pytest.mark.parametrize(
    ("effects", "left"),
    # Losses make the force curved; what heats is the current as each sample begins.
    [(CLIP, 1e-9), (LOSS, 1e-9), (HEAT, 8e-7)],
    ids=lambda one: "+".join(one) if isinstance(one, dict) else "",
)
@pytest.mark.parametrize("inductance", [0.002, 0.0])
def test_limits_and_losses_act_on_the_current_of_the_circuit(effects, left, inductance):
    circuit = {"resistance": 1.5, "inductance": inductance, "back_emf": 5.0}
    assert difference(effects, **circuit) < left


@pytest.mark.parametrize(
    "effects",
    [{}, COULOMB, pytest.param(GEAR, marks=pytest.mark.thorough)],
    ids="+".join,
)
def test_a_free_axis_follows_the_oracle(effects):
    assert difference(effects, stiffness=0.0) < RATTLING_M


@pytest.mark.parametrize(
    "effect",
    [
        "coulomb_friction",
        "hysteresis",
        # The free axis and the single effect are the fast tests of the gear.
        pytest.param("gear_backlash", marks=pytest.mark.slow),
    ],
)
def test_a_given_start_follows_the_oracle(effect):
    effects = {effect: SINGLE[effect]}
    expected = RATTLING_M if effects == GEAR else tolerance({effect: SINGLE[effect]})
    assert difference(effects, start=(0.004, -0.3)) < expected


@pytest.mark.thorough
@pytest.mark.parametrize("motor_share", [0.05, 0.3])
@pytest.mark.parametrize("other", [{}, CUBIC, COULOMB], ids=["", "cubic", "coulomb"])
def test_a_part_of_the_damping_may_brake_the_motor_of_a_gear(other, motor_share):
    gear = {
        **GEAR["gear_backlash"],
        "motor_share": motor_share,
        "motor_damping_share": 0.4,
    }
    effects = {"gear_backlash": gear, **other}
    # Beside friction it rattles.
    assert difference(effects) < max(tolerance(effects), RATTLING_M)
