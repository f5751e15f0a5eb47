"""The base, fitted again: what measuring alone explains."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli import diagnose
from hwid_cli.diagnosis import base_fit, candidate
from hwid_cli.diagnosis.candidate import with_input_noise
from hwid_cli.diagnosis.diagnose import find
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import Controller, Drive
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.recordings import Recording
from tests.diagnosis.small_drive import (
    DRIVE,
    NOISE,
    N,
    fit,
    problem,
    recordings,
    simulation,
    sizes,
    white,
)


def in_turn(tasks, *, keep):
    return [one.function(*one.arguments) for one in tasks]


@pytest.mark.parametrize(("times", "kept"), [(1.5, 1.5), (5.0, 1.0)])
def test_noise_that_a_fit_leaves_a_fifth_of_is_read_from_the_motion(
    monkeypatch, times, kept
):
    # What settles before the input moves, such as a load when its brake opens, is
    # motion: the drive follows it.
    of_rest = NoiseFloor(times * NOISE, "rest", 0.0, True, (1.0,), "")
    monkeypatch.setattr(
        base_fit, "noise_floor", lambda _, rests=True: of_rest if rests else white()
    )
    found = base_fit.fitted_base(problem(recordings()))
    assert found.noise.rms == pytest.approx(kept * NOISE)


def loaded(number, drive):
    """Every second recording with a quarter more mass."""
    return replace(drive, mass_kg=(1.25 if number % 2 else 1.0) * drive.mass_kg)


def loaded_and_noisy():
    free = replace(DRIVE, stiffness_N_per_m=0.0)
    rng = np.random.default_rng(3)
    noisy = [
        replace(one, input=one.input + 0.1 * np.r_[0, rng.standard_normal(N - 1)])
        for one in recordings(drive=free, own=loaded)
    ]
    of = problem(noisy, stiffness_N_per_m=0.0)
    plain = fit(of, {"parameter_change:mass": {"log_mass": 0.0}})
    return of, plain, replace(white(), input_rms=0.1)


@pytest.mark.thorough
@pytest.mark.parametrize("are_many", [False, True])
def test_loads_of_a_free_axis_are_told_behind_noise_of_the_input(monkeypatch, are_many):
    of, plain, noise = loaded_and_noisy()
    if are_many:
        # Some of the recordings are asked before all of them.
        monkeypatch.setattr(candidate, "SCREENING_SAMPLES", of.n_evaluated // 5)
    found = with_input_noise(of, plain, sizes(of), noise)

    def off(one):
        factor = np.exp(one.own[:, 0])
        ratios = factor[1::2, None] / factor[0::2]
        return float(np.max(np.abs(ratios / 1.25 - 1)))

    assert plain.whiteness > 1
    assert found.cause == "input_noise"
    assert off(found) < 0.5 * off(plain)
    # Masses and all others together change nothing.
    base = drive_of(found)["force_constant_N_per_A"] / np.exp(found.own[:, 0])
    true = np.where(np.arange(9) % 2, 5.0 / 1.25, 5.0)
    assert np.median(base / true) == pytest.approx(1.0, abs=0.01)


def test_noise_of_the_input_is_not_fitted_to_many_samples_where_some_hold_more(
    monkeypatch,
):
    of, plain, noise = loaded_and_noisy()
    asked = []

    def fitted(some, _, point, __):
        asked.append(some.n_evaluated)
        return point

    monkeypatch.setattr(candidate, "fit_with_input_noise", fitted)
    monkeypatch.setattr(candidate, "left_over", lambda *_: (9.0, ""))
    monkeypatch.setattr(candidate, "SCREENING_SAMPLES", of.n_evaluated // 5)
    assert with_input_noise(of, plain, sizes(of), noise) is plain
    (n,) = asked
    assert n < 0.5 * of.n_evaluated


def drive_of(found):
    return {
        one.parameter: value
        for one, value in zip(found.names, found.values, strict=True)
    }


@pytest.mark.thorough
def test_a_period_that_the_simulation_states_is_not_lost_while_the_base_is_off():
    """From there a fit of all at once ends at 5.26 mm, a thousand times the noise."""
    cogging = {"cogging": {"amplitude_N": 0.8, "period_m": 4e-3, "phase_rad": 0.6}}
    given = problem(
        recordings(cogging),
        damping_N_s_per_m=22.0,
        stiffness_N_per_m=900.0,
        force_constant_N_per_A=4.0,
        effects={"cogging": {**cogging["cogging"], "amplitude_N": 0.5}},
    )
    at_once = fit(given)
    found = base_fit.fitted_base(given).base
    column = [one.parameter for one in found.names].index("period_m")

    assert at_once.whiteness > 100
    assert found.whiteness <= 1.0
    assert found.values[column] == pytest.approx(4e-3, rel=1e-4)


def hardening_stage():
    """Recordings of a lightly damped stage with friction, beside it with wrong values."""
    drive = replace(
        DRIVE,
        mass_kg=0.35,
        damping_N_s_per_m=4.5,
        stiffness_N_per_m=2600.0,
        force_constant_N_per_A=9.5,
    )
    effects = {
        "coulomb_friction": {"force_N": 0.35},
        "cubic_stiffness": {"stiffness_N_per_m3": 2.2e7},
    }
    wrong = {
        "mass_kg": 0.365,
        "damping_N_s_per_m": 4.9,
        "stiffness_N_per_m": 2500.0,
        "force_constant_N_per_A": 9.2,
        "effects": {
            "coulomb_friction": {"force_N": 0.33},
            "cubic_stiffness": {"stiffness_N_per_m3": 2.05e7},
        },
    }
    return recordings(effects, drive=drive, noise=2e-6), wrong


def friction_of(found):
    column = [one.parameter for one in found.names].index("force_N")
    return found.values[column]


# In proportion to the mass, which is given too large.
FRICTION = pytest.approx(0.35 * 0.365 / 0.35, rel=1e-3)


@pytest.mark.thorough
def test_friction_that_a_fit_has_lost_comes_back_by_way_of_pieces():
    """On a hardening spring a fit of all at once jumps beside the resonance."""
    read, wrong = hardening_stage()
    given = problem(read, **wrong)
    found = base_fit.fitted_base(given).base

    assert friction_of(fit(given)) < 1e-3
    assert found.whiteness <= 1.0
    assert friction_of(found) == FRICTION


@pytest.mark.thorough
def test_a_free_axis_with_friction_is_followed_from_its_logged_command():
    """Played back, a fit of all at once is centimetres away: 4000 times the noise."""
    effects = {
        "stribeck_friction": {
            "force_N": 9.0, "static_excess_N": 4.0, "velocity_m_per_s": 0.02,
        },
        "cogging": {"amplitude_N": 3.2, "period_m": 0.032, "phase_rad": 0.7},
    }  # fmt: skip
    axis = Drive(
        mass_kg=12.0,
        damping_N_s_per_m=35.0,
        stiffness_N_per_m=0.0,
        force_constant_N_per_A=42.0,
        effects=effects,
        controller=Controller(
            position_gain_per_s=30.0, velocity_gain=25.0, reset_rate_per_s=20.0
        ),
        hold="zero",
    )
    time, rng = 1e-3 * np.arange(4000), np.random.default_rng(4)
    moves = ((0.12, 0.2, 0.5), (-0.2, 1.2, 0.6), (0.15, 2.4, 0.4), (-0.05, 3.5, 0.2))
    there_and_back = sum(a * np.clip((time - t) / d, 0, 1) for a, t, d in moves)
    swing = 0.06 * np.sin(2 * np.pi * 1.2 * np.maximum(time - 0.1, 0.0))
    read = []
    for number, reference in enumerate((there_and_back, swing)):
        motion = simulate_drive(reference, axis, sample_time_s=1e-3)
        output = motion.output + 1e-6 * rng.standard_normal(time.size)
        read.append(Recording(f"run_{number}", motion.command, output, 1e-3))
    given = problem(
        read,
        mass_kg=12.4,
        damping_N_s_per_m=33.0,
        stiffness_N_per_m=0.0,
        force_constant_N_per_A=40.9,
        hold="zero",
        effects={
            "stribeck_friction": {
                "force_N": 8.6, "static_excess_N": 4.3, "velocity_m_per_s": 0.021,
            },
            "cogging": {"amplitude_N": 3.05, "period_m": 0.032, "phase_rad": 0.74},
        },
    )  # fmt: skip
    found = base_fit.fitted_base(given).base

    assert found.whiteness <= 1.0
    assert friction_of(found) == pytest.approx(9.0 * 12.4 / 12.0, rel=1e-4)


@pytest.mark.thorough
def test_a_base_that_is_stuck_is_fitted_from_where_an_effect_has_led_it(monkeypatch):
    """Else the stage that lacks nothing is unknown, at 130 times the noise."""
    monkeypatch.setattr(base_fit, "fit_through_pieces", lambda _, found, *__: found)
    read, wrong = hardening_stage()
    options = DiagnoseOptions(
        hold_out=("step_1", "sine_1"), effects=("stribeck_friction", "end_stop")
    )
    found = find(
        problem(read, held_out=options.hold_out, options=options, **wrong),
        options, in_turn, lambda what, total: None,
    )  # fmt: skip

    assert found.verdict.word == "parameters"
    assert found.base.whiteness <= 1.0
    assert friction_of(found.base) == FRICTION


@pytest.mark.thorough
def test_a_base_beside_what_is_missing_stays():
    """Without the effect that is missing the base leaves what it left before."""
    given = problem(recordings({"coulomb_friction": {"force_N": 0.8}}))
    fitted = base_fit.fitted_base(given)
    with_it = fit(given, {"coulomb_friction": {"force_N": 0.8}})

    assert with_it.sse.sum() < 0.1 * fitted.base.sse.sum()
    assert base_fit.fitted_from(fitted, with_it) is None


@pytest.mark.parametrize(
    ("known", "mass_kg", "is_free"),
    [
        ({"force_constant_N_per_A": 0.02}, 0.27, True),
        ({"force_constant_N_per_A": 0.02}, 0.3, False),
        ({"stiffness_N_per_m": 0.02}, 0.27, False),
        ({}, 0.27, False),
    ],
)
def test_a_known_force_constant_that_contradicts_the_mass_sets_the_scale(
    known, mass_kg, is_free
):
    of = problem(recordings(), mass_kg=mass_kg, known=known)
    found = base_fit.fitted_base(of)
    drive = candidate.fitted_drive(found.problem.drive, found.base)
    assert found.problem.drive.is_mass_free is is_free
    assert drive.mass_kg == pytest.approx(0.3 if is_free else mass_kg, rel=2e-3)
    if is_free:
        assert found.base.whiteness <= 1.0
        assert drive.force_constant_N_per_A == 5.0
        assert drive.stiffness_N_per_m == pytest.approx(1184.0, rel=2e-3)


def test_a_missing_spring_is_no_reason_to_doubt_the_mass():
    stiff = {"cubic_stiffness": {"stiffness_N_per_m3": 8e5}}
    of = problem(recordings(stiff), known={"force_constant_N_per_A": 0.02})
    assert not base_fit.fitted_base(of).problem.drive.is_mass_free


def test_a_mass_that_does_not_go_with_a_known_force_constant_is_said():
    options = DiagnoseOptions(effects=("coulomb_friction",), laws="never")
    simulated = simulation(mass_kg=0.27, known={"force_constant_N_per_A": 0.02})
    found = diagnose(recordings(), simulated, options)
    assert found.verdict == "parameters"
    (said,) = [one for one in found.warnings if "does not go with" in one]
    assert said.startswith("mass_kg 0.27 does not go with the force constant that")
    after = {one.name: one.after for one in found.base}
    assert after["mass_kg"] == pytest.approx(0.3, rel=2e-3)
