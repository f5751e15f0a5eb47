"""Coordinates of a fit: what is searched, and within which bounds."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.diagnosis.parameters import (
    START,
    ParameterPoint,
    Unknown,
    drive_at,
    effects_at,
    first_point,
    parameter_layout,
    residuals_at,
    sum_of_squares,
    vectors_at,
)
from hwid_cli.drive import slots
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import DRIVE, STEP_S, problem, recordings, sizes

LOG = Unknown("effect", "force_N", True, 2.0, 0.1, 50.0)
NEGATIVE = Unknown("base", "force_constant_N_per_A", True, -5.0, -5e4, -5e-4)
LINEAR = Unknown("effect", "coefficient", False, 0.05, -0.4, 0.4)


def laid_out(effects=(), start=None, *, of=None, **changes):
    of = problem(recordings()[:3], **changes) if of is None else of
    start = start or {}
    found = parameter_layout(of, effects, start, sizes(of))
    return of, found, first_point(of, found, of.drive, start)


@given(st.floats(0.1, 50.0))
def test_a_logarithmic_coordinate_gives_its_value_back(value):
    # A logarithm and its exponential lose a few roundings.
    assert LOG.value(LOG.coordinate(value)) == pytest.approx(value, rel=1e-13)
    assert NEGATIVE.value(NEGATIVE.coordinate(-value)) == pytest.approx(
        -value, rel=1e-13
    )


@given(st.floats(-0.4, 0.4))
def test_a_linear_coordinate_gives_its_value_back(value):
    assert LINEAR.value(LINEAR.coordinate(value)) == pytest.approx(value, rel=1e-13)


def test_coordinates_have_no_unit():
    assert LOG.coordinate(2.0) == 0.0
    assert NEGATIVE.coordinate(-5.0) == 0.0
    assert LINEAR.coordinate(0.05) == 1.0


@pytest.mark.parametrize(
    ("unknown", "value", "moved"),
    [
        (LOG, 0.0, 0.1),
        (LOG, -3.0, 0.1),
        (LOG, 99.0, 50.0),
        (NEGATIVE, 3.0, -5e-4),
        (LINEAR, 0.9, 0.4),
        (LINEAR, -0.9, -0.4),
    ],
)
def test_a_value_outside_the_bounds_is_moved_onto_them(unknown, value, moved):
    assert unknown.value(unknown.coordinate(value)) == pytest.approx(moved, rel=1e-12)


def test_the_base_has_damping_stiffness_and_force_constant():
    _, found, _ = laid_out()
    assert [one.name for one in found.shared] == [
        "damping_N_s_per_m",
        "stiffness_N_per_m",
        "force_constant_N_per_A",
    ]
    assert found.own == ()
    assert found.size(3) == 3


def test_a_free_axis_gets_no_spring():
    _, found, _ = laid_out(stiffness_N_per_m=0.0)
    assert "stiffness_N_per_m" not in [one.name for one in found.shared]


def test_a_damping_of_zero_may_grow():
    of, found, point = laid_out(damping_N_s_per_m=0.0)
    damping = drive_at(of, found, point).damping_N_s_per_m
    # A fiftieth of sqrt(k m).
    assert damping == pytest.approx(0.02 * np.sqrt(1184.0 * 0.3))


def test_a_negative_force_constant_stays_negative():
    of, found, point = laid_out(force_constant_N_per_A=-5.0)
    assert drive_at(of, found, point).force_constant_N_per_A == pytest.approx(-5.0)
    assert found.shared[2].high < 0


def test_effects_share_one_value_over_all_recordings():
    start = {"hysteresis": {"force_N": 0.3, "yield_m": 1e-4}}
    _, found, point = laid_out(("hysteresis",), start)

    assert [one.owner for one in found.shared] == ["base"] * 3 + ["hysteresis"] * 2
    values = effects_at(found, point)["hysteresis"]
    assert values == pytest.approx({"force_N": 0.3, "yield_m": 1e-4})


def test_a_phase_belongs_to_each_recording():
    start = {"periodic_force": {"amplitude_N": 0.3, "frequency_Hz": 30.0}}
    of, found, point = laid_out(("periodic_force",), start)
    # The force acts before the recording begins: it starts in motion.
    assert [one.name for one in found.own] == ["phase_rad", "position", "velocity"]
    assert found.size(3) == 3 + 2 + 3 * 3

    each = point.own.copy()
    each[:, 0] = np.array([0.1, 0.2, 0.3]) / found.own[0].scale
    own = ParameterPoint(point.shared, each)
    vectors = vectors_at(of, found, own)
    phases = [vector[slots.PERIODIC_PHASE] for vector in vectors]
    assert phases == pytest.approx([0.1, 0.2, 0.3])
    assert effects_at(found, own, 1)["periodic_force"]["phase_rad"] == pytest.approx(
        0.2
    )
    assert "phase_rad" not in effects_at(found, own)["periodic_force"]


def test_a_factor_between_recordings_acts_on_the_base():
    start = {"parameter_change:damping": {"log_damping": 0.0}}
    of, found, point = laid_out(("parameter_change:damping",), start)
    own = np.log([[0.5], [1.0], [2.0]]) / found.own[0].scale
    vectors = vectors_at(of, found, ParameterPoint(point.shared, own))
    assert [vector[slots.DAMPING] for vector in vectors] == pytest.approx(
        [7.5, 15.0, 30.0]
    )


def test_effects_of_the_simulation_start_from_its_values():
    of = problem(recordings()[:3], effects={"sensor_drift": {"drift_m_per_s": 0.004}})
    present = drive_effects(of.drive)
    _, found, point = laid_out(tuple(present), present, of=of)
    assert effects_at(found, point) == {
        "sensor_drift": pytest.approx({"drift_m_per_s": 0.004})
    }


@pytest.mark.parametrize(
    "effects",
    [
        # Far beyond what the recordings reach, and beyond any bound of a search.
        {"end_stop": {"position_m": 0.2, "stiffness_N_per_m": 1e4}},
        {"end_stop": {"position_m": 1e-5, "stiffness_N_per_m": 1e-3}},
        {"one_sided_stop": {"position_m": -0.2, "stiffness_N_per_m": 1e9}},
        {"hysteresis": {"force_N": 0.3, "yield_m": 0.5}},
        {"hysteresis": {"force_N": 0.3, "yield_m": 1e-8}},
        {"cogging": {"amplitude_N": 0.1, "period_m": 1.0}},
        {"input_delay": {"delay_s": 0.9}},
        {"sensor_cubic": {"coefficient": 5.0}},
        # A positive coordinate can hold a negative number with its sign.
        {"cogging": {"amplitude_N": -0.1, "period_m": 4e-3, "phase_rad": 0.3}},
        {"quadratic_drag": {"drag_N_s2_per_m2": -0.5}},
        {"torque_ripple": {"share": 0.99, "per_turn": 1e-3}},
        {
            "one_sided_stop": {
                "position_m": 0.01,
                "stiffness_N_per_m": 1e5,
                "exponent": 7.0,
                "damping_s_per_m": 1e-9,
            }
        },
    ],
    ids=str,
)
def test_what_the_simulation_has_is_used_as_it_is_stated(effects):
    of = problem(recordings()[:3], effects=effects)
    present = drive_effects(of.drive)
    identifier = next(iter(present))
    _, found, point = laid_out(tuple(present), present, of=of)
    # A logarithm and its exponential lose a few roundings.
    assert effects_at(found, point)[identifier] == pytest.approx(
        present[identifier], rel=1e-12
    )
    for one in found.shared:
        if one.owner == identifier:
            assert one.low <= present[identifier][one.name] <= one.high


def test_what_the_simulation_has_with_no_size_stays_of_no_size():
    stated = {"force_N": 0.0, "load_share": 0.0, "load": "spring"}
    of = problem(recordings()[:3], effects={"load_friction": stated})
    present = drive_effects(of.drive)
    _, found, point = laid_out(tuple(present), present, of=of)
    values = effects_at(found, point)["load_friction:spring"]
    # Nothing beside forces of 20 N, and it may grow.
    assert 0 < values["force_N"] < 1e-8
    assert 0 < values["load_share"] < 1e-8


def test_bounds_of_a_candidate_stay_those_of_the_search():
    start = {"end_stop": {"position_m": 0.2, "stiffness_N_per_m": 1e4}}
    of, found, point = laid_out(("end_stop",), start)
    reach = sizes(of).displacement_m
    assert effects_at(found, point)["end_stop"]["position_m"] == pytest.approx(reach)


def test_an_estimated_start_begins_at_the_first_output_at_rest():
    of = problem(recordings()[:3], options=DiagnoseOptions(initial_state="estimated"))
    _, found, point = laid_out(of=of)
    assert [(one.owner, one.name) for one in found.own] == [
        (START, "position"),
        (START, "velocity"),
    ]
    for signals, vector in zip(of.signals, vectors_at(of, found, point), strict=True):
        assert vector[slots.IS_START_GIVEN] == 1.0
        assert vector[slots.START_POSITION] == pytest.approx(signals.output[0])
        assert vector[slots.START_VELOCITY] == 0.0


def test_the_search_for_the_start_of_a_free_axis_begins_where_it_rested():
    of, found, point = laid_out(stiffness_N_per_m=0.0)
    assert [(one.owner, one.name) for one in found.own] == [(START, "position")]
    for signals, vector in zip(of.signals, vectors_at(of, found, point), strict=True):
        assert vector[slots.IS_START_GIVEN] == 1.0
        # It goes through a coordinate without unit and back.
        assert vector[slots.START_POSITION] == pytest.approx(
            signals.rest_position_m, rel=1e-12
        )
        assert vector[slots.START_VELOCITY] == 0.0


def test_a_spring_starts_in_equilibrium():
    of, found, point = laid_out()
    assert vectors_at(of, found, point)[0][slots.IS_START_GIVEN] == 0.0


def test_the_base_of_a_point_is_that_of_its_drive():
    of, found, _ = laid_out()
    point = ParameterPoint(np.log([2.0, 0.5, 3.0]), np.zeros((3, 0)))
    drive = drive_at(of, found, point)
    assert drive.damping_N_s_per_m == pytest.approx(2 * DRIVE.damping_N_s_per_m)
    assert drive.stiffness_N_per_m == pytest.approx(0.5 * DRIVE.stiffness_N_per_m)
    assert drive.force_constant_N_per_A == pytest.approx(15.0)
    assert drive.mass_kg == DRIVE.mass_kg


def bounds_of(name, **changes):
    _, found, _ = laid_out(**changes)
    return next((one.low, one.high) for one in found.shared if one.name == name)


def test_a_known_parameter_stays_within_its_tolerance():
    known = {"force_constant_N_per_A": 0.05}
    low, high = bounds_of("force_constant_N_per_A", known=known)
    assert (low, high) == pytest.approx((5.0 * 0.95, 5.0 * 1.05), rel=1e-12)
    low, high = bounds_of("stiffness_N_per_m", known=known)
    assert high / low > 1e7


def test_a_known_negative_force_constant_has_ordered_bounds():
    known = {"force_constant_N_per_A": 0.1}
    low, high = bounds_of(
        "force_constant_N_per_A", known=known, force_constant_N_per_A=-5.0
    )
    assert (low, high) == pytest.approx((-5.5, -4.5), rel=1e-12)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("force_constant_N_per_A", {"known": {"force_constant_N_per_A": 0.0}}),
        # A share of zero is zero.
        (
            "damping_N_s_per_m",
            {"known": {"damping_N_s_per_m": 0.1}, "damping_N_s_per_m": 0.0},
        ),
    ],
)
def test_what_cannot_move_is_no_coordinate(name, changes):
    of, found, first = laid_out(**changes)
    assert name not in {one.name for one in found.shared}
    assert getattr(drive_at(of, found, first), name) == getattr(of.drive, name)


@pytest.mark.parametrize(("amplitude_m", "is_possible"), [(1e-4, True), (2e-4, False)])
def test_a_scale_that_reads_backwards_leaves_no_number(amplitude_m, is_possible):
    # The slope of the reading is at least 1 - 2 pi A / l: it turns back from 0.16 mm on.
    values = {"amplitude_m": amplitude_m, "period_m": 1e-3, "phase_rad": 0.0}
    of, found, point = laid_out(
        ("sensor_eccentricity",), {"sensor_eccentricity": values}
    )

    parts = residuals_at(of, found, point)

    assert all(np.isfinite(part).all() == is_possible for part in parts)
    assert np.isfinite(sum_of_squares(parts)) == is_possible


@pytest.mark.parametrize(
    ("initial_state", "effects", "has_current"),
    [
        ("estimated", {"actuator_lag": {"time_constant_s": 0.01}}, True),
        ("estimated", {"input_delay": {"delay_s": 0.01}}, False),
        ("rest", {"actuator_lag": {"time_constant_s": 0.01}}, False),
    ],
)
def test_a_current_with_a_state_has_a_start_of_its_own(
    initial_state, effects, has_current
):
    of = problem(recordings()[:3], options=DiagnoseOptions(initial_state=initial_state))
    _, found, point = laid_out(tuple(effects), effects, of=of)
    names = [one.name for one in found.own if one.owner == START]
    assert ("current" in names) == has_current
    if has_current:
        column = names.index("current")
        each = point.own.copy()
        each[:, column] = np.array([0.1, 0.2, 0.3]) / found.own[column].scale
        vectors = vectors_at(of, found, ParameterPoint(point.shared, each))
        given = [one[slots.START_CURRENT] for one in vectors]
        assert given == pytest.approx([0.1, 0.2, 0.3])


def test_a_winding_of_the_base_has_a_start_of_its_own():
    options = DiagnoseOptions(initial_state="estimated")
    changes = {"resistance_ohm": 2.0, "inductance_H": 4e-3}
    changes["known"] = {"inductance_H": 0.0}
    of = problem(recordings()[:3], options=options, **changes)
    _, found, _ = laid_out(of=of)
    assert [one.name for one in found.own] == ["position", "velocity", "current"]


@pytest.mark.parametrize(("given", "largest"), [(13.0, 10 * 0.3 / STEP_S), (9e3, 9e3)])
def test_damping_makes_a_drive_no_faster_than_the_recordings_show(given, largest):
    # Unless the configuration itself says more.
    of = problem(recordings())
    of = replace(of, drive=replace(of.drive, mass_kg=0.3, damping_N_s_per_m=given))
    layout = parameter_layout(of, (), {}, sizes(of))
    (damping,) = [one for one in layout.shared if one.name == "damping_N_s_per_m"]
    assert damping.high == pytest.approx(largest)


def test_a_step_far_beyond_the_bounds_has_a_value():
    unknown = Unknown("base", "damping_N_s_per_m", True, 2.0, 0.1, 10.0)
    with np.errstate(over="raise"):
        assert unknown.value(1e4) > 1e200
    assert unknown.value(1.0) == 2.0 * np.exp(1.0)
