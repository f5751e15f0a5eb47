"""Where the error sits, for effects whose place is known."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.latent_force import latent_force
from hwid_cli.diagnosis.problem import Compared, Signals
from hwid_cli.diagnosis.scales import line_frequencies
from hwid_cli.diagnosis.where import latent_force_curves, places
from hwid_cli.drive.simulation import simulate_drive
from tests.diagnosis.diagnosed import (
    DRIVE,
    SAMPLE_TIME_S,
    compared,
    white,
)

SIGMA = 2.8e-5
NOISE = white(SIGMA)


def found_places(effects, *, base=DRIVE, true=None, chosen=None, noise=NOISE):
    pairs = compared(effects, noise_rms=noise.rms, base=base, true=true, chosen=chosen)
    return places(pairs, noise, base, latent_force(pairs, base, noise))


def about(found, sort):
    return {one.variable: one for one in found if one.about == sort}


@pytest.mark.parametrize(
    ("effect", "values", "variable"),
    [
        ("coulomb_friction", {"force_N": 0.8}, "velocity"),
        (
            "asymmetric_friction",
            {"force_forward_N": 1.0, "force_backward_N": 0.4},
            "velocity",
        ),
        ("quadratic_drag", {"drag_N_s2_per_m2": 8.0}, "velocity"),
        ("cubic_stiffness", {"stiffness_N_per_m3": 4e5}, "displacement"),
        ("quadratic_stiffness", {"stiffness_N_per_m2": 8e3}, "displacement"),
        ("spring_gap", {"half_gap_m": 5e-4}, "displacement"),
        ("input_dead_zone", {"threshold_A": 0.3}, "current"),
        ("supply_sag", {"loss_at_reference": 0.15}, "current"),
        ("input_delay", {"delay_s": 0.004}, "rate of the current"),
        ("sensor_drift", {"drift_m_per_s": 5e-4}, "time"),
        ("constant_load", {"force_N": 0.5}, "constant"),
    ],
)
def test_the_variable_of_an_effect_comes_first(effect, values, variable):
    first = found_places({effect: values})[0]

    assert (first.about, first.variable) == ("variable", variable)
    # Far above what 16 bins of the smoothed noise would take by chance.
    assert 0.2 < first.share <= 1
    assert np.isnan(first.rms)
    assert f"{100 * first.share:.0f} %" in first.sentence


def test_friction_sits_at_reversals_and_a_lag_does_not():
    friction = found_places({"coulomb_friction": {"force_N": 0.8}})[0]
    # The base as it fits a lag best, which leaves errors at reversals as well.
    fitted = replace(
        DRIVE,
        damping_N_s_per_m=13.41,
        stiffness_N_per_m=976.0,
        force_constant_N_per_A=4.109,
    )
    lag = found_places(
        {"actuator_lag": {"time_constant_s": 0.004}}, base=fitted, true=DRIVE
    )[0]

    assert "at reversals of velocity" in friction.sentence
    assert "reversals" not in lag.sentence


def test_a_stop_shows_in_steps_above_the_size_that_reaches_it():
    # Slow ramps deflect by 12.7 mm at 3 A and by 16.9 mm at 4 A.
    effect = {"end_stop": {"position_m": 0.0145, "stiffness_N_per_m": 5e3}}
    pairs = compared(effect, noise_rms=SIGMA, chosen="step")
    pairs = [one for one in pairs if one.signals.name.endswith("_0.2")]

    first = places(pairs, NOISE, DRIVE, latent_force(pairs, DRIVE, NOISE))[0]

    assert "all steps above 3 A" in first.sentence


def test_a_delay_sits_in_the_rise_and_fall_of_steps():
    found = about(found_places({"input_delay": {"delay_s": 0.004}}), "segment")

    assert found["rise"].share + found["fall"].share > 0.9
    first = next(iter(found.values()))
    assert first.sentence.startswith("the error sits in the rise and fall of steps")


def test_shares_of_recordings_and_segments_add_up():
    found = found_places({"coulomb_friction": {"force_N": 0.8}})

    recordings, segments = about(found, "recording"), about(found, "segment")
    assert len(recordings) == 27
    assert sum(one.share for one in recordings.values()) == pytest.approx(1)
    assert sum(one.share for one in segments.values()) == pytest.approx(1)
    shares = [one.share for one in recordings.values()]
    assert shares == sorted(shares, reverse=True)


def test_noise_alone_gives_a_recording_no_share():
    effect = {"end_stop": {"position_m": 0.0165, "stiffness_N_per_m": 5e3}}
    found = about(found_places(effect, noise=white(5e-4)), "recording")

    # Its noise alone would be 0.3 % of all squares; the scatter of its square is 4 %
    # of that, and only what is above the noise counts.
    assert found["step_1_0.2"].share < 5e-4
    assert found["step_5_0.005"].share > 0.05


def test_harmonics_tell_odd_from_even():
    cubic = found_places({"cubic_stiffness": {"stiffness_N_per_m3": 4e5}})
    quadratic = found_places({"quadratic_stiffness": {"stiffness_N_per_m2": 8e3}})

    odd, even = about(cubic, "harmonic"), about(quadratic, "harmonic")
    assert odd["odd harmonics"].share > 0.02
    assert "even harmonics" not in odd
    assert even["even harmonics"].share > 0.1
    assert even["constant"].share > 0.3


def test_the_exponent_of_a_linear_error_is_one():
    # Double the damping: the error is in proportion to the input.
    found = found_places({}, true=replace(DRIVE, damping_N_s_per_m=30.0))

    steps = about(found, "amplitude")["step"]
    assert "(exponent 1.0)" in steps.sentence
    assert "in proportion" in steps.sentence


def test_nothing_but_noise_is_said_to_be_noise():
    (only,) = found_places({})

    assert only.share == 0
    assert "looks like noise" in only.sentence


@pytest.mark.parametrize("chosen", ["step_3_0.05", "sine_2_12", "multisine_0"])
def test_one_recording_is_enough(chosen):
    found = found_places({"coulomb_friction": {"force_N": 0.8}}, chosen=chosen)

    assert about(found, "recording")[chosen].share == pytest.approx(1)
    assert bool(about(found, "segment")) == chosen.startswith("step")
    assert bool(about(found, "harmonic")) == chosen.startswith("sine")
    assert not about(found, "amplitude")


def test_a_constant_input_and_no_noise_do_not_fail():
    measured = 1e-3 * np.sin(np.arange(300) / 10)
    still = np.full(300, 2.0)
    signals = Signals("a", "hold", still, measured, still, measured, SAMPLE_TIME_S)
    motion = simulate_drive(still, DRIVE, sample_time_s=SAMPLE_TIME_S)
    pair = Compared(signals, motion.output, motion.position, motion.velocity)
    noise = white(0.0)

    smoothed = latent_force([pair], DRIVE, noise)
    found = places([pair], noise, DRIVE, smoothed)
    curves = latent_force_curves([pair], [pair], smoothed, DRIVE, noise)

    assert found
    assert all(np.isfinite(one.share) for one in found)
    assert all(np.isfinite(one.mean).all() for one in curves)
    assert line_frequencies([pair], noise)


def test_no_recordings_have_no_places():
    assert places([], NOISE, DRIVE, []) == ()
    assert latent_force_curves([], None, [], DRIVE, NOISE) == ()
    assert len(line_frequencies([], NOISE)) == 1


def test_the_law_of_the_right_effect_lies_on_the_measured_force():
    effect = {"cubic_stiffness": {"stiffness_N_per_m3": 4e5}}
    pairs = compared(effect, noise_rms=SIGMA)
    exact = compared(effect, noise_rms=0.0)
    after = [
        replace(pair, simulated=one.signals.compared)
        for pair, one in zip(pairs, exact, strict=True)
    ]
    smoothed = latent_force(pairs, DRIVE, NOISE)

    first, second = latent_force_curves(pairs, after, smoothed, DRIVE, NOISE)

    assert (first.variable, first.unit) == ("displacement", "m")
    assert (second.variable, second.unit) == ("current", "A")
    assert first.at.size == first.mean.size == first.spread.size == first.law.size
    assert np.all(np.diff(first.at) > 0)
    # A bin holds 1300 samples of a smoothed noise; the spread is that of one sample.
    size = np.max(np.abs(first.mean))
    assert np.max(np.abs(first.law - first.mean)) < 0.05 * size
    # The outer bins are as wide as the motion seldom goes there.
    expected = -4e5 * first.at**3
    assert np.max(np.abs(first.mean - expected)) < 0.1 * np.max(np.abs(expected))


def test_without_effects_there_is_no_law():
    pairs = compared({"coulomb_friction": {"force_N": 0.8}}, chosen="sine_5")
    smoothed = latent_force(pairs, DRIVE, NOISE)

    for one in latent_force_curves(pairs, None, smoothed, DRIVE, NOISE):
        assert one.law.size == 0


@pytest.mark.parametrize("frequency", [6.2, 17.3, 81.0])
def test_the_line_of_a_periodic_force_comes_first(frequency):
    effect = {"periodic_force": {"amplitude_N": 0.3, "frequency_Hz": frequency}}
    pairs = compared(effect, noise_rms=SIGMA)

    # A tenth of a line of 1 / 1.45 s.
    assert line_frequencies(pairs, NOISE)[0] == pytest.approx(frequency, abs=0.07)


def test_at_most_three_lines_and_at_least_one():
    noisy = compared({}, chosen="step_1")
    exact = compared({}, noise_rms=0.0, chosen="step_1")

    assert 1 <= len(line_frequencies(noisy, NOISE)) <= 3
    assert len(line_frequencies(exact, NOISE)) == 1


def test_the_law_of_no_effect_is_zero():
    pairs = compared({"coulomb_friction": {"force_N": 0.8}}, chosen="sine_5")
    smoothed = latent_force(pairs, DRIVE, NOISE)

    for one in latent_force_curves(pairs, pairs, smoothed, DRIVE, NOISE):
        assert one.law.size == one.mean.size
        assert not one.law.any()
        assert one.mean.any()


def test_wrong_parameters_do_not_hide_the_variable():
    wrong = replace(DRIVE, stiffness_N_per_m=1300.0)
    first = found_places({"coulomb_friction": {"force_N": 0.8}}, base=wrong)[0]

    assert first.variable == "velocity"
