"""What the sensor makes of the motion."""

import numpy as np

from tests.drive.drive_cases import SAMPLE_TIME_S, rms, tool


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
