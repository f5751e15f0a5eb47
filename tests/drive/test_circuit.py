from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate

from hwid_cli.drive import circuit
from hwid_cli.records.machines import ServoMachine

SERVO = ServoMachine(rest_s=0.0)

# With the thesis's constant the motion takes 1e-9 of the current's power, too little to
# see an error in the coupling; with this one it takes a share that is easily seen.
COUPLED = replace(SERVO, back_emf_V_per_rpm=5.0, spring_rate_N_per_mm=0.3)


def times(end_s: float, sample_time_s: float) -> np.ndarray:
    return sample_time_s * np.arange(round(end_s / sample_time_s) + 1)


def test_torque_constant_is_the_back_emf_constant_per_radian():
    # 7.2e-5 V per 2 pi / 60 rad/s, computed by hand.
    assert circuit.torque_constant(SERVO) == pytest.approx(6.8754935e-4, rel=1e-7)


def test_current_without_back_emf_rises_as_in_an_rl_circuit():
    servo = replace(SERVO, back_emf_V_per_rpm=0.0)
    t = times(0.1, 1e-3)
    current = circuit.switch_on(servo, 100.0, t)[:, 0]
    expected = 220.0 / 103.9 * (1 - np.exp(-103.9 / (1 + 1.2e-5) * t))
    # Hundred products of 1e-16 each.
    np.testing.assert_allclose(current, expected, rtol=1e-12)


def test_switching_on_between_two_samples_is_exact():
    servo = replace(SERVO, back_emf_V_per_rpm=0.0, rest_s=0.00137)
    t = times(0.02, 1e-3)
    current = circuit.switch_on(servo, 100.0, t)[:, 0]
    since = np.maximum(t - 0.00137, 0.0)
    expected = 220.0 / 103.9 * (1 - np.exp(-103.9 / (1 + 1.2e-5) * since))
    np.testing.assert_allclose(current, expected, rtol=1e-12)
    assert current[1] == 0.0
    assert current[2] > 0.0


def test_wheel_settles_where_the_spring_carries_the_motor_torque():
    servo = replace(SERVO, damping_ratio=0.3, wheel_radius_m=0.5)
    current, angle, speed = circuit.switch_on(servo, 100.0, times(1.0, 1e-3))[-1]
    assert current == pytest.approx(220.0 / 103.9, rel=1e-12)
    travel = 0.5 * angle
    constant = circuit.torque_constant(servo)
    assert travel == pytest.approx(
        constant * current * 0.5 / (293.1e3 * 0.25), rel=1e-9
    )
    assert abs(speed) < 1e-18


def test_default_travel_is_nanometres():
    angle = circuit.switch_on(SERVO, 220.0, times(0.5, 1e-3))[-1, 1]
    assert angle * SERVO.wheel_radius_m == pytest.approx(2.30e-9, rel=0.01)


def test_oscillation_has_the_frequency_of_inertia_and_spring():
    t = times(0.15, 1e-5)
    # A large resistance makes the current rise at once, so that the shaft rings.
    angle = circuit.switch_on(SERVO, 1e5, t)[:, 1]
    ringing = angle - circuit.torque_constant(SERVO) * 220.0 / 100_003.9 / 293.1e3
    crossings = np.flatnonzero(np.diff(np.sign(ringing[5000:15_000])))
    half_period = np.mean(np.diff(crossings)) * 1e-5
    damped = np.sqrt(293.1e3 / 0.3) * np.sqrt(1 - 0.02**2)
    # Crossings are read to one sample of 10 us among 30 half-periods of 3.2 ms.
    assert np.pi / half_period == pytest.approx(damped, rel=2e-4)


def test_oscillation_dies_out_with_the_damping_ratio():
    roots = np.linalg.eigvals(circuit.state_equations(SERVO, 100.0)[0])
    oscillating = roots[np.abs(roots.imag) > 0]
    # The back-EMF changes the damping by less than 1e-9 of it.
    np.testing.assert_allclose(-oscillating.real / np.abs(oscillating), 0.02, rtol=1e-6)


def test_state_agrees_with_a_general_integrator():
    a, b = circuit.state_equations(COUPLED, 100.0)
    t = times(0.1, 1e-3)
    reference = integrate.solve_ivp(
        lambda _, z: a @ z + b * 220.0,
        (0.0, t[-1]),
        np.zeros(3),
        method="DOP853",
        t_eval=t,
        rtol=1e-12,
        atol=1e-14,
    ).y.T
    states = circuit.switch_on(COUPLED, 100.0, t)
    # The integrator's own tolerance over about a hundred steps.
    np.testing.assert_allclose(states, reference, rtol=1e-9, atol=1e-11)


def test_energy_of_the_source_is_stored_or_lost_in_resistors_and_damper():
    t = times(0.05, 1e-5)
    current, angle, speed = circuit.switch_on(COUPLED, 100.0, t).T
    stiffness = circuit.rotary_stiffness(COUPLED)
    damping = 2 * 0.02 * np.sqrt(stiffness * 0.3)
    supplied = integrate.simpson(220.0 * current, x=t)
    lost = integrate.simpson(103.9 * current**2 + damping * speed**2, x=t)
    stored = 0.5 * (
        (1 + 1.2e-5) * current[-1] ** 2
        + 0.3 * speed[-1] ** 2
        + stiffness * angle[-1] ** 2
    )
    # Simpson's rule on 5000 steps: (1e-5 / 1e-2)^4 of the integrals.
    assert supplied == pytest.approx(lost + stored, rel=1e-10)
    moved = 0.5 * (0.3 * speed[-1] ** 2 + stiffness * angle[-1] ** 2)
    assert moved > 1e-3 * supplied


def test_half_the_sample_time_gives_the_same_samples():
    coarse = circuit.switch_on(SERVO, 44.0, times(0.5, 2e-4))
    fine = circuit.switch_on(SERVO, 44.0, times(0.5, 1e-4))[::2]
    scale = np.max(np.abs(coarse), axis=0)
    # 5000 products of rounding 1e-16 each.
    assert np.max(np.abs(coarse - fine) / scale) < 1e-11


def test_nothing_moves_before_the_source_is_switched_on():
    servo = replace(SERVO, rest_s=0.04)
    states = circuit.switch_on(servo, 100.0, times(0.1, 1e-3))
    np.testing.assert_array_equal(states[:40], 0.0)
    np.testing.assert_array_equal(circuit.switch_on(servo, 1.0, times(0.03, 1e-3)), 0)


def test_resistor_is_the_voltage_over_the_current():
    assert circuit.series_resistance(SERVO, 5.0) == 44.0
