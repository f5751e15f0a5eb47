"""The spring of a drive's base, straight or curved, at each place."""

import numpy as np

from hwid_cli.records.drive import Drive, StandIn


def stiffness_at(drive: Drive, position: np.ndarray) -> np.ndarray:
    """Slope of the spring's force at each place, [N/m].

    Parameters
    ----------
    position : ndarray, shape (n,), [m]
    """
    quadratic, cubic = _bends(drive)
    bend = 2 * quadratic + 3 * cubic * position
    return np.asarray(drive.stiffness_N_per_m + bend * position)


def spring_force(drive: Drive, position: np.ndarray) -> np.ndarray:
    """Force that pulls back at each place, [N].

    Parameters
    ----------
    position : ndarray, shape (n,), [m]
    """
    quadratic, cubic = _bends(drive)
    bend = quadratic + cubic * position
    return np.asarray((drive.stiffness_N_per_m + bend * position) * position)


def _bends(drive: Drive) -> tuple[float, float]:
    return drive.bends if isinstance(drive, StandIn) else (0.0, 0.0)
