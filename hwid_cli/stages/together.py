"""One model of all recordings together, with maps and orders that its own folds choose.

Few recordings are worth most together: each visits another part of what a model has to say.
With all of them in one fit none is left to choose by. So each is left out in turn, and the
maps and orders are taken that come closest to what was left out: first whether a longer
delay is needed, then the kinds of maps, their size, and the orders. The model itself is fitted to all of them.

References
----------
docs/method.md, section "Groups", eq. (17a).
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hwid_cli.model.fit import fit, fit_without_standard_errors
from hwid_cli.model.response_estimate import MOST_DELAY, estimate_response
from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import estimated_state, simulate, validation_output
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.maps import MAP_KINDS
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.delay_choice import WORTH_A_DELAY, further_delays
from hwid_cli.stages.identify import STAGE_VERSION, Run
from hwid_cli.stages.order_grid import candidate_orders
from hwid_cli.tasks.cache import recording_key, task_key
from hwid_cli.tasks.task import Task

# Does the work of a round, so many fits, with what runs its tasks.
RunRound = Callable[[int, Callable[[Run], Any]], Any]

# Folds at most: each costs a fit of nearly all recordings for every candidate.
MOST_FOLDS = 5
# Units with which kinds of maps are compared, and of the best one those that are tried
# before all that the configuration gives: few go on more plainly where no sample lies.
_FEWEST_UNITS, FEW_UNITS, _MOST_UNITS = 3, 5, 1000
# Share of a recording whose samples tell where a model starts that has a fitted start.
_START_SHARE = 0.2
# Numerator coefficients and poles: of a mass on a spring, and with a lag before it.
_USUAL = ((1, 2), (2, 3))
# Of candidates that are as close within this share the smallest is taken, [-].
_AS_CLOSE = 0.02
# By how much a model has to come closer that remembers its start for longer than recordings
# last, [-]: no new recording tells such a start, unless the machine itself is like that.
_WORTH_LASTING = 1.5
# Fits of all recordings that try longer delays, where any of them asks for one.
LONGER_DELAYS_FITS = MOST_DELAY + 1
# How far off counts at most, over the standard deviation of the output, [-]: a model that
# is worse than a constant is no worse for being far worse.
_FARTHEST = 3.0


@dataclass(frozen=True)
class Candidate:
    """Maps and orders that may be taken.

    Parameters
    ----------
    nb, nk : int, [-]
        Place in the order grid.
    """

    options: FitOptions
    nb: int
    nk: int
    orders: Orders

    @property
    def size(self) -> tuple[int, int]:
        """Number of its coefficients and units of its maps: what small means."""
        maps = self.options.of_input, self.options.of_output
        units = sum(one.kind_and_units[1] for one in maps)
        return self.orders.nb + self.orders.nf, units


def own_maps(found: Fit, fits: Iterable[Fit]) -> tuple[tuple[str, int], ...]:
    """Kind and units of a fit's maps, where others of its results have other ones.

    Parameters
    ----------
    fits : iterable of Fit
        Of a single recording they have the maps of the configuration.
    """

    def maps_of(one: Fit) -> tuple[tuple[str, int], ...]:
        options = one.options
        return options.of_input.kind_and_units, options.of_output.kind_and_units

    given = {maps_of(one) for one in fits if len(one.identified_on) == 1}
    own = maps_of(found)
    return own if given and own not in given else ()


@dataclass(frozen=True, eq=False)
class Together:
    """The model of all recordings.

    Parameters
    ----------
    fit : Fit
        To all of them; its options hold the maps that were chosen.
    nb, nk : int, [-]
        Place in the order grid.
    n_models : int, [-]
        Fits that were made.
    """

    fit: Fit
    nb: int
    nk: int
    n_models: int


def kinds_tried(options: FitOptions) -> tuple[FitOptions, ...]:
    """The maps of the configuration, and each of them alone.

    Examples
    --------
    >>> [(one.input_map, one.output_map) for one in kinds_tried(FitOptions())][1:]
    [('piecewise_linear', 'none'), ('none', 'piecewise_linear')]
    """
    input_alone = replace(options, output_map="none", output_function=None)
    output_alone = replace(options, input_map="none", input_function=None)
    alone = tuple(one for one in (input_alone, output_alone) if one.has_maps)
    return tuple(dict.fromkeys((options, *alone)))


def with_units(options: FitOptions, units: int) -> FitOptions:
    """The same maps with at most so many units, where the kind of a map has units."""

    def of(kind: str, own: int) -> int:
        least = MAP_KINDS[kind].least_units
        return own if least is None else max(least, min(units, own))

    return replace(
        options,
        input_units=of(options.input_map, options.of_input.units),
        output_units=of(options.output_map, options.of_output.units),
    )


def folds_of(n: int) -> list[list[int]]:
    """Numbers of the recordings that each fold leaves out.

    Examples
    --------
    >>> folds_of(3), folds_of(7)
    ([[0], [1], [2]], [[0, 5], [1, 6], [2], [3], [4]])
    """
    count = min(n, MOST_FOLDS)
    return [list(range(first, n, count)) for first in range(count)]


def most_fits(options: FitOptions, n_recordings: int, n_orders: int) -> int:
    """Number of fits that the model of all takes, but for fits that are refused.

    Examples
    --------
    >>> most_fits(FitOptions(), n_recordings=4, n_orders=12)
    102
    """
    candidates = len(_USUAL) * len(kinds_tried(options)) + 2 + n_orders
    # A longer delay is a candidate more.
    return candidates * len(folds_of(n_recordings)) + 1 + LONGER_DELAYS_FITS


def fit_together(
    recordings: Sequence[Recording],
    grid: OrdersOptions,
    options: FitOptions,
    run: RunRound,
) -> Together:
    """Choose maps and orders by what is left out in turn, and fit all recordings.

    Parameters
    ----------
    recordings : sequence of Recording
        At least two.
    run : callable
        Runs the tasks of a round.
    """
    orders = candidate_orders(grid)
    folds = _Folds(recordings, run)
    responses = [estimate_response(one) for one in recordings]
    if delays := further_delays(responses, grid, options):
        plain = Candidate(with_units(options, _FEWEST_UNITS), *_typical(orders)[0])
        options = replace(options, delays=folds.delays_needed(plain, delays))
    kinds = [with_units(one, _FEWEST_UNITS) for one in kinds_tried(options)]
    best = folds.best_of(
        [Candidate(one, *at) for one in kinds for at in _typical(orders)]
    )
    of_kind = next(
        one
        for one in kinds_tried(options)
        if with_units(one, _FEWEST_UNITS) == best.options
    )
    more = [with_units(of_kind, n) for n in (_FEWEST_UNITS, FEW_UNITS, _MOST_UNITS)]
    best = folds.best_of([replace(best, options=one) for one in dict.fromkeys(more)])
    chosen, whole = folds.fitted([Candidate(best.options, *at) for at in orders])
    return Together(whole, chosen.nb, chosen.nk, folds.n_fits)


def _typical(
    orders: Sequence[tuple[int, int, Orders]],
) -> tuple[tuple[int, int, Orders], ...]:
    """Orders at which kinds of maps are compared: those of the grid next to usual ones."""

    def distance(one: tuple[int, int, Orders], usual: tuple[int, int]) -> int:
        nb, nf = usual
        return abs(one[2].nb - nb) + abs(one[2].nf - nf)

    near = (min(orders, key=lambda one: distance(one, usual)) for usual in _USUAL)
    return tuple(dict.fromkeys(near))


class _Folds:
    """Candidates, and how far each is off what it was not fitted to."""

    def __init__(self, recordings: Sequence[Recording], run: RunRound) -> None:
        self._recordings, self._run = tuple(recordings), run
        self._contents = [recording_key(one) for one in recordings]
        self._out = folds_of(len(recordings))
        self._fits_of: dict[Candidate, list[Fit]] = {}
        self._lasting: set[Candidate] = set()
        self.n_fits = 0

    def best_of(
        self, candidates: Sequence[Candidate], *, is_of_motion: bool = False
    ) -> Candidate:
        """The smallest of those that are nearly as close as the closest one.

        Parameters
        ----------
        is_of_motion : bool
            Compare how outputs move, whatever their level and size: of a left out step
            that is higher than all others the maps know no end, whatever the orders are.
        """
        new = [one for one in candidates if one not in self._fits_of]
        tasks = [self._task(one, left_out) for one in new for left_out in self._out]
        found = iter(self._fits(tasks))
        for one in new:
            fits = self._fits_of[one] = [next(found) for _ in self._out]
            if any(map(self._outlasts, fits)):
                self._lasting.add(one)
        off = {
            one: self._off(self._fits_of[one], is_of_motion=is_of_motion)
            for one in candidates
        }
        least, pool = min(off.values()), list(off)
        settling = [one for one in pool if one not in self._lasting]
        nearest = min((off[one] for one in settling), default=np.inf)
        if nearest <= least + np.log(_WORTH_LASTING):
            pool, least = settling, nearest
        near = [one for one in pool if off[one] <= least + np.log1p(_AS_CLOSE)]
        return min(near, key=lambda one: (one.size, off[one]))

    def delays_needed(
        self, plain: Candidate, delays: tuple[int, ...]
    ) -> tuple[int, ...]:
        """Of longer delays those that recordings ask for; none where they do not.

        Of few recordings, what the maps know of a left out one decides more than a delay
        does. So a model of all of them has to fit clearly better, and what is left out
        must not speak against it. Each delay has a fit of its own: the starts of a fit
        that may take several know nothing of its maps yet.
        """
        late = [
            replace(plain, options=replace(plain.options, delays=(one,)))
            for one in delays
        ]
        found = self._fits([self._task(one, ()) for one in (plain, *late)])
        without, *bics = (one.information.bic for one in found)
        least = int(np.argmin(np.nan_to_num(bics, nan=np.inf)))
        if not bics[least] < without - WORTH_A_DELAY or least == 0:
            return ()
        compared = (late[least], plain)
        self.best_of(compared)
        off = [self._off(self._fits_of[one], is_of_motion=True) for one in compared]
        # Further coefficients reach beyond it.
        return delays[least - 1 : least + 1] if off[0] <= off[1] else ()

    def fitted(self, candidates: Sequence[Candidate]) -> tuple[Candidate, Fit]:
        """The best candidate, fitted to all recordings with standard errors.

        Where only that fit never forgets its start, the next best is taken.
        """
        while True:
            best = self.best_of(candidates, is_of_motion=True)
            whole = self._whole(best)
            if best in self._lasting or not self._outlasts(whole):
                return best, whole
            self._lasting.add(best)

    def _whole(self, candidate: Candidate) -> Fit:
        (found,) = self._fits([self._task(candidate, ())])
        return replace(found, identified_on=tuple(one.name for one in self._recordings))

    def _fits(self, tasks: Sequence[Task]) -> list[Fit]:
        found: list[Fit] = []
        self.n_fits += len(tasks)
        self._run(
            len(tasks),
            lambda execute: found.extend(one.result for one in execute(tasks)),
        )
        return found

    def _off(self, fits: Sequence[Fit], *, is_of_motion: bool) -> float:
        """Mean logarithm of how far fits are off what each has left out."""
        pairs = [
            (found, self._recordings[place])
            for found, left_out in zip(fits, self._out, strict=True)
            for place in left_out
        ]
        logs = [np.log(_share_off(*pair, is_of_motion=is_of_motion)) for pair in pairs]
        return float(np.mean(logs))

    def _outlasts(self, found: Fit) -> bool:
        """Whether a model remembers where it started for longer than recordings last."""
        if found.model is None:
            return False
        longest = max(one.n_samples for one in self._recordings)
        radius = np.abs(np.roots(found.model.denominator)).max(initial=0.0)
        return bool(radius > 1.0 - 0.5 / longest)

    def _task(self, candidate: Candidate, left_out: Sequence[int]) -> Task:
        """A fit of all recordings but some."""
        kept = [n for n in range(len(self._recordings)) if n not in left_out]
        content = {
            "recordings": [self._contents[n] for n in kept],
            "orders": candidate.orders,
            "options": candidate.options,
            "is_whole": not left_out,
        }
        names = "+".join(self._recordings[n].name for n in kept)
        return Task(
            key=task_key("together", STAGE_VERSION, content, []),
            name=f"{names}/{candidate.nb}/{candidate.nk}",
            function=fit_without_standard_errors if left_out else fit,
            arguments=(
                tuple(self._recordings[n] for n in kept),
                candidate.orders,
                candidate.options,
            ),
            result_type=Fit,
        )


def _share_off(found: Fit, recording: Recording, *, is_of_motion: bool) -> float:
    """RMSD over the standard deviation of the output, bounded on both sides.

    A start that all of a recording had told would follow what the model does not explain:
    it is told by the first samples, and the others count.

    Parameters
    ----------
    is_of_motion : bool
        Of the straight line through what is simulated that comes closest.
    """
    if found.model is None:
        return _FARTHEST
    output, first = recording.output, 0
    if found.model.initial_state == "estimated":
        first = int(_START_SHARE * recording.n_samples)
        start = replace(recording, input=recording.input[:first], output=output[:first])
        state = estimated_state(found.model, start)
        simulated = simulate(found.model, recording.input, initial_state=state)
    else:
        simulated = validation_output(found.model, recording)
    if not np.isfinite(simulated).all():
        return _FARTHEST
    measured, simulated = output[first:], simulated[first:]
    if is_of_motion:
        line = np.column_stack([np.ones(simulated.size), simulated])
        simulated = line @ np.linalg.lstsq(line, measured, rcond=None)[0]
    off = rmsd(measured, simulated)
    share = off / max(float(np.std(output)), np.finfo(float).tiny)
    return float(np.clip(share, 1e-9, _FARTHEST))
