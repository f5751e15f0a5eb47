"""What the missing force goes with: the variables, and their share of its variance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.diagnosis.latent_force import Smoothed
from hwid_cli.diagnosis.problem import Compared
from hwid_cli.records.drive import SOURCES, Drive

# Bins of equal count for the shares; finer ones for the curves.
_BINS = 16
# Speeds below this share of a high quantile count as standing.
_STANDING = 0.02
# Most samples that the shares are computed on.
_MOST_SAMPLES = 100_000


@dataclass(frozen=True, eq=False)
class Variable:
    """One variable along all recordings.

    Parameters
    ----------
    name : str
        In words.
    unit : str
        Empty where it has no axis of its own.
    values : ndarray, shape (n_samples,)
    """

    name: str
    unit: str
    values: np.ndarray


def variables(
    compared: Sequence[Compared], smoothed: Sequence[Smoothed], drive: Drive
) -> tuple[Variable, ...]:
    """Variables that a missing force may go with.

    Returns
    -------
    tuple of Variable
        Evaluated samples of all recordings, one after the other.
    """
    position = evaluated_position(compared, smoothed)
    velocity = joined(compared, [one.velocity for one in smoothed])
    inputs = [one.signals.input for one in compared]
    rates = [
        np.gradient(one.signals.input, one.signals.sample_time_s)
        if one.signals.input.size > 1
        else np.zeros(1)
        for one in compared
    ]
    times = [
        one.signals.sample_time_s * np.arange(one.signals.input.size)
        for one in compared
    ]
    source, units = drive.source, drive.units
    fast = float(np.quantile(np.abs(velocity), 0.99)) if velocity.size else 0.0
    direction = np.sign(velocity) * (np.abs(velocity) > _STANDING * fast)
    return (
        Variable("displacement", units.length, position),
        Variable("size of the displacement", "", np.abs(position)),
        Variable("velocity", f"{units.length}/s", velocity),
        Variable("direction", "", direction),
        Variable("speed", "", np.abs(velocity)),
        Variable(source, units.source, joined(compared, inputs)),
        Variable(f"rate of the {source}", f"{units.source}/s", joined(compared, rates)),
        Variable("time", "s", joined(compared, times)),
    )


def evaluated_force(
    compared: Sequence[Compared], smoothed: Sequence[Smoothed]
) -> np.ndarray:
    """Missing force at the evaluated samples of all recordings.

    Returns
    -------
    ndarray, shape (n_samples,), [N]
    """
    return joined(compared, [one.force for one in smoothed])


def evaluated_position(
    compared: Sequence[Compared], smoothed: Sequence[Smoothed]
) -> np.ndarray:
    """Measured position, smoothed, at the evaluated samples of all recordings.

    Returns
    -------
    ndarray, shape (n_samples,), [m]
    """
    return joined(compared, [one.position for one in smoothed])


def shares(
    force: np.ndarray, all_variables: Sequence[Variable]
) -> tuple[np.ndarray, float]:
    """Share of the missing force that goes with each variable.

    What is proportional to displacement, velocity or input is taken off before: it is
    a matter of the base's parameters. So is a constant, whose share is given apart.

    Parameters
    ----------
    force : ndarray, shape (n_samples,), [N]

    Returns
    -------
    shares : ndarray, shape (n_variables,), [-]
    constant : float, [-]
        Share of the constant in the mean square of itself and what is left.

    References
    ----------
    Correlation ratio (eta squared) over bins of equal count.
    """
    every = max(1, -(-force.size // _MOST_SAMPLES))
    force = force[::every]
    values = [one.values[::every] for one in all_variables]
    linear = [
        one
        for one, variable in zip(values, all_variables, strict=True)
        if variable.name in ("displacement", "velocity", *SOURCES.values())
    ]
    columns = np.column_stack([np.ones(force.size), *linear])
    size = np.sqrt(np.mean(np.square(columns), axis=0))
    columns = columns / np.where(size > 0, size, 1.0)
    weights = np.linalg.lstsq(columns, force, rcond=None)[0]
    left = force - columns @ weights
    # Without its mean already: the constant is one of the columns.
    variance, square = float(np.mean(np.square(left))), float(weights[0] ** 2)
    constant = square / (square + variance) if square > 0 else 0.0
    if variance <= 0:
        return np.zeros(len(values)), constant
    return np.array([_between(left, one) / variance for one in values]), constant


def binned(
    values: np.ndarray, force: np.ndarray, edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mean and spread of a force over bins of a variable.

    Parameters
    ----------
    values : ndarray, shape (n_samples,)
    force : ndarray, shape (n_samples,), [N]
    edges : ndarray, shape (n_bins + 1,)

    Returns
    -------
    at : ndarray, shape (n_bins,)
        Mean of the variable.
    mean, spread : ndarray, shape (n_bins,), [N]
    counts : ndarray, shape (n_bins,)
        NaN in the others where this is 0.
    """
    n_bins = edges.size - 1
    # What lies beyond the first and last edge belongs to the first and last bin.
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, n_bins - 1)
    counts = np.bincount(bins, minlength=n_bins)
    filled = np.where(counts > 0, counts, np.nan)
    at = np.bincount(bins, values, n_bins) / filled
    mean = np.bincount(bins, force, n_bins) / filled
    square = np.bincount(bins, force**2, n_bins) / filled
    return at, mean, np.sqrt(np.maximum(square - mean**2, 0.0)), counts


def quantile_edges(values: np.ndarray, n_bins: int) -> np.ndarray:
    """Edges of bins of equal count; fewer where many values are the same.

    Parameters
    ----------
    values : ndarray, shape (n_samples,)

    Returns
    -------
    ndarray, shape (n_edges,)
    """
    edges = np.unique(np.quantile(values, np.linspace(0, 1, n_bins + 1)))
    return edges if edges.size > 1 else np.array([edges[0], edges[0] + 1.0])


def _between(force: np.ndarray, values: np.ndarray) -> float:
    """Variance of the means over bins of a variable."""
    levels = np.unique(values[:: max(1, values.size // 1000)])
    if levels.size <= 3:
        edges = np.append(levels, levels[-1] + 1.0)
    else:
        edges = quantile_edges(values, _BINS)
    _, mean, _, counts = binned(values, force, edges)
    used = counts > 0
    return float(counts[used] @ np.square(mean[used] - force.mean()) / force.size)


def joined(compared: Sequence[Compared], signals: Sequence[np.ndarray]) -> np.ndarray:
    """Evaluated samples of all recordings, one after the other.

    Parameters
    ----------
    signals : sequence of ndarray, shape (n_samples,)
        One for each recording.

    Returns
    -------
    ndarray, shape (n_evaluated,)
    """
    parts = [
        one[two.signals.evaluated] for one, two in zip(signals, compared, strict=True)
    ]
    return np.concatenate(parts) if parts else np.zeros(0)
