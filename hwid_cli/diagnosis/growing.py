"""Fits of effects whose motion remembers every impact, to growing parts of recordings.

Teeth that let go and hit again send a small error of a parameter on to all later impacts.
Over a whole recording the error then has a valley beside every other one, and a fit stops
in the first. In a first part few impacts have happened, and a fit from almost anywhere
finds the values; a longer part begins where the shorter one has ended. Several fits go
this way side by side: valleys that a short part cannot tell apart are all followed. A
continuation in the length of the recordings. docs/method_diagnosis.md, eq. (D18c).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hwid_cli.diagnosis.candidate import (
    MOST_ITERATIONS,
    SearchStart,
    evaluated,
    fit_from,
    reached_by,
)
from hwid_cli.diagnosis.few_samples import fewer_recordings, first_parts
from hwid_cli.diagnosis.parameters import (
    BASE,
    ParameterLayout,
    first_point,
    residuals_at,
    sum_of_squares,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.search import SearchResult, fit_own, fit_point, within_bounds
from hwid_cli.diagnosis.whiteness import whiteness
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor

# Samples that grow; the end is fitted to all.
GROWN_SAMPLES = 12_000
# The first part, as a share of the longest recording.
FIRST_SHARE = 0.04
# Fits side by side; the better half goes on, the others begin beside it, by about this
# standard deviation of the effects' coordinates.
SIDE_BY_SIDE = 8
BESIDE = 0.002
SEED = 1
ITERATIONS = 4
# A longer part has so many times the samples at most, and less where the best mean square
# has risen by the factor: the way was lost in between. Growth that went well grows, by the
# exponent.
MOST_GROWTH, LEAST_GROWTH = 1.3, 1.07
MOST_RISE = 1.06
BOLDER = 1.4
# Where nothing else is missing, early parts leave noise: a set that leaves this mean square
# over it twice in a row, of less than that share of the recordings, grows no further. Nor
# does one that has lost its way so often there, or that does no better there, by this
# factor, than the fit to whole recordings.
NO_HOPE = 2.0
EARLY = 0.3
MOST_LOST = 5
LEAST_BETTER = 1.02
# Points whose coordinates differ by less are one.
SAME_POINT = 1e-4
# Valleys that leave at most so many times the RMS of the deepest one are as likely.
AS_LIKELY = 1.2


def is_rugged(effects: Sequence[str]) -> bool:
    """Whether some of the effects need growing parts."""
    return any(CATALOGUE[one].is_rugged for one in effects)


def grown_starts(
    start: SearchStart, effects: Sequence[str], scales: Scales
) -> list[SearchStart]:
    """A start, and others with the rugged effects elsewhere.

    Parameters
    ----------
    start : SearchStart
        Where a fit to whole recordings has stopped.
    effects : sequence of str
        Ids in the catalogue.
    """
    starts = [start]
    for effect in effects:
        if CATALOGUE[effect].is_rugged:
            starts += [
                replace(start, effects={**start.effects, effect: values})
                for values in CATALOGUE[effect].starts(scales)
            ]
    return starts


def with_valleys_of(found: CandidateFit, before: CandidateFit) -> CandidateFit:
    """A better fit of the same effects, which knows the valleys of the former one.

    Parameters
    ----------
    before : CandidateFit
        Its own place is a further valley where it has some.
    """
    if not before.valleys.size:
        return found
    valleys = [*found.valleys, *before.valleys, before.values]
    return replace(found, valleys=np.array(valleys))


def fit_grown(
    problem: DiagnosisProblem,
    standing: CandidateFit,
    starts: Sequence[SearchStart],
    scales: Scales,
    noise: NoiseFloor,
    *,
    to_the_end: bool = False,
) -> CandidateFit:
    """Fit the base with effects to growing parts of the training recordings.

    Parameters
    ----------
    standing : CandidateFit
        Where a fit to whole recordings has stopped.
    starts : sequence of SearchStart
        That place first.
    to_the_end : bool
        Grow on where early parts gain nothing: of what bounces seldom, the other valley
        may show late.

    Returns
    -------
    CandidateFit
        Of the same effects; the standing one where growth leads nowhere.
    """
    train = problem.part(held_out=False)
    everything = (*drive_effects(problem.drive), *standing.effects)
    few = fewer_recordings(train, GROWN_SAMPLES)
    n_first = int(FIRST_SHARE * _longest(few))
    first = first_parts(few, n_first)
    begun = [
        fit_from(first, everything, one, scales, MOST_ITERATIONS) for one in starts
    ]
    growth = _Growth(few, begun[0].layout, noise)
    must_gain = None if to_the_end else starts[0]
    found = growth.through(begun, n_first, must_gain)
    if not found:
        return standing
    start = reached_by(few, growth.whole(found[0]))
    best = fit_from(train, everything, start, scales, MOST_ITERATIONS)
    fit = evaluated(problem, standing.effects, best, train, noise)
    return replace(fit, valleys=growth.valleys(found))


def _longest(problem: DiagnosisProblem) -> int:
    return max(one.driven_by.size for one in problem.signals)


class _Growth:
    """Fits side by side to longer and longer parts of some recordings."""

    def __init__(
        self, few: DiagnosisProblem, fit_layout: ParameterLayout, noise: NoiseFloor
    ) -> None:
        self.few = few
        self.layout = fit_layout
        self.noise = noise
        self._rng = np.random.default_rng(SEED)
        self._widths = np.array(
            [0.0 if one.owner == BASE else BESIDE for one in fit_layout.shared]
        )

    def through(
        self,
        begun: Sequence[SearchResult],
        n_samples: int,
        standing: SearchStart | None,
    ) -> list[SearchResult]:
        """Grow from parts of so many samples to whole recordings.

        Parameters
        ----------
        standing : SearchStart or None
            Where a fit to whole recordings has stopped, which early parts have to leave
            behind; None where they need not.

        Returns
        -------
        list of SearchResult
            On whole recordings, the best first; empty where early parts leave more than
            noise, or nothing is gained there.
        """
        kept = _distinct(begun, SIDE_BY_SIDE)
        n, growth, before = n_samples, MOST_GROWTH, 1.0
        early, n_lost = int(EARLY * _longest(self.few)), 0
        while True:
            longer = min(max(int(growth * n), n + 1), _longest(self.few))
            part = first_parts(self.few, longer)
            there = self._fitted(part, [*kept, *self._beside(kept, len(kept))])
            now = self._over_noise(part, there)
            # Where much is left, it rises whatever is done: smaller steps do no good.
            may_help = min(before, now) <= NO_HOPE
            is_lost = now > MOST_RISE * max(before, 1.0)
            if is_lost and may_help and growth > LEAST_GROWTH:
                growth = max(growth**0.5, LEAST_GROWTH)
                continue
            if is_lost:
                n_lost += 1
                there += self._fitted(part, self._beside(kept, 0))
                now = self._over_noise(part, there)
            is_hopeless = n_lost > MOST_LOST or min(before, now) > NO_HOPE
            growth = growth if may_help else MOST_GROWTH
            if longer < early and is_hopeless:
                return []
            if n < early <= longer and not self._gains(part, now, standing):
                return []
            n, before, growth = longer, now, min(growth**BOLDER, MOST_GROWTH)
            if n >= _longest(self.few):
                return _distinct(there, len(there))
            kept = _distinct(there, SIDE_BY_SIDE // 2)

    def _gains(
        self, part: DiagnosisProblem, now: float, standing: SearchStart | None
    ) -> bool:
        """Whether growth leaves less of early parts than the fit to whole recordings.

        Where that left nothing but noise, the other valleys are worth knowing.
        """
        if standing is None:
            return True
        base: dict[str, Any] = dict(standing.base)
        drive = replace(self.few.drive, **base)
        shared = first_point(self.few, self.layout, drive, standing.effects).shared
        point = fit_own(self.few, self.layout, shared)
        if whiteness(residuals_at(self.few, self.layout, point), self.noise) <= 1.0:
            return True
        left = sum_of_squares(residuals_at(part, self.layout, point))
        return left / self._floor(part) > LEAST_BETTER * now

    def whole(self, here: SearchResult) -> SearchResult:
        """A fit to whole recordings, to its end."""
        return fit_point(
            self.few, self.layout, here.point, max_iterations=MOST_ITERATIONS
        )

    def valleys(self, found: Sequence[SearchResult]) -> np.ndarray:
        """Shared values of all that are as likely as the best one.

        Parameters
        ----------
        found : sequence of SearchResult
            On whole recordings, the best first.

        Returns
        -------
        ndarray, shape (n_valleys, n_shared)
        """
        most = AS_LIKELY**2 * max(found[0].sse, self._floor(self.few))
        return np.array(
            [
                [
                    one.value(q)
                    for one, q in zip(self.layout.shared, at.point.shared, strict=True)
                ]
                for at in found
                if at.sse <= most
            ]
        )

    def _fitted(
        self, part: DiagnosisProblem, points: Sequence[SearchResult]
    ) -> list[SearchResult]:
        """Fits to parts of the recordings, from where others have ended."""
        return [
            fit_point(part, self.layout, one.point, max_iterations=ITERATIONS)
            for one in points
        ]

    def _beside(self, kept: Sequence[SearchResult], n_there: int) -> list[SearchResult]:
        """Points near some, in turn, that bring their number to that side by side."""
        near = []
        for number in range(max(SIDE_BY_SIDE - n_there, 0)):
            one = kept[number % len(kept)]
            # Near ones and far ones: how far the next valley is, nobody knows.
            far = np.exp(self._rng.normal())
            away = far * self._widths * self._rng.normal(size=self._widths.size)
            point = replace(one.point, shared=one.point.shared + away)
            near.append(replace(one, point=within_bounds(self.layout, point)))
        return near

    def _over_noise(
        self, part: DiagnosisProblem, there: Sequence[SearchResult]
    ) -> float:
        """Mean square of the best one, over that of the noise, [-]."""
        return min(one.sse for one in there) / self._floor(part)

    def _floor(self, part: DiagnosisProblem) -> float:
        """Sum of squares of the noise."""
        floor = part.n_evaluated * self.noise.rms**2
        return max(floor, float(np.finfo(float).tiny))


def _distinct(found: Sequence[SearchResult], most: int) -> list[SearchResult]:
    """The best of the points that differ, so many at most."""
    chosen: list[SearchResult] = []
    for one in sorted(found, key=lambda one: one.sse):
        is_new = all(
            np.max(np.abs(one.point.shared - other.point.shared)) > SAME_POINT
            for other in chosen
        )
        if is_new and len(chosen) < most:
            chosen.append(one)
    return chosen
