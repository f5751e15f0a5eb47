"""The circuit with an inductance against the matrix exponential and scipy's solver."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate, signal

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Drive
from tests.drive.drive_cases import (
    CORNER_TIMES_S,
    CORNERS,
    COULOMB,
    SAMPLE_TIME_S,
    TIMES_S,
    rms,
    tool,
)
from tests.drive.drive_oracle import simulate
from tests.drive.drive_oracle_machine import Machine

INDUCTANCE = {"winding_inductance": {"inductance_H": 2e-3}}
CIRCUIT = {"resistance_ohm": 0.5, "back_emf_V_s_per_m": 5.0}


def test_the_current_follows_the_linear_circuit():
    # States: current, position, velocity.
    a = [[-0.5 / 2e-3, 0, -5.0 / 2e-3], [0, 0, 1], [5 / 0.3, -1184 / 0.3, -15.1 / 0.3]]
    system = signal.StateSpace(a, [[1 / 2e-3], [0], [0]], [[0, 1, 0]], [[0]])
    voltage = np.interp(TIMES_S, CORNER_TIMES_S, CORNERS)
    expected = signal.lsim(system, voltage, TIMES_S)[1]
    found = tool(INDUCTANCE, **CIRCUIT).output
    # Rounding of both.
    assert rms(found - expected) < 1e-14


@pytest.mark.parametrize("is_winding", [True, False])
def test_a_current_that_has_not_settled_dies_away(is_winding):
    # States: current, position, velocity; 3 A or 3 V beyond what rests, in motion.
    gain = 5.0 / 0.3
    if is_winding:
        a = [[-250.0, 0, -2500.0], [0, 0, 1], [gain, -1184 / 0.3, -15.1 / 0.3]]
        effects, changes, rest = INDUCTANCE, CIRCUIT, 2.0 / 0.5
    else:
        a = [[-100.0, 0, 0], [0, 0, 1], [gain, -1184 / 0.3, -15.1 / 0.3]]
        effects, changes, rest = {"actuator_lag": {"time_constant_s": 0.01}}, {}, 2.0
    b = [[500.0 if is_winding else 100.0], [0], [0]]
    system = signal.StateSpace(a, b, [[0, 1, 0]], [[0]])
    times, start = TIMES_S[:400], (0.004, -0.3, 3.0)
    first = [rest + 3.0, 0.004, -0.3]
    expected = signal.lsim(system, np.full(400, 2.0), times, X0=first)[1]
    found = tool(effects, np.full(400, 2.0), start=start, **changes).position
    assert rms(found - expected) < 1e-11
    settled = tool(effects, np.full(400, 2.0), start=start[:2], **changes).position
    assert rms(settled - expected) > 1e-4


def test_with_friction_it_follows_the_oracle():
    machine = Machine(effects=COULOMB, resistance=0.5, inductance=2e-3, back_emf=5.0)
    expected, _ = simulate(machine, CORNER_TIMES_S, CORNERS, TIMES_S)
    assert rms(tool(INDUCTANCE | COULOMB, **CIRCUIT).output - expected) < 1e-10


def test_it_adds_to_the_inductance_of_the_simulation():
    half = {"winding_inductance": {"inductance_H": 1e-3}}
    both = tool(half, **CIRCUIT, inductance_H=1e-3).output
    np.testing.assert_array_equal(both, tool(INDUCTANCE, **CIRCUIT).output)


def test_a_short_coil_is_none():
    short = {"winding_inductance": {"inductance_H": 1e-7}}
    # 0.2 us behind, at 1 m/s.
    assert rms(tool(short, **CIRCUIT).output - tool({}, **CIRCUIT).output) < 1e-6


@pytest.mark.parametrize("time", [SAMPLE_TIME_S, SAMPLE_TIME_S / 8])
def test_a_step_of_voltage_at_a_blocked_drive_charges_the_coil(time):
    stuck = {"coulomb_friction": {"force_N": 1e3}}
    moved = tool(INDUCTANCE | stuck, np.full(50, 2.0), sample_time=time, **CIRCUIT)
    assert np.all(moved.output == moved.output[0])


def followed_by_scipy(voltage, step, circuit, force_of, hold):
    """Positions of a mass behind a fast coil, from sample to sample."""
    mass, damping, gain, resistance, inductance = circuit
    state, positions = np.zeros(3), [0.0]
    for first, last in pairwise(voltage):
        end = last if hold == "linear" else first

        def rates(t, now, first=first, end=end):
            x, v, i = now
            u = first + (end - first) * t / step
            force = force_of(x, v, i) - damping * v
            drop = resistance * i + gain * v
            return [v, force / mass, (u - drop) / inductance]

        found = integrate.solve_ivp(
            rates, (0, step), state, method="Radau", rtol=1e-9, atol=1e-12
        )
        state = found.y[:, -1]
        positions.append(state[0])
    return np.array(positions)


def loudspeaker(effects, hold):
    """A loudspeaker's voltage, motion and circuit: 60 us of coil in 500 us of sample."""
    mass, damping, gain, resistance, inductance = circuit = 0.028, 1.6, 8.2, 5.6, 3.5e-4
    voltage = np.repeat(np.random.default_rng(4).uniform(-12, 12, 8), 10)
    voltage[:3] = 0.0
    drive = Drive(
        mass_kg=mass,
        damping_N_s_per_m=damping,
        stiffness_N_per_m=2200.0,
        force_constant_N_per_A=gain,
        resistance_ohm=resistance,
        inductance_H=inductance,
        effects=effects,
        hold=hold,
        reference_current_A=2.0,
    )
    found = simulate_drive(voltage, drive, sample_time_s=5e-4).position
    return voltage, found, circuit


@pytest.mark.parametrize("hold", ["linear", "zero"])
@pytest.mark.parametrize(
    ("effects", "force_of", "bound"),
    [
        (
            {"cubic_stiffness": {"stiffness_N_per_m3": 4e7}},
            lambda x, v, i: 8.2 * i - 2200 * x - 4e7 * x**3,
            1e-5,
        ),
        (
            {"quadratic_drag": {"drag_N_s2_per_m2": 6.0}},
            lambda x, v, i: 8.2 * i - 2200 * x - 6.0 * v * abs(v),
            1e-5,
        ),
        (
            {"torque_ripple": {"share": 0.2, "per_turn": 300.0, "phase_rad": 0.4}},
            lambda x, v, i: 8.2 * i * (1 + 0.2 * np.sin(300 * x + 0.4)) - 2200 * x,
            1e-5,
        ),
        (
            {"force_constant_saturation": {"loss_at_reference": 0.2}},
            lambda x, v, i: 8.2 * i * (1 - 0.2 * (i / 2) ** 2) - 2200 * x,
            1e-4,
        ),
        (
            {"supply_sag": {"loss_at_reference": 0.2}},
            lambda x, v, i: 8.2 * i * (1 - 0.2 * abs(i / 2)) - 2200 * x,
            1e-4,
        ),
    ],
)
def test_curved_forces_behind_a_coil_much_faster_than_a_sample(
    effects, force_of, bound, hold
):
    voltage, found, circuit = loudspeaker(effects, hold)
    expected = followed_by_scipy(voltage, 5e-4, circuit, force_of, hold)
    assert np.abs(found - expected).max() < bound * np.ptp(expected)


@pytest.mark.parametrize("hold", ["linear", "zero"])
@pytest.mark.parametrize(
    "further",
    [
        {"elastic_coupling:motor": {"stiffness_N_per_m": 44e3, "motor_share": 0.3}},
        {
            "second_mode": {
                "mass_kg": 3e-3,
                "frequency_Hz": 110.0,
                "damping_ratio": 0.02,
            }
        },
        {"asymmetric_friction": {"force_forward_N": 1.0, "force_backward_N": 1.6}},
        {"load_friction:drive": {"force_N": 0.6, "load_share": 0.08}},
    ],
)
def test_bodies_and_friction_behind_a_fast_coil_are_those_of_short_samples(
    further, hold
):
    """A sample in sixteen parts asks for steps as short as the coil is fast."""
    voltage = np.repeat(np.random.default_rng(6).uniform(-12, 12, 8), 10)
    effects = {"cubic_stiffness": {"stiffness_N_per_m3": 4e7}} | further
    coil = {"inductance_H": 3.5e-4, "resistance_ohm": 5.6, "hold": hold}
    drive = Drive(
        mass_kg=0.028,
        damping_N_s_per_m=1.6,
        stiffness_N_per_m=2200.0,
        force_constant_N_per_A=8.2,
        effects=effects,
        **coil,
    )
    found = simulate_drive(voltage, drive, sample_time_s=5e-4).output
    fine = np.repeat(voltage, 16)
    if hold == "linear":
        fine = np.interp(np.arange(79 * 16 + 1) / 16, np.arange(80), voltage)
    expected = simulate_drive(fine, drive, sample_time_s=5e-4 / 16).output[::16]
    assert np.abs(found - expected).max() < 1e-5 * np.ptp(expected)


def test_a_drive_at_rest_behind_a_coil_lets_go_when_the_current_is_there():
    """With a curved spring, as without: the coil charges while friction holds."""
    held = {"coulomb_friction": {"force_N": 3.0}}
    curved = held | {"cubic_stiffness": {"stiffness_N_per_m3": 1e-9}}
    voltage = np.where(np.arange(400) < 20, 0.0, 2.0)
    plain, with_curve = (
        tool(INDUCTANCE | one, voltage, **CIRCUIT) for one in (held, curved)
    )
    moves = np.flatnonzero(plain.position)[0]
    assert moves > 20
    assert np.flatnonzero(with_curve.position)[0] == moves
    assert rms(plain.position - with_curve.position) < 1e-6 * np.ptp(plain.position)
