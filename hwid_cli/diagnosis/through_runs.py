"""A last fit of effects and the simulation's parameters through runs alone.

Turns step by what the stand-in says of an effect. Where an effect and parameters of the
simulation nearly cancel, or where its motion is not the stand-in's, they creep. So the best
turn is followed by Gauss-Newton steps whose derivatives are of the simulation's own runs:
each value is moved a little, and run and stand-in are brought to agree again.
docs/method_diagnosis.md, eq. (D32g).
"""

from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import rebuilt, with_values
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.parameters import BASE, START
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.turns import Turn, answered, fit_of_run
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import STILL_LARGE

# Times the noise that a run leaves at most to be followed, and the runs that this may take
# even where others have used up theirs.
MOST_LEFT, _LEAST_ROOM = 10.0, 300
# Runs until forces and motion agree to this share of the noise, at most: of a place that is
# kept, and of one beside it, which begins there.
_TO_AGREE, _BESIDE, _AGREEMENT = 12, 4, 0.02
# Sets of derivatives, trials of a step that are shorter, and longer ones.
_MOST_STEPS, _MOST_TRIALS, _MOST_DOUBLINGS = 6, 5, 4
# A difference changes the output by about so many times the noise, or by this share of what
# is left, so that it stands above what run and stand-in differ by; it moves no value by more
# or less than these shares of its size.
_CHANGE, _SHARE_LEFT = 0.5, 0.3
_LEAST_DIFFERENCE, _MOST_DIFFERENCE = 1e-3, 0.1
# The first width, and the factor by which one may differ from what was wanted.
_FIRST_DIFFERENCE, _ALIKE = 3e-3, 3.0
# A step has to promise so many squares of the noise, and this share of what is left
# beyond it.
_WORTH_A_STEP, _WORTH_A_SHARE = 1.0, 1e-2
# What a step leaves of the squares for another one to follow whatever runs are left, and,
# where more than three times the noise is left, for another one to follow at all.
_MUCH_LESS, _LESS = 0.7, 0.9
# No value moves by more than this factor (its logarithm) in a step.
_LONGEST = 0.3
# After a step that leaves less, and after one that does not.
_FIRST_DAMPING, _LESS_DAMPING, _MORE_DAMPING = 1e-8, 0.1, 100.0


@dataclass(frozen=True, eq=False)
class _Place:
    """Where a search is: a turn whose run and stand-in agree.

    Parameters
    ----------
    coordinates : ndarray, shape (n,), [-]
        Of the effects, and of the simulation's parameters over their sizes.
    turn : Turn
        On the training recordings.
    """

    coordinates: np.ndarray
    turn: Turn

    @property
    def errors(self) -> np.ndarray:
        """What the run leaves, shape (n_evaluated,), [output unit]."""
        return np.concatenate(self.turn.left)

    @property
    def sse(self) -> float:
        """Their sum of squares."""
        return float(self.errors @ self.errors)


def followed(
    findings: Findings, turn: Turn, runs: Runs, *, at_most: float = MOST_LEFT
) -> Turn:
    """The best turn fitted by what runs alone say, where that leaves less.

    Parameters
    ----------
    at_most : float, [-]
        Times the noise that it leaves, beyond which something else is missing.
    """
    criteria, fit = findings.criteria, fit_of_run(findings, turn)
    if not turn.fit.effects or criteria.ratio(fit) > at_most:
        return turn
    # Where nothing but noise is left, a valley is worth no more than the runs that are left.
    least = 0 if criteria.is_complete(fit) else _LEAST_ROOM
    room = replace(runs, run_tasks=runs.run_tasks.at_least(least))
    return fitted_through_runs(findings, turn, room) or turn


def fitted_through_runs(findings: Findings, turn: Turn, runs: Runs) -> Turn | None:
    """Follow the best turn by steps whose derivatives are of runs.

    Returns
    -------
    Turn or None
        On all recordings; None where that leaves no less, or does not apply.
    """
    search = _Search.of(findings, turn, runs)
    if search is None:
        return None
    place = search.best()
    if place is None:
        return None
    fit = search.fit_at(place.coordinates, turn.fit)
    values = search.values_at(place.coordinates)
    whole = replace(turn, fit=fit, values=values, disagreement=np.inf)
    found = search.agreed(whole)
    return None if found is None or found.sse.sum() >= turn.sse.sum() else found


class _Search:
    """Steps over the values of effects and parameters, by runs of training recordings."""

    def __init__(self, findings: Findings, turn: Turn, runs: Runs) -> None:
        self._findings, self._runs = findings, runs
        rows = [not one.is_held_out for one in turn.problem.signals]
        own = turn.fit.own[rows] if turn.fit.own.size else turn.fit.own
        self._turn = replace(
            turn,
            problem=turn.problem.part(held_out=False),
            fit=replace(turn.fit, own=own),
            rival=np.inf,
        )
        layout, point = rebuilt(self._turn.problem, self._turn.fit, findings.scales)
        self._shared = [
            (one, float(q))
            for one, q in zip(layout.shared, point.shared, strict=True)
            if one.owner != BASE
        ]
        self._free = list(runs.simulator.free.items())
        # Widths of differences, which tell those of the next ones.
        n = len(self._shared) + len(self._free)
        self._widths = [_FIRST_DIFFERENCE] * n
        self._sizes = [
            abs(turn.values[n]) or abs(one.value) or 1.0 for n, one in self._free
        ]

    @classmethod
    def of(cls, findings: Findings, turn: Turn, runs: Runs) -> "_Search | None":
        """None where factors of the base act beside, or recordings have values of their own."""
        if turn.tried is None or not turn.problem.known or not runs.simulator.free:
            return None
        at_run = replace(turn, fit=turn.tried[0], values=turn.tried[1])
        layout, _ = rebuilt(at_run.problem, at_run.fit, findings.scales)
        if any(one.owner != START for one in layout.own):
            return None
        found = cls(findings, at_run, runs)
        return found if found._shared else None

    def fit_at(self, coordinates: np.ndarray, fit: CandidateFit) -> CandidateFit:
        """A fit with the effects' values at a place."""
        values = {
            one.ref: one.value(float(q))
            for (one, _), q in zip(self._shared, coordinates, strict=False)
        }
        return with_values(fit, values)

    def values_at(self, coordinates: np.ndarray) -> dict[str, float]:
        """The simulation's parameters at a place."""
        rest = coordinates[len(self._shared) :]
        moved = {
            name: float(np.clip(size * q, *one.limits))
            for (name, one), size, q in zip(self._free, self._sizes, rest, strict=True)
        }
        return {**self._turn.values, **moved}

    def agreed(self, turn: Turn, most: int = _TO_AGREE) -> Turn | None:
        """Run until the forces are those of the motion that they make, so often at most.

        None where a run gives no answer.
        """
        noise, now, in_vain = self._findings.criteria.noise.rms, turn, 0
        nearest: Turn | None = None
        for _ in range(most):
            answer = answered(self._findings, now, self._runs)
            if answer is None:
                return None
            now = answer.turn
            if nearest is None or now.disagreement < nearest.disagreement:
                nearest, in_vain = now, 0
            else:
                in_vain += 1
            if now.disagreement <= _AGREEMENT * noise or in_vain > 1:
                break
        return nearest

    def best(self) -> _Place | None:
        """Where the steps end; None where none leaves less."""
        place, damping = self._begin(), _FIRST_DAMPING
        first, gains_much = place, False
        for _ in range(_MOST_STEPS):
            if place is None or (self._runs.run_tasks.are_spent and not gains_much):
                break
            slopes = self._slopes(place)
            following, damping = self._step(place, slopes, damping)
            if following is None:
                break
            gains_much = following.sse < _MUCH_LESS * place.sse
            creeps = following.sse > max(_LESS * place.sse, self._near)
            place = following
            if creeps:
                break
        return None if place is first else place

    @property
    def _near(self) -> float:
        """Squares of the training recordings that are near the noise's."""
        n = sum(one.n_evaluated for one in self._turn.problem.signals)
        return n * (STILL_LARGE * self._findings.criteria.noise.rms) ** 2

    def _begin(self) -> _Place | None:
        own = [q for _, q in self._shared]
        pairs = zip(self._free, self._sizes, strict=True)
        own += [self._turn.values[name] / size for (name, _), size in pairs]
        found = self.agreed(replace(self._turn, disagreement=np.inf))
        return None if found is None else _Place(np.array(own), found)

    def _moved(
        self, place: _Place, coordinates: np.ndarray, most: int = _TO_AGREE
    ) -> _Place | None:
        """The place with other coordinates, within their bounds."""
        inside = [
            one.coordinate(one.value(float(q)))
            for (one, _), q in zip(self._shared, coordinates, strict=False)
        ]
        rest = [
            float(np.clip(size * q, *one.limits)) / size
            for (_, one), size, q in zip(
                self._free, self._sizes, coordinates[len(inside) :], strict=True
            )
        ]
        there = np.array([*inside, *rest])
        turn = replace(
            place.turn,
            fit=self.fit_at(there, place.turn.fit),
            values=self.values_at(there),
            disagreement=np.inf,
        )
        found = self.agreed(turn, most)
        return None if found is None else _Place(there, found)

    def _slopes(self, place: _Place) -> np.ndarray:
        """Derivatives of the errors by all coordinates, shape (n_evaluated, n)."""
        left = float(np.sqrt(np.mean(place.errors**2)))
        change = max(_CHANGE * self._findings.criteria.noise.rms, _SHARE_LEFT * left)
        columns = []
        for column in range(place.coordinates.size):
            step, slope = self._widths[column], np.zeros(place.errors.size)
            for _ in range(2):
                slope = self._difference(place, column, step)
                size = float(np.sqrt(np.mean(slope**2)))
                wanted = change / size if size > 0.0 else _MOST_DIFFERENCE
                wanted = float(np.clip(wanted, _LEAST_DIFFERENCE, _MOST_DIFFERENCE))
                if 1.0 / _ALIKE < wanted / step < _ALIKE:
                    break
                step = self._widths[column] = wanted
            columns.append(slope)
        return np.column_stack(columns)

    def _difference(self, place: _Place, column: int, step: float) -> np.ndarray:
        moved = place.coordinates.copy()
        moved[column] += step
        there = self._moved(place, moved, _BESIDE)
        if there is None or there.coordinates[column] == place.coordinates[column]:
            moved[column] -= 2.0 * step
            there = self._moved(place, moved, _BESIDE)
        if there is None:
            return np.zeros(place.errors.size)
        by = there.coordinates[column] - place.coordinates[column]
        if by == 0.0:
            return np.zeros(place.errors.size)
        return np.asarray((there.errors - place.errors) / by)

    def _step(
        self, place: _Place, slopes: np.ndarray, damping: float
    ) -> tuple[_Place | None, float]:
        """The next place, and the damping that has led there."""
        lengths = np.linalg.norm(slopes, axis=0)
        usable = lengths > 0.0
        scaled = slopes[:, usable] / lengths[usable]
        noise = self._findings.criteria.noise.rms
        excess = max(place.sse - place.errors.size * noise**2, 0.0)
        least = max(_WORTH_A_STEP * noise**2, _WORTH_A_SHARE * excess)
        for _ in range(_MOST_TRIALS):
            n = scaled.shape[1]
            stacked = np.vstack([scaled, np.sqrt(damping) * np.eye(n)])
            right = np.concatenate([-place.errors, np.zeros(n)])
            inner = np.linalg.lstsq(stacked, right)[0]
            promised = place.sse - float(np.sum((place.errors + scaled @ inner) ** 2))
            if promised < least:
                break
            change = np.zeros(place.coordinates.size)
            change[usable] = inner / lengths[usable]
            longest = float(np.max(np.abs(change)))
            change *= min(1.0, _LONGEST / longest) if longest > 0.0 else 1.0
            there = self._moved(place, place.coordinates + change)
            if there is not None and there.sse < place.sse:
                return self._further(place, there), _LESS_DAMPING * damping
            damping *= _MORE_DAMPING
        return None, damping

    def _further(self, place: _Place, there: _Place) -> _Place:
        """The same way twice, four times as far, and so on, while that leaves less.

        Along a valley what differences err by makes it look shorter than it is.
        """
        for _ in range(_MOST_DOUBLINGS):
            change = 2.0 * (there.coordinates - place.coordinates)
            beyond = self._moved(place, place.coordinates + change)
            if beyond is None or beyond.sse >= there.sse:
                break
            there = beyond
        return there
