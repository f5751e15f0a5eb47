"""The parameters of a simulation of the user's own, fitted through its runs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.simulator import derivative, difference_for
from hwid_cli.records.programs import FreeParameter, SimulatorRun

# Evaluations of a search; it goes on, so many times at most, where a straight
# continuation of the runs would still take this share away. Bent valleys, as of parameters
# that are known as a product, take many short steps.
_MOST_EVALUATIONS, _MOST_SEARCHES = 8, 4
_STILL_PROMISED = 0.05
# Beside a rival, where the values found are the answer, it goes on for less, [-]; the
# first one has so many evaluations.
_HARDLY_PROMISED = 0.001
_FIRST_EVALUATIONS = 4
# Shares that chance alone promises for each parameter, over the number of samples.
_BY_CHANCE = 2.0
# A parameter that keeps its sign moves by factors, within e^+-14.
_LARGEST_EXPONENT = 14.0
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
    chosen = _chosen(signals)
    return _fitted(ask, chosen, free, values, np.inf) or values


def fit_beside(
    ask: Ask,
    signals: Sequence[Signals],
    free: Mapping[str, FreeParameter],
    values: dict[str, float],
    rival: Mapping[str, float],
) -> dict[str, float] | None:
    """The same, given up where a few evaluations leave more than something else does.

    Parameters
    ----------
    rival : mapping of str to float, [output unit squared]
        What that leaves of each recording, by its name.
    """
    chosen = _chosen(signals)
    most = sum(rival[one.name] for one in chosen)
    return _fitted(ask, chosen, free, values, most)


def _chosen(signals: Sequence[Signals]) -> list[Signals]:
    """Training recordings that parameters are fitted to: large and small ones."""
    train = [one for one in signals if not one.is_held_out]
    train = sorted(train, key=lambda one: -float(np.ptp(one.compared)))
    return train[:: max(1, len(train) // _MOST_FITTED)][:_MOST_FITTED]


def _fitted(
    ask: Ask,
    signals: Sequence[Signals],
    free: Mapping[str, FreeParameter],
    values: dict[str, float],
    most: float,
) -> dict[str, float] | None:
    """Fitted parameters; None where runs fail or leave more than so much, [output unit^2]."""
    gap = _Gap(ask, signals, free, values, by_factors=True)
    start = np.clip(gap.coordinates(values), gap.low, gap.high)
    if not np.isfinite(gap.errors(start)).all():
        return None
    searches, enough = [_MOST_EVALUATIONS] * _MOST_SEARCHES, _STILL_PROMISED
    if np.isfinite(most):
        searches.insert(0, _FIRST_EVALUATIONS)
        enough = _HARDLY_PROMISED
    before = np.inf
    by_chance = min(_BY_CHANCE * start.size / gap.size, 0.5)
    for evaluations in searches:
        found = scipy.optimize.least_squares(
            gap.errors, start, gap.slopes, (gap.low, gap.high), x_scale=1.0,
            max_nfev=evaluations, ftol=1e-6, xtol=1e-5,
        )  # fmt: skip
        start = found.x
        if 2.0 * found.cost > most:
            return None
        is_first = evaluations == _FIRST_EVALUATIONS
        is_more = _promised(found) > max(enough, by_chance)
        # What corners of a simulation promise never comes.
        has_come = found.cost < (1.0 - enough) * before
        if found.status > 0 or not (is_first or (is_more and has_come)):
            break
        before = found.cost
    return gap.at(start)


def _promised(found: scipy.optimize.OptimizeResult) -> float:
    """Share of what is left that the slopes say could still be taken away, [-]."""
    free = found.active_mask == 0
    directions, _ = np.linalg.qr(found.jac[:, free])
    along = directions.T @ found.fun
    return float(along @ along) / max(float(found.fun @ found.fun), 1e-300)


def linearised(
    ask: Ask,
    signals: Sequence[Signals],
    free: Mapping[str, FreeParameter],
    values: dict[str, float],
) -> tuple[np.ndarray, np.ndarray] | None:
    """What runs leave, and how it changes by the parameters; None where no run is possible.

    Returns
    -------
    ndarray, shape (n_evaluated,), [output unit]
        Errors of all recordings in a row.
    ndarray, shape (n_evaluated, n_free), [output unit]
        Their derivatives by each parameter over its size.
    """
    gap = _Gap(ask, signals, free, values, by_factors=False)
    here = gap.coordinates(values)
    errors = gap.errors(here)
    if not np.isfinite(errors).all():
        return None
    return errors, gap.slopes(here) if free else np.zeros((errors.size, 0))


def cost_of(ask: Ask, signals: Sequence[Signals], values: Mapping[str, float]) -> float:
    """Sum of squares that runs leave; infinite where one gives no answer."""
    found = ask(signals, values)
    if found is None:
        return float("inf")
    errors = errors_of(signals, found)
    return float(errors @ errors)


def errors_of(signals: Sequence[Signals], found: Sequence[SimulatorRun]) -> np.ndarray:
    """Measured less simulated of all recordings in a row, [output unit]."""
    pairs = zip(signals, found, strict=True)
    return np.concatenate(
        [(one.compared - run.output)[one.evaluated] for one, run in pairs]
    )


@dataclass(frozen=True)
class _Coordinate:
    """A parameter over its size; the logarithm of that where its sign stays.

    Parameters
    ----------
    size : float
        With its sign where it stays.
    """

    size: float
    is_log: bool
    limits: tuple[float, float]

    @classmethod
    def of(cls, free: FreeParameter, by_factors: bool) -> "_Coordinate":
        low, high = free.limits
        size = free.value or 1.0
        if by_factors and low / size > 0 and high / size > 0:
            ends = sorted(np.log([low / size, high / size]).tolist())
            most = _LARGEST_EXPONENT
            return cls(size, True, (max(ends[0], -most), min(ends[1], most)))
        size = abs(size)
        return cls(size, False, (low / size, high / size))

    def at(self, value: float) -> float:
        """Coordinate of a value, [-]."""
        share = value / self.size
        if not self.is_log:
            return share
        return float(np.log(share)) if share > 0 else self.limits[0]

    def value(self, coordinate: float) -> float:
        """Value at a coordinate."""
        return self.size * (float(np.exp(coordinate)) if self.is_log else coordinate)


class _Gap:
    """What a simulation leaves of recordings, by the coordinates of its parameters.

    Parameters
    ----------
    free : mapping of str to FreeParameter
        What moves; no difference reaches beyond its bounds.
    values : mapping of str to float
        Of all parameters.
    by_factors : bool
        Whether parameters that keep their sign move by factors.
    """

    def __init__(
        self,
        ask: Ask,
        signals: Sequence[Signals],
        free: Mapping[str, FreeParameter],
        values: Mapping[str, float],
        *,
        by_factors: bool,
    ) -> None:
        self._ask, self._signals, self._values = ask, signals, values
        self._free = {
            name: _Coordinate.of(one, by_factors) for name, one in free.items()
        }
        limits = [one.limits for one in self._free.values()]
        self.low, self.high = np.array(limits).reshape(-1, 2).T
        self.size = sum(one.n_evaluated for one in signals)
        # A search that goes on begins where its last part has been.
        self._asked: dict[bytes, np.ndarray] = {}
        self._slopes: dict[int, np.ndarray] = {}
        self._sloped: tuple[bytes, np.ndarray] | None = None

    def coordinates(self, values: Mapping[str, float]) -> np.ndarray:
        """Coordinates of the free parameters, shape (n_free,), [-]."""
        return np.array([one.at(values[name]) for name, one in self._free.items()])

    def at(self, coordinates: np.ndarray) -> dict[str, float]:
        """All parameters."""
        pairs = zip(self._free.items(), coordinates.tolist(), strict=True)
        return {**self._values, **{name: one.value(q) for (name, one), q in pairs}}

    def errors(self, coordinates: np.ndarray) -> np.ndarray:
        """Measured less simulated; infinite where no run is possible.

        From there a search takes a shorter step.
        """
        place = coordinates.tobytes()
        if place not in self._asked:
            self._asked[place] = self._left(coordinates)
        return self._asked[place]

    def slopes(self, coordinates: np.ndarray) -> np.ndarray:
        """Derivatives of the errors, by differences."""
        place = coordinates.tobytes()
        if self._sloped is None or self._sloped[0] != place:
            self._sloped = place, self._differences(coordinates)
        return self._sloped[1]

    def _differences(self, coordinates: np.ndarray) -> np.ndarray:
        here = self.errors(coordinates)
        rms = float(np.sqrt(np.mean(here**2)))
        columns = []
        for column in range(coordinates.size):
            difference = partial(self._difference, coordinates, here, column)
            last = self._slopes.get(column)
            # The last slope tells how wide the next difference has to be.
            slope = (
                derivative(difference, rms)
                if last is None
                else difference(difference_for(last, rms))
            )
            # At the edge of what it can be run with, a parameter stays.
            slope = slope if np.isfinite(slope).all() else np.zeros(here.size)
            self._slopes[column] = slope
            columns.append(slope)
        return np.column_stack(columns)

    def _difference(
        self, coordinates: np.ndarray, here: np.ndarray, column: int, step: float
    ) -> np.ndarray:
        moved = coordinates.copy()
        is_inside = moved[column] + step <= self.high[column]
        moved[column] += step if is_inside else -step
        change = self._left(moved) - here
        return np.asarray(change / (step if is_inside else -step))

    def _left(self, coordinates: np.ndarray) -> np.ndarray:
        found = self._ask(self._signals, self.at(coordinates))
        if found is None:
            return np.full(self.size, np.inf)
        return errors_of(self._signals, found)
