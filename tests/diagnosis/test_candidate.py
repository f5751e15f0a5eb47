"""A fit of a candidate: training recordings decide, and it stands for what it found."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.candidate import (
    MOST_ITERATIONS,
    SCREENING_SAMPLES,
    base_start,
    belongs_to,
    bends_effects,
    fitted_drive,
    fitted_effects,
    fitted_values,
    present_start,
    rebuilt,
    screen,
    start_values,
)
from hwid_cli.diagnosis.few_samples import fewer_recordings
from hwid_cli.diagnosis.parameters import (
    first_point,
    parameter_layout,
    residuals_at,
    sum_of_squares,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.search import fit_point
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import (
    DRIVE,
    NOISE,
    fit,
    problem,
    recordings,
    search_start,
    simulation,
    sizes,
)

HELD_OUT = ("step_1", "sine_1", "sine_3")
COULOMB = {"coulomb_friction": {"force_N": 0.8}}
START = {"coulomb_friction": {"force_N": 0.3}}


def fitted(given, *starts):
    # Scales of what was not spoilt: they are no part of what is shown here.
    starts = starts or (START,)
    return fit(problem(given, held_out=HELD_OUT), *starts, scales=sizes(problem()))


def value(found, name):
    return found.values[[str(one) for one in found.names].index(name)]


def test_base_and_effect_are_found_with_their_names():
    found = fitted(recordings(COULOMB))

    assert found.effects == ("coulomb_friction",)
    assert [str(one) for one in found.names] == [
        "base/damping_N_s_per_m",
        "base/stiffness_N_per_m",
        "base/force_constant_N_per_A",
        "coulomb_friction/force_N",
    ]
    assert found.has_converged
    assert found.is_usable
    # One percent is many times the interval of these recordings.
    assert value(found, "coulomb_friction/force_N") == pytest.approx(0.8, rel=0.01)


def test_every_recording_comes_down_to_the_noise():
    found = fitted(recordings(COULOMB))
    rms = np.sqrt(found.sse / 400)
    is_held = np.array([one.name in HELD_OUT for one in recordings()])
    # The RMS of 400 samples scatters by 3.5 %: four times that.
    assert (np.abs(rms / NOISE - 1) < 0.14)[~is_held].all()
    # Where a held-out step comes to rest hangs on the parameters' last digits.
    assert (rms / NOISE < 1.4)[is_held].all()
    assert found.whiteness < 1


def test_held_out_recordings_never_touch_what_is_shared():
    given = recordings(COULOMB)
    spoilt = [
        replace(one, output=3 * one.output[::-1]) if one.name in HELD_OUT else one
        for one in given
    ]
    first, second = fitted(given), fitted(spoilt)

    assert first.values.tobytes() == second.values.tobytes()
    is_held = np.array([one.name in HELD_OUT for one in given])
    np.testing.assert_array_equal(first.sse[~is_held], second.sse[~is_held])
    assert (second.sse[is_held] > 100 * first.sse[is_held]).all()


def test_training_recordings_do_touch_it():
    given = recordings(COULOMB)
    other = [replace(given[0], output=1.01 * given[0].output), *given[1:]]
    assert not np.array_equal(fitted(given).values, fitted(other).values)


def test_the_order_of_the_recordings_only_orders_the_result():
    given = recordings(COULOMB)
    forward, backward = fitted(given), fitted(given[::-1])
    # Sums in another order differ by rounding; a search that goes on until a step gains
    # a hundred-thousandth may then stop a step sooner, within a tenth
    # of a standard error: these know the values to a few thousandths.
    np.testing.assert_allclose(forward.values, backward.values, rtol=5e-4)
    np.testing.assert_allclose(forward.sse.sum(), backward.sse.sum(), rtol=1e-4)
    assert forward.whiteness == pytest.approx(backward.whiteness, rel=0.05)


def test_effects_that_the_simulation_has_are_fitted_again():
    of = problem(recordings(COULOMB), effects={"coulomb_friction": {"force_N": 0.5}})
    found = fit(of)
    assert found.effects == ()
    assert value(found, "coulomb_friction/force_N") == pytest.approx(0.8, rel=0.01)


@pytest.mark.thorough
def test_the_best_of_several_starts_is_kept():
    given = recordings({"cogging": {"amplitude_N": 0.5, "period_m": 0.005}})
    starts = [
        {"cogging": {"amplitude_N": 0.3, "period_m": period, "phase_rad": 0.0}}
        for period in (0.0021, 0.0012, 0.0048)
    ]
    poor = fitted(given, *starts[:2])
    good = fitted(given, *starts)

    assert good.sse.sum() < 0.1 * poor.sse.sum()
    assert value(good, "cogging/period_m") == pytest.approx(0.005, rel=0.01)


def test_phases_of_held_out_recordings_are_found_as_well():
    force = {"amplitude_N": 0.4, "frequency_Hz": 31.0}
    given = recordings(
        own=lambda number, drive: replace(
            drive, effects={"periodic_force": {**force, "phase_rad": 0.9 * number}}
        )
    )
    start = {"periodic_force": {"amplitude_N": 0.2, "frequency_Hz": 30.6}}
    found = fitted(given, start)

    assert [str(one) for one in found.own_names] == [
        "periodic_force/phase_rad",
        "start/position",
        "start/velocity",
    ]
    apart = np.angle(np.exp(1j * (found.own[:, 0] - 0.9 * np.arange(9))))
    # Phase and frequency share the noise: about 0.03 rad over these short recordings.
    assert np.abs(apart).max() < 0.15
    assert value(found, "periodic_force/frequency_Hz") == pytest.approx(31.0, rel=0.01)
    assert found.whiteness < 1


def test_factors_of_held_out_recordings_are_found_as_well():
    factors = 1 + 0.05 * np.sin(2.1 * np.arange(9))
    given = recordings(
        own=lambda number, drive: replace(
            drive, stiffness_N_per_m=1184.0 * factors[number]
        )
    )
    which = "parameter_change:stiffness"
    found = fitted(given, {which: {}})

    total = np.exp(found.own[:, 0]) * value(found, "base/stiffness_N_per_m")
    # The noise moves the stiffness of one recording by less than 0.5 %.
    np.testing.assert_allclose(total, 1184.0 * factors, rtol=5e-3)


def test_a_screened_candidate_is_not_finished():
    of = problem(recordings(COULOMB))
    start = {"input_dead_zone": {"threshold_A": 0.2}}
    before = sum_of_squares(residuals_at(*placed(of, start)))
    begun = [search_start(of, start)]
    found = screen(of, ("input_dead_zone",), begun, sizes(of))
    whole = fit_point(*placed(of, start), max_iterations=MOST_ITERATIONS)

    assert before > found.sse > whole.sse


def placed(of, start):
    layout = parameter_layout(of, tuple(start), start, sizes(of))
    return of, layout, first_point(of, layout, of.drive, start)


def test_a_screening_is_gone_on_with_from_where_it_came_to():
    of = problem(recordings(COULOMB))
    found = screen(of, ("coulomb_friction",), [search_start(of, START)], sizes(of))
    (reached,) = found.starts
    drive = replace(of.drive, **reached.base)
    layout = parameter_layout(of, tuple(reached.effects), reached.effects, sizes(of))
    point = first_point(of, layout, drive, reached.effects)
    # Values go through a logarithm and back.
    assert sum_of_squares(residuals_at(of, layout, point)) == pytest.approx(
        found.sse, rel=1e-6
    )


def test_the_screening_keeps_the_best_of_several_starts():
    of = problem(recordings({"cogging": {"amplitude_N": 0.5, "period_m": 0.005}}))
    begun = [
        search_start(
            of, {"cogging": {"amplitude_N": 0.3, "period_m": period, "phase_rad": 0.0}}
        )
        for period in (0.0021, 0.0012, 0.0048)
    ]
    found = screen(of, ("cogging",), begun, sizes(of))
    alone = screen(of, ("cogging",), begun[2:], sizes(of))

    assert found.sse == alone.sse
    period = found.starts[0].effects["cogging"]["period_m"]
    assert period == pytest.approx(0.005, rel=0.05)


def test_a_screening_that_runs_away_is_a_value():
    of = problem(recordings())
    begun = [search_start(of, {"cubic_stiffness": {"stiffness_N_per_m3": -1e9}})]
    found = screen(of, ("cubic_stiffness",), begun, sizes(of))
    assert found.sse == float("inf")
    assert found.starts == tuple(begun)


def test_a_candidate_that_runs_away_is_a_value():
    start = {"cubic_stiffness": {"stiffness_N_per_m3": -1e9}}
    found = fitted(recordings(), start)

    assert not found.is_usable
    assert found.whiteness == float("inf")
    assert not found.has_converged


def test_wrong_parameters_to_start_from_do_not_matter():
    off = replace(DRIVE, damping_N_s_per_m=20.0, force_constant_N_per_A=4.0)
    of = problem(recordings(COULOMB))
    found = [fit(of, START, drive=drive).values for drive in (DRIVE, off)]
    # Both stop when a step gains a hundred-thousandth.
    np.testing.assert_allclose(found[0], found[1], rtol=2e-3)


def test_few_samples_are_taken_from_every_kind_and_the_largest_first():
    of = problem(recordings())
    few = fewer_recordings(of, 900)
    names = [one.name for one in few.signals]

    assert {one.kind for one in few.signals} == {"step", "sine"}
    assert few.n_evaluated <= 900 + 400
    largest = max(
        (one for one in of.signals if one.kind == "step"),
        key=lambda one: np.max(np.abs(one.output)),
    )
    assert largest.name in names
    assert names == [one.name for one in of.signals if one.name in names]


def test_inputs_of_every_size_are_screened_however_long_they_are():
    # The output of the smallest input drifts furthest, as that of a free axis does.
    drifting = [
        replace(one, output=one.output + 0.05 / np.max(np.abs(one.input)))
        for one in recordings()
    ]
    of = problem(drifting)
    sizes = {one.name: np.max(np.abs(one.driven_by)) for one in of.signals}

    few = fewer_recordings(of, 400)
    chosen = [sizes[one.name] for one in few.signals]

    assert min(chosen) == min(sizes.values())
    assert max(chosen) == max(sizes.values())
    assert few.n_evaluated < of.n_evaluated / 3


def test_of_long_recordings_the_first_parts_of_several_are_taken():
    of = problem(recordings(n=4000))
    few = fewer_recordings(of, SCREENING_SAMPLES)
    whole = {one.name: one for one in of.signals}

    assert len(few.signals) == 6
    assert few.n_evaluated < 2 * SCREENING_SAMPLES
    for one in few.signals:
        # From where it begins to move.
        assert 1500 <= one.driven_by.size <= 1500 + 50
        np.testing.assert_array_equal(
            one.output, whole[one.name].output[: one.output.size]
        )
    # Whole ones that are as many stay whole.
    assert {one.driven_by.size for one in fewer_recordings(of, 30_000).signals} == {
        4000
    }


def test_the_recordings_of_which_most_is_left_come_first():
    of = problem(recordings(n=4000))
    usual = {one.name for one in fewer_recordings(of, 100).signals}
    others = [row for row, one in enumerate(of.signals) if one.name not in usual]
    for row in others:
        left = np.ones(len(of.signals))
        left[row] = 2.0
        few = {one.name for one in fewer_recordings(of, 100, left).signals}
        assert of.signals[row].name in few
    assert len(others) == 3


def test_recordings_that_are_few_anyway_are_all_taken():
    of = problem(recordings())
    assert fewer_recordings(of, SCREENING_SAMPLES) is of


def test_a_single_recording_can_be_fitted():
    of = problem(recordings(COULOMB)[5:6])
    assert isinstance(of, DiagnosisProblem)
    found = fit(of, START)
    assert value(found, "coulomb_friction/force_N") == pytest.approx(0.8, rel=0.05)


PHASES = 0.9 * np.arange(9)


@pytest.fixture(scope="module")
def pushed():
    force = {"amplitude_N": 0.4, "frequency_Hz": 31.0}
    given = recordings(
        own=lambda number, drive: replace(
            drive,
            effects={
                "sensor_drift": {"drift_m_per_s": 0.01},
                "periodic_force": {**force, "phase_rad": PHASES[number]},
            },
        )
    )
    of = problem(
        given,
        held_out=("sine_1",),
        options=DiagnoseOptions(initial_state="estimated"),
        effects={"sensor_drift": {"drift_m_per_s": 0.008}},
    )
    start = {"periodic_force": {"amplitude_N": 0.3, "frequency_Hz": 31.2}}
    return of, fit(of, start)


def test_it_simulates_as_it_did(pushed):
    of, found = pushed
    fit_layout, point = rebuilt(of, found, sizes(of))
    sse = [float(part @ part) for part in residuals_at(of, fit_layout, point)]
    trained = [not one.is_held_out for one in of.signals]
    # Values go through a logarithm and back.
    np.testing.assert_allclose(np.array(sse)[trained], found.sse[trained], rtol=1e-6)
    # A held-out one is evaluated with a phase from its other samples: three values
    # for 400 samples, which gain a part in a hundred by chance.
    row = trained.index(False)
    assert sse[row] < found.sse[row] < 1.05 * sse[row]


def test_it_keeps_its_drive(pushed):
    of, found = pushed
    drive = fitted_drive(of.drive, found)
    assert drive.stiffness_N_per_m == found.values[1]
    # One percent: some hundred samples of 0.1 % noise, over many.
    assert drive.stiffness_N_per_m == pytest.approx(DRIVE.stiffness_N_per_m, rel=0.01)
    assert drive.mass_kg == of.drive.mass_kg


def test_it_keeps_its_effects_and_marks_what_is_own(pushed):
    _, found = pushed
    effects = fitted_effects(found)
    assert set(effects) == {"sensor_drift", "periodic_force"}
    assert effects["periodic_force"]["frequency_Hz"] == pytest.approx(31.0, rel=0.01)
    assert effects["periodic_force"]["phase_rad"] == 0.0
    assert "start" not in effects


def test_effects_of_the_simulation_take_their_fitted_values(pushed):
    _, found = pushed
    start = present_start(found, {"sensor_drift": {"drift_m_per_s": 0.008}})
    assert set(start) == {"sensor_drift"}
    assert start["sensor_drift"]["drift_m_per_s"] == pytest.approx(0.01, rel=0.05)


def test_a_fit_of_the_base_alone_has_no_effects():
    of = problem(recordings()[:2])
    found = fit(of)
    assert fitted_effects(found) == {}
    assert simulation().effects == {}


@pytest.mark.parametrize(
    ("share", "start"), [(1e-7, 0.1), (0.5, 0.5), (2.0, 2.0), (0.0, 0.1)]
)
def test_an_effect_of_the_simulation_that_has_vanished_comes_back(pushed, share, start):
    """Friction that is gone beside what was missing: there no search sees it."""
    _, found = pushed
    fitted = fitted_effects(found)["sensor_drift"]["drift_m_per_s"]
    stated = fitted / share if share else 0.008
    if not share:
        found = replace(found, values=np.zeros_like(found.values))
    present = {"sensor_drift": {"drift_m_per_s": stated}}
    begun = present_start(found, present)["sensor_drift"]["drift_m_per_s"]
    assert begun == pytest.approx(start * stated)
    assert start_values(found, present)["sensor_drift"]["drift_m_per_s"] == begun
    exact = fitted_values(found, present)["sensor_drift"]["drift_m_per_s"]
    assert exact == pytest.approx(share * stated)


@pytest.mark.parametrize(("share", "start"), [(1e-7, 0.1), (0.5, 0.5), (30.0, 30.0)])
def test_damping_that_a_fit_has_lost_comes_back(share, start):
    of = problem(recordings()[:2])
    found = fit(of)
    column = [one.parameter for one in found.names].index("damping_N_s_per_m")
    values = found.values.copy()
    values[column] = share * DRIVE.damping_N_s_per_m
    begun = base_start(of.drive, replace(found, values=values))

    assert begun["damping_N_s_per_m"] == pytest.approx(start * DRIVE.damping_N_s_per_m)
    assert begun["mass_kg"] == DRIVE.mass_kg


@pytest.mark.parametrize(("times", "is_bent"), [(1.9, False), (2.1, True), (0.4, True)])
def test_an_effect_of_the_simulation_is_bent_beyond_a_factor_of_two(times, is_bent):
    of = problem(recordings(COULOMB)[:2], effects=COULOMB)
    found = fit(of)
    column = [one.parameter for one in found.names].index("force_N")
    values = found.values.copy()
    values[column] = times * 0.8

    assert bends_effects(of.drive, replace(found, values=values)) == is_bent


def test_a_fit_belongs_to_recordings_that_start_as_its_own_did():
    rest = problem(recordings(COULOMB))
    found = fit(rest, START, scales=sizes(rest))
    assert belongs_to(rest, found, sizes(rest))
    anywhere = replace(rest, start="estimated")
    assert not belongs_to(anywhere, found, sizes(rest))
