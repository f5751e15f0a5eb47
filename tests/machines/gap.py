"""How far a machine's output is from what a simple simulation of it can reach.

The simple simulation is m x'' = kt u - c x' - k x from rest, stepped exactly from sample to
sample; damping, stiffness and force constant are fitted to the noise-free output of all
recordings by least squares. What remains, divided by the noise, is the true gap.
"""

from collections.abc import Callable

import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares

from tests.machines.machine import Machine, Recordings, clean_readings
from tests.machines.plants import Base


def linear_output(
    base: Base, commands: np.ndarray, sample_s: float, hold: str
) -> np.ndarray:
    """Position of a one-mass machine, from rest.

    Parameters
    ----------
    commands : ndarray, shape (n_samples, n_recordings)
    sample_s : float, [s]
    hold : str
        `linear` or `zero`: how a command goes on between samples.
    """
    kt, damping = base.force_constant, base.damping
    if base.resistance is not None:
        damping = damping + kt * kt / base.resistance
        kt = kt / base.resistance
    matrix = np.zeros((4, 4))
    matrix[0, 1] = 1.0
    matrix[1, :3] = -base.stiffness / base.mass, -damping / base.mass, kt / base.mass
    matrix[2, 3] = 1.0 / sample_s
    step = expm(matrix * sample_s)
    rise = (
        np.diff(commands, axis=0) if hold == "linear" else np.zeros_like(commands[1:])
    )
    state = np.zeros((2, commands.shape[1]))
    outputs = np.zeros_like(commands)
    for k in range(len(rise)):
        state = step[:2, :2] @ state + np.outer(step[:2, 2], commands[k])
        state += np.outer(step[:2, 3], rise[k])
        outputs[k + 1] = state[0]
    return outputs


def _rms(values: np.ndarray, lengths: np.ndarray) -> float:
    """Root mean square over the part of each column that was kept."""
    kept = np.arange(len(values))[:, None] < lengths
    return float(np.sqrt(np.mean(values[kept] ** 2)))


def refitted_gap(machine: Machine, recordings: Recordings, hold: str) -> float:
    """Rms between noise-free output and the refitted simple simulation, over the noise."""
    if machine.known:
        return projected_gap(machine, recordings, lambda effect: False)
    base = machine.base
    clean = recordings.clean
    if machine.jitter:
        clean = clean_readings(machine, machine.hidden, recordings.commands)
    # The base's numbers may differ between recordings; a simulation has one of each.
    given = {
        name: float(np.mean(value))
        for name, value in vars(base).items()
        if value is not None
    }
    free = [
        "damping",
        "force_constant",
        *(["stiffness"] if given["stiffness"] > 0 else []),
    ]
    kept = np.arange(len(recordings.clean))[:, None] < recordings.lengths
    held = machine.settings.get("initial_state") == "held"

    def error(logs):
        numbers = given | dict(zip(free, np.exp(logs), strict=True))
        made = linear_output(
            Base(**numbers), recordings.commands, machine.sample_s, hold
        )
        left = made - clean
        if held:
            left = left - np.array(
                [one[part].mean() for one, part in zip(left.T, kept.T, strict=True)]
            )
        left = np.nan_to_num(left, nan=1e3, posinf=1e3, neginf=-1e3)
        return left[kept] / recordings.noise_rms

    start = np.log([max(given[name], 1e-12) for name in free])
    found = least_squares(error, start, x_scale=0.1, method="trf", max_nfev=40)
    return float(np.sqrt(np.mean(found.fun**2)))


def projected_gap(
    machine: Machine, recordings: Recordings, kept_effects: Callable[[str], bool]
) -> float:
    """Rms that is left when only some effects are simulated, over the noise.

    Two Gauss-Newton steps of the base's parameters on the machine's own equations take out
    what wrong parameters would explain.
    """
    hidden = [one for one in machine.hidden if kept_effects(one.effect)]
    lengths = recordings.lengths
    kept = np.arange(len(recordings.clean))[:, None] < lengths
    base = machine.base
    free = [
        "damping",
        "force_constant",
        *(["stiffness"] if np.any(base.stiffness) else []),
    ]
    logs, best = np.zeros(len(free)), np.inf

    def left(logs):
        factors = dict(zip(free, np.exp(logs), strict=True))
        numbers = {
            name: value if value is None else value * factors.get(name, 1.0)
            for name, value in vars(base).items()
        }
        other = Machine(**(vars(machine) | {"base": Base(**numbers)}))
        return (clean_readings(other, hidden, recordings.commands) - recordings.clean)[
            kept
        ]

    for _ in range(3):
        now = left(logs)
        best = min(best, float(np.sqrt(np.mean(now**2))))
        columns = []
        for n in range(len(free)):
            moved = logs.copy()
            moved[n] += 0.01
            columns.append((left(moved) - now) / 0.01)
        change = np.linalg.lstsq(np.stack(columns, axis=1), -now, rcond=None)[0]
        logs = np.clip(logs + change, -1.0, 1.0)
    best = min(best, float(np.sqrt(np.mean(left(logs) ** 2))))
    return best / recordings.noise_rms
