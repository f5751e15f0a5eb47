"""Which model to use for a recording, told from its input alone.

A new recording has an input and no measured output yet. The known recording with the
most similar input is looked up, and the model that serves that one best is used. How
often that works is found out on recordings whose output is known.
"""

import numpy as np

from hwid_cli.records.groups import Prediction
from hwid_cli.stages.coverage_matrix import ScoredModels, assign


def predict_all(
    scored: ScoredModels, distances: np.ndarray, is_known: np.ndarray
) -> tuple[Prediction, ...]:
    """Predict the model for each recording as if it were new.

    Models that were fitted to the recording itself are left out of the choice. They would
    cover it whatever its input is like, and for a recording that is really new there is
    no such model: with them the choice would look right far more often than it is. For the
    same reason a recording is never its own neighbour.

    The models to choose from were themselves chosen with all recordings in view. So
    ``is_possible`` may be too favourable to a new recording; the choice among them is
    not, it sees nothing but the input.

    Parameters
    ----------
    scored : ScoredModels
        The models to choose from, on all recordings.
    distances : ndarray, shape (n_recordings, n_recordings), [-]
        Between the inputs of the recordings.
    is_known : ndarray of bool, shape (n_recordings,)
        Recordings that may be neighbours: all but the test recordings, which stand for
        those yet to come.

    Returns
    -------
    tuple of Prediction
        In the order of the recordings. Where there is no neighbour or no model to choose
        from, its name is empty and its number NaN.
    """
    return tuple(
        _predict(scored, number, _nearest(distances[number], is_known, number))
        for number in range(len(scored.recordings))
    )


def _nearest(
    distances: np.ndarray, is_known: np.ndarray, number: int
) -> tuple[int, float]:
    """Find the nearest known recording other than that of the number."""
    may_be = is_known.copy()
    may_be[number] = False
    if not may_be.any():
        return -1, float("nan")
    nearest = int(np.argmin(np.where(may_be, distances, np.inf)))
    return nearest, float(distances[nearest])


def _predict(
    scored: ScoredModels, number: int, neighbour: tuple[int, float]
) -> Prediction:
    nearest, distance = neighbour
    # Models that are fitted to the recording are blanked, not dropped: places stay.
    eligible = np.where(scored.is_own[:, number, np.newaxis], np.nan, scored.rmsd)
    serving = assign(eligible)
    chosen = -1 if nearest < 0 else int(serving[nearest])
    best = int(serving[number])
    own_rmsd = eligible[:, number]
    rmsd, best_rmsd = (
        float("nan") if model < 0 else float(own_rmsd[model])
        for model in (chosen, best)
    )
    return Prediction(
        recording=scored.recordings[number],
        nearest="" if nearest < 0 else scored.recordings[nearest],
        distance=distance,
        model="" if chosen < 0 else scored.models[chosen],
        rmsd=rmsd,
        best_model="" if best < 0 else scored.models[best],
        best_rmsd=best_rmsd,
        is_right=rmsd < scored.threshold,
        is_possible=best_rmsd < scored.threshold,
    )
