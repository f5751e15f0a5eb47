"""Which models cover which recordings, read off a table of RMSDs.

All functions take plain tables, so that published ones can be scored by the same rules.
A model's own recordings are those that it was fitted to. They are left out of the
counts, as in the published matrix: that a model fits what it has seen says little.
"""

from dataclasses import dataclass

import numpy as np

from hwid_cli.stages.set_cover import smallest_cover

# A recording is hard to cover when fewer than this share of the other models does, [-].
HARD_BELOW_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class ScoredModels:
    """Models, recordings, and how each model did on each recording.

    Parameters
    ----------
    rmsd : ndarray, shape (n, m), [output unit]
        NaN where a model's output is not finite.
    is_own : ndarray of bool, shape (n, m)
        Whether the model was fitted to the recording.
    threshold : float, [output unit]
        A model covers a recording when its RMSD lies below.
    """

    models: tuple[str, ...]
    recordings: tuple[str, ...]
    rmsd: np.ndarray
    is_own: np.ndarray
    threshold: float

    @property
    def covered(self) -> np.ndarray:
        """Whether each model covers each recording, its own ones included."""
        return self.rmsd < self.threshold


def count_covers(covered: np.ndarray, is_own: np.ndarray) -> np.ndarray:
    """Count the recordings that each model covers, its own left out.

    Parameters
    ----------
    covered : ndarray of bool, shape (n_models, n_recordings)
    is_own : ndarray of bool, shape (n_models, n_recordings)

    Returns
    -------
    ndarray of int, shape (n_models,), [-]
    """
    return np.sum(covered & ~is_own, axis=1)


def count_covered_by(covered: np.ndarray, is_own: np.ndarray) -> np.ndarray:
    """Count the models that cover each recording, those fitted to it left out.

    Parameters
    ----------
    covered : ndarray of bool, shape (n_models, n_recordings)
    is_own : ndarray of bool, shape (n_models, n_recordings)

    Returns
    -------
    ndarray of int, shape (n_recordings,), [-]
    """
    return np.sum(covered & ~is_own, axis=0)


def are_hard_to_cover(covered: np.ndarray, is_own: np.ndarray) -> np.ndarray:
    """Find the recordings that hardly any model of another recording covers.

    Parameters
    ----------
    covered : ndarray of bool, shape (n_models, n_recordings)
    is_own : ndarray of bool, shape (n_models, n_recordings)

    Returns
    -------
    ndarray of bool, shape (n_recordings,)
        True where fewer than ``HARD_BELOW_SHARE`` of the models that were not fitted to
        the recording cover it. False where there is no such model to tell.
    """
    others = np.sum(~is_own, axis=0)
    return count_covered_by(covered, is_own) < HARD_BELOW_SHARE * others


def assign(rmsd: np.ndarray) -> np.ndarray:
    """Choose the model of lowest RMSD for each recording.

    Parameters
    ----------
    rmsd : ndarray, shape (n_models, n_recordings), [output unit]
        NaN serves nobody.

    Returns
    -------
    ndarray of int, shape (n_recordings,), [-]
        The first model of equal ones; -1 where there is none.
    """
    if len(rmsd) == 0:
        return np.full(rmsd.shape[1], -1)
    usable = np.isfinite(rmsd)
    chosen = np.argmin(np.where(usable, rmsd, np.inf), axis=0)
    return np.where(usable.any(axis=0), chosen, -1)


def smallest_set(rmsd: np.ndarray, threshold: float) -> np.ndarray:
    """Choose the fewest models that together cover all that any model covers.

    Parameters
    ----------
    rmsd : ndarray, shape (n_models, n_recordings), [output unit]
    threshold : float, [output unit]

    Returns
    -------
    ndarray of int, shape (n_chosen,), [-]
        Models in rising order. Here a model's own recordings count: what it was fitted to
        is what it is for. Among the smallest sets, the one with the lowest sum of RMSDs
        over the covered recordings, each served by the best model of the set.
    """
    return smallest_cover(rmsd < threshold, rmsd)
