"""Which effects of a fit the recordings leave open."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.intervals import (
    harmonics,
    intervals,
    runs_to_bound,
    shared_covariance,
    soft_stops,
    unclear_effects,
)
from hwid_cli.diagnosis.parameters import START
from hwid_cli.records.candidates import ParameterRef
from tests.diagnosis.made_up_fits import made_up
from tests.diagnosis.small_drive import fit, problem, recordings, sizes

STRIBECK = {"force_N": 0.6, "static_excess_N": 0.5, "velocity_m_per_s": 0.02}


@pytest.mark.parametrize(
    ("true", "unclear"),
    [
        # Plain friction: an excess at rest of next to nothing fits as well.
        ({"coulomb_friction": {"force_N": 0.8}}, ("stribeck_friction",)),
        ({"stribeck_friction": STRIBECK}, ()),
    ],
)
def test_a_law_that_may_be_the_simpler_one_is_left_open(true, unclear):
    given = problem(recordings(true))
    scales = sizes(problem())
    start = {"force_N": 0.7, "static_excess_N": 0.05, "velocity_m_per_s": 0.02}
    found = fit(given, {"stribeck_friction": start}, scales=scales)

    assert found.is_usable
    assert unclear_effects(given, found, scales) == unclear


@pytest.mark.parametrize(
    ("true", "unclear"),
    [
        ({"coulomb_friction": {"force_N": 0.8}}, ("stribeck_friction",)),
        ({"stribeck_friction": STRIBECK}, ()),
    ],
)
def test_what_the_simulation_has_of_a_law_shares_its_strength_in_any_way(true, unclear):
    """Plain friction of both adds up: neither has a size of its own."""
    plain = {"coulomb_friction": {"force_N": 0.5}}
    given = problem(recordings(true), effects=plain)
    scales = sizes(problem())
    start = {"force_N": 0.3, "static_excess_N": 0.05, "velocity_m_per_s": 0.02}
    found = fit(given, {"stribeck_friction": start}, scales=scales)

    assert unclear_effects(given, found, scales) == unclear


def test_a_fit_whose_recordings_had_starts_of_their_own_is_left_open_where_they_have_none():
    given = problem(recordings({"coulomb_friction": {"force_N": 0.8}}))
    scales = sizes(problem())
    found = fit(given, {"coulomb_friction": {"force_N": 0.7}}, scales=scales)
    assert unclear_effects(given, found, scales) == ()
    place = ParameterRef(START, "position")
    beside_free_axis = replace(
        found, own_names=(place,), own=np.zeros((len(given.signals), 1))
    )
    assert unclear_effects(given, beside_free_axis, scales) == found.effects


CONTACT = "one_sided_stop:contact"


def test_a_contact_is_there_whatever_its_exponent_makes_of_its_stiffness():
    """The stiffness is open by more than a factor of e, the force at a depth is not."""
    stop = {
        "position_m": 5e-3,
        "stiffness_N_per_m": 1e5,
        "exponent": 1.5,
        "damping_s_per_m": 0.5,
    }
    given = problem(recordings({CONTACT: stop}, noise=8e-4))
    scales = sizes(problem())
    found = fit(given, {CONTACT: stop}, scales=scales)

    low, high = intervals(given, found, scales)
    column = found.names.index(ParameterRef(CONTACT, "stiffness_N_per_m"))
    assert high[column] > np.e**2 * low[column]
    assert unclear_effects(given, found, scales) == ()


def test_a_contact_that_nothing_reaches_is_open():
    far = {
        "position_m": 1.0,
        "stiffness_N_per_m": 1e5,
        "exponent": 1.5,
        "damping_s_per_m": 0.5,
    }
    given = problem(recordings())
    scales = sizes(problem())
    found = fit(given, {CONTACT: far}, scales=scales)
    assert unclear_effects(given, found, scales) == (CONTACT,)


def test_what_nothing_determines_leaves_the_other_intervals_as_they_are(monkeypatch):
    """Its variance is beyond all numbers."""
    given = problem(recordings({"coulomb_friction": {"force_N": 0.8}}))
    scales = sizes(problem())
    found = fit(given, {"coulomb_friction": {"force_N": 0.7}}, scales=scales)
    low, high = intervals(given, found, scales)

    def with_one_lost(*arguments, **options):
        covariance, scale = shared_covariance(*arguments, **options)
        covariance, scale = covariance.copy(), scale.copy()
        covariance[0, 0], scale[0] = 1e20, 1e-150
        return covariance, scale

    monkeypatch.setattr("hwid_cli.diagnosis.intervals.shared_covariance", with_one_lost)
    lost = intervals(given, found, scales)
    np.testing.assert_array_equal(lost[0][1:], low[1:])
    np.testing.assert_array_equal(lost[1][1:], high[1:])
    assert not lost[1][0] <= high[0]


@pytest.mark.parametrize(("share", "at_bound"), [(0.95, True), (0.5, False)])
def test_a_strength_that_ran_to_its_bound_imitates(share, at_bound):
    given = problem(recordings())
    scales = sizes(problem())
    start = {"share": 0.1, "per_turn": 300.0, "phase_rad": 0.2}
    found = fit(given, {"torque_ripple": start}, scales=scales)
    column = found.names.index(ParameterRef("torque_ripple", "share"))
    values = found.values.copy()
    values[column] = share
    found = replace(found, values=values)

    assert runs_to_bound(given, found, scales) is at_bound
    assert ("torque_ripple" in unclear_effects(given, found, scales)) or not at_bound


def test_a_base_has_no_bound_to_run_to():
    given = problem(recordings())
    assert not runs_to_bound(given, fit(given), sizes(problem()))


def test_what_the_simulation_has_of_a_law_may_be_all_of_its_strength():
    """The excess at rest alone tells Stribeck friction from the simulation's own."""
    plain = {"coulomb_friction": {"force_N": 0.5}}
    given = problem(recordings({"stribeck_friction": STRIBECK}), effects=plain)
    scales = sizes(problem())
    start = {"force_N": 1e-7, "static_excess_N": 0.4, "velocity_m_per_s": 0.02}
    found = fit(given, {"stribeck_friction": start}, scales=scales)
    none = found.names.index(ParameterRef("stribeck_friction", "force_N"))
    assert found.values[none] < 1e-3
    assert unclear_effects(given, found, scales) == ()
    # Of its own strength nothing is said.
    low, high = intervals(given, found, scales)
    assert np.isnan([low[none], high[none]]).all()


@pytest.mark.parametrize(
    ("force_Hz", "hum_Hz", "unclear"),
    [
        (6.6, 13.2, ("sensor_hum",)),
        (13.21, 6.6, ("periodic_force",)),
        (16.5, 50.0, ()),
        (10.0, 10.0, ()),
    ],
)
def test_a_hum_at_a_multiple_of_a_force_may_be_its_harmonic(force_Hz, hum_Hz, unclear):
    found = made_up(("periodic_force", "sensor_hum"), 100.0)
    names = tuple(
        ParameterRef(one, "frequency_Hz") for one in ("periodic_force", "sensor_hum")
    )
    pair = replace(found, names=names, values=np.array([force_Hz, hum_Hz]))
    assert harmonics(pair) == unclear
    alone = replace(found, names=names[:1], values=np.array([force_Hz]))
    assert harmonics(alone) == ()


@pytest.mark.parametrize(
    ("effects", "stiffness", "neighbour", "soft"),
    [
        (("end_stop",), 1.5, 0.9, ("end_stop",)),
        (("end_stop:dashpot", "cubic_stiffness"), 1.5, 0.0, ("end_stop:dashpot",)),
        # A corner that leaves noise is one.
        (("end_stop",), 1.5, 0.1, ()),
        (("one_sided_stop", "coulomb_friction"), 1.5, 0.1, ()),
        # Harder than the spring.
        (("end_stop", "cubic_stiffness"), 5.0, 0.9, ()),
    ],
)
def test_a_stop_softer_than_the_spring_may_stand_for_a_curve(
    effects, stiffness, neighbour, soft
):
    given = problem(recordings())
    spring = given.drive.stiffness_N_per_m
    names = tuple(ParameterRef(one, "stiffness_N_per_m") for one in effects)
    found = replace(
        made_up(effects, 1.0),
        names=names,
        values=np.full(len(names), stiffness * spring),
        neighbour=neighbour,
    )
    assert soft_stops(given, found) == soft
    free = replace(given, drive=replace(given.drive, stiffness_N_per_m=0.0))
    assert soft_stops(free, found) == ()
