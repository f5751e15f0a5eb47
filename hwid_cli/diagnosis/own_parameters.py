"""The parameters of a simulation of the user's own, fitted through its runs."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import scipy

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.simulator import DIFFERENCE
from hwid_cli.records.programs import FreeParameter, SimulatorRun

_MOST_EVALUATIONS = 8
# Recordings that they are fitted to.
_MOST_FITTED = 6

# Runs on some recordings with some parameters; None where one gives no answer.
Ask = Callable[[Sequence[Signals], Mapping[str, float]], list[SimulatorRun] | None]


def fit_parameters(
    ask: Ask,
    signals: Sequence[Signals],
    free: Mapping[str, FreeParameter],
    values: dict[str, float],
) -> dict[str, float]:
    """Parameters fitted to training recordings within their bounds.

    Parameters
    ----------
    ask : callable
        Runs, with what is known beside the parameters.
    values : dict of str to float
        All of them, to begin with; they stay where no run is possible with them.
    """
    train = [one for one in signals if not one.is_held_out]
    train = sorted(train, key=lambda one: -float(np.ptp(one.compared)))
    # Large and small ones.
    chosen = train[:: max(1, len(train) // _MOST_FITTED)][:_MOST_FITTED]
    sizes = np.array([abs(one.value) or 1.0 for one in free.values()])
    limits = [one.limits for one in free.values()]
    low, high = (np.array(ends) / sizes for ends in zip(*limits, strict=True))
    n_errors = sum(one.n_evaluated for one in chosen)

    def at(coordinates: np.ndarray) -> dict[str, float]:
        new = (coordinates * sizes).tolist()
        return {**values, **dict(zip(free, new, strict=True))}

    def errors(coordinates: np.ndarray) -> np.ndarray:
        found = ask(chosen, at(coordinates))
        # From there the search takes a shorter step.
        return np.full(n_errors, np.inf) if found is None else _errors(chosen, found)

    def slopes(coordinates: np.ndarray) -> np.ndarray:
        here = errors(coordinates)
        columns = []
        for column in range(len(sizes)):
            step = (
                DIFFERENCE
                if coordinates[column] + DIFFERENCE <= high[column]
                else (-DIFFERENCE)
            )
            moved = coordinates.copy()
            moved[column] += step
            slope = (errors(moved) - here) / step
            # At the edge of what it can be run with, a parameter stays.
            columns.append(slope if np.isfinite(slope).all() else np.zeros(n_errors))
        return np.column_stack(columns)

    start = np.array([values[name] for name in free]) / sizes
    if not np.isfinite(errors(np.clip(start, low, high))).all():
        return values
    found = scipy.optimize.least_squares(
        errors, np.clip(start, low, high), slopes, (low, high), x_scale=1.0,
        max_nfev=_MOST_EVALUATIONS, ftol=1e-6, xtol=1e-5,
    )  # fmt: skip
    return at(found.x)


def _errors(signals: Sequence[Signals], found: Sequence[SimulatorRun]) -> np.ndarray:
    return np.concatenate(
        [
            (one.compared - run.output)[one.evaluated]
            for one, run in zip(signals, found, strict=True)
        ]
    )
