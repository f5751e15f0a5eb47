"""The ranking beforehand: what each candidate should explain."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hwid_cli.diagnosis.candidate import fitted_drive, fitted_values
from hwid_cli.diagnosis.forecast import (
    Forecast,
    changed_by,
    forecast,
    linearise,
    pair_shares,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import fit, problem, recordings, sizes

HIDDEN = {
    "coulomb_friction": {"force_N": 0.8},
    "quadratic_drag": {"drag_N_s2_per_m2": 9.0},
    "cubic_stiffness": {"stiffness_N_per_m3": 8e5},
    "end_stop": {"position_m": 0.012, "stiffness_N_per_m": 4000.0},
    "input_dead_zone": {"threshold_A": 0.2},
    "input_saturation": {"limit_A": 2.8},
    "actuator_lag": {"time_constant_s": 3e-3},
    "sensor_drift": {"drift_m_per_s": 0.01},
}
SLOW = ("quadratic_drag", "end_stop", "input_dead_zone", "sensor_drift")


@cache
def linearised(hidden):
    """The base where an effect hides; not to be altered."""
    of = problem(recordings({hidden: HIDDEN[hidden]}))
    return linearise(of, fitted_drive(of.drive, fit(of)), {}, sizes(of))


@pytest.mark.thorough
@pytest.mark.parametrize(
    "hidden",
    [
        *("coulomb_friction", "cubic_stiffness", "input_saturation", "actuator_lag"),
        *(pytest.param(one, marks=pytest.mark.slow) for one in SLOW),
    ],
)
def test_the_hidden_effect_is_among_the_first_three_of_all(hidden):
    at_base = linearised(hidden)
    found = [forecast(at_base, one) for one in CATALOGUE if "parameter" not in one]
    # What includes the hidden one should explain as much.
    found = [one for one in found if hidden not in CATALOGUE[one.effect].contains]
    found.sort(key=lambda one: -one.share)
    assert hidden in [one.effect for one in found[:3]]


def test_shares_lie_between_nothing_and_all():
    at_base = linearised("coulomb_friction")
    shares = [forecast(at_base, one).share for one in HIDDEN]
    assert all(-1e-12 <= one <= 1 for one in shares)
    assert max(shares) > 0.8


def test_starts_are_ordered_by_how_near_they_come():
    # A twelfth, a twenty-fifth and a hundredth of the largest force, 20 N, are tried.
    at_base = linearised("coulomb_friction")
    starts = forecast(at_base, "coulomb_friction").starts
    # The largest one explains less than a third of what the best one does.
    assert [one["force_N"] for one in starts] == pytest.approx([0.8, 0.2])


def test_of_a_limit_every_start_that_cuts_is_kept():
    """Beside a base that is off, or in a loop, no forecast knows which one is near."""
    at_base = linearised("input_saturation")
    starts = forecast(at_base, "input_saturation").starts
    assert sorted(one["limit_A"] for one in starts) == pytest.approx(
        [0.6, 1.2, 2.0, 2.8, 3.52]
    )
    assert starts[0]["limit_A"] == pytest.approx(2.8)


def test_the_base_absorbs_its_own_directions():
    at_base = linearised("coulomb_friction")
    np.testing.assert_allclose(
        at_base.absorbed.T @ at_base.absorbed, np.eye(3), atol=1e-12
    )
    assert np.abs(at_base.absorbed.T @ at_base.error).max() < 1e-12
    column = forecast(at_base, "coulomb_friction").column
    assert column @ column == pytest.approx(1.0)
    assert np.abs(at_base.absorbed.T @ column).max() < 1e-9


def test_what_recordings_have_for_themselves_takes_nothing_from_a_further_effect():
    # Springs of several rooms, between the values that are tried first; a fixed stop.
    factors = (1.05, 0.93, 1.08, 0.96, 1.02, 1.07, 0.94, 0.98, 1.06)
    cut = {"input_saturation": {"limit_A": 3.3}}
    of = problem(
        recordings(
            cut,
            own=lambda number, drive: replace(
                drive, stiffness_N_per_m=drive.stiffness_N_per_m * factors[number]
            ),
        )
    )
    scales, change = sizes(of), "parameter_change:stiffness"
    parent = fit(of, {change: {}})

    drive = fitted_drive(of.drive, parent)
    at_parent = linearise(of, drive, fitted_values(parent, {}), scales)
    left = forecast(at_parent, "input_saturation").share

    # What is left of it once the springs are right, and not of the wrong springs.
    assert left > 0.8


def test_an_effect_of_the_wrong_sign_explains_nothing():
    # Friction only resists: what drags along looks like its opposite.
    at_base = linearised("coulomb_friction")
    parts = [-one for one in at_base.parts]
    turned = replace(at_base, parts=parts, error=-at_base.error)
    assert forecast(at_base, "coulomb_friction").share > 0.8
    changed = forecast(turned, "quadratic_drag")
    assert changed.share >= 0.0


def test_an_effect_that_changes_nothing_gets_no_share():
    # No current is cut at a limit that it never reaches.
    at_base = linearised("coulomb_friction")
    far = replace(at_base, scales=replace(at_base.scales, current_A=100.0))
    found = forecast(far, "input_saturation")
    assert found.share == 0.0
    assert not found.column.any()
    assert found.starts


def test_pairs_are_ranked_by_what_two_columns_explain_together():
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((40, 4))
    columns /= np.linalg.norm(columns, axis=0)
    error = 2 * columns[:, 1] - columns[:, 3] + 0.01 * rng.standard_normal(40)
    forecasts = [
        Forecast(name, 0.0, ({},), column)
        for name, column in zip("abcd", columns.T, strict=True)
    ]
    ranked = pair_shares(forecasts, error)

    assert len(ranked) == 6
    assert ranked[0][1:] == ("b", "d")
    for share, one, other in ranked:
        pair = columns[:, ["abcd".index(one), "abcd".index(other)]]
        fit = pair @ np.linalg.lstsq(pair, error, rcond=None)[0]
        # Two ways to the same projection.
        assert share == pytest.approx(fit @ fit / (error @ error), rel=1e-9)


def test_two_columns_of_one_direction_explain_no_more_than_one():
    column = np.array([0.6, 0.8])
    same = [Forecast(name, 0.0, ({},), column) for name in "ab"]
    ((share, _, _),) = pair_shares(same, np.array([0.6, 0.8]))
    assert share == pytest.approx(0.0, abs=1e-9) or share == pytest.approx(1.0)


def test_a_limit_that_is_never_reached_changes_nothing_beside_own_values_and_starts():
    # Starts are free, and each recording has a stiffness of its own: both as fitted.
    of = problem(recordings(), options=DiagnoseOptions(initial_state="estimated"))
    present = {"parameter_change:stiffness": {"log_stiffness": 0.0}}
    at_base = linearise(of, of.drive, present, sizes(of))
    changed = changed_by(at_base, "input_saturation", {"limit_A": 50.0})
    np.testing.assert_allclose(changed, 0.0, atol=1e-12)
