"""A lag between a simulation's input and the place where its forces act.

A valve, a coil or an amplifier passes its input on a little later. A force that acts
behind it, as friction at a cylinder does, is not late. Where the simulation has no input
for forces, one has to come through its input: it is sent ahead by that lag.
docs/method_diagnosis.md, eq. (D30e).
"""

import numpy as np
import scipy

from hwid_cli.diagnosis.held_force import mean_over_steps


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
