"""The spring of a drive, straight or curved, at each place."""

import numpy as np

from hwid_cli.compiled import compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.move import take_stock
from hwid_cli.drive.motion.resting import resting_point
from hwid_cli.drive.motion.springs import spring_force as force_at
from hwid_cli.drive.simulation import drive_effects, parameter_vector
from hwid_cli.records.drive import Drive, StandIn

# A slope is that between two places so far apart, as a share of the largest displacement.
_APART = 1e-5


def stiffness_at(drive: Drive, position: np.ndarray) -> np.ndarray:
    """Slope of the force of the base's spring at each place, [N/m].

    Parameters
    ----------
    position : ndarray, shape (n,), [m]
    """
    quadratic, cubic = _bends(drive)
    bend = 2 * quadratic + 3 * cubic * position
    return np.asarray(drive.stiffness_N_per_m + bend * position)


def stiffness_with_effects(drive: Drive, position: np.ndarray) -> np.ndarray:
    """Slope of all that depends on the position alone, at each place, [N/m].

    The base's spring with the magnets, the weight and the stops that the drive has.

    Parameters
    ----------
    position : ndarray, shape (n,), [m]
    """
    if not drive_effects(drive):
        return stiffness_at(drive, position)
    vector = parameter_vector(drive, drive_effects(drive))
    places = np.ascontiguousarray(position, dtype=np.float64)
    return _slopes(places, _APART * drive.reference_displacement_m, vector)


@compiled()
def _slopes(positions: np.ndarray, apart: float, given_p: np.ndarray) -> np.ndarray:
    """Return the slope of everything that depends on position alone, at each place, [N/m].

    Parameters
    ----------
    positions : ndarray, shape (n,), [m]
    apart : float, [m]
        Between the two places whose difference it is.
    given_p : ndarray, shape (at least N_SLOTS,)
    """
    p = given_p.copy()
    take_stock(1.0, p)
    if p[slots.STIFFNESS] > 0.0:
        p[slots.COGGING_ORIGIN] = resting_point(0.0, False, p)
    found = np.empty(positions.size)
    for n in range(positions.size):
        above = force_at(positions[n] + 0.5 * apart, p)
        found[n] = (above - force_at(positions[n] - 0.5 * apart, p)) / apart
    return found


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
