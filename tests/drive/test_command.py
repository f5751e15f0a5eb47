"""The path of the command against the same path in steps of 2 us."""

import numpy as np
import pytest

from hwid_cli.drive.command import MOST_PIECES, command_pieces
from hwid_cli.drive.simulation import parameter_vector
from hwid_cli.records.drive import Drive
from tests.drive.drive_cases import DEAD_ZONE, DELAY, RATE, SATURATION

SAMPLE_TIME_S = 1e-3
FINE = 500


def path(command, effects):
    """Times and values of the corners behind the path."""
    vector = parameter_vector(Drive(), effects)
    pieces, followed = np.empty((MOST_PIECES, 3)), 0.0
    time, corners = 0.0, []
    for n in range(len(command) - 1):
        count, followed = command_pieces(
            n,
            n * SAMPLE_TIME_S,
            SAMPLE_TIME_S,
            command[:-1],
            command[1:],
            0.0,
            vector,
            followed,
            pieces,
        )
        assert sum(pieces[:count, 0]) == pytest.approx(SAMPLE_TIME_S, rel=1e-12)
        for length, first, last in pieces[:count]:
            corners += [(time, first), (time + length, last)]
            time += length
    return np.array(corners).T


def fine_path(command, effects):
    """The same by plain arithmetic in small steps."""
    times = SAMPLE_TIME_S / FINE * np.arange(FINE * (len(command) - 1) + 1)
    delay = effects.get("input_delay", {}).get("delay_s", 0.0)
    given = np.interp(times - delay, SAMPLE_TIME_S * np.arange(len(command)), command)
    width = effects.get("input_dead_zone", {}).get("threshold_A", 0.0)
    given = np.sign(given) * np.maximum(abs(given) - width, 0.0)
    limit = effects.get("input_saturation", {}).get("limit_A", np.inf)
    given = np.clip(given, -limit, limit)
    rate = effects.get("rate_limit", {}).get("rate_A_per_s", np.inf)
    followed = [given[0]]
    for value in given[1:]:
        most = rate * SAMPLE_TIME_S / FINE
        followed.append(followed[-1] + min(max(value - followed[-1], -most), most))
    return times, np.array(followed)


@pytest.mark.parametrize(
    "effects",
    [
        DEAD_ZONE,
        SATURATION,
        RATE,
        DELAY,
        {"input_delay": {"delay_s": 0.002}},
        DEAD_ZONE | SATURATION,
        SATURATION | RATE,
        DEAD_ZONE | SATURATION | RATE | DELAY,
    ],
    ids="+".join,
)
def test_the_path_agrees_with_small_steps(effects):
    rng = np.random.default_rng(3)
    command = np.concatenate([[0.0], np.cumsum(rng.normal(0.0, 0.5, 200))])
    times, expected = fine_path(command, effects)
    found = np.interp(times, *path(command, effects))
    # Corners lie between the small steps: 2 us at up to 1500 A/s.
    assert np.max(abs(found - expected)) < 4e-3
    assert np.sqrt(np.mean((found - expected) ** 2)) < 2e-4
