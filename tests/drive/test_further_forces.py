"""Forces that few drives have, against closed forms; see also ``test_drive_oracle``."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

from hwid_cli.drive.catalogue import CATALOGUE, entry_of, may_be_added
from hwid_cli.drive.simulation import drive_effects, simulate_drive
from hwid_cli.records.drive import Drive
from tests.drive.drive_cases import (
    BOUC_WEN,
    CONTACT,
    COULOMB,
    PRELOAD,
    SAMPLE_TIME_S,
    rms,
    tool,
)

K, KT, M = 1184.0, 5.0, 0.3
# Rounding of some thousand steps on motions of 1e-2 m.
ROUNDING_M = 1e-13
# Runge-Kutta steps of motions of 1e-2 m.
CURVED_M = 1e-8


def slowly(*levels_A, seconds=2.0):
    """A current so slow that all forces balance, from level to level."""
    steps = round(seconds / SAMPLE_TIME_S)
    corners = steps * np.arange(len(levels_A))
    return np.interp(np.arange(corners[-1] + 1), corners, levels_A)


def free_axis(effects, count, *, start, inertia=0.02, damping=0.0, step=1e-3):
    drive = Drive(mass_kg=inertia, damping_N_s_per_m=damping, effects=effects)
    return simulate_drive(np.zeros(count), drive, sample_time_s=step, start=start)


# Gravity ------------------------------------------------------------------------------


@pytest.mark.parametrize("largest", [0.1, 1.0, 2.5])
def test_a_pendulum_swings_in_the_time_of_the_elliptic_integral(largest):
    torque, angle = 3.0, 0.4
    effects = {"gravity": {"torque_N_m": torque, "angle_rad": angle}}
    period = 4.0 * np.sqrt(0.02 / torque) * ellipk(np.sin(largest / 2) ** 2)
    step = period / 400
    motion = free_axis(effects, 401, start=(largest - angle, 0.0), step=step)
    # At its quarters: through the lowest point, at the other end, back again.
    quarters = motion.position[[100, 200, 300, 400]] + angle
    np.testing.assert_allclose(quarters, [0, -largest, 0, largest], atol=2e-6)


def test_a_pendulum_keeps_its_energy():
    effects = {"gravity": {"torque_N_m": 3.0, "angle_rad": -0.3}}
    motion = free_axis(effects, 2000, start=(0.0, 40.0))
    energy = 0.01 * motion.velocity**2 - 3.0 * np.cos(motion.position - 0.3)
    # It turns over and over; Runge-Kutta steps leave some 1e-7 in two seconds.
    assert motion.position[-1] > 20.0
    assert np.ptp(energy) < 1e-5 * np.ptp(0.01 * motion.velocity**2)


@pytest.mark.parametrize("start", [0.0, 0.9])
def test_a_settled_weight_counts_from_where_the_arm_starts(start):
    """As the weight beside a constant torque that has held it."""
    gravity = {"torque_N_m": 3.0, "angle_rad": 0.4}
    settled = {"gravity": {**gravity, "counts_from": "start"}}
    held = 3.0 * np.sin(start + 0.4)
    beside = {"gravity": gravity, "constant_load": {"force_N": held}}
    for first in ((start, 0.0), (start, 2.0)):
        found = free_axis(settled, 800, start=first, damping=0.05)
        expected = free_axis(beside, 800, start=first, damping=0.05)
        np.testing.assert_allclose(found.position, expected.position, atol=1e-9)
    at_rest = free_axis(settled, 300, start=(start, 0.0))
    np.testing.assert_allclose(at_rest.position, start, atol=1e-9)


def test_a_free_arm_begins_where_the_recording_does_and_falls():
    effects = {"gravity": {"torque_N_m": 3.0, "angle_rad": 0.0}}
    drive = Drive(mass_kg=0.02, damping_N_s_per_m=0.1, effects=effects)
    motion = simulate_drive(
        np.zeros(3000), drive, sample_time_s=1e-3, rest_position_m=1.2
    )
    assert motion.position[0] == 1.2
    assert abs(motion.position[-1]) < 1e-3
    balanced = simulate_drive(
        np.full(50, 3.0 * np.sin(1.2)), drive, sample_time_s=1e-3, rest_position_m=1.2
    )
    # The start balances to rounding.
    assert np.ptp(balanced.position) < 1e-14


def test_a_sprung_arm_starts_where_spring_and_weight_balance():
    effects = {"gravity": {"torque_N_m": 30.0, "angle_rad": 0.9}}
    command = np.full(20, 2.0)
    motion = tool(effects, command, stiffness_N_per_m=20.0)
    expected = brentq(lambda x: 20 * x + 30 * np.sin(x + 0.9) - 10, -3, 3, xtol=1e-15)
    np.testing.assert_allclose(motion.position, expected, rtol=1e-12)


def test_the_weight_of_an_arm_at_right_angles_is_a_load():
    weight = {"gravity": {"torque_N_m": 2.0, "angle_rad": -0.5 * np.pi}}
    load = {"constant_load": {"force_N": 2.0}}
    # 0.02 rad change the cosine by 2e-4.
    assert rms(tool(weight).position - tool(load).position) < 1e-3 * 2.0 / K


# Preload ------------------------------------------------------------------------------


def test_nothing_moves_below_the_preload():
    motion = tool(PRELOAD, slowly(0.0, 0.29, -0.29, 0.0, seconds=0.1))
    np.testing.assert_array_equal(motion.position, 0.0)
    np.testing.assert_array_equal(motion.velocity, 0.0)


def test_beyond_the_preload_the_spring_gives_way():
    command = slowly(0.0, 2.0, -1.0, 0.0, seconds=10.0)
    motion = tool(PRELOAD, command)
    force = KT * command
    expected = np.sign(force) * np.maximum(abs(force) - 1.5, 0.0) / K
    # Damping of 15 N s/m at 1.3 mm/s moves it by 16 um, as it sets out for some more.
    assert np.max(abs(motion.position - expected)) < 5e-5


def test_a_preload_keeps_the_energy_of_a_free_swing():
    motion = tool(PRELOAD, np.zeros(3000), start=(0.01, 0.5), damping_N_s_per_m=0.0)
    energy = 0.5 * K * motion.position**2 + 1.5 * abs(motion.position)
    energy += 0.5 * M * motion.velocity**2
    # Some thirty passages of 0, each located to 1e-13.
    assert np.ptp(energy) < 1e-10 * energy[0]
    assert np.sum(np.diff(np.sign(motion.position)) != 0) > 30


def test_a_preloaded_drive_comes_to_rest_at_zero_for_good():
    motion = tool(PRELOAD, np.zeros(1500), start=(0.01, 0.0))
    assert set(motion.position[-900:]) == {0.0}
    assert set(motion.velocity[-900:]) == {0.0}


def test_shorter_samples_catch_a_preloaded_drive_at_the_same_place():
    coarse = tool(PRELOAD, np.zeros(301), start=(0.01, 0.0)).position
    fine = tool(
        PRELOAD, np.zeros(6001), start=(0.01, 0.0), sample_time=SAMPLE_TIME_S / 20
    ).position[::20]
    # What a sample's fiftieth of free swing is: 1.5 N (2e-5 s)^2 / 0.3 kg.
    assert np.max(abs(coarse - fine)) < 2e-9


# Friction -----------------------------------------------------------------------------


@pytest.mark.parametrize("load", ["spring", "drive"])
def test_friction_that_follows_a_load_opens_a_wedge(load):
    effects = {"load_friction": {"force_N": 0.5, "load_share": 0.2, "load": load}}
    command = slowly(0.0, 4.0, 0.5, seconds=5.0)
    motion = tool(effects, command)
    places = np.array([4000, 9500])
    force = KT * command[places]
    sliding = np.array([1.0, -1.0])
    slow = 15.1 * motion.velocity[places]
    if load == "spring":
        expected = (force - slow - 0.5 * sliding) / (1 + 0.2 * sliding)
    else:
        expected = force * (1 - 0.2 * sliding) - slow - 0.5 * sliding
    # All is uniform by then but for rounding of the swing at the start.
    np.testing.assert_allclose(K * motion.position[places], expected, atol=1e-6)


def test_what_a_motor_holds_by_its_own_friction_leaves_as_the_motor_lets_go():
    effects = {"load_friction": {"force_N": 0.2, "load_share": 0.9, "load": "drive"}}
    # Through 0 within one sample: at 0 nothing but 0.2 N holds the spring.
    command = np.concatenate([np.full(30, -4.0), np.full(30, 4.0)])
    start = (0.01, 0.0)
    found = tool(effects, command, start=start).position
    fine = np.interp(np.arange(59 * 50 + 1) / 50, np.arange(60), command)
    expected = tool(effects, fine, start=start, sample_time=SAMPLE_TIME_S / 50)
    assert rms(found - expected.position[::50]) < CURVED_M
    assert np.ptp(found) > 1e-3


def test_friction_along_the_way_is_what_is_left_of_the_balance():
    values = {"force_N": 1.0, "variation_share": 0.5, "period_m": 4e-3}
    effects = {"position_friction": {**values, "phase_rad": 0.7}}
    command = slowly(0.0, 4.0, seconds=8.0)
    motion = tool(effects, command)
    missing = KT * command - K * motion.position - 15.1 * motion.velocity
    angle = 2 * np.pi * motion.position / 4e-3 + 0.7
    sliding = motion.velocity > 1e-4
    assert np.mean(sliding) > 0.8
    # It sticks and slips a little where friction falls; inertia is small.
    expected = 1.0 + 0.5 * np.sin(angle)
    assert rms((missing - expected)[sliding]) < 0.03


def test_a_torque_ripple_shows_at_rest():
    effects = {"torque_ripple": {"share": 0.2, "per_turn": 700.0, "phase_rad": 0.3}}
    motion = tool(effects, np.full(30, 3.0))
    position = motion.position[0]
    force = KT * 3.0 * (1 + 0.2 * np.sin(700.0 * position + 0.3))
    assert position == pytest.approx(force / K, rel=1e-12)
    assert np.ptp(motion.position) < ROUNDING_M


def test_a_motor_behind_a_gear_ripples_with_its_own_angle():
    gear = {"half_gap_m": 2e-3, "stiffness_N_per_m": 5e4, "motor_share": 0.3}
    ripple = {"share": 0.2, "per_turn": 700.0, "phase_rad": 0.3}
    effects = {"torque_ripple": ripple, "gear_backlash": gear}
    motion = tool(effects, np.full(30, 3.0))

    def away(force):
        turned = force / K + 2e-3 + force / 5e4
        return force - KT * 3.0 * (1 + 0.2 * np.sin(700.0 * turned + 0.3))

    force = brentq(away, 10.0, 20.0, xtol=1e-14)
    assert motion.position[0] == pytest.approx(force / K, rel=1e-9)
    assert np.ptp(motion.position) < 1e-11


# Contacts -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("exponent", "stiffness"), [(1.0, 2e4), (1.5, 3e5), (2.5, 4e7)]
)
@pytest.mark.parametrize("damping", [0.2, 1.5])
def test_a_contact_gives_back_what_hunt_and_crossley_say(exponent, stiffness, damping):
    stop = {
        "position_m": 0.01,
        "stiffness_N_per_m": stiffness,
        "exponent": exponent,
        "damping_s_per_m": damping,
    }
    drive = Drive(mass_kg=0.3, effects={"one_sided_stop": stop})
    motion = simulate_drive(
        np.zeros(100), drive, sample_time_s=SAMPLE_TIME_S, start=(0.0, 0.7)
    )

    def spent(v):
        # m v dv / (1 + c v) = -k d^n dd on the way in and on the way out.
        return v / damping - np.log1p(damping * v) / damping**2

    back = brentq(lambda v: spent(v) - spent(0.7), -1 / damping + 1e-9, -1e-6)
    assert motion.velocity[-1] == pytest.approx(back, rel=1e-5)
    deepest = spent(0.7) * (exponent + 1) * 0.3 / stiffness
    assert np.max(motion.position) < 0.01 + deepest ** (1 / (exponent + 1)) + 1e-9


def test_a_contact_at_rest_is_as_deep_as_its_law_says():
    motion = tool(CONTACT, np.full(20, 5.0))
    expected = brentq(
        lambda x: K * x + 3e5 * (x - 0.012) ** 1.5 - 25.0, 0.012, 0.02, xtol=1e-16
    )
    np.testing.assert_allclose(motion.position, expected, rtol=1e-12)


def test_stops_to_both_sides_are_two_stops():
    one = {"end_stop": {"position_m": 0.012, "stiffness_N_per_m": 2e4}}
    two = {
        "one_sided_stop": {"position_m": 0.012, "stiffness_N_per_m": 2e4},
        "one_sided_stop:second": {"position_m": -0.012, "stiffness_N_per_m": 2e4},
    }
    assert rms(tool(one).position - tool(two).position) < 1e-12
    rich = {"exponent": 1.5, "damping_s_per_m": 0.5}
    one, two = ({key: v | rich for key, v in stops.items()} for stops in (one, two))
    assert rms(tool(one).position - tool(two).position) < 1e-12


def test_two_waves_of_one_period_are_one_wave():
    wave = {"amplitude_N": 0.3, "period_m": 5e-3, "phase_rad": 0.3}
    other = {"amplitude_N": 0.4, "period_m": 5e-3, "phase_rad": 1.2}
    sum_of_both = 0.3 * np.exp(0.3j) + 0.4 * np.exp(1.2j)
    together = {
        "amplitude_N": float(abs(sum_of_both)),
        "period_m": 5e-3,
        "phase_rad": float(np.angle(sum_of_both)),
    }
    two = tool({"cogging": wave, "cogging:second": other}).position
    # Both stiffnesses make the steps shorter than that of the sum.
    assert rms(two - tool({"cogging": together}).position) < 2 * CURVED_M


# Hysteresis ---------------------------------------------------------------------------


def deflections(effects, command):
    """Deflection of a hysteresis of 0.8 N, from what is left of the balance."""
    motion = tool(effects, command, damping_N_s_per_m=100.0)
    missing = KT * command - K * motion.position - 100.0 * motion.velocity
    missing -= M * np.gradient(motion.velocity, SAMPLE_TIME_S)
    return motion.position, missing / 0.8


def test_bouc_and_wen_close_the_loop_that_their_law_draws():
    values = BOUC_WEN["hysteresis"]
    position, z = deflections(BOUC_WEN, slowly(0.0, 1.0, -1.0, 1.0))
    last = slice(4010, 5000)
    before, after = z[last][:-1], z[last][1:]
    middle = 0.5 * (before + after)
    ratio = values["shape_ratio"]
    share = (np.sign(middle) + ratio) / (1 + ratio)
    share *= abs(middle) ** values["exponent"]
    rate = np.diff(z[last]) / np.diff(position[last]) * values["yield_m"]
    moving = abs(middle) < 0.9
    assert np.sum(moving) > 30
    # Differences over a sample's way, a fiftieth of the yield length.
    assert np.max(abs(rate - (1 - share))[moving]) < 0.05


def test_with_equal_shapes_the_way_back_is_straight():
    effects = {"hysteresis": {"force_N": 0.8, "yield_m": 1e-3, "shape_ratio": 1.0}}
    position, z = deflections(effects, slowly(0.0, 2.0, 0.0))
    back = np.flatnonzero((np.arange(z.size) > 2010) & (z > 0.05) & (z < 0.95))
    slopes = np.diff(z[back]) / np.diff(position[back])
    np.testing.assert_allclose(slopes, 1e3, rtol=2e-3)


# Stops with a dashpot -----------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.02, 0.1, 0.4, 0.9])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    "stop", ["end_stop", "one_sided_stop", "one_sided_stop:second"]
)
def test_a_dashpot_throws_back_as_its_closed_form_says(stop, side, ratio):
    mass, stiffness, speed = 0.02, 2000.0, 0.1
    rate, root = np.sqrt(stiffness / mass), np.sqrt(1.0 - ratio**2)
    place = {
        "position_m": 1e-3 * (1.0 if stop == "end_stop" else side),
        "stiffness_N_per_m": stiffness,
        "damping_N_s_per_m": 2.0 * ratio * np.sqrt(stiffness * mass),
    }
    effects = {stop: place}
    if stop == "one_sided_stop:second":
        effects["one_sided_stop"] = place | {"position_m": 2e-3 * side}
    # Long enough to leave again, too short for the stop on the other side.
    motion = free_axis(effects, 36, start=(0.0, side * speed), inertia=mass)
    # Spring and dashpot cancel there; beyond it they would pull.
    angle = np.arctan2(2.0 * ratio * root, 2.0 * ratio**2 - 1.0)
    kept = np.exp(-ratio * angle / root)
    # The corner of the force lies within a Runge-Kutta step.
    np.testing.assert_allclose(motion.velocity[-1], -side * kept * speed, rtol=5e-4)
    deepest = np.arctan2(root, ratio) / (root * rate)
    depth = speed / rate * np.exp(-ratio * rate * deepest)
    fine = free_axis(effects, 3600, start=(0.0, side * speed), inertia=mass, step=1e-5)
    reached = np.max(side * fine.position)
    np.testing.assert_allclose(reached, 1e-3 + depth, atol=1e-5 * depth)


# All of them --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wide", "values", "narrow"),
    [
        ("load_friction:spring", {"force_N": 0.8, "load_share": 0.0}, COULOMB),
        ("load_friction:drive", {"force_N": 0.8, "load_share": 0.0}, COULOMB),
        (
            "position_friction",
            {"force_N": 0.8, "variation_share": 0.0, "period_m": 1e-3},
            COULOMB,
        ),
        (
            "hysteresis:bouc_wen",
            {"force_N": 0.8, "yield_m": 2e-4, "exponent": 1.0, "shape_ratio": 1e-13},
            {"hysteresis": {"force_N": 0.8, "yield_m": 2e-4}},
        ),
        (
            "end_stop:contact",
            {"position_m": 0.01, "stiffness_N_per_m": 1e4, "damping_s_per_m": 1e-13},
            {"end_stop": {"position_m": 0.01, "stiffness_N_per_m": 1e4}},
        ),
        (
            "one_sided_stop:dashpot",
            {"position_m": 0.01, "stiffness_N_per_m": 1e4, "damping_N_s_per_m": 1e-13},
            {"one_sided_stop": {"position_m": 0.01, "stiffness_N_per_m": 1e4}},
        ),
        (
            "one_sided_stop:contact",
            {"position_m": -0.01, "stiffness_N_per_m": 1e4, "exponent": 1 + 1e-13},
            {"one_sided_stop": {"position_m": -0.01, "stiffness_N_per_m": 1e4}},
        ),
    ],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_what_contains_another_effect_becomes_it(wide, values, narrow):
    assert next(iter(narrow)) in CATALOGUE[wide].contains
    # Followed by Runge-Kutta steps instead of exactly.
    assert rms(tool({wide: values}).position - tool(narrow).position) < CURVED_M


@pytest.mark.parametrize(
    "effects",
    [
        {"load_friction": {"force_N": 0.2, "load_share": 0.2, "load": "spring"}},
        {
            "position_friction": {
                "force_N": 0.8,
                "variation_share": 0.9,
                "period_m": 4e-3,
            }
        },
    ],
    ids=lambda one: next(iter(one)),
)
def test_friction_of_every_kind_takes_energy_and_comes_to_rest(effects):
    motion = tool(effects, np.zeros(1500), start=(0.01, 1.0), damping_N_s_per_m=0.0)
    energy = K * motion.position**2 + M * motion.velocity**2
    # Runge-Kutta steps, far below the 0.4 J at the start.
    assert np.max(np.diff(energy)) < 1e-8
    assert energy[-1] < 0.02 * energy[0]
    assert set(motion.velocity[-20:]) == {0.0}


@pytest.mark.parametrize(
    ("identifier", "stated", "entry"),
    [
        ("end_stop", {"position_m": 1}, "end_stop"),
        ("end_stop", {"position_m": 1, "exponent": 2}, "end_stop:contact"),
        ("one_sided_stop", {"damping_s_per_m": 1}, "one_sided_stop:contact"),
        ("end_stop", {"damping_N_s_per_m": 1}, "end_stop:dashpot"),
        ("one_sided_stop", {"damping_N_s_per_m": 1}, "one_sided_stop:dashpot"),
        ("one_sided_stop:second", {"position_m": 1}, "one_sided_stop:second"),
        ("one_sided_stop:second", {"exponent": 1}, "one_sided_stop:second_contact"),
        ("cogging:second", {"period_m": 1}, "cogging:second"),
        ("hysteresis", {"yield_m": 1, "shape_ratio": 0}, "hysteresis:bouc_wen"),
        ("load_friction", {"load": "drive", "force_N": 1}, "load_friction:drive"),
        ("load_friction:second", {"load": "spring"}, "load_friction:spring"),
        ("load_friction:drive", {"force_N": 1}, "load_friction:drive"),
        ("parameter_change", {"which": "damping"}, "parameter_change:damping"),
    ],
)
def test_a_stated_effect_is_the_simplest_entry_that_holds_it(identifier, stated, entry):
    assert entry_of(identifier, stated).id == entry


def test_what_the_catalogue_does_not_have_has_no_entry():
    assert entry_of("magic", {}) is None
    assert entry_of("load_friction", {"force_N": 1.0}) is None


def test_the_same_entry_twice_is_refused():
    stop = {"position_m": 1.0, "stiffness_N_per_m": 1.0}
    effects = {"end_stop": stop, "end_stop:second": stop}
    with pytest.raises(ValueError, match="'end_stop' is there twice"):
        drive_effects(Drive(effects=effects))


def test_words_and_spreads_are_no_numbers_of_the_simulation():
    effects = {
        "load_friction": {"force_N": 1.0, "load_share": 0.1, "load": "drive"},
        "parameter_change": {"which": "damping", "spread": 0.1},
    }
    assert drive_effects(Drive(effects=effects)) == {
        "load_friction:drive": {"force_N": 1.0, "load_share": 0.1},
        "parameter_change:damping": {"log_damping": 0.0},
    }


def test_a_second_one_may_be_added_to_a_first_and_to_nothing_else():
    assert not may_be_added("cogging:second", ())
    assert may_be_added("cogging:second", ("cogging",))
    assert not may_be_added("cogging:second", ("cogging", "cogging:second"))
    assert not may_be_added("cogging", ("cogging",))
    assert may_be_added("cogging", ("gravity",))
    assert may_be_added("one_sided_stop:second", ("one_sided_stop:contact",))
