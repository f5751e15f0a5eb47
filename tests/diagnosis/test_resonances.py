"""Starts from spectra, on recordings that scipy has made with equations of its own."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from hwid_cli.diagnosis.resonances import resonances
from hwid_cli.records.drive import Controller
from hwid_cli.records.recordings import Recording
from tests.diagnosis.small_drive import DRIVE, in_turn, problem, sizes

STEP_S, N = 1e-3, 4000
M, C, K, KT = 0.3, 3.0, 1184.0, 5.0


def recordings(a, b, c):
    """Random levels that end in motion, and steps, of dz/dt = A z + b u, y = c z."""
    rng = np.random.default_rng(3)
    system = signal.StateSpace(a, b, c, np.zeros((1, 1)))
    time = STEP_S * np.arange(N)
    inputs = {
        "levels": np.repeat(rng.uniform(-2, 2, N // 20), 20),
        "steps": np.repeat([0.0, 1.5, -1.0, 2.0], N // 4),
    }
    found = []
    for name, current in inputs.items():
        current[:40] = 0.0
        output = signal.lsim(system, current, time, interp=True)[1]
        noise = 1e-6 * rng.standard_normal(N)
        found.append(Recording(name, current, output + noise, STEP_S, kind="random"))
    return found


def with_part(mass, frequency, ratio):
    """A part on a spring of its own beside the mass."""
    k2 = mass * (2 * np.pi * frequency) ** 2
    c2 = 2 * ratio * np.sqrt(k2 * mass)
    a = [
        [0, 1, 0, 0],
        [-(K + k2) / M, -(C + c2) / M, k2 / M, c2 / M],
        [0, 0, 0, 1],
        [k2 / mass, c2 / mass, -k2 / mass, -c2 / mass],
    ]
    return a, [[0], [KT / M], [0], [0]], [[1, 0, 0, 0]]


def with_coupling(stiffness, share, ratio, sensor):
    """A motor that drives the load through a spring; the load on the main spring."""
    motor, load = share * M, (1 - share) * M
    damping = 2 * ratio * np.sqrt(stiffness * motor * load / M)
    a = [
        [0, 1, 0, 0],
        [-(K + stiffness) / load, -(C + damping) / load, stiffness / load, damping / load],
        [0, 0, 0, 1],
        [stiffness / motor, damping / motor, -stiffness / motor, -damping / motor],
    ]  # fmt: skip
    reading = [[1, 0, 0, 0]] if sensor == "load" else [[0, 0, 1, 0]]
    return a, [[0], [0], [0], [KT / motor]], reading


def found_in(made, effect, **base):
    of = problem(recordings(*made))
    # As a base with one resonance in the place of two is fitted: far off, and damped.
    drive = replace(DRIVE, damping_N_s_per_m=40.0, stiffness_N_per_m=0.85 * K, **base)
    return resonances(of, drive, (effect, "coulomb_friction"), sizes(of), in_turn)


# Near the resonance of the drive, above it, and far above it.
@pytest.mark.thorough
@pytest.mark.parametrize("frequency", [8.0, 14.0, 60.0])
def test_a_part_that_swings_along_is_seen(frequency):
    found = found_in(with_part(0.07, frequency, 0.01), "second_mode")
    best = found["second_mode"][0]
    part = best.effects["second_mode"]
    assert part["mass_kg"] == pytest.approx(0.07, rel=0.03)
    assert part["frequency_Hz"] == pytest.approx(frequency, rel=0.005)
    assert part["damping_ratio"] == pytest.approx(0.01, rel=0.1)
    assert best.base["stiffness_N_per_m"] == pytest.approx(K, rel=0.01)
    assert best.base["damping_N_s_per_m"] == pytest.approx(C, rel=0.05)


@pytest.mark.thorough
@pytest.mark.parametrize("sensor", ["motor", "load"])
def test_a_coupling_that_gives_way_is_seen(sensor):
    effect = f"elastic_coupling:{sensor}"
    found = found_in(with_coupling(9e3, 0.3, 0.02, sensor), effect)[effect]
    # A sensor at the load hardly tells the share: what it tells is where both swing.
    swings = [
        one.effects[effect]["stiffness_N_per_m"]
        / (
            one.effects[effect]["motor_share"]
            * (1 - one.effects[effect]["motor_share"])
        )
        for one in found
    ]
    assert min(swings) == pytest.approx(9e3 / (0.3 * 0.7), rel=0.02)
    assert found[0].base["stiffness_N_per_m"] == pytest.approx(K, rel=0.02)


def test_a_free_axis_and_a_closed_loop_show_none_so():
    of = problem(recordings(*with_part(0.07, 14.0, 0.01)))
    loop = Controller(position_gain_per_s=50.0, velocity_gain=4.0)
    free = replace(DRIVE, stiffness_N_per_m=0.0)
    for drive in (free, replace(DRIVE, controller=loop)):
        assert resonances(of, drive, ("second_mode",), sizes(of), in_turn) == {}


def test_only_what_may_be_tried_is_looked_for():
    of = problem(recordings(*with_part(0.07, 14.0, 0.01)))
    assert resonances(of, DRIVE, ("coulomb_friction",), sizes(of), in_turn) == {}
