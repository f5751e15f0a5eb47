"""Pieces that judge: a linear motor whose whole recordings no simulation can follow."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli import DiagnoseOptions, Recording, SimulationOptions, diagnose
from hwid_cli.diagnosis.base_fit import compared_as_given
from hwid_cli.diagnosis.latent_force import latent_force
from hwid_cli.diagnosis.noise import noise_floor
from hwid_cli.diagnosis.pieces import in_pieces
from hwid_cli.diagnosis.pieces_search import seeds_of_pieces
from hwid_cli.diagnosis.problem import prepare
from tests.diagnosis.small_drive import in_turn
from tests.diagnosis.small_rounds import FEW, rounds_of
from tests.stages.diagnosed_drive import FRICTION

STEP_S, NOISE = 2e-3, 2e-5
MASS, DAMPING, CONSTANT = 4.0, 8.0, 25.0
AMPLITUDE, PERIOD, PHASE = 9.0, 0.02, 0.7


def servo(reference, start, noise):
    """Current and measured position of a motor with teeth under a PD controller."""
    stiff, damped = 160.0, 7.0

    def acceleration(x, v, current):
        teeth = AMPLITUDE * (np.sin(2 * np.pi * x / PERIOD + PHASE) - np.sin(PHASE))
        return (CONSTANT * current - DAMPING * v - teeth) / MASS

    x, v, before = start, 0.0, None
    currents, readings = [], []
    for target, error_of_reading in zip(reference, noise, strict=True):
        reading = x + error_of_reading
        error = target - reading
        slope = 0.0 if before is None else (error - before) / STEP_S
        current, before = stiff * error + damped * slope, error
        currents.append(current)
        readings.append(reading)
        h = STEP_S / 10
        for _ in range(10):
            middle = v + 0.5 * h * acceleration(x, v, current)
            at_middle = acceleration(x + 0.5 * h * v, middle, current)
            x, v = x + h * middle, v + h * at_middle
    return np.array(currents), np.array(readings)


def recordings():
    rng = np.random.default_rng(11)
    t = STEP_S * np.arange(900)
    references = {
        "wave_1": 0.03 * np.sin(2 * np.pi * 1.1 * t),
        "wave_2": -0.045 * np.sin(2 * np.pi * 0.8 * t),
        "ramps_3": 0.05 * np.abs((t / 0.9) % 2 - 1) - 0.05,
        "ramps_4": 0.035 - 0.035 * np.abs((t / 0.6) % 2 - 1),
        "wave_5": 0.02 * np.sin(2 * np.pi * 1.7 * t) + 0.03 * t,
    }
    found = []
    for name, reference in references.items():
        start = 1e-4 * rng.standard_normal()
        noise = NOISE * rng.standard_normal(t.size)
        current, reading = servo(reference, start, noise)
        found.append(Recording(name, current, reading, STEP_S, kind="other"))
    return found


@pytest.fixture(scope="module")
def diagnosis():
    simulation = SimulationOptions(
        mass_kg=MASS,
        damping_N_s_per_m=1.3 * DAMPING,
        stiffness_N_per_m=0.0,
        force_constant_N_per_A=0.95 * CONSTANT,
        hold="zero",
    )
    options = DiagnoseOptions(
        effects=("cogging", "coulomb_friction", "constant_load"),
        max_effects=1,
        laws="never",
    )
    return diagnose(recordings(), simulation, options)


@pytest.mark.thorough
def test_teeth_of_a_motor_under_control_are_named(diagnosis):
    (effect,) = diagnosis.effects
    of = {one.name: one for one in effect.parameters}

    assert (diagnosis.verdict, effect.id) == ("named", "cogging")
    assert of["period_m"].value == pytest.approx(PERIOD, rel=1e-3)
    assert of["amplitude_N"].value == pytest.approx(AMPLITUDE, rel=0.01)
    assert of["period_m"].low < PERIOD < of["period_m"].high
    assert diagnosis.after.ratio_to_noise < 1.5 < diagnosis.before.ratio_to_noise / 20


@pytest.mark.thorough
def test_who_reads_it_is_told_of_the_pieces(diagnosis):
    (warning, *_) = diagnosis.warnings

    assert "judged in pieces of 0.15 s with starts of their own" in warning
    assert "a start that is off by the noise changes the motion by" in warning


@pytest.mark.thorough
def test_where_pieces_meet_no_force_is_drawn(diagnosis):
    assert diagnosis.latent_force
    assert [one.law.size for one in diagnosis.latent_force] == [0, 0]


@pytest.mark.thorough
def test_recordings_keep_their_names_and_their_lengths(diagnosis):
    names = [one.name for one in diagnosis.gaps]

    assert names == ["wave_1", "wave_2", "ramps_3", "ramps_4", "wave_5"]
    assert set(diagnosis.train) | set(diagnosis.held_out) == set(names)
    assert all(one.measured.size == 900 for one in diagnosis.overlays)


def held_by_friction(noise):
    """Mass on a spring that friction holds 2 mm away from it; the sensor reads 0 there.

    Semi-implicit Euler on fine steps, as in the tutorial.
    """
    fine, rest, force, friction, stiffness = 50, 2e-3, 5.0, 3.0, 1200.0
    t = STEP_S * np.arange(600)
    current = 4.0 * np.sin(2 * np.pi * 3.0 * np.maximum(t - 0.1, 0.0))
    x, v, found = rest, 0.0, []
    for i in np.repeat(current, fine):
        found.append(x)
        dv = (force * i - stiffness * x - 20.0 * v) * STEP_S / fine / 0.3
        stop = friction * STEP_S / fine / 0.3
        v = v + dv - np.clip(v + dv, -stop, stop)
        x += v * STEP_S / fine
    position = np.array(found[::fine])
    simulation = SimulationOptions(
        mass_kg=0.3,
        damping_N_s_per_m=20.0,
        stiffness_N_per_m=stiffness,
        force_constant_N_per_A=force,
        hold="zero",
        effects={"coulomb_friction": {"force_N": friction}},
    )
    return Recording("held", current, position - rest + noise, STEP_S), simulation


def test_pieces_of_a_recording_whose_zero_is_free_count_from_the_same_zero():
    noise = NOISE * np.random.default_rng(3).standard_normal(600)
    recording, simulation = held_by_friction(noise)
    problem = prepare(
        [recording], simulation, DiagnoseOptions(initial_state="held"), ()
    )
    given = compared_as_given(problem)
    smoothed = latent_force(given, problem.drive, noise_floor(problem))
    pieces = in_pieces(problem, smoothed)

    # The mass moves 2 mm away from what the sensor calls 0: pieces that start at the
    # position and are read at the sensor must not be apart by it.
    for whole in (given, compared_as_given(pieces)):
        left = np.concatenate([one.residual for one in whole])
        assert np.sqrt(np.mean(left**2)) < 5.0 * NOISE


@pytest.mark.parametrize("error", [pytest.param(0.0, marks=pytest.mark.thorough), 0.5])
def test_pieces_that_start_at_another_speed_are_not_searched(error):
    """A lost sample where a piece begins doubles the speed that is read there."""
    rounds = rounds_of(FRICTION, FEW)
    given = compared_as_given(rounds.problem)
    smoothed = [
        replace(one, velocity=one.velocity + error)
        for one in latent_force(
            given, rounds.problem.drive, noise_floor(rounds.problem)
        )
    ]
    asked = []

    def run_tasks(tasks, *, keep):
        asked.extend(one.name for one in tasks)
        return in_turn(tasks, keep=keep)

    seeds, *_ = seeds_of_pieces(replace(rounds, run_tasks=run_tasks), smoothed, 1)
    assert bool(asked) is bool(seeds) is (error == 0.0)
