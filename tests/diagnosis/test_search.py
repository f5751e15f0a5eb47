"""Fits by simulation error: derivatives, and known drives found again."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis import search
from hwid_cli.diagnosis.parameters import (
    ParameterPoint,
    drive_at,
    effects_at,
    first_point,
    parameter_layout,
    residuals_at,
    sum_of_squares,
)
from hwid_cli.diagnosis.search import (
    derivatives,
    fit_own,
    fit_point,
    local_matrix,
    matrix_beside_pushes,
    with_own_trials,
)
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import DRIVE, NOISE, problem, recordings, sizes

OFF = replace(
    DRIVE,
    damping_N_s_per_m=19.0,
    stiffness_N_per_m=1000.0,
    force_constant_N_per_A=4.3,
)


def begun(of, start=None, drive=None):
    start = start or {}
    found = parameter_layout(of, tuple(start), start, sizes(of))
    return found, first_point(of, found, drive or of.drive, start)


def fitted(of, start=None, drive=None, **options):
    found, point = begun(of, start, drive)
    return fit_point(of, found, point, **{"max_iterations": 40, **options})


@pytest.mark.parametrize(
    ("start", "initial_state"),
    [
        ({}, "rest"),
        ({"cubic_stiffness": {"stiffness_N_per_m3": 8e5}}, "rest"),
        ({"actuator_lag": {"time_constant_s": 2e-3}}, "estimated"),
        (
            {"periodic_force": {"amplitude_N": 0.5, "frequency_Hz": 3.0}},
            "estimated",
        ),
        ({"parameter_change:damping": {"log_damping": 0.1}}, "rest"),
    ],
)
def test_derivatives_agree_with_central_differences(start, initial_state):
    of = problem(
        recordings()[3:7], options=DiagnoseOptions(initial_state=initial_state)
    )
    found, point = begun(of, start)
    columns = derivatives(of, found, point, residuals_at(of, found, point))

    shared, width = len(found.shared), 1e-4
    for column in range(shared + len(found.own)):
        shifted = []
        for sign in (1, -1):
            moved = ParameterPoint(point.shared.copy(), point.own.copy())
            if column < shared:
                moved.shared[column] += sign * width
            else:
                moved.own[:, column - shared] += sign * width
            shifted.append(residuals_at(of, found, moved))
        for row, (more, less) in enumerate(zip(*shifted, strict=True)):
            central = (less - more) / (2 * width)
            # One-sided differences of 3e-4 miss 1.5e-4 of the curvature, which is up
            # to ten times the slope for the frequency of a force over 7.5 rad.
            apart = np.linalg.norm(columns[row][:, column] - central)
            assert apart <= 2e-3 * np.linalg.norm(central) + 1e-12


def test_a_derivative_at_an_upper_bound_looks_inwards():
    of = problem(recordings()[1:2])
    limit = sizes(of).current_A
    # At its bound, the largest current, the limit cuts nothing; beyond it neither.
    found, point = begun(of, {"input_saturation": {"limit_A": limit}})
    (columns,) = derivatives(of, found, point, residuals_at(of, found, point))
    assert np.linalg.norm(columns[:, -1]) > 0


def test_the_base_is_found_again_without_noise():
    of = problem(recordings(noise=0.0))
    found = fitted(of, drive=OFF)
    drive = drive_at(of, found.layout, found.point)

    assert found.has_converged
    for name in ("damping_N_s_per_m", "stiffness_N_per_m", "force_constant_N_per_A"):
        # Ten digits of a simulation that is exact to rounding; 1e-6 leaves room for
        # one-sided derivatives, which stop the search a little early.
        assert getattr(drive, name) == pytest.approx(getattr(DRIVE, name), rel=1e-6)


@pytest.mark.parametrize(
    ("effect", "true", "start"),
    [
        (
            "stribeck_friction",
            {"force_N": 0.5, "static_excess_N": 0.4, "velocity_m_per_s": 0.02},
            {"force_N": 0.6, "static_excess_N": 0.3, "velocity_m_per_s": 0.03},
        ),
        (
            "cubic_stiffness",
            {"stiffness_N_per_m3": 8e5},
            {"stiffness_N_per_m3": 3e5},
        ),
        ("quadratic_drag", {"drag_N_s2_per_m2": 9.0}, {"drag_N_s2_per_m2": 4.0}),
        ("input_dead_zone", {"threshold_A": 0.2}, {"threshold_A": 0.1}),
        ("actuator_lag", {"time_constant_s": 2e-3}, {"time_constant_s": 5e-3}),
        ("sensor_cubic", {"coefficient": 0.06}, {"coefficient": 0.02}),
        ("constant_load", {"force_N": 0.7}, {"force_N": -0.2}),
    ],
)
def test_an_effect_and_the_base_are_found_again_without_noise(effect, true, start):
    of = problem(recordings({effect: true}, noise=0.0))
    found = fitted(of, {effect: start})
    values = effects_at(found.layout, found.point)[effect]
    # See above.
    assert values == pytest.approx(true, rel=1e-6)
    assert drive_at(of, found.layout, found.point).stiffness_N_per_m == pytest.approx(
        DRIVE.stiffness_N_per_m, rel=1e-6
    )


def test_friction_is_found_again_as_closely_as_its_corners_let_it():
    of = problem(recordings({"coulomb_friction": {"force_N": 0.8}}, noise=0.0))
    found = fitted(of, {"coulomb_friction": {"force_N": 0.5}})
    force = effects_at(found.layout, found.point)["coulomb_friction"]["force_N"]
    # Where a mass comes to rest jumps with the force: nothing finer than a difference
    # for derivatives, 3e-4, is seen. Noise of 0.1 % hides three times as much.
    assert force == pytest.approx(0.8, rel=3e-4)


def test_with_noise_everything_is_within_four_standard_errors():
    true = {"coulomb_friction": {"force_N": 0.8}}
    of = problem(recordings(true, noise=5 * NOISE, seed=4))
    found = fitted(of, {"coulomb_friction": {"force_N": 0.5}}, OFF)

    aim, wanted = begun(of, true)
    matrix = local_matrix(of, found.layout, found.point)
    errors = np.sqrt(np.diag(np.linalg.inv(matrix))) * 5 * NOISE
    apart = np.array(
        [
            one.value(q) / other.value(r) - 1
            for one, q, other, r in zip(
                found.layout.shared,
                found.point.shared,
                aim.shared,
                wanted.shared,
                strict=True,
            )
        ]
    )
    # Logarithms, so relative. Four: one of 16 000 draws is beyond.
    assert (np.abs(apart) < 4 * errors).all()
    assert (errors < 0.02).all()


def test_pushes_that_do_what_the_base_does_leave_an_effect_as_uncertain_as_the_base():
    start = {"cubic_stiffness": {"stiffness_N_per_m3": 8e5}}
    of = problem(recordings(start, noise=0.0))
    layout, point = begun(of, start)
    free = np.linalg.inv(local_matrix(of, layout, point))
    # More of a parameter of the base is a force: of the input, the way or the speed.
    signals = []
    for one in of.signals:
        speed = np.gradient(one.output, one.sample_time_s)
        pushes = np.column_stack([one.input, -one.output, -speed])
        # As much as the noise each, as they are handed on.
        pushes *= np.array([1e-3, 1.0, 1e-2])
        signals.append(replace(one, force=np.zeros(one.output.size), pushes=pushes))
    pushed = replace(of, signals=tuple(signals))
    matrix = matrix_beside_pushes(pushed, layout, point)
    (effect,) = [j for j, one in enumerate(layout.shared) if one.owner in start]
    assert 1 / matrix[effect, effect] == pytest.approx(free[effect, effect], rel=0.01)
    # The base is held: its own derivatives count for nothing.
    held = np.delete(matrix, effect, axis=0)
    np.testing.assert_array_equal(held, 0.0)
    alone = local_matrix(of, layout, point)[effect, effect]
    assert matrix[effect, effect] < 0.5 * alone


def test_a_start_that_is_not_at_rest_is_estimated():
    cut = [
        replace(one, input=one.input[130:], output=one.output[130:])
        for one in recordings(noise=0.0)[5:]
    ]
    of = problem(cut, options=DiagnoseOptions(initial_state="estimated"))
    found = fitted(of, drive=OFF)
    assert drive_at(of, found.layout, found.point).stiffness_N_per_m == pytest.approx(
        DRIVE.stiffness_N_per_m, rel=1e-6
    )
    # At rest instead, the same recordings leave much.
    assert fitted(problem(cut), drive=OFF).sse > 1e6 * found.sse


def test_only_own_parameters_move_where_the_shared_ones_are_held():
    of = problem(recordings(), options=DiagnoseOptions(initial_state="estimated"))
    found, point = begun(of, drive=OFF)
    ended = fit_point(of, found, point, max_iterations=5, own_columns=[0, 1])
    np.testing.assert_array_equal(ended.point.shared, point.shared)
    assert not np.array_equal(ended.point.own, point.own)


def test_own_parameters_that_are_not_asked_for_stay():
    of = problem(recordings(), options=DiagnoseOptions(initial_state="estimated"))
    found, point = begun(of, drive=OFF)
    ended = fit_point(of, found, point, max_iterations=5, own_columns=[1])
    np.testing.assert_array_equal(ended.point.own[:, 0], point.own[:, 0])
    assert (ended.point.own[:, 1] != point.own[:, 1]).all()


def test_a_search_never_ends_above_its_start():
    of = problem(recordings({"cogging": {"amplitude_N": 0.6, "period_m": 0.004}}))
    for period in (2e-3, 3e-3, 6e-3):
        start = {"cogging": {"amplitude_N": 0.3, "period_m": period, "phase_rad": 0.0}}
        found, point = begun(of, start)
        before = sum_of_squares(residuals_at(of, found, point))
        assert fit_point(of, found, point, max_iterations=3).sse <= before


@pytest.mark.thorough
def test_secant_steps_save_simulations_and_end_in_the_same_place(monkeypatch):
    # From far away, where one set of derivatives is not enough.
    true = {"force_N": 0.5, "static_excess_N": 0.4, "velocity_m_per_s": 0.02}
    start = {"force_N": 0.2, "static_excess_N": 1.2, "velocity_m_per_s": 0.08}
    of = problem(recordings({"stribeck_friction": true}))

    def counted(least_ratio):
        count = 0
        simulate = search.residuals_at

        def counting(*arguments):
            nonlocal count
            count += 1
            return simulate(*arguments)

        with monkeypatch.context() as patch:
            patch.setattr(search, "_LEAST_RATIO", least_ratio)
            patch.setattr(search, "residuals_at", counting)
            return fitted(of, {"stribeck_friction": start}, OFF), count

    with_secants, few = counted(0.1)
    without, many = counted(np.inf)
    assert few < 0.8 * many
    assert with_secants.iterations < without.iterations
    assert with_secants.sse <= 1.001 * without.sse + 1e-12


def test_a_search_says_that_it_was_stopped():
    ended = fitted(problem(recordings()), drive=OFF, max_iterations=1)
    assert ended.iterations == 1
    assert not ended.has_converged


def test_a_simulation_that_runs_away_is_an_infinite_sum():
    # A spring that pushes away beyond a small displacement.
    of = problem(recordings()[:3])
    ended = fitted(of, {"cubic_stiffness": {"stiffness_N_per_m3": -1e9}})
    assert ended.sse == float("inf")
    assert not ended.has_converged


def test_parameters_stay_within_their_bounds():
    # A lag that the recordings do not have goes to its lowest value and no further.
    of = problem(recordings())
    ended = fitted(of, {"actuator_lag": {"time_constant_s": 2e-3}})
    lag = ended.layout.shared[-1]
    value = lag.value(ended.point.shared[-1])
    assert lag.low * (1 - 1e-12) <= value <= lag.high


def test_what_is_skipped_has_no_influence():
    given = recordings(noise=0.0)
    spoilt = [
        replace(one, output=np.r_[one.output[:30] + 1.0, one.output[30:]])
        for one in given
    ]
    options = DiagnoseOptions(skip_samples=30)
    found = [fitted(problem(one, options=options)).sse for one in (given, spoilt)]
    assert found[0] == pytest.approx(found[1], abs=1e-20)


FORCE = {"amplitude_N": 0.3, "frequency_Hz": 31.0}
START = {"periodic_force": FORCE}


def pushed(number, drive):
    phase = 0.4 + 0.9 * number
    return replace(drive, effects={"periodic_force": {**FORCE, "phase_rad": phase}})


def test_phases_are_found_for_a_given_force():
    of = problem(recordings(own=pushed, noise=0.0))
    found, point = begun(of, START)
    own = fit_own(of, found, point.shared)

    phases = own.own[:, 0] * found.own[0].scale
    apart = np.angle(np.exp(1j * (phases - 0.4 - 0.9 * np.arange(9))))
    # The search stops when a step gains a hundred-thousandth of what is left.
    np.testing.assert_allclose(apart, 0.0, atol=1e-5)
    np.testing.assert_array_equal(own.shared, point.shared)


def test_a_trial_takes_each_recording_to_the_nearest_quarter_turn():
    of = problem(recordings(own=pushed, noise=0.0))
    found, point = begun(of, START)
    tried = with_own_trials(of, found, point).own[:, 0] * found.own[0].scale
    apart = np.angle(np.exp(1j * (tried - 0.4 - 0.9 * np.arange(9))))
    # Half of a quarter turn, and a little where the mass still answers to the start.
    assert np.abs(apart).max() < 0.25 * np.pi + 0.1


def test_factors_between_recordings_are_found():
    factors = 1 + 0.08 * np.sin(2.1 * np.arange(9))
    of = problem(
        recordings(
            own=lambda number, drive: replace(
                drive, stiffness_N_per_m=1184.0 * factors[number]
            ),
            noise=0.0,
        )
    )
    found, point = begun(of, {"parameter_change:stiffness": {"log_stiffness": 0.0}})
    own = fit_own(of, found, point.shared)
    logarithms = own.own[:, 0] * found.own[0].scale
    np.testing.assert_allclose(np.exp(logarithms), factors, rtol=1e-6)


def test_a_start_in_motion_is_found():
    cut = [
        replace(one, input=one.input[130:], output=one.output[130:])
        for one in recordings(noise=0.0)
    ]
    of = problem(cut, options=DiagnoseOptions(initial_state="estimated"))
    found, point = begun(of, {})
    own = fit_own(of, found, point.shared)
    left = np.concatenate(residuals_at(of, found, own))
    assert np.abs(left).max() < 1e-9


@pytest.mark.parametrize(
    ("effects", "changes"),
    [
        ({"actuator_lag": {"time_constant_s": 0.02}}, {}),
        (
            {"winding_inductance": {"inductance_H": 0.02}},
            {"resistance_ohm": 1.0, "back_emf_V_s_per_m": 5.0},
        ),
    ],
)
def test_a_current_that_has_not_settled_is_found(effects, changes):
    drive = replace(DRIVE, **changes)
    # In the middle of ramps, where the current is far from what it would rest at.
    cut = [
        replace(one, input=one.input[42:], output=one.output[42:])
        for one in recordings(effects, drive=drive, noise=0.0)
    ]
    of = problem(cut, options=DiagnoseOptions(initial_state="estimated"), **changes)
    found, point = begun(of, effects)
    assert found.own[-1].name == "current"
    left = residuals_at(of, found, fit_own(of, found, point.shared))
    assert np.abs(np.concatenate(left)).max() < 1e-9
    # Position and velocity alone do not tell it.
    only_motion = replace(found, own=found.own[:2])
    left = residuals_at(of, only_motion, fit_own(of, only_motion, point.shared))
    assert np.abs(np.concatenate(left)).max() > 1e-4


def test_one_recording_does_not_move_another():
    given = recordings(own=pushed)
    spoilt = [given[0], replace(given[1], output=-given[1].output), *given[2:]]
    found = []
    for one in (given, spoilt):
        of = problem(one, reference_displacement_m=0.02)
        start, point = begun(problem(given), START)
        found.append(with_own_trials(of, start, point).own)
    np.testing.assert_array_equal(
        np.delete(found[0], 1, axis=0), np.delete(found[1], 1, axis=0)
    )
    # The phase comes first.
    assert found[0][1, 0] != found[1][1, 0]


def test_without_own_parameters_there_is_nothing_to_find():
    of = problem(recordings()[:2])
    found, point = begun(of, {})
    own = fit_own(of, found, point.shared)
    assert isinstance(own, ParameterPoint)
    assert own.own.shape == (2, 0)


@pytest.mark.parametrize("which", ["stiffness", "force_constant", "damping"])
def test_every_own_parameter_has_values_to_try(which):
    of = problem(recordings()[:2])
    found, point = begun(of, {f"parameter_change:{which}": {f"log_{which}": 0.0}})
    assert with_own_trials(of, found, point).own.shape == (2, 1)


def test_own_values_are_found_without_derivatives_by_shared_ones(monkeypatch):
    of = problem(recordings(own=pushed, noise=0.0))
    found, point = begun(of, START)
    parts = residuals_at(of, found, point)
    whole = derivatives(of, found, point, parts)
    simulated = []

    def counted(*given):
        simulated.append(given[0])
        return residuals_at(*given)

    monkeypatch.setattr(search, "residuals_at", counted)
    only = derivatives(of, found, point, parts, [0])
    assert len(simulated) == 1
    n_shared = len(found.shared)
    for one, other in zip(only, whole, strict=True):
        np.testing.assert_array_equal(one[:, :n_shared], 0.0)
        np.testing.assert_array_equal(one[:, n_shared], other[:, n_shared])


def test_a_recording_that_runs_away_does_not_keep_others_from_their_own_values():
    # A joint search has an infinite sum then, and leaves every recording as it was.
    of = problem(recordings(own=pushed, noise=0.0))
    first, *others = of.signals
    spoilt = replace(first, compared=np.full_like(first.compared, np.nan))
    found, point = begun(of, START)
    of = replace(of, signals=(spoilt, *others))
    own = fit_own(of, found, point.shared).own[1:, 0] * found.own[0].scale
    apart = np.angle(np.exp(1j * (own - 0.4 - 0.9 * np.arange(1, 9))))
    np.testing.assert_allclose(apart, 0.0, atol=1e-5)


def test_own_values_are_looked_for_around_those_of_other_recordings():
    # Shared and own factor of the force are one: where all the recordings of a fit share
    # 1.8, the drive sticks at 1, and nothing tells the way from there.
    def weaker(number, true):
        return replace(true, force_constant_N_per_A=4.0 + 0.05 * number)

    given = recordings(
        {"coulomb_friction": {"force_N": 12.0}},
        drive=replace(DRIVE, stiffness_N_per_m=0.0),
        noise=0.0,
        own=weaker,
    )
    free = {"stiffness_N_per_m": 0.0, "force_constant_N_per_A": 2.2}
    of = problem([one for one in given if np.ptp(one.output) > 1e-4], **free)
    which = "parameter_change:force_constant"
    effects = {
        which: {"log_force_constant": 0.0},
        "coulomb_friction": {"force_N": 12.0},
    }
    found, point = begun(of, effects)
    near = np.log(4.0 / 2.2) / found.own[0].scale

    def left(own):
        return sum_of_squares(residuals_at(of, found, own))

    without = left(fit_own(of, found, point.shared))
    usual = np.array([near])
    assert left(fit_own(of, found, point.shared, usual)) < 1e-3 * without
