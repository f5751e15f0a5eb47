"""Machines whose recordings fill a folder: their laws and a Runge-Kutta method, nothing else."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

State = np.ndarray
# Steps of the Runge-Kutta method in a sample.
FINER = 4


@dataclass(frozen=True)
class Plant:
    """A machine, and what its recordings are like.

    Parameters
    ----------
    rates : callable (state, u) -> ndarray
        Derivatives of the state by time.
    output : callable (state, u) -> float
        What the sensor reads.
    n_state : int
    step_s : float, [s]
    low, high : float
        Between which the input moves.
    rest : float
        Input before a recording, in equilibrium with which it starts.
    slow_s : float, [s]
        How long it takes to settle.
    kinds : tuple of str
        Of the recordings that somebody has: kinds of ``inputs``.
    noise : float, [-]
        Share of the output's range.
    """

    rates: Callable[[State, float], np.ndarray]
    output: Callable[[State, float], float]
    n_state: int
    step_s: float
    low: float
    high: float
    rest: float
    slow_s: float
    kinds: tuple[str, ...]
    noise: float

    def simulate(self, u: np.ndarray) -> np.ndarray:
        """Output for an input that is held over each sample, from equilibrium."""
        state, h = self._settled(float(u[0])), self.step_s / FINER
        found = np.empty(u.size)
        for k, value in enumerate(u.tolist()):
            found[k] = self.output(state, value)
            for _ in range(FINER):
                state = self._stepped(state, value, h)
        return found

    def _settled(self, u: float) -> State:
        state = np.zeros(self.n_state)
        for _ in range(int(8 * self.slow_s / self.step_s)):
            state = self._stepped(state, u, self.step_s)
        return state

    def _stepped(self, x: State, u: float, h: float) -> State:
        k1 = self.rates(x, u)
        k2 = self.rates(x + h / 2 * k1, u)
        k3 = self.rates(x + h / 2 * k2, u)
        k4 = self.rates(x + h * k3, u)
        return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def swinging(
    frequency: float, damping: float, force: Callable[[float, float, float], float]
) -> Callable[[State, float], np.ndarray]:
    """A mass on a spring, with a static gain of one for its force."""
    w = 2 * np.pi * frequency

    def rates(x: State, u: float) -> np.ndarray:
        push = w * w * (force(u, x[0], x[1]) - x[0]) - 2 * damping * w * x[1]
        return np.array([x[1], push])

    return rates


def _muscle(x: State, u: float) -> np.ndarray:
    wanted = max(u, 0.0)
    filling = 0.08 if wanted > x[0] else 0.17
    pull = 400.0 * (x[0] - 0.25 * x[0] ** 2 - x[1]) - 24.0 * x[2]
    return np.array([(wanted - x[0]) / filling, x[2], pull])


def _heater(x: State, u: float) -> np.ndarray:
    warm, plate = x
    lost = 0.35 * warm + 6e-9 * ((warm + 293.0) ** 4 - 293.0**4)
    return np.array([(u - lost) / 90.0, (warm - plate) / 30.0])


def _two_masses(x: State, u: float) -> np.ndarray:
    twist = 900.0 * (x[0] - x[2]) + 2.0 * (x[1] - x[3])
    return np.array([x[1], u - twist - 2.0 * x[1], x[3], twist / 1.5 - 1.0 * x[3]])


def _dead_zone(u: float, x: float, v: float) -> float:
    return 40.0 * (max(u - 0.6, 0.0) + min(u + 0.5, 0.0))


def _first(x: State, u: float) -> float:
    return float(x[0])


def _second(x: State, u: float) -> float:
    return float(x[1])


STEPS, SINES = ("step",) * 5, ("sine",) * 5
MIXED = ("step", "step", "sine", "levels", "sine")

PLANTS = {
    "stage with a dead zone, steps": Plant(
        swinging(12.0, 0.06, _dead_zone), _first, 2, 0.002, -4.5, 4.5, 0.0, 0.4, STEPS, 0.005
    ),
    "tank with a free outflow, steps": Plant(
        lambda x, u: np.array([0.12 * u - 0.2 * np.sqrt(max(x[0], 0.0))]),
        lambda x, u: float(x[0]), 1, 1.0, 3.0, 9.0, 6.0, 60.0, STEPS, 0.01,
    ),
    "heater that radiates, steps": Plant(
        _heater, _second, 2, 5.0, 0.0, 100.0, 30.0, 200.0, STEPS, 0.003
    ),
    "drum behind an equal-percentage valve, steps": Plant(
        lambda x, u: np.array([
            (400.0 * 30.0 ** (u / 100 - 1) - x[0]) / 8.0, (x[0] - x[1]) / 15.0,
        ]),
        lambda x, u: float(120.0 + 1.4 * x[1] - 0.4 * x[0]),
        2, 0.5, 30.0, 70.0, 50.0, 25.0, STEPS, 0.01,
    ),
    "resonance whose input is cut, sines": Plant(
        swinging(17.0, 0.015, lambda u, x, v: min(max(u, -2.0), 2.0)),
        _first, 2, 0.002, -4.0, 4.0, 0.0, 1.0, SINES, 0.004,
    ),
    "loudspeaker with a force factor that falls, sines": Plant(
        swinging(
            45.0, 0.35, lambda u, x, v: u * np.exp(-((x / 9.0) ** 2)) - 0.01 * x**3
        ),
        _first, 2, 5e-4, -8.0, 8.0, 0.0, 0.1, SINES, 0.006,
    ),
    "lag read by a sensor that saturates, sines": Plant(
        lambda x, u: np.array([4.0 * (u - x[0]), 25.0 * (x[0] - x[1])]),
        lambda x, u: float(1.0 + 2.0 * np.arctan(0.9 * x[1])),
        2, 0.01, -3.0, 3.0, 0.0, 1.0, SINES, 0.03,
    ),
    "muscle that fills faster than it vents": Plant(
        _muscle, _second, 3, 0.01, 0.0, 3.0, 0.0, 0.6, MIXED, 0.015
    ),
    "valve that saturates on both sides": Plant(
        swinging(30.0, 0.8, lambda u, x, v: min(max(u, -6.0), 6.0)),
        lambda x, u: float(np.tanh(x[0] / 5.0)),
        2, 0.001, -10.0, 10.0, 0.0, 0.1, MIXED, 0.008,
    ),
    "two masses and nothing else": Plant(
        _two_masses, lambda x, u: float(x[3]), 4, 0.005, -10.0, 10.0, 0.0, 1.5, MIXED, 0.01
    ),
}  # fmt: skip
