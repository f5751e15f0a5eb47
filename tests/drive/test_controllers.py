"""Controllers against their own equations, the motion between samples by scipy's solver."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hwid_cli.records.drive import Controller
from tests.drive.drive_cases import COULOMB, CUBIC, SAMPLE_TIME_S, rms, tool

N = 250
STEP = 0.004 * np.minimum(np.maximum(np.arange(N) - 20, 0) / 30, 1.0)
WAVE = 0.003 * np.sin(2 * np.pi * 6.0 * SAMPLE_TIME_S * np.arange(N))
CASCADE = {"position_gain_per_s": 20.0, "velocity_gain": 30.0}
CONTROLLERS = {
    "cascade": CASCADE,
    "cascade PI": CASCADE | {"reset_rate_per_s": 25.0},
    "cascade PI, limited": CASCADE | {"reset_rate_per_s": 25.0, "limit": 0.3},
    "P": {"proportional_gain": 300.0},
    "PI": {"proportional_gain": 200.0, "integral_gain": 4000.0},
    "PID": {
        "proportional_gain": 300.0,
        "integral_gain": 4000.0,
        "derivative_gain": 4.0,
    },
    "PID, limited": {
        "proportional_gain": 300.0,
        "integral_gain": 4000.0,
        "derivative_gain": 4.0,
        "limit": 0.4,
    },
}


class Law:
    """The documented laws, written down once more."""

    def __init__(self, limit=np.inf, **gains):
        self.limit, self.gains = limit, gains
        self.total, self.last = 0.0, None

    def command(self, reference, x, v):
        gains = self.gains
        if "velocity_gain" in gains:
            error = gains["position_gain_per_s"] * (reference - x) - v
            total = self.total + SAMPLE_TIME_S * error
            wanted = error + gains.get("reset_rate_per_s", 0.0) * total
            wanted *= gains["velocity_gain"]
        else:
            error = reference - x
            total = self.total + SAMPLE_TIME_S * error
            wanted = gains["proportional_gain"] * error
            wanted += gains.get("integral_gain", 0.0) * total
            change = 0.0 if self.last is None else error - self.last
            wanted += gains.get("derivative_gain", 0.0) * change / SAMPLE_TIME_S
        self.last = error
        grows = abs(wanted) > self.limit and np.sign(wanted) == np.sign(error)
        if not grows:
            self.total = total
        return float(np.clip(wanted, -self.limit, self.limit))


def solved(law, reference, cubic=0.0):
    """Position, velocity and command of a mass on a spring."""

    def rate(t, z, force):
        pull = 15.1 * z[1] + 1184.0 * z[0] + cubic * z[0] ** 3
        return [z[1], (force - pull) / 0.3]

    state, rows = np.zeros(2), []
    for wanted in reference:
        command = law.command(wanted, *state)
        rows.append([*state, command])
        state = solve_ivp(
            rate, (0.0, SAMPLE_TIME_S), state, "DOP853", args=(5.0 * command,),
            rtol=1e-11, atol=1e-15,
        ).y[:, -1]  # fmt: skip
    return np.array(rows).T


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize("reference", [STEP, WAVE], ids=["step", "wave"])
def test_a_controlled_drive_follows_the_solver(name, reference):
    gains = CONTROLLERS[name]
    position, velocity, command = solved(Law(**gains), reference)
    found = tool({}, reference, controller=Controller(**gains))
    # The solver's tolerance on some mm; gains up to 4000 A/(m s) carry it to the command.
    assert rms(found.position - position) < 1e-12
    assert rms(found.velocity - velocity) < 1e-10
    assert rms(found.command - command) < 1e-9
    if "limit" in gains:
        assert np.max(np.abs(command)) == gains["limit"]


def test_a_controlled_curved_drive_follows_the_solver():
    gains = CONTROLLERS["PID"]
    position, _, _ = solved(Law(**gains), STEP, cubic=5e5)
    found = tool(CUBIC, STEP, controller=Controller(**gains))
    assert rms(found.position - position) < 5e-9


@pytest.mark.parametrize("name", ["cascade PI, limited", "PID"])
def test_friction_is_located_between_the_samples_of_a_controller(name):
    gains = CONTROLLERS[name]
    found = tool(COULOMB, WAVE, controller=Controller(**gains))
    # The same commands from outside give the same motion, and the law the same commands.
    again = tool(COULOMB, found.command, hold="zero")
    assert rms(again.position - found.position) < 1e-13
    law = Law(**gains)
    commands = [
        law.command(*row)
        for row in zip(WAVE, found.position, found.velocity, strict=True)
    ]
    np.testing.assert_allclose(found.command, commands, atol=1e-12)


def test_an_integral_part_takes_the_load():
    load = {"constant_load": {"force_N": -2.0}}
    gains = {"proportional_gain": 300.0, "integral_gain": 6000.0}
    found = tool(load, np.full(1500, 0.004), controller=Controller(**gains))
    # 20 time constants of the slowest part, 1 / 10 s.
    assert found.output[-1] == pytest.approx(0.004, rel=1e-6)


def test_a_limited_controller_does_not_wind_up():
    gains = {"proportional_gain": 300.0, "integral_gain": 6000.0, "limit": 0.8}
    reference = np.where(np.arange(800) < 500, 0.01, 0.0)
    found = tool({}, reference, controller=Controller(**gains))
    assert np.all(found.command[:500] == 0.8)
    # 0.8 A hold 3.4 mm, for which it asks back 1.0 A: half a second beyond the limit
    # would have summed up 20 A.
    assert found.command[500] == -0.8
    assert abs(found.output[-1]) < 1e-4
