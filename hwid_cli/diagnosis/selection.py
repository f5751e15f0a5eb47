"""Which candidate is best, whether its evidence suffices, and what the verdict is.

An information criterion alone names something even where nothing is missing: input
noise or a coarse sensor is enough. Naming therefore also asks for held-out recordings:
most of their error beyond the noise must be explained, in most of them. Candidates that
the recordings cannot tell apart are all given.
docs/method_diagnosis.md, eq. (D21) to (D25).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from math import inf

import numpy as np
import scipy

from hwid_cli.diagnosis.parameters import BASE, START, is_factor
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.records.candidates import CandidateFit, RankedCandidate
from hwid_cli.records.diagnosis import STILL_LARGE, NoiseFloor
from hwid_cli.records.drive import StandIn
from hwid_cli.records.own_effects import plain_name

# A set of effects must lower the criterion by this much against the smaller one.
LEAST_GAIN = 10.0
# Share of the held-out excess over the noise that a single effect must explain ...
LEAST_EXPLAINED = 0.5
# ... and one that leaves much more than the noise ...
LEAST_EXPLAINED_LARGE = 0.65
# ... and a set of several, which imitates more, and may leave this many times ...
LEAST_EXPLAINED_SET = 0.8
MOST_LEFT_BY_SET = 2.0
# ... of which each effect must bring this share of all, less where nothing remains: a law
# that is not quite right leaves as much.
LEAST_CONTRIBUTION = 5e-3
LEAST_LAST_CONTRIBUTION = 5e-4
# What leaves more has to explain this share, and each effect of a set to bring that much:
# of several effects, and of values that each recording has for itself, which imitate most.
LEAST_EXPLAINED_FAR = 0.99
LEAST_CONTRIBUTION_FAR = 0.05
# So has one effect that leaves this share of the motion: whatever turns with the error
# explains a good part of one that large.
LARGE_SHARE_OF_MOTION = 0.1
# ... in this share of the held-out recordings.
LEAST_IMPROVED = 0.65
# Chance at which changes between recordings are said to go with their inputs, and the
# recordings beyond the fitted features that such a test needs.
CHANCE = 1e-3
_LEAST_FREEDOM = 3
# A recording counts where its sum of squares changes by this share of the mean change.
LEAST_CHANGE = 0.1
# Changes of a parameter between recordings below this are scatter, [-].
LEAST_SPREAD = 0.01
# Residuals that go together all along still count as so many pieces of each recording:
# it rises, holds and falls, fast and slowly.
LEAST_PIECES = 10
# Ratio to the noise up to which what remains is of no account.
CLOSE_TO_NOISE = 1.03
# Ratio up to which a remainder that no effect explains is no missing effect: the logger,
# a timer, a cable.
SMALL_REMAINDER = 1.2
# Whiteness up to which a small remainder counts as noise that is not quite white.
_NEARLY_WHITE = 2.0
# Candidates closer than this are not told apart.
TIE = 6.0
# Nor are those that leave at most so many times as much beyond the noise, where both
# leave something.
WITHIN_REACH = 1.25
# Share that each of several rivals explains of what none of them explains for the most.
LEAST_OF_RIVALS = 0.35
# Sets that leave at most so many times what the best one leaves count as near it, and
# what at least so many near sets share is there, whatever the rest is.
NEAR_BEST, LEAST_SHARING = 2.0, 10
# Share of what a verdict leaves that makes a set worth following.
LEAST_LEAD = 0.25
# The base of a stand-in that a candidate changes by more than this factor is no longer that
# of the simulation. A damping may be near nothing, and so its factor anything.
REPLACED = 3.0
_OF_SIMULATION = ("stiffness_N_per_m", "force_constant_N_per_A")
# What is named explains this many times what a stand-in may be wrong by, at least.
LEAST_OVER_STAND_IN = 10.0
# An effect that includes another one must add this share of what both gain.
LEAST_ADDED = 0.03


@dataclass(frozen=True)
class Evidence:
    """How one candidate does against another one.

    Parameters
    ----------
    gain : float, [-]
        How much lower its criterion is.
    explained : float, [-]
        Share of the other's held-out excess over the noise.
    improved : float, [-]
        Share of the held-out recordings that it changes in which it is better.
    """

    gain: float
    explained: float
    improved: float


@dataclass(frozen=True, eq=False)
class SelectionCriteria:
    """What selection needs beside the fits.

    Parameters
    ----------
    n_samples : ndarray, shape (n_recordings,)
    is_held_out : ndarray of bool, shape (n_recordings,)
    inputs : ndarray, shape (n_recordings, n_features)
        Size, direction and speed of each recording's input.
    standing : StandIn or None
        What stands for the simulation, if anything does.
    stand_in_error : float, [output unit squared]
        Of the problem.
    motion : float, [output unit]
        RMS of the held-out motion about its mean; infinite where a command is compared, in
        which all that the motion lacks shows.
    """

    n_samples: np.ndarray
    is_held_out: np.ndarray
    noise: NoiseFloor
    inputs: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    standing: StandIn | None = None
    stand_in_error: float = 0.0
    motion: float = inf

    @classmethod
    def of(cls, problem: DiagnosisProblem, noise: NoiseFloor) -> "SelectionCriteria":
        """Criteria for the recordings of a problem."""
        held = np.array([one.is_held_out for one in problem.signals])
        # A single recording validates itself; the report says so.
        held = held if held.any() else ~held
        counts = np.array([one.n_evaluated for one in problem.signals])
        features = np.array([_features(one) for one in problem.signals])
        standing = problem.drive if isinstance(problem.drive, StandIn) else None
        error = problem.stand_in_error
        moved = [
            one.compared - np.mean(one.compared)
            for one, is_held in zip(problem.signals, held, strict=True)
            if is_held
        ]
        motion = float(np.sqrt(np.mean(np.concatenate(moved) ** 2)))
        motion = inf if problem.compares_command else motion
        return cls(counts, held, noise, features, standing, error, motion)

    def rms(self, found: CandidateFit, *, held_out: bool) -> float:
        """RMS over the held-out recordings, or the others.

        Returns
        -------
        float, [output unit]
        """
        rows = self.is_held_out if held_out else ~self.is_held_out
        rows = rows if rows.any() else ~rows
        return float(np.sqrt(found.sse[rows].sum() / self.n_samples[rows].sum()))

    def ratio(self, found: CandidateFit) -> float:
        """RMS of the held-out recordings over that of the noise.

        Returns
        -------
        float, [-]
        """
        rms = self.rms(found, held_out=True)
        return rms / self.noise.rms if self.noise.rms > 0 else float("inf")

    def evidence(self, found: CandidateFit, other: CandidateFit) -> Evidence:
        """How a candidate does against another one."""
        held = self.is_held_out
        floor = self.n_samples[held].sum() * self.noise.rms**2
        before, after = other.sse[held].sum(), found.sse[held].sum()
        excess = before - floor
        explained = (before - after) / excess if excess > 0 else 0.0
        change = other.sse[held] - found.sse[held]
        # A stop that a recording never reaches says nothing there, for or against.
        affected = np.abs(change) > LEAST_CHANGE * np.mean(np.abs(change))
        improved = float(np.mean(change[affected] > 0)) if affected.any() else 0.0
        return Evidence(self.gain(found, other), float(explained), improved)

    def gain(self, found: CandidateFit, other: CandidateFit) -> float:
        """How much lower the criterion of a candidate is than another's.

        Residuals that go together count as fewer samples.

        Returns
        -------
        float, [-]
            Infinite where only one of them could be simulated.

        References
        ----------
        docs/method_diagnosis.md, eq. (D21).
        """
        if not found.is_usable:
            return -float("inf")
        if not other.is_usable:
            return float("inf")
        both = min(max(found.neighbour, 0.0), max(other.neighbour, 0.0))
        n = float(self.n_samples.sum()) * (1 - both) / (1 + both)
        n = max(n, LEAST_PIECES * self.n_samples.size)
        least = 1e-24 * max(float(other.sse.sum()), 1e-300)
        fits = np.log((other.sse.sum() + least) / (found.sse.sum() + least))
        more = count(found) - count(other)
        # How recordings start shows in their first samples only, whatever n: each such
        # value is charged what it gains by chance.
        starts = _count_starts(found) - _count_starts(other)
        return float(n * fits - more * np.log(max(n, 2.0)) - starts)

    def excess(self, found: CandidateFit) -> float:
        """Sum of squares of all recordings beyond the noise.

        Returns
        -------
        float, [output unit squared]
        """
        floor = float(self.n_samples.sum()) * self.noise.rms**2
        return max(float(found.sse.sum()) - floor, 0.0)

    def is_complete(self, found: CandidateFit) -> bool:
        """Whether nothing but noise remains."""
        return found.is_usable and found.whiteness <= 1.0

    def needs_nothing(self, base: CandidateFit) -> bool:
        """Whether nothing remains but noise, or the little that a stand-in may be wrong by.

        Parameters
        ----------
        base : CandidateFit
            Re-fitted, without further effects.
        """
        is_small = self.ratio(base) <= SMALL_REMAINDER
        is_of_stand_in = is_small and self.excess(base) < self.stand_in_error
        return self.is_complete(base) or is_of_stand_in

    def is_nearly_all(self, found: CandidateFit, base: CandidateFit) -> bool:
        """Whether nothing remains, or too little for a further effect to be named.

        Parameters
        ----------
        base : CandidateFit
            Re-fitted, without further effects.
        """
        if self.is_complete(found):
            return True
        return self.excess(found) < LEAST_LAST_CONTRIBUTION * self.excess(base)

    def is_small_part(self, found: CandidateFit, base: CandidateFit) -> bool:
        """Whether too little is left for a name unless then nothing remains.

        Parameters
        ----------
        base : CandidateFit
            Re-fitted, without further effects.
        """
        return self.excess(found) < LEAST_CONTRIBUTION * self.excess(base)

    def may_be_named(self, found: CandidateFit, base: CandidateFit) -> bool:
        """Whether the evidence for a set of effects suffices.

        Parameters
        ----------
        base : CandidateFit
            Re-fitted, without further effects.

        References
        ----------
        docs/method_diagnosis.md, eq. (D24).
        """
        against = self.evidence(found, base)
        explains = against.explained >= self._least_explained(found)
        return (
            against.gain >= LEAST_GAIN
            and (explains or self.is_complete(found))
            and against.improved >= LEAST_IMPROVED
            and has_size(found)
            and not self.replaces(found)
            and self.is_beyond_stand_in(found, base)
            and not self.is_systematic(found)
            and (self.is_complete(found) or not holds_look_alikes(found))
        )

    def _least_explained(self, found: CandidateFit) -> float:
        """Share that a set has to explain, from how much it leaves."""
        # Where much remains, a further effect makes up for a law that is not right.
        if len(found.effects) > 1:
            return LEAST_EXPLAINED_FAR if self.is_far(found) else LEAST_EXPLAINED_SET
        if self.ratio(found) <= STILL_LARGE:
            return LEAST_EXPLAINED
        is_free = _is_free(found)
        is_far = self.rms(found, held_out=True) > LARGE_SHARE_OF_MOTION * self.motion
        return LEAST_EXPLAINED_FAR if is_free or is_far else LEAST_EXPLAINED_LARGE

    def is_far(self, found: CandidateFit) -> bool:
        """Whether a set of several effects leaves more than such sets may."""
        return len(found.effects) > 1 and self.ratio(found) > MOST_LEFT_BY_SET

    def replaces(self, found: CandidateFit) -> bool:
        """Whether a candidate puts another base in the place of the simulation's.

        What stands for a simulation moves as it does: an effect beside which it has to
        become another drive says nothing about the simulation.

        References
        ----------
        docs/method_diagnosis.md, eq. (D30).
        """
        if self.standing is None:
            return False
        values = {one.parameter: value
                  for one, value in zip(found.names, found.values, strict=True)
                  if one.owner == BASE}  # fmt: skip
        pairs = [(values[one], getattr(self.standing, one))
                 for one in _OF_SIMULATION if one in values]  # fmt: skip
        return any(
            abs(one) > REPLACED * abs(other) or abs(other) > REPLACED * abs(one)
            for one, other in pairs
            if other != 0
        )

    def is_beyond_stand_in(self, found: CandidateFit, other: CandidateFit) -> bool:
        """Whether a candidate explains more than a stand-in may be wrong by.

        Where nothing but noise remains, that error was small; but all that is explained
        may be it.

        References
        ----------
        docs/method_diagnosis.md, eq. (D33b).
        """
        explained = float(other.sse.sum() - found.sse.sum())
        times = 1.0 if self.is_complete(found) else LEAST_OVER_STAND_IN
        return explained >= times * self.stand_in_error

    def is_systematic(self, found: CandidateFit) -> bool:
        """Whether what should differ by chance goes with the recordings' inputs.

        A parameter that changes with size, direction or speed of the input stands in for
        a law that is missing.

        References
        ----------
        docs/method_diagnosis.md, eq. (D24).
        """
        columns = [
            column for column, one in enumerate(found.own_names) if is_factor(one)
        ]
        return any(_goes_with(found.own[:, one], self.inputs) for one in columns)


def _features(signals: Signals) -> tuple[float, float, float]:
    """Size, direction and speed of an input."""
    moved = signals.driven_by - signals.driven_by[0]
    size = float(np.max(np.abs(moved))) or 1.0
    speed = float(np.sqrt(np.mean(np.diff(moved) ** 2))) / size
    return (
        float(np.log(size)),
        float(np.mean(moved)) / size,
        float(np.log(speed + 1e-9)),
    )


def _goes_with(values: np.ndarray, inputs: np.ndarray) -> bool:
    """Whether values follow the inputs' features more than by chance (F test)."""
    n = values.size
    if inputs.shape[0] != n:
        return False
    spread = inputs.std(axis=0)
    used = inputs[:, spread > 1e-6]
    freedom = n - used.shape[1] - 1
    if used.shape[1] == 0 or freedom < _LEAST_FREEDOM:
        return False
    columns = np.column_stack([np.ones(n), used])
    left = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
    whole = float(np.sum((values - values.mean()) ** 2))
    unexplained = float(left @ left)
    ratio = (whole - unexplained) / used.shape[1] / max(unexplained / freedom, 1e-300)
    return bool(scipy.special.fdtrc(used.shape[1], freedom, ratio) < CHANCE)


def count(found: CandidateFit) -> int:
    """Number of parameters of a candidate, without how recordings start."""
    own = sum(one.owner != START for one in found.own_names)
    return int(found.values.size + own * found.own.shape[0])


def _count_starts(found: CandidateFit) -> int:
    starts = sum(one.owner == START for one in found.own_names)
    return int(starts * found.own.shape[0])


def has_size(found: CandidateFit) -> bool:
    """Whether changes between recordings are more than scatter."""
    return not any(
        is_factor(one) and float(np.std(found.own[:, column])) < LEAST_SPREAD
        for column, one in enumerate(found.own_names)
    )


def holds_look_alikes(found: CandidateFit) -> bool:
    """Whether two effects of a set look like each other.

    Where something remains beside both, they imitate one law that is neither.
    """
    return any(
        public_id(one) in CATALOGUE[two].confused_with
        and public_id(two) in CATALOGUE[one].confused_with
        for one, two in combinations(found.effects, 2)
        if public_id(one) != public_id(two)
    )


def ranked(
    criteria: SelectionCriteria,
    found: Sequence[CandidateFit],
    base: CandidateFit,
    shares: Mapping[tuple[str, ...], float],
    verdict: "DiagnosisVerdict",
) -> tuple[RankedCandidate, ...]:
    """Table of all candidates, the best first.

    Parameters
    ----------
    shares : dict of tuple of str to float
        Forecasts, of candidates that were not fitted as well.
    verdict : DiagnosisVerdict
        Whose set and rivals are marked, with the errors that it states.
    """
    told = {one.effects: ("rival", one) for one in verdict.rivals}
    told[verdict.chosen.effects] = ("diagnosis", verdict.chosen)
    rows = []
    for fit in found:
        role, one = told.get(fit.effects, ("", fit))
        rows.append(replace(_row(criteria, one, base, shares), role=role))
    rows.sort(key=lambda row: -row.bic_gain if np.isfinite(row.bic_gain) else np.inf)
    fitted = {one.effects for one in found}
    nan = float("nan")
    waiting = sorted(
        (item for item in shares.items() if item[0] not in fitted),
        key=lambda item: -item[1],
    )
    rows += [
        RankedCandidate(
            tuple(plain_name(one) for one in ids),
            share,
            False,
            nan,
            nan,
            nan,
            nan,
            nan,
            nan,
            "not finished: far behind",
        )
        for ids, share in waiting
    ]
    return tuple(rows)


def _row(
    criteria: SelectionCriteria,
    found: CandidateFit,
    base: CandidateFit,
    shares: Mapping[tuple[str, ...], float],
) -> RankedCandidate:
    share = shares.get(found.effects, float("nan"))
    nan = float("nan")
    if not found.is_usable:
        text = "could not be simulated"
        return RankedCandidate(
            tuple(plain_name(one) for one in found.effects), share, True,
            nan, nan, nan, nan, nan, nan, text,
        )  # fmt: skip
    against = criteria.evidence(found, base)
    return RankedCandidate(
        effects=tuple(plain_name(one) for one in found.effects),
        forecast_share=share,
        is_fitted=True,
        train_rms=criteria.rms(found, held_out=False),
        held_out_rms=criteria.rms(found, held_out=True),
        bic_gain=against.gain,
        explained_share=against.explained,
        improved_share=against.improved,
        whiteness=found.whiteness,
        note="" if found.has_converged else "stopped at the iteration limit",
    )


def select_best(
    criteria: SelectionCriteria, found: Sequence[CandidateFit], base: CandidateFit
) -> CandidateFit | None:
    """Pick the best candidate, the simplest of those that are as good.

    Parameters
    ----------
    found : sequence of CandidateFit
        Of sets of the same size.

    Returns
    -------
    CandidateFit or None
        None where nothing could be simulated.
    """
    usable = [one for one in found if one.is_usable]
    if not usable:
        return None
    best = max(usable, key=lambda one: criteria.gain(one, base))
    for rival in sorted(usable, key=count):
        if count(rival) >= count(best) and not _has_fewer_kinds(rival, best):
            continue
        if is_part_of(rival, best):
            if not _adds_enough(criteria, best, rival, base):
                best = rival
        elif criteria.gain(best, rival) < TIE:
            best = rival
    return best


def is_part_of(smaller: CandidateFit, larger: CandidateFit) -> bool:
    """Whether each effect of one set is in the other, or a limit case of one there."""
    left = list(larger.effects)
    for effect in smaller.effects:
        match = next(
            (one for one in left if one == effect or effect in CATALOGUE[one].contains),
            None,
        )
        if match is None:
            return False
        left.remove(match)
    return True


def _has_fewer_kinds(one: CandidateFit, other: CandidateFit) -> bool:
    """Whether a set needs only some of another's kinds of effects: one of them twice."""
    kinds, others = set(names_of(one)), set(names_of(other))
    return kinds < others and count(one) <= count(other)


def _adds_enough(
    criteria: SelectionCriteria,
    larger: CandidateFit,
    smaller: CandidateFit,
    base: CandidateFit,
) -> bool:
    gain = criteria.gain(larger, smaller)
    if gain < TIE:
        return False
    added = smaller.sse.sum() - larger.sse.sum()
    together = base.sse.sum() - larger.sse.sum()
    is_clear = criteria.is_complete(larger) and not criteria.is_complete(smaller)
    return bool(added >= LEAST_ADDED * together or is_clear)


def rivals(
    criteria: SelectionCriteria, found: Sequence[CandidateFit], best: CandidateFit
) -> list[CandidateFit]:
    """List the candidates that the data cannot tell from the best one.

    Where the best one leaves nothing but noise, its criterion decides. Where it leaves
    more, its law is not quite the machine's, and neither is a rival's: those that leave
    about as much are as likely.

    Returns
    -------
    list of CandidateFit
        Those that include the best one, or are included in it, are left out: they are
        measured by what they add. So are those that need a further kind of effect where
        the best one has one kind twice.
    """
    is_complete = criteria.is_complete(best)
    left = criteria.excess(best)
    most = max(WITHIN_REACH * left, left + criteria.stand_in_error)
    return [
        one
        for one in found
        if one.is_usable
        and one is not best
        and not is_part_of(best, one)
        and not is_part_of(one, best)
        and names_of(one) != names_of(best)
        and not _has_fewer_kinds(best, one)
        and (
            criteria.gain(best, one) < TIE
            or (not is_complete and criteria.excess(one) <= most)
        )
    ]


def lead(
    criteria: SelectionCriteria,
    found: Iterable[CandidateFit],
    verdict: "DiagnosisVerdict",
) -> CandidateFit | None:
    """Set of effects that explains most of what the verdict leaves, without a proof.

    Returns
    -------
    CandidateFit or None
        For people to follow; None where nothing remains, or nothing explains a good
        part of it in most of the held-out recordings.
    """
    chosen = verdict.chosen
    if verdict.is_complete or verdict.word not in ("named", "unknown"):
        return None
    best, most = None, LEAST_LEAD
    for one in found:
        adds = set(chosen.effects) < set(one.effects)
        if not (adds and one.is_usable and has_size(one)):
            continue
        against = criteria.evidence(one, chosen)
        is_clear = against.gain >= LEAST_GAIN and against.improved >= LEAST_IMPROVED
        takes = float(chosen.sse.sum() - one.sse.sum())
        is_clear = is_clear and takes >= criteria.stand_in_error
        if is_clear and against.explained > most:
            best, most = one, against.explained
    return best


def title_of(found: CandidateFit) -> str:
    """Public ids of a set of effects, in words."""
    return " with ".join(public_id(one) for one in found.effects)


def names_of(found: CandidateFit) -> tuple[str, ...]:
    """Public ids of a set of effects, sorted."""
    return tuple(sorted(public_id(one) for one in found.effects))


@dataclass(frozen=True, eq=False)
class DiagnosisVerdict:
    """What is said, and the fit that it rests on.

    Parameters
    ----------
    word : str
        One of ``records.diagnosis.VERDICTS``.
    chosen : CandidateFit
        With the effects that are named; the base where there are none.
    rivals : tuple of CandidateFit
        Sets of effects that the data cannot tell from the chosen one.
    """

    word: str
    is_complete: bool
    chosen: CandidateFit
    rivals: tuple[CandidateFit, ...]


def decide(
    criteria: SelectionCriteria,
    given_sse: np.ndarray,
    base: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    best: Sequence[CandidateFit],
    unclear: Callable[[CandidateFit], tuple[str, ...]],
) -> DiagnosisVerdict:
    """Weigh the evidence.

    Parameters
    ----------
    given_sse : ndarray, shape (n_recordings,)
        Of the simulation with the parameters that the configuration gives.
    base : CandidateFit
        Re-fitted, without further effects.
    fits : mapping of tuple of str to CandidateFit
        Of all sets of effects.
    best : sequence of CandidateFit
        The best of each size.
    unclear : callable
        Effects of a fit that may as well not be there.
    """
    if criteria.needs_nothing(base):
        word = _without_effect(criteria, given_sse, base)
        return DiagnosisVerdict(word, criteria.is_complete(base), base, ())

    def may_be_named(one: CandidateFit) -> bool:
        return (
            criteria.may_be_named(one, base)
            and _needs_each(criteria, one, fits, base)
            and not unclear(one)
        )

    for winner in reversed(best):
        same_size = [one for one in fits.values()
                     if len(one.effects) == len(winner.effects)]  # fmt: skip
        tried = _as_winner(criteria, winner, same_size, base)
        chosen = next((one for one in tried if may_be_named(one)), None)
        if chosen is None:
            continue
        near = [one for one in rivals(criteria, same_size, chosen) if may_be_named(one)]
        word = "ambiguous" if near else "named"
        return DiagnosisVerdict(word, criteria.is_complete(chosen), chosen, tuple(near))
    is_close = criteria.ratio(base) <= CLOSE_TO_NOISE
    if is_close and base.whiteness <= _NEARLY_WHITE:
        return DiagnosisVerdict(
            _without_effect(criteria, given_sse, base), True, base, ()
        )
    explained = [
        criteria.evidence(one, base).explained for one in fits.values() if one.is_usable
    ]
    is_small = criteria.ratio(base) <= SMALL_REMAINDER
    if is_small and max(explained, default=0.0) < LEAST_OF_RIVALS:
        return DiagnosisVerdict(
            _without_effect(criteria, given_sse, base), False, base, ()
        )
    halves = _rivals_by_halves(criteria, base, fits, unclear)
    if len(halves) > 1:
        return DiagnosisVerdict("ambiguous", False, halves[0], tuple(halves[1:]))
    shared = _shared_by_best(criteria, base, fits, unclear)
    if shared is not None:
        return DiagnosisVerdict("named", False, shared, ())
    return DiagnosisVerdict("unknown", False, base, ())


def _as_winner(
    criteria: SelectionCriteria,
    winner: CandidateFit,
    same_size: Sequence[CandidateFit],
    base: CandidateFit,
) -> list[CandidateFit]:
    """The winner of a size, its limit cases, and what it is a limit case of."""
    others = [one for one in same_size if one is not winner]
    simpler = [one for one in others if is_part_of(one, winner)]
    # It explains a little more, which the winner may lack for a name.
    wider = [one for one in others if one.is_usable and is_part_of(winner, one)]
    wider.sort(key=lambda one: -criteria.gain(one, base))
    return [winner, *simpler, *wider]


def _shared_by_best(
    criteria: SelectionCriteria,
    base: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    unclear: Callable[[CandidateFit], tuple[str, ...]],
) -> CandidateFit | None:
    """What all sets near the best one share, where no set is enough for a name.

    References
    ----------
    docs/method_diagnosis.md, eq. (D24a).
    """
    usable = [one for one in fits.values() if one.is_usable]
    left = [1.0 - criteria.evidence(one, base).explained for one in usable]
    most = NEAR_BEST * min(left, default=0.0)
    near = [one for one, rest in zip(usable, left, strict=True) if rest <= most]
    if len(near) < LEAST_SHARING:
        return None
    shared = set.intersection(*(set(names_of(one)) for one in near))
    for one in sorted(usable, key=lambda one: -criteria.gain(one, base)):
        against = criteria.evidence(one, base)
        is_clear = against.gain >= LEAST_GAIN and against.improved >= LEAST_IMPROVED
        is_clear = is_clear and against.explained >= LEAST_EXPLAINED
        is_clear = is_clear and criteria.is_beyond_stand_in(one, base)
        is_clear = is_clear and not _is_free(one)
        # The sets show that it is there; how large it is may hang on what is missing.
        is_simpler = any(CATALOGUE[effect].told_by for effect in unclear(one))
        if shared and set(names_of(one)) == shared and is_clear and not is_simpler:
            return one
    return None


def _is_free(found: CandidateFit) -> bool:
    """Whether each recording has a value for itself."""
    return any(is_factor(one) for one in found.own_names)


def _changes_freely(found: CandidateFit, effect: str) -> bool:
    """Whether an effect has a value of its own in every recording.

    Such values make up for a law that is not quite right, down to the noise.
    """
    return any(one.owner == effect and is_factor(one) for one in found.own_names)


def _needs_each(
    criteria: SelectionCriteria,
    whole: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    base: CandidateFit,
) -> bool:
    """Whether a set leaves much more without any one of its effects."""
    if len(whole.effects) == 1:
        return True
    is_far = criteria.is_far(whole)
    for effect in whole.effects:
        left = tuple(one for one in whole.effects if one != effect)
        if left not in fits:
            if is_far:
                return False
            continue
        against = criteria.evidence(whole, fits[left])
        completes = criteria.is_complete(whole) and not criteria.is_complete(fits[left])
        explains = against.explained >= LEAST_EXPLAINED or completes
        is_clear = against.gain >= LEAST_GAIN and against.improved >= LEAST_IMPROVED
        brings = criteria.excess(fits[left]) - criteria.excess(whole)
        is_last = completes and not _changes_freely(whole, effect)
        least = LEAST_CONTRIBUTION_FAR if is_far else LEAST_CONTRIBUTION
        least = LEAST_LAST_CONTRIBUTION if is_last else least
        is_clear = is_clear and brings >= least * criteria.excess(base)
        is_clear = is_clear and criteria.is_beyond_stand_in(whole, fits[left])
        if not (is_clear and explains):
            return False
    return True


def _rivals_by_halves(
    criteria: SelectionCriteria,
    base: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    unclear: Callable[[CandidateFit], tuple[str, ...]],
) -> list[CandidateFit]:
    """Single effects that each explain a good part, in every recording, the best first."""
    found = []
    for one in fits.values():
        if len(one.effects) != 1 or not one.is_usable or not has_size(one):
            continue
        if _is_free(one) and criteria.ratio(one) > STILL_LARGE:
            continue
        against = criteria.evidence(one, base)
        explains = against.explained >= LEAST_OF_RIVALS and against.improved == 1.0
        is_clear = explains and against.gain >= LEAST_GAIN and not unclear(one)
        if is_clear and criteria.is_beyond_stand_in(one, base):
            found.append(one)
    found.sort(key=lambda one: -criteria.gain(one, base))
    if not found:
        return []
    return [found[0], *rivals(criteria, found, found[0])]


def _without_effect(
    criteria: SelectionCriteria, given_sse: np.ndarray, base: CandidateFit
) -> str:
    """``parameters`` if the re-fit was needed, else ``none``."""
    before, after = float(given_sse.sum()), float(base.sse.sum())
    if not np.isfinite(before):
        return "parameters"
    n = float(criteria.n_samples.sum())
    gain = n * np.log(max(before, 1e-300) / max(after, 1e-300))
    least = LEAST_GAIN + base.values.size * np.log(n)
    # Noise-free records: rounding differences are no parameters.
    is_visible = before > after * 1.001
    return "parameters" if gain > least and is_visible else "none"
