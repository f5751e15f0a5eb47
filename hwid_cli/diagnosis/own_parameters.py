"""The parameters of a simulation of the user's own, fitted through its runs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import scipy

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.simulator import derivative, difference_for
from hwid_cli.records.diagnosis import STILL_LARGE
from hwid_cli.records.programs import FreeParameter, SimulatorRun

# Evaluations of a search; it goes on, so many times at most, where the last few of them
# have still brought it below this share. Near a resonance it is far from its end.
_MOST_EVALUATIONS, _MOST_SEARCHES = 8, 4
# Or where little more than the noise is left, the slopes promise to take this share of it
# away, and so much has come before: bent valleys, as of parameters that are known as a
# product, take many short steps. What is missing would be imitated the better, too.
_STILL_PROMISED = 0.05
# Shares that chance alone promises for each parameter, over the number of samples; at most.
_BY_CHANCE, _MOST_BY_CHANCE = 2.0, 0.5
# Beside a rival, where the values found are the answer, it goes on while they leave less
# than this share, [-]; the first one has so many evaluations.
_HARDLY_FALLS = 0.999
# A search ends where a step takes less than this share away; sooner beside a rival where far
# more than the noise is left: the last digits of a wrong answer are worth no run, [-].
_FINE, _COARSE = 1e-6, 0.01
_FIRST_EVALUATIONS = 4
_LAST_FEW, _STILL_FALLS = 3, 0.8
# To move a parameter by its size costs the square of this share of what is left: derivatives
# say little so far from there, and what hardly depends on it is not to lead it far away, [-].
HOLD = 0.03
# A search that ends far from the noise without that price is followed by one with it, where
# that moves a parameter by so much of its size, [-].
_FAR = 0.5
# Recordings that they are fitted to.
_MOST_FITTED = 6


@dataclass(frozen=True)
class _Squares:
    """Squares that decide how far a search goes, [output unit squared].

    Parameters
    ----------
    most : float
        More than a rival leaves.
    near : float
        What leaves less is near the noise.
    rough : float
        What leaves more is worth no last digits.
    """

    most: float
    near: float
    rough: float


# Runs on some recordings with some parameters; None where one gives no answer.
Ask = Callable[[Sequence[Signals], Mapping[str, float]], list[SimulatorRun] | None]
_Of = Callable[[np.ndarray], np.ndarray]


def fit_parameters(
    ask: Ask,
    signals: Sequence[Signals],
    free: Mapping[str, FreeParameter],
    values: dict[str, float],
    noise_rms: float = 0.0,
    *,
    is_rough: bool = False,
) -> dict[str, float]:
    """Parameters fitted to training recordings within their bounds.

    Parameters
    ----------
    ask : callable
        Runs, with what is known beside the parameters.
    values : dict of str to float
        All of them, to begin with; they stay where no run is possible with them.
    noise_rms : float, [output unit]
        Of the recordings; near it a search goes on for less.
    is_rough : bool
        Whether what is left far from the noise is fitted again afterwards.
    """
    chosen = _chosen(signals)
    near = _near(chosen, noise_rms)
    squares = _Squares(np.inf, near, near if is_rough else np.inf)
    return _fitted(ask, chosen, free, values, squares) or values


def fit_beside(
    ask: Ask,
    signals: Sequence[Signals],
    free: Mapping[str, FreeParameter],
    values: dict[str, float],
    rival: Mapping[str, float],
    noise_rms: float,
) -> dict[str, float] | None:
    """The same, given up where a few evaluations leave more than something else does.

    Parameters
    ----------
    rival : mapping of str to float, [output unit squared]
        What that leaves of each recording, by its name.
    """
    chosen = _chosen(signals)
    most = sum(rival[one.name] for one in chosen)
    near = _near(chosen, noise_rms)
    return _fitted(ask, chosen, free, values, _Squares(most, near, near))


def _near(signals: Sequence[Signals], noise_rms: float) -> float:
    """Squares that are near those of the noise, [output unit squared]."""
    return sum(one.n_evaluated for one in signals) * (STILL_LARGE * noise_rms) ** 2


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
    squares: _Squares,
) -> dict[str, float] | None:
    """Fitted parameters; None where runs fail or leave more than a rival."""
    gap = _Gap(ask, signals, free, values)
    start = np.clip(gap.coordinates(values), gap.low, gap.high)
    if not np.isfinite(gap.errors(start)).all():
        return None
    searches, falls = [_MOST_EVALUATIONS] * _MOST_SEARCHES, _STILL_FALLS
    is_beside = bool(np.isfinite(squares.most))
    if is_beside:
        searches.insert(0, _FIRST_EVALUATIONS)
        falls = _HARDLY_FALLS
    before, is_held = np.inf, False
    for evaluations in searches:
        is_coarse = gap.least > squares.rough
        errors, slopes = gap.held(start) if is_held else (gap.errors, gap.slopes)
        found = scipy.optimize.least_squares(
            errors, start, slopes, (gap.low, gap.high), x_scale=1.0,
            max_nfev=evaluations, ftol=_COARSE if is_coarse else _FINE, xtol=1e-5,
        )  # fmt: skip
        start = found.x
        if 2.0 * found.cost > squares.most:
            return None
        is_far = gap.least > squares.near
        is_led_off = is_far and not is_held and gap.is_led_off(found)
        is_over = found.status > 0 and (is_far or not is_coarse)
        if is_over and not is_led_off:
            break
        is_first = evaluations == _FIRST_EVALUATIONS
        has_come = found.cost < (1.0 - _STILL_PROMISED) * before
        may_follow = 2.0 * found.cost <= squares.near and has_come
        goes_on = is_first or is_led_off or gap.falls_by(falls)
        if not (goes_on or (may_follow and _promises_more(found))):
            break
        before, is_held = found.cost, is_far
    return gap.at(start)


def _promises_more(found: Any) -> bool:
    """Whether slopes say that a good part of what is left could still be taken away."""
    directions, _ = np.linalg.qr(found.jac[:, found.active_mask == 0])
    along = directions.T @ found.fun
    promised = float(along @ along) / max(float(found.fun @ found.fun), 1e-300)
    by_chance = min(_BY_CHANCE * found.x.size / found.fun.size, _MOST_BY_CHANCE)
    return promised > max(_STILL_PROMISED, by_chance)


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
    gap = _Gap(ask, signals, free, values)
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


class _Gap:
    """What a simulation leaves of recordings, by its parameters over their sizes.

    Parameters
    ----------
    free : mapping of str to FreeParameter
        What moves; no difference reaches beyond its bounds.
    values : mapping of str to float
        Of all parameters.
    """

    def __init__(
        self,
        ask: Ask,
        signals: Sequence[Signals],
        free: Mapping[str, FreeParameter],
        values: Mapping[str, float],
    ) -> None:
        self._ask, self._signals, self._values = ask, signals, values
        self._sizes = {name: abs(one.value) or 1.0 for name, one in free.items()}
        self._stated = self.coordinates({name: one.value for name, one in free.items()})
        limits = np.array([one.limits for one in free.values()]).reshape(-1, 2)
        self.low, self.high = limits.T / np.array(list(self._sizes.values()))
        self._size = sum(one.n_evaluated for one in signals)
        self._costs: list[float] = []
        # A search that goes on begins where its last part has been.
        self._asked: dict[bytes, np.ndarray] = {}
        self._slopes: dict[int, np.ndarray] = {}
        self._sloped: tuple[bytes, np.ndarray] | None = None

    def coordinates(self, values: Mapping[str, float]) -> np.ndarray:
        """Free parameters over their sizes, shape (n_free,), [-]."""
        return np.array([values[name] / size for name, size in self._sizes.items()])

    @property
    def least(self) -> float:
        """Squares of the best place so far, [output unit squared]."""
        return min(self._costs)

    def falls_by(self, share: float) -> bool:
        """Whether the last few evaluations have left less than a share of those before."""
        return min(self._costs) < share * min(self._costs[:-_LAST_FEW])

    def at(self, coordinates: np.ndarray) -> dict[str, float]:
        """All parameters."""
        pairs = zip(self._sizes.items(), coordinates.tolist(), strict=True)
        return {**self._values, **{name: size * q for (name, size), q in pairs}}

    def errors(self, coordinates: np.ndarray) -> np.ndarray:
        """Measured less simulated; infinite where no run is possible.

        From there a search takes a shorter step.
        """
        place = coordinates.tobytes()
        if place not in self._asked:
            left = self._asked[place] = self._left(coordinates)
            self._costs.append(float(left @ left))
        return self._asked[place]

    def is_led_off(self, found: Any) -> bool:
        """Whether a parameter is far from its stated value for next to nothing."""
        left = float(np.linalg.norm(found.fun))
        hold = HOLD * left * np.eye(found.x.size)
        stacked = np.vstack([found.jac, hold])
        pull = np.concatenate(
            [np.zeros_like(found.fun), hold @ (self._stated - found.x)]
        )
        back = np.linalg.lstsq(stacked, pull)[0]
        return bool(np.max(np.abs(back), initial=0.0) > _FAR)

    def held(self, start: np.ndarray) -> tuple[_Of, _Of]:
        """Errors and their derivatives, with those of parameters that leave their values.

        Parameters
        ----------
        start : ndarray, shape (n_free,), [-]
            What the search leaves there tells how much that costs.
        """
        left = self.errors(start)
        hold = HOLD * float(np.linalg.norm(left)) * np.eye(start.size)

        def errors(coordinates: np.ndarray) -> np.ndarray:
            beside = hold @ (coordinates - self._stated)
            return np.concatenate([self.errors(coordinates), beside])

        return errors, lambda coordinates: np.vstack([self.slopes(coordinates), hold])

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
            return np.full(self._size, np.inf)
        return errors_of(self._signals, found)
