"""A lag between a simulation's input and the place where its forces act.

A valve, a coil or an amplifier passes its input on a little later. A force that acts
behind it, as friction at a cylinder does, is not late. Where the simulation has no input
for forces, one has to come through its input: it is sent ahead by that lag.
docs/method_diagnosis.md, eq. (D30e).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from hwid_cli.diagnosis.force_balance import (
    balance_along,
    balancing_columns,
    column_lengths,
)
from hwid_cli.diagnosis.held_force import mean_over_steps
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.records.drive import HELD
from hwid_cli.records.programs import SimulatorRun

# A lag of the input is one where what drives without it leave is at least this much, and
# the best lag leaves at most this share of it; so many are looked at, from this share of a
# sample to this one of a recording.
_LEAST_BEFORE_LAG, _BEHIND_LAG = 0.01, 0.2
_N_LAGS, _SHORTEST_LAG, _LONGEST_LAG = 16, 0.3, 0.1


def behind_lag(
    driven_by: np.ndarray, lag_s: float, sample_time_s: float, *, is_held: bool
) -> np.ndarray:
    """What comes out of a lag of first order that begins at 0.

    Parameters
    ----------
    driven_by : ndarray, shape (n_samples,), [input unit]
    lag_s : float, [s]
        Its time constant.
    is_held : bool
        Whether the input is held between samples, not in straight lines.

    Returns
    -------
    ndarray, shape (n_samples,), [input unit]
    """
    time = sample_time_s * np.arange(driven_by.size)
    lag = scipy.signal.TransferFunction([1.0], [lag_s, 1.0])
    return np.asarray(scipy.signal.lsim(lag, driven_by, time, interp=not is_held)[1])


def through_input(
    force: np.ndarray, lag_s: float, sample_time_s: float, *, is_held: bool
) -> np.ndarray:
    """A force as it has to come through an input that a lag passes on.

    Parameters
    ----------
    force : ndarray, shape (n_samples,), [N]
        In straight lines between samples.
    lag_s : float, [s]
        0 where there is none.
    is_held : bool
        Whether the input is held between samples.

    Returns
    -------
    ndarray, shape (n_samples,), [N]
    """
    slopes = np.diff(force, append=force[-1:]) / sample_time_s
    if is_held:
        return np.asarray(mean_over_steps(force) + lag_s * slopes)
    # At a sample two lines meet.
    slopes[1:] = 0.5 * (slopes[1:] + slopes[:-1])
    return np.asarray(force + lag_s * slopes)


def inputs_behind(signals: Sequence[Signals], lag_s: float, hold: str) -> list[Signals]:
    """Recordings whose inputs have passed a lag.

    Parameters
    ----------
    lag_s : float, [s]
    hold : str
        How their inputs go on between samples; one of ``records.drive.HOLDS``.
    """
    is_held = hold == HELD
    return [
        replace(
            one,
            driven_by=behind_lag(
                one.driven_by, lag_s, one.sample_time_s, is_held=is_held
            ),
        )
        for one in signals
    ]


def lag_of_input(
    signals: Sequence[Signals], runs: Sequence[SimulatorRun], hold: str
) -> float:
    """Time constant of a lag without which no drive moves as the simulation, [s]; or 0.

    Parameters
    ----------
    runs : sequence of SimulatorRun
        What the simulation makes of the inputs.
    hold : str
        How these go on between samples.

    References
    ----------
    docs/method_diagnosis.md, eq. (D30e).
    """
    kinds: tuple[dict[str, bool], ...] = ({}, {"is_curved": True}, {"is_dry": True})
    before = min(balance_along(signals, runs, hold, **one).left for one in kinds)
    if before < _LEAST_BEFORE_LAG:
        return 0.0
    step = signals[0].sample_time_s
    longest = _LONGEST_LAG * step * min(one.driven_by.size for one in signals)
    rows, sizes, _ = balancing_columns(signals, runs, is_curved=True)
    # Only the input changes with the lag: the columns are worked off once.
    basis, among = np.linalg.qr(rows / column_lengths(rows))

    def left(log_lag: float) -> float:
        behind = inputs_behind(signals, float(np.exp(log_lag)), hold)
        pairs = zip(behind, sizes, strict=True)
        right = np.concatenate([one.driven_by / size for one, size in pairs])
        along = basis.T @ right
        beside = max(float(right @ right - along @ along), 0.0)
        inner = scipy.optimize.nnls(among, along)[1]
        return float(np.sqrt((beside + inner**2) / (right @ right)))

    logs = np.log(np.geomspace(_SHORTEST_LAG * step, longest, _N_LAGS))
    lefts = [left(one) for one in logs]
    at = int(np.argmin(lefts))
    if at in (0, _N_LAGS - 1) or lefts[at] > before:
        return 0.0
    best = scipy.optimize.minimize_scalar(
        left, bounds=(logs[at - 1], logs[at + 1]), method="bounded"
    )
    return float(np.exp(best.x)) if best.fun <= _BEHIND_LAG * before else 0.0
