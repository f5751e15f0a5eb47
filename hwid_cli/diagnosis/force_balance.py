"""Mass, damper and spring that balance an input along the motion of a simulation.

Least squares of forces, none of which is negative: no drive is moved for it.
docs/method_diagnosis.md, eq. (D30).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.stand_in import STILL, Moved, along_motion, moved_as
from hwid_cli.records.drive import StandIn
from hwid_cli.records.programs import SimulatorRun

# A spring or a damper that gives less of the force than this share is none.
_LEAST_SHARE = 1e-4
# A drive has a mass, [kg].
LEAST_MASS = 1e-12


@dataclass(frozen=True, eq=False)
class Balance:
    """A drive that balances the input along the motion of a simulation.

    Parameters
    ----------
    left : float, [-]
        Share of the input that is not balanced.
    constant : float, [input unit]
        What of the input is not needed, all along.
    """

    drive: StandIn
    left: float
    constant: float


def balance_along(
    signals: Sequence[Signals],
    runs: Sequence[SimulatorRun],
    hold: str,
    *,
    is_curved: bool = False,
    is_dry: bool = False,
) -> Balance:
    """Mass, damping and spring that balance the input along the motion.

    Parameters
    ----------
    hold : str
        How the input goes on between samples.
    is_dry : bool
        Beside a friction that goes with the direction alone, where something moves; it
        is no part of the drive.
    """
    kind = StandIn(1.0, 0.0, 0.0, 1.0, hold=hold)
    rows, sizes, used = balancing_columns(
        signals, runs, is_curved=is_curved, is_dry=is_dry
    )
    right = np.concatenate([
        along_motion(kind, one.driven_by)[counts] / size
        for one, size, counts in zip(signals, sizes, used, strict=True)
    ])  # fmt: skip
    best = _balanced(rows, right, is_curved=is_curved)
    output = output_of(signals[0])
    return replace(best, drive=replace(best.drive, output=output, hold=hold))


def balancing_columns(
    signals: Sequence[Signals],
    runs: Sequence[SimulatorRun],
    *,
    is_curved: bool = False,
    is_dry: bool = False,
) -> tuple[np.ndarray, list[float], list[np.ndarray]]:
    """What may balance an input along the motion of a simulation.

    Returns
    -------
    ndarray, shape (n_used, n_columns)
        Acceleration, velocity, position, pairs of what may have either sign, and what a
        friction does, each recording over the size of its input.
    list of float, [input unit]
        These sizes.
    list of ndarray of bool, shape (n_samples,)
        Which samples are used.
    """
    rows, sizes, used = [], [], []
    for one, found in zip(signals, runs, strict=True):
        moved = moved_as(one, found)
        sizes.append(float(np.std(one.driven_by)) or 1.0)
        # What may have either sign is two columns that are not negative.
        signed = [np.ones(one.driven_by.size)]
        if is_curved:
            signed += [moved.position**2, moved.position**3]
        columns = [moved.acceleration, moved.velocity, moved.position]
        columns += [sign * column for column in signed for sign in (1.0, -1.0)]
        used.append(np.ones(one.driven_by.size, dtype=bool))
        if is_dry:
            columns.append(np.sign(moved.velocity))
            used[-1] = is_moving(moved)
        rows.append(np.column_stack(columns)[used[-1]] / sizes[-1])
    return np.concatenate(rows), sizes, used


def output_of(signals: Signals) -> str:
    """What is compared; one of ``records.drive.OUTPUTS``."""
    return "velocity" if signals.is_velocity else "position"


def _balanced(matrix: np.ndarray, vector: np.ndarray, *, is_curved: bool) -> Balance:
    """Least squares of forces, none of which is negative.

    Parameters
    ----------
    matrix : ndarray, shape (n_samples, n_columns)
        Acceleration, velocity, position, pairs of what may have either sign, and more.
    vector : ndarray, shape (n_samples,)
        The input.
    """
    lengths = column_lengths(matrix)
    found_values, left = scipy.optimize.nnls(matrix / lengths, vector)
    values = found_values / lengths
    whole = float(np.sqrt(np.sum(vector**2))) or 1.0
    shares = values * lengths / whole
    mass, damping, stiffness = values[:3]
    if shares[0] < _LEAST_SHARE:
        # Hardly any inertia: as much as a sampled motion can show.
        mass = max(_LEAST_SHARE * whole / lengths[0], LEAST_MASS)
    drive = StandIn(
        mass_kg=float(mass),
        damping_N_s_per_m=float(damping if shares[1] > _LEAST_SHARE else 0.0),
        stiffness_N_per_m=float(stiffness if shares[2] > _LEAST_SHARE else 0.0),
        force_constant_N_per_A=1.0,
        quadratic_N_per_m2=float(values[5] - values[6]) if is_curved else 0.0,
        cubic_N_per_m3=float(values[7] - values[8]) if is_curved else 0.0,
    )
    return Balance(drive, float(left) / whole, float(values[3] - values[4]))


def is_moving(moved: Moved) -> np.ndarray:
    """Samples in which friction has the direction of the motion; at rest it has any.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
    """
    speed = np.abs(moved.velocity)
    return np.asarray(speed > STILL * np.max(speed))


def column_lengths(columns: np.ndarray) -> np.ndarray:
    """Length of each column, 1 for one of zeros.

    Parameters
    ----------
    columns : ndarray, shape (n_samples, n_columns)

    Returns
    -------
    ndarray, shape (n_columns,)
    """
    lengths = np.sqrt(np.sum(columns**2, axis=0))
    lengths[lengths == 0] = 1.0
    return np.asarray(lengths)
