"""Sizes of recordings; lines of an error, in time and along the way."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.latent_force import Smoothed
from hwid_cli.diagnosis.problem import Compared, DiagnosisProblem, Signals
from hwid_cli.diagnosis.scales import (
    line_frequencies,
    line_share,
    motor_force,
    scales_of_recordings,
    waves_along,
    waves_of_reading,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.effect import Wave
from hwid_cli.records.drive import Drive
from tests.diagnosis.small_drive import (
    DRIVE,
    STEP_S,
    N,
    problem,
    recordings,
    sizes,
    white,
)

TIME = STEP_S * np.arange(400)


def compared(residuals):
    """Recordings of which a simulation leaves given residuals."""
    signals = problem().signals
    return [
        Compared(one, one.compared - left, one.output, np.gradient(one.output, STEP_S))
        for one, left in zip(signals, residuals, strict=False)
    ]


def test_a_line_takes_its_share_whatever_its_phases():
    rng = np.random.default_rng(5)
    left = [
        np.sin(2 * np.pi * 31 * TIME + phase) + 0.5 * rng.standard_normal(400)
        for phase in range(9)
    ]
    pairs = compared(left)
    (frequency, *_) = line_frequencies(pairs, white(0.5))
    assert frequency == pytest.approx(31, abs=0.3)
    # 1/2 against 1/2 + 1/4.
    assert line_share(pairs, frequency) == pytest.approx(2 / 3, abs=0.03)


def test_slow_noise_has_no_line():
    rng = np.random.default_rng(6)
    left = [np.cumsum(rng.standard_normal(400)) for _ in range(9)]
    slow = [one - np.convolve(one, np.ones(50) / 50, "same") for one in left]
    pairs = compared(slow)
    assert line_share(pairs, line_frequencies(pairs, white(1.0))[0]) < 0.2


def test_nothing_has_no_line():
    assert line_share(compared([np.zeros(400)] * 3), 20.0) == 0.0


@pytest.mark.parametrize(("period", "phase"), [(0.0019, 0.4), (0.0031, -2.5)])
def test_a_force_that_repeats_along_the_way_is_read_off(period, phase):
    pairs = compared([np.zeros(400)] * 9)
    rng = np.random.default_rng(7)
    smoothed = []
    for one in pairs:
        force = 0.7 * np.sin(2 * np.pi * one.position / period + phase)
        # Something slow beside it, and noise.
        force += 30.0 * one.position + 0.1 * rng.standard_normal(400)
        smoothed.append(Smoothed(force, one.position, one.velocity, 0 * force))
    best = waves_along(pairs, smoothed)[0]

    assert best.period_m == pytest.approx(period, rel=2e-3)
    assert best.amplitude == pytest.approx(0.7, rel=0.1)
    apart = np.angle(np.exp(1j * (best.phase_rad - phase)))
    assert abs(apart) < 0.2


def test_a_share_of_the_motor_force_that_repeats_is_read_off():
    pairs = compared([np.zeros(400)] * 9)
    rng = np.random.default_rng(7)
    motor = motor_force(pairs, DRIVE)
    assert motor[:400] == pytest.approx(
        DRIVE.force_constant_N_per_A * pairs[0].signals.input
    )
    ends = np.cumsum([one.position.size for one in pairs])[:-1]
    smoothed = []
    for one, push in zip(pairs, np.split(motor, ends), strict=True):
        force = 0.2 * push * np.sin(2 * np.pi * one.position / 0.0019 + 0.4)
        # A force constant that is wrong beside it, and noise.
        force += 0.1 * push + 0.1 * rng.standard_normal(400)
        smoothed.append(Smoothed(force, one.position, one.velocity, 0 * force))
    best = waves_along(pairs, smoothed, motor)[0]

    assert best.period_m == pytest.approx(0.0019, rel=2e-3)
    assert best.amplitude == pytest.approx(0.2, rel=0.1)
    assert abs(np.angle(np.exp(1j * (best.phase_rad - 0.4)))) < 0.2
    starts = CATALOGUE["torque_ripple"].starts(
        replace(sizes(problem()), ripples=(best,))
    )
    assert starts[0]["per_turn"] == pytest.approx(2 * np.pi / 0.0019, rel=2e-3)
    assert starts[0]["share"] == pytest.approx(0.2, rel=0.1)


@pytest.mark.parametrize(("period", "phase"), [(0.0019, 0.4), (0.0006, -2.0)])
def test_what_a_sensor_errs_by_along_the_way_is_read_off(period, phase):
    rng = np.random.default_rng(8)
    at_rest = compared([np.zeros(400)] * 9)
    errors = [
        3e-4 * np.sin(2 * np.pi * one.position / period + phase)
        # A zero of its own and noise.
        + 1e-3 * number
        + 2e-5 * rng.standard_normal(400)
        for number, one in enumerate(at_rest)
    ]
    pairs = compared(errors)
    smoothed = [
        Smoothed(np.zeros(400), one.position, one.velocity, np.zeros(400))
        for one in at_rest
    ]
    best = waves_of_reading(pairs, smoothed)[0]
    assert best.period_m == pytest.approx(period, rel=2e-3)
    assert best.amplitude == pytest.approx(3e-4, rel=0.1)
    assert abs(np.angle(np.exp(1j * (best.phase_rad - phase)))) < 0.2

    effect = CATALOGUE["sensor_eccentricity"]
    scales = replace(sizes(problem()), reading_waves=(best,))
    first, *others = effect.starts(scales)
    assert first["period_m"] == best.period_m
    assert others == effect.grid(scales)


def test_a_velocity_has_no_place_to_err_at():
    (pair,) = compared([np.zeros(400)])[:1]
    of_speed = replace(pair, signals=replace(pair.signals, is_velocity=True))
    still = Smoothed(np.ones(400), np.zeros(400), np.zeros(400), np.zeros(400))
    assert waves_of_reading([of_speed], [still]) == ()


def test_without_motion_nothing_repeats():
    (one,) = compared([np.zeros(400)])[:1]
    still = Smoothed(np.ones(400), np.zeros(400), np.zeros(400), np.zeros(400))
    assert waves_along([replace(one, position=np.zeros(400))], [still]) == ()


def signals(driven_by, output, *, skip=0, held_out=False, step=0.01):
    driven_by, output = np.asarray(driven_by, float), np.asarray(output, float)
    return Signals(
        "r", "other", driven_by, output, driven_by, output, step, skip, held_out
    )  # fmt: skip


def two_recordings(**drive):
    return DiagnosisProblem(
        (
            signals([0.0, 2.0, 2.0], [0.0, -0.3, 0.1]),
            signals([0.0, -3.0, -2.5, -2.5], [0.0, 0.2, 0.0, 0.0]),
        ),
        Drive(**drive),
    )


def test_scales_are_the_largest_of_all_recordings():
    of = two_recordings(
        mass_kg=2.0, stiffness_N_per_m=50.0, force_constant_N_per_A=-4.0
    )
    found = scales_of_recordings(
        of, [np.array([0.5, -0.7]), np.array([0.6, np.nan])], (12.0,)
    )

    assert found.displacement_m == pytest.approx(0.3)
    assert found.stroke_m == pytest.approx(0.4)
    assert found.current_A == pytest.approx(3.0)
    assert found.current_rate_A_per_s == pytest.approx(300.0)
    assert found.velocity_m_per_s == pytest.approx(0.7)
    assert found.force_N == pytest.approx(12.0)
    assert found.duration_s == pytest.approx(0.04)
    assert found.frequencies_Hz == (12.0,)


def test_the_natural_frequency_comes_from_mass_and_spring():
    of = two_recordings(mass_kg=2.0, stiffness_N_per_m=2.0 * (2 * np.pi * 80) ** 2)
    assert scales_of_recordings(of, [np.ones(2)] * 2).natural_Hz == pytest.approx(80.0)


def test_a_free_axis_has_two_periods_in_its_longest_recording():
    of = two_recordings(stiffness_N_per_m=0.0)
    assert scales_of_recordings(of, [np.ones(2)] * 2).natural_Hz == pytest.approx(50.0)


def test_the_force_of_a_voltage_is_that_of_its_current():
    of = two_recordings(force_constant_N_per_A=4.0, resistance_ohm=8.0)
    assert scales_of_recordings(of, [np.ones(2)] * 2).force_N == pytest.approx(1.5)


def test_scales_of_recordings_without_motion_are_not_zero():
    still = DiagnosisProblem((signals([0, 1, 1], [0, 0, 0]),), Drive())
    found = scales_of_recordings(still, [np.zeros(3)])
    assert min(found.displacement_m, found.velocity_m_per_s, found.stroke_m) > 0


@pytest.mark.parametrize(("passes_once", "fewest"), [(False, 0.5), (True, 3.0)])
def test_friction_along_a_way_that_is_passed_once_has_to_repeat(passes_once, fewest):
    scales = replace(sizes(problem()), passes_once=passes_once)
    friction = CATALOGUE["position_friction"]
    (period,) = [one for one in friction.parameters if one.name == "period_m"]
    assert period.bounds(scales)[1] == pytest.approx(scales.stroke_m / fewest)
    starts = period.starts(scales)
    assert starts
    assert max(starts) <= scales.stroke_m / fewest


@pytest.mark.parametrize(
    ("share_of_stroke", "fewest"),
    # The stroke of recordings to both sides is twice the way of each.
    [(0.0, 0.4), (1.0, 3.0), (0.5, 6.0)],
)
def test_a_ripple_has_to_repeat_where_no_recording_comes_back(share_of_stroke, fewest):
    scales = sizes(problem())
    waves = [Wave(scales.stroke_m / n, 0.1, 0.5) for n in (8, 2)]
    scales = replace(
        scales, way_m=share_of_stroke * scales.stroke_m, ripples=tuple(waves)
    )
    ripple = CATALOGUE["torque_ripple"]
    (per_turn,) = [one for one in ripple.parameters if one.name == "per_turn"]
    least = 2 * np.pi * fewest / scales.stroke_m
    assert per_turn.bounds(scales)[0] == pytest.approx(least)
    starts = per_turn.starts(scales)
    assert starts
    assert min(starts) >= least
    together = [one["per_turn"] for one in ripple.seen(scales)]
    assert min(together) >= least
    # Two of each wave that repeats often enough.
    assert len(together) >= (4 if fewest < 2 else 2)
    bare = replace(scales, ripples=tuple(waves[1:]))
    assert bool(ripple.seen(bare)) is (fewest < 2)


@pytest.mark.parametrize("n", [1, 2])
def test_scales_know_that_a_way_is_passed_once(n):
    one = problem().signals[0]
    up = replace(one, output=np.linspace(0.0, 0.01, one.output.size))
    of = DiagnosisProblem((up,) * n, DRIVE)
    found = scales_of_recordings(of, [np.zeros(3)] * n)
    assert found.passes_once == (n == 1)


@pytest.mark.parametrize("is_velocity", [False, True])
def test_a_base_that_hardly_moves_makes_no_speed_small(is_velocity):
    # Friction, drag and limits at speed start from it, and a thousandth of it is stiff.
    of = problem([replace(one, output=0.1 * np.sin(0.02 * np.arange(N)))
                  for one in recordings()])  # fmt: skip
    signals = [replace(one, is_velocity=is_velocity) for one in of.signals]
    of = replace(of, signals=tuple(signals))
    still = [np.zeros(3) for _ in signals]
    found = scales_of_recordings(of, still).velocity_m_per_s
    # Of a position 0.1 m at 20 rad/s: 2 m/s.
    assert found == pytest.approx(0.1 if is_velocity else 2.0, rel=0.01)
    fast = scales_of_recordings(of, [np.full(3, 50.0) for _ in signals])
    assert fast.velocity_m_per_s == 50.0


@pytest.mark.parametrize("has_spring", [True, False])
def test_appendages_of_a_free_axis_are_looked_for_at_all_frequencies(has_spring):
    given = replace(
        sizes(problem()), has_spring=has_spring, natural_Hz=0.08, sample_time_s=5e-3,
        frequencies_Hz=(0.917,),
    )  # fmt: skip
    found = CATALOGUE["second_mode"].parameter("frequency_Hz").starts(given)
    assert (0.917 in found) is not has_spring
    # A search finds a resonance from within a factor of 1.3.
    near = [min(abs(np.log(np.array(found) / one))) for one in (0.9, 2.0, 7.0, 15.0)]
    assert (max(near) < np.log(1.3)) is not has_spring
