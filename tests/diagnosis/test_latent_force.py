"""Force that a simulation lacks, against the force that was left out."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from hwid_cli.diagnosis.latent_force import latent_force
from hwid_cli.diagnosis.problem import Compared, Signals
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Controller, StandIn
from tests.diagnosis.diagnosed import (
    DRIVE,
    FULL_SCALE,
    SAMPLE_TIME_S,
    compared,
    white,
)

SIGMA = 1e-3 * FULL_SCALE


def together(found, name):
    return np.concatenate([getattr(one, name) for one in found])


def test_a_cubic_spring_comes_back_as_force_and_motion():
    effect = {"cubic_stiffness": {"stiffness_N_per_m3": 2e5}}
    pairs = compared(effect, noise_rms=SIGMA)

    found = latent_force(pairs, DRIVE, white(SIGMA))

    truth = replace(DRIVE, effects=effect)
    motions = [
        simulate_drive(one.signals.driven_by, truth, sample_time_s=SAMPLE_TIME_S)
        for one in pairs
    ]
    position, velocity = together(motions, "position"), together(motions, "velocity")
    force, expected = together(found, "force"), -2e5 * position**3
    # Noise of 0.1 % of full scale leaves 14 % of the force; its spread says so too.
    assert np.corrcoef(force, expected)[0, 1] > 0.98
    error = np.std(force - expected)
    assert error < 0.2 * np.std(expected)
    assert error < together(found, "spread").mean()
    # Smoothing beats the noise of a single sample.
    assert np.std(together(found, "position") - position) < 0.6 * SIGMA
    assert np.std(together(found, "velocity") - velocity) < 0.02 * np.std(velocity)


def test_what_a_loop_sums_up_is_no_part_of_the_force_that_lasts():
    time = SAMPLE_TIME_S * np.arange(3000)
    push = 0.4 * np.clip(time / 0.5, 0.0, 1.0)
    mass, damping, stiffness, reset = 0.6, 6.2, 36.0, 4.0
    loop = ([1.0, 0.0], [mass, damping, stiffness, reset * stiffness])
    error, nothing = lsim(loop, push, time)[1], np.zeros(time.size)
    signals = Signals("a", "ramp", nothing, error, nothing, error, SAMPLE_TIME_S)
    pair = Compared(signals, nothing, nothing, nothing)
    stand_in = StandIn(mass, damping, stiffness, stiffness, reset_per_s=reset)

    (found,) = latent_force([pair], stand_in, white(0.0))
    (without,) = latent_force([pair], replace(stand_in, reset_per_s=0.0), white(0.0))

    inside = slice(50, -50)
    assert np.max(np.abs(found.force - push)[inside]) < 0.01 * 0.4
    # A loop lets go of what lasts.
    assert abs(without.force[-60]) < 0.2 * 0.4


def test_without_noise_a_slow_force_is_exact():
    size = 3000
    push = 0.4 * np.sin(2 * np.pi * np.arange(size) * SAMPLE_TIME_S)
    driven_by = np.sin(2 * np.pi * 3 * np.arange(size) * SAMPLE_TIME_S)
    # What the simulation lacks is a force, so the current makes it here.
    measured = simulate_drive(
        driven_by + push / DRIVE.force_constant_N_per_A,
        DRIVE,
        sample_time_s=SAMPLE_TIME_S,
    )
    motion = simulate_drive(driven_by, DRIVE, sample_time_s=SAMPLE_TIME_S)
    signals = Signals(
        "a", "sine", driven_by, measured.output, driven_by, measured.output,
        SAMPLE_TIME_S,
    )  # fmt: skip
    pair = Compared(signals, motion.output, motion.position, motion.velocity)

    (found,) = latent_force([pair], DRIVE, white(0.0))

    # The force is held over a sample of 1 ms, in which it moves by up to 0.6 %.
    inside = slice(50, -50)
    assert np.max(np.abs(found.force - push)[inside]) < 0.01 * 0.4


def test_coulomb_friction_shows_its_level_in_both_directions():
    pairs = compared(
        {"coulomb_friction": {"force_N": 0.8}}, noise_rms=SIGMA, chosen="sine_5_3"
    )

    (found,) = latent_force(pairs, DRIVE, white(SIGMA))

    fast = np.abs(found.velocity) > 0.5 * np.max(np.abs(found.velocity))
    level = -np.sign(found.velocity[fast]) * found.force[fast]
    # Smoothing over a reversal and the end of the recording take a little.
    assert level.mean() == pytest.approx(0.8, rel=0.05)


@pytest.mark.parametrize("stiffness", [1184.0, 0.0], ids=["spring", "free"])
def test_a_measured_velocity_shows_the_force_as_well(stiffness):
    base = replace(DRIVE, output="velocity", stiffness_N_per_m=stiffness)
    sigma = 1e-3
    pairs = compared(
        {"coulomb_friction": {"force_N": 0.8}},
        base=base, noise_rms=sigma, chosen="sine_5_3",
    )  # fmt: skip

    (found,) = latent_force(pairs, base, white(sigma))

    fast = np.abs(found.velocity) > 0.5 * np.max(np.abs(found.velocity))
    level = -np.sign(found.velocity[fast]) * found.force[fast]
    assert level.mean() == pytest.approx(0.8, rel=0.05)
    assert np.std(found.velocity - pairs[0].signals.output) < 2 * sigma


@pytest.mark.parametrize(
    ("gains", "feedback"),
    [
        ({"proportional_gain": 600.0, "derivative_gain": 30.0}, "position"),
        ({"proportional_gain": 30.0, "integral_gain": 600.0}, "velocity"),
        (
            {
                "position_gain_per_s": 15.0,
                "velocity_gain": 30.0,
                "reset_rate_per_s": 5.0,
            },
            "position",
        ),
    ],
    ids=["PD", "PI of a velocity", "cascade PI"],
)
def test_each_controller_answers_a_force(gains, feedback):
    base = replace(
        DRIVE, stiffness_N_per_m=0.0, controller=Controller(**gains), output=feedback
    )
    times = SAMPLE_TIME_S * np.arange(3000)
    reference = 0.01 * np.sin(2 * np.pi * times)
    true = replace(base, effects={"coulomb_friction": {"force_N": 0.8}})
    load = simulate_drive(reference, true, sample_time_s=SAMPLE_TIME_S)
    motion = simulate_drive(reference, base, sample_time_s=SAMPLE_TIME_S)
    signals = Signals(
        "a", "sine", reference, load.command, load.command, load.output, SAMPLE_TIME_S
    )
    pair = Compared(signals, motion.command, motion.position, motion.velocity)

    (found,) = latent_force([pair], base, white(1e-4))

    fast = np.abs(load.velocity) > 0.5 * np.max(np.abs(load.velocity))
    level = -np.sign(load.velocity[fast]) * found.force[fast]
    # What an integral part sums up of a displacement is left out.
    assert level.mean() == pytest.approx(0.8, rel=0.15)


def test_under_a_controller_the_command_shows_the_force():
    base = replace(
        DRIVE, stiffness_N_per_m=0.0, controller=Controller(20.0, 30.0), hold="zero"
    )
    times = SAMPLE_TIME_S * np.arange(3000)
    reference = 0.01 * np.sin(2 * np.pi * times)
    true = replace(base, effects={"constant_load": {"force_N": 0.6}})
    load = simulate_drive(reference, true, sample_time_s=SAMPLE_TIME_S)
    motion = simulate_drive(reference, base, sample_time_s=SAMPLE_TIME_S)
    signals = Signals(
        "a", "sine", reference, load.command, load.command, load.output, SAMPLE_TIME_S
    )
    pair = Compared(signals, motion.command, motion.position, motion.velocity)

    (found,) = latent_force([pair], base, white(1e-4))

    # A free axis starts where it rests, so that the load pulls it away first.
    settled = slice(1500, 2900)
    assert found.force[settled].mean() == pytest.approx(0.6, rel=0.01)
    # For slow motion it is minus the force constant times the error of the command.
    residual = (load.command - motion.command)[settled]
    assert -base.force_constant_N_per_A * residual.mean() == pytest.approx(
        found.force[settled].mean(), rel=0.02
    )
    error = found.position - load.position
    assert np.max(np.abs(error[settled])) < 0.02 * np.max(
        np.abs(motion.position - load.position)
    )


def test_a_voltage_drive_damps_the_copy_by_its_back_emf():
    base = replace(DRIVE, resistance_ohm=2.0, back_emf_V_s_per_m=5.0)
    pairs = compared({"coulomb_friction": {"force_N": 0.8}}, base=base)
    pairs = [one for one in pairs if one.signals.name == "sine_5_3"]

    (found,) = latent_force(pairs, base, white(SIGMA))

    fast = np.abs(found.velocity) > 0.5 * np.max(np.abs(found.velocity))
    level = -np.sign(found.velocity[fast]) * found.force[fast]
    assert level.mean() == pytest.approx(0.8, rel=0.05)


def test_a_perfect_simulation_lacks_no_force():
    pairs = compared({}, noise_rms=0.0, chosen="step_1")

    found = latent_force(pairs, DRIVE, white(0.0))

    assert not together(found, "force").any()
    assert together(found, "position") == pytest.approx(
        np.concatenate([one.position for one in pairs])
    )


def test_a_simulation_that_ran_away_leaves_finite_numbers():
    (pair,) = compared({}, chosen="sine_5_3")
    lost = np.where(np.arange(pair.simulated.size) > 700, np.nan, pair.simulated)
    pair = replace(pair, simulated=lost, position=lost, velocity=lost)

    (found,) = latent_force([pair], DRIVE, white(SIGMA))

    for name in ("force", "position", "velocity", "spread"):
        assert np.isfinite(getattr(found, name)).all()


def test_recordings_may_differ_in_length_and_sample_time():
    pairs = compared({"coulomb_friction": {"force_N": 0.8}}, chosen="sine_5")
    first, second = pairs[1], pairs[2]
    signals = second.signals
    fewer_recordings = replace(
        signals,
        driven_by=signals.driven_by[::2],
        compared=signals.compared[::2],
        input=signals.input[::2],
        output=signals.output[::2],
        sample_time_s=2 * SAMPLE_TIME_S,
    )
    second = Compared(
        fewer_recordings,
        second.simulated[::2],
        second.position[::2],
        second.velocity[::2],
    )

    alone = latent_force([pairs[2]], DRIVE, white(SIGMA))
    found = latent_force([first, second], DRIVE, white(SIGMA))

    assert [one.force.size for one in found] == [1450, 725]
    # Half of the samples and another walk: the same force but for smoothing.
    assert np.corrcoef(found[1].force, alone[0].force[::2])[0, 1] > 0.95
