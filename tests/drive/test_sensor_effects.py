"""What the sensor makes of the motion."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Controller, Drive
from tests.drive.drive_cases import (
    CORNER_TIMES_S,
    CORNERS,
    COULOMB,
    SAMPLE_TIME_S,
    SCALES,
    TIMES_S,
    rms,
    tool,
)


def follow(fine, half_gap):
    """Play on a finely sampled motion."""
    y, followed = fine[0], []
    for x in fine:
        y = min(max(y, x - half_gap), x + half_gap)
        followed.append(y)
    return np.array(followed)


def test_play_follows_turning_points_between_the_samples():
    half_gap = 1e-3
    found = tool({"output_backlash": {"half_gap_m": half_gap}}).output
    fine = tool({}, sample_time=SAMPLE_TIME_S / 100).position
    expected = follow(fine, half_gap)[::100]
    # 10 us before a turning point with 100 m/s^2 are 5e-9 m.
    assert rms(found - expected) < 1e-8
    plain = follow(fine[::100], half_gap)
    assert rms(plain - expected) > 5e-7


def test_sensor_laws_act_on_the_position():
    position = tool({}).position
    share = position / 0.02

    quadratic = tool({"sensor_quadratic": {"coefficient": 0.1}}).output
    np.testing.assert_allclose(quadratic, position * (1 + 0.1 * share), atol=1e-16)
    cubic = tool({"sensor_cubic": {"coefficient": 0.1}}).output
    np.testing.assert_allclose(cubic, position * (1 + 0.1 * share**2), atol=1e-16)
    drift = tool({"sensor_drift": {"drift_m_per_s": 0.1}}).output
    times = SAMPLE_TIME_S * np.arange(position.size)
    np.testing.assert_allclose(drift, position + 0.1 * times, atol=1e-16)


def test_a_saturated_sensor_is_clipped_on_both_sides():
    position = tool({}).position
    output = tool({"sensor_saturation": {"limit_m": 0.012}}).output
    np.testing.assert_array_equal(output, np.clip(position, -0.012, 0.012))
    assert (output == 0.012).any()
    assert (output == -0.012).any()


def test_hum_swings_in_the_reading_alone():
    plain = tool({})
    values = {"amplitude_m": 2e-4, "frequency_Hz": 50.0, "phase_rad": 0.7}
    found = tool({"sensor_hum": values})
    expected = plain.position + 2e-4 * np.sin(2 * np.pi * 50.0 * TIMES_S + 0.7)
    np.testing.assert_allclose(found.output, expected, atol=1e-15)
    np.testing.assert_array_equal(found.position, plain.position)


def test_an_eccentric_scale_errs_along_the_way():
    position = tool({}).position
    values = {"amplitude_m": 3e-4, "period_m": 4e-3, "phase_rad": 0.7}
    found = tool({"sensor_eccentricity": values}).output
    swing = np.sin(2 * np.pi * position / 4e-3 + 0.7) - np.sin(0.7)
    np.testing.assert_allclose(found, position + 3e-4 * swing, atol=1e-15)


def test_the_terms_of_the_sensor_act_in_their_order():
    laws = {
        "sensor_eccentricity": {"amplitude_m": 3e-4, "period_m": 4e-3},
        "sensor_quadratic": {"coefficient": 0.1},
        "sensor_drift": {"drift_m_per_s": 0.01},
        "sensor_hum": {"amplitude_m": 2e-4, "frequency_Hz": 50.0},
        "sensor_saturation": {"limit_m": 0.012},
    }
    y = tool({}).position
    y = y + 3e-4 * np.sin(2 * np.pi * y / 4e-3)
    y = y * (1 + 0.1 * y / 0.02) + 0.01 * TIMES_S
    y = np.clip(y + 2e-4 * np.sin(2 * np.pi * 50.0 * TIMES_S), -0.012, 0.012)
    np.testing.assert_allclose(tool(laws).output, y, atol=1e-15)


def at_times(ratio, effects, fine=400, shift=0.0):
    """The motion at other times, from samples so fine that the nearest cubic is exact."""
    command = np.append(CORNERS, CORNERS[-1])
    corners = np.append(CORNER_TIMES_S, 1.0)
    dense = SAMPLE_TIME_S / fine
    times = dense * np.arange(round(0.45 / dense) + 1)
    position = tool(
        effects, np.interp(times, corners, command), sample_time=dense
    ).position
    return CubicSpline(times, position)(ratio * TIMES_S + shift)


@pytest.mark.parametrize("ratio", [0.97, 0.9999, 1.0003, 1.05])
def test_another_clock_reads_the_motion_at_other_times(ratio):
    found = tool({"clock_skew": {"ratio": ratio}})
    # A cubic through positions and velocities leaves h^4/384 of the fourth derivative:
    # 25 N/ms swing 0.3 kg by 3e5 m/s^3 at corners.
    assert rms(found.output - at_times(ratio, {})) < 3e-8
    np.testing.assert_array_equal(found.position, tool({}).position)


def test_another_clock_reads_friction_as_well():
    found = tool({"clock_skew": {"ratio": 1.01}} | COULOMB).output
    # Where the drive stops, the acceleration jumps by 5 m/s^2 within a sample of 1 ms.
    assert rms(found - at_times(1.01, COULOMB, fine=40)) < 1e-7


def test_the_same_clock_changes_nothing():
    found = tool({"clock_skew": {"ratio": 1.0}})
    np.testing.assert_array_equal(found.output, tool({}).output)


def test_play_and_drift_go_by_the_other_clock():
    effects = {
        "clock_skew": {"ratio": 0.98},
        "output_backlash": {"half_gap_m": 1e-3},
        "sensor_drift": {"drift_m_per_s": 0.01},
    }
    fine = tool({}, sample_time=SAMPLE_TIME_S / 100).position
    expected = follow(fine, 1e-3)[::98][: TIMES_S.size] + 0.01 * 0.98 * TIMES_S
    # As of the play with one clock.
    assert rms(tool(effects).output - expected) < 3e-8


@pytest.mark.parametrize("size", [1, 2])
@pytest.mark.parametrize("ratio", [0.9, 1.1])
def test_the_shortest_recordings_have_another_clock(size, ratio):
    found = tool({"clock_skew": {"ratio": ratio}}, np.full(size, 2.0)).output
    np.testing.assert_allclose(found, 2.0 * 5.0 / 1184.0, rtol=1e-12)


def test_a_smooth_input_is_read_by_another_clock():
    found = tool({"clock_skew": {"ratio": 0.99}}, hold="smooth").output
    plain = tool({}, hold="smooth")
    spline = CubicHermiteSpline(TIMES_S, plain.position, plain.velocity)
    # Between samples the tool has finer ones.
    assert rms(found - spline(0.99 * TIMES_S)) < 3e-8


SENSOR_LAG = {"sensor_lag": {"time_constant_s": 0.012}}


RATIOS = [0.0, 0.6, 1.0, 1.8]


def behind(times, followed, time_constant, ratio=0.0):
    """A lag of first or second order behind a curve, by a general integrator."""
    curve = CubicSpline(times, followed)

    def rates(t, state):
        y, rate = state
        if ratio == 0.0:
            return [(curve(t) - y) / time_constant, 0.0]
        pull = (curve(t) - y) / time_constant - 2.0 * ratio * rate
        return [rate, pull / time_constant]

    found = solve_ivp(
        rates, (0.0, times[-1]), [followed[0], 0.0], t_eval=times, rtol=1e-10,
        atol=1e-14, max_step=1e-3,
    )  # fmt: skip
    return found.y[0]


def lag(ratio):
    values = {"time_constant_s": 0.012}
    return {"sensor_lag": values | ({"damping_ratio": ratio} if ratio else {})}


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("output", ["position", "velocity"])
def test_a_sensor_that_lags_reads_what_a_lag_of_its_order_gives(output, ratio):
    found = tool(lag(ratio), output=output)
    expected = behind(TIMES_S, getattr(found, output), 0.012, ratio)
    # A straight line between samples is off by dt^2 / 12 of the second derivative on
    # average, of which a lag lets most through: 20 m/s^2, or 2e3 m/s^3 of a velocity.
    bound = {"position": 3e-6, "velocity": 3e-4}[output]
    assert rms(found.output - expected) < bound
    assert rms(found.output - getattr(found, output)) > 100 * bound
    np.testing.assert_array_equal(found.position, tool({}).position)


def test_a_sensor_that_lags_comes_behind_its_other_laws():
    laws = {
        "sensor_cubic": {"coefficient": 0.2},
        "sensor_saturation": {"limit_m": 0.01},
    }
    sensed = tool(laws).output
    expected = behind(TIMES_S, sensed, 0.012)
    assert rms(tool(laws | SENSOR_LAG).output - expected) < 1e-5


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("output", ["position", "velocity"])
def test_a_recording_that_begins_in_motion_has_lagged_before(output, ratio):
    drive = Drive(
        mass_kg=1.0, damping_N_s_per_m=0.0, stiffness_N_per_m=0.0,
        force_constant_N_per_A=1.0, effects=lag(ratio), output=output,
    )  # fmt: skip
    found = simulate_drive(
        np.zeros(50), drive, sample_time_s=1e-3, start=(0.003, 0.4)
    ).output
    # At a constant speed a lag is behind by its slope at 0, from the first sample on.
    late = 0.012 * (2 * ratio if ratio else 1.0)
    expected = 0.003 + 0.4 * (1e-3 * np.arange(50) - late)
    expected = expected if output == "position" else np.full(50, 0.4)
    np.testing.assert_allclose(found, expected, atol=1e-15)


@pytest.mark.parametrize(
    "controller",
    [
        Controller(position_gain_per_s=10.0, velocity_gain=3.0),
        Controller(proportional_gain=120.0, integral_gain=900.0, derivative_gain=2.0),
    ],
    ids=["cascade", "PID"],
)
@pytest.mark.parametrize("ratio", [0.0, 0.7])
def test_a_controller_reads_the_sensor_that_lags(controller, ratio):
    mass, damping, constant, late, step = 0.3, 15.0, 5.0, 0.012, 1e-3
    reference = 0.01 * np.sin(2 * np.pi * 4.0 * np.arange(400) * step) ** 2
    drive = Drive(
        mass_kg=mass, damping_N_s_per_m=damping, stiffness_N_per_m=0.0,
        force_constant_N_per_A=constant, controller=controller,
        effects=lag(ratio),
    )  # fmt: skip
    found = simulate_drive(reference, drive, sample_time_s=step)

    def rates(t, state, current):
        x, v, late_x, late_v, rate_x, rate_v = state
        push = constant * current - damping * v
        moved = [v, push / mass]
        off_x, off_v = (x - late_x) / late, (v - late_v) / late
        if ratio == 0.0:
            return [*moved, off_x, off_v, 0.0, 0.0]
        pull_x, pull_v = off_x - 2 * ratio * rate_x, off_v - 2 * ratio * rate_v
        return [*moved, rate_x, rate_v, pull_x / late, pull_v / late]

    state, total, last, given = np.zeros(6), 0.0, None, []
    for wanted in reference:
        _, _, x, v, *_ = state
        error = wanted - x
        gain, reset = controller.proportional_gain, controller.integral_gain
        if controller.velocity_gain is not None:
            error = controller.position_gain_per_s * error - v
            gain, reset = controller.velocity_gain, 0.0
        total += step * error
        current = gain * error + reset * total
        if last is not None:
            current += controller.derivative_gain * (error - last) / step
        last = error
        given.append(current)
        state = solve_ivp(
            rates, (0.0, step), state, args=(current,), rtol=1e-9, atol=1e-12
        ).y[:, -1]
    assert rms(found.command - given) < 2e-3 * rms(np.array(given))
    undelayed = simulate_drive(
        reference, drive.__class__(**{**vars(drive), "effects": {}}), sample_time_s=step
    )
    assert rms(undelayed.command - given) > 0.05 * rms(np.array(given))


def test_a_controller_begins_with_what_lags_as_well():
    drive = Drive(
        mass_kg=1.0, damping_N_s_per_m=0.0, stiffness_N_per_m=0.0,
        force_constant_N_per_A=1.0, effects=SENSOR_LAG,
        controller=Controller(proportional_gain=5.0),
    )  # fmt: skip
    found = simulate_drive(
        np.full(10, 0.02), drive, sample_time_s=1e-3, start=(0.003, 0.4)
    )
    assert found.command[0] == pytest.approx(5.0 * (0.02 - (0.003 - 0.012 * 0.4)))


def test_a_probe_may_be_as_slow_as_a_twentieth_of_a_recording():
    (lag,) = CATALOGUE["sensor_lag"].parameters
    long = replace(SCALES, duration_s=100.0)
    assert lag.bounds(long)[1] == pytest.approx(5.0)
    assert lag.bounds(SCALES)[1] == pytest.approx(0.5 / SCALES.natural_Hz)
