"""Whether the evidence for a candidate suffices for a name, and what it leaves.

An information criterion alone names something even where nothing is missing: input
noise or a coarse sensor is enough. Naming therefore also asks for held-out recordings:
most of their error beyond the noise must be explained, in most of them.
docs/method_diagnosis.md, eq. (D21) to (D24).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np
import scipy

from hwid_cli.diagnosis.fit_facts import (
    count,
    count_starts,
    has_own_values,
    has_size,
    holds_look_alikes,
    is_one_but_for_a_law,
)
from hwid_cli.diagnosis.noise import noise_levels
from hwid_cli.diagnosis.parameters import BASE, is_factor
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.candidates import LIKE_INPUT_NOISE, CandidateFit
from hwid_cli.records.diagnosis import (
    LEAST_SURE,
    SMALL_REMAINDER,
    STILL_LARGE,
    NoiseFloor,
)
from hwid_cli.records.drive import Drive, StandIn

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
# Less where no other set of as many effects comes near it: of so many that were tried, each
# leaves so many times as much.
LEAST_EXPLAINED_ALONE = 0.95
LEAST_OF_SIZE, ALONE = 10, 2.5
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
# Residuals that go together all along still count as so many pieces of each recording:
# it rises, holds and falls, fast and slowly.
LEAST_PIECES = 10
# Ratio to the noise up to which what remains is of no account.
CLOSE_TO_NOISE = 1.03
# Ratio to the noise of noise and what is a third as large: drifts and other flaws of
# measuring are of that size.
A_THIRD_MORE = float(np.sqrt(1 + 1 / 9))
# The base of a stand-in that a candidate changes by more than this factor is no longer that
# of the simulation. A damping may be near nothing, and so its factor anything.
REPLACED = 3.0
_SPRING = "stiffness_N_per_m"
_OF_SIMULATION = (_SPRING, "force_constant_N_per_A")
# A spring whose force is below this share of the input's may be any: a cylinder has none,
# and a stand-in one of rounding errors.
LEAST_OF_FORCES = 0.01
# What is named explains this many times what a stand-in may be wrong by, at least.
LEAST_OVER_STAND_IN = 10.0


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
    least_stiffness : float, [N/m]
        Of a spring of ``standing`` that counts as one.
    motion : float, [output unit]
        RMS of the held-out motion about its mean; infinite where a command is compared, in
        which all that the motion lacks shows.
    levels : ndarray, shape (n_recordings,), [-]
        Noise of each recording over that of all; empty where it is alike in all.
    """

    n_samples: np.ndarray
    is_held_out: np.ndarray
    noise: NoiseFloor
    inputs: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    standing: StandIn | None = None
    stand_in_error: float = 0.0
    least_stiffness: float = 0.0
    motion: float = inf
    levels: np.ndarray = field(default_factory=lambda: np.zeros(0))

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
        return cls(
            counts, held, noise, features, standing, error, _least_stiffness(problem),
            motion, noise_levels(problem, noise),
        )  # fmt: skip

    @property
    def floors(self) -> np.ndarray:
        """Sum of squares of the noise in each recording, [output unit squared]."""
        levels = self.levels if self.levels.size else np.ones(self.n_samples.size)
        return np.asarray(self.n_samples * (levels * self.noise.rms) ** 2)

    @property
    def held_out_noise(self) -> float:
        """RMS of the noise in the recordings that judge, [output unit]."""
        held = self.is_held_out
        return float(np.sqrt(self.floors[held].sum() / self.n_samples[held].sum()))

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
        rms, noise = self.rms(found, held_out=True), self.held_out_noise
        return rms / noise if noise > 0 else float("inf")

    def is_close_to_noise(self, found: CandidateFit) -> bool:
        """Whether too little is left for a name, of held-out recordings and of all."""
        return found.is_usable and self._over_noise_at_most(found) <= A_THIRD_MORE

    def _over_noise_at_most(self, found: CandidateFit) -> float:
        """What held-out recordings leave or all, whichever is more, over the noise."""
        every = np.ones(self.is_held_out.size, dtype=bool)
        return max(self.ratio(found), self._over_noise(found, every))

    def evidence(self, found: CandidateFit, other: CandidateFit) -> Evidence:
        """How a candidate does against another one."""
        held = self.is_held_out
        explained = self._explained(found, other, held)
        change = other.sse[held] - found.sse[held]
        # A stop that a recording never reaches says nothing there, for or against.
        affected = np.abs(change) > LEAST_CHANGE * np.mean(np.abs(change))
        improved = float(np.mean(change[affected] > 0)) if affected.any() else 0.0
        return Evidence(self.gain(found, other), explained, improved)

    def _explained(
        self, found: CandidateFit, other: CandidateFit, rows: np.ndarray
    ) -> float:
        """Share of the other's excess over the noise in some recordings, [-]."""
        before, after = other.sse[rows].sum(), found.sse[rows].sum()
        excess = before - self.floors[rows].sum()
        return float((before - after) / excess) if excess > 0 else 0.0

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
        starts = count_starts(found) - count_starts(other)
        return float(n * fits - more * np.log(max(n, 2.0)) - starts)

    def excess(self, found: CandidateFit) -> float:
        """Sum of squares of all recordings beyond the noise.

        Returns
        -------
        float, [output unit squared]
        """
        floor = float(self.floors.sum())
        return max(float(found.sse.sum()) - floor, 0.0)

    def is_complete(self, found: CandidateFit) -> bool:
        """Whether nothing but noise remains.

        The training recordings' residuals must be noise by their shape, and the held-out
        recordings must not leave clearly more: a law that is not quite right may take all
        there is from the recordings that it is fitted to.

        References
        ----------
        docs/method_diagnosis.md, eq. (D23a).
        """
        # With effects, noise of the input is no excuse for that much. What it leaves
        # wanders by chance, so recordings are compared behind its filter (D27).
        is_fact = not found.effects or self.ratio(found) <= STILL_LARGE
        is_white = found.is_usable and found.whiteness <= 1.0
        is_alike = not found.effects and found.cause in LIKE_INPUT_NOISE
        return is_white and is_fact and (is_alike or self.holds(found))

    def leaves_noise(self, found: CandidateFit) -> bool:
        """Whether nothing but noise remains, be it that of the input.

        Of far more than the sensor's noise that is said, and not taken for complete.
        """
        is_of_input = found.is_usable and found.cause in LIKE_INPUT_NOISE
        return self.is_complete(found) or (is_of_input and found.whiteness <= 1.0)

    def holds(self, found: CandidateFit) -> bool:
        """Whether a candidate leaves hardly more of held-out recordings than of others."""
        held, train = (self._over_noise(found, rows) for rows in self._sides)
        both = min(max(found.neighbour, 0.0), 1.0) ** 2
        n = max(
            float(self.n_samples[self.is_held_out].sum()) * (1 - both) / (1 + both), 1
        )
        scatter = LEAST_SURE * np.sqrt(0.5 / n)
        return bool(held <= (SMALL_REMAINDER + scatter) * max(train, 1.0))

    @property
    def _sides(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the held-out recordings, and of the others; of all where these judge."""
        held = self.is_held_out
        return held, held if held.all() else ~held

    def _over_noise(self, found: CandidateFit, rows: np.ndarray) -> float:
        """RMS of some recordings over that of their noise, [-]."""
        floor = float(self.floors[rows].sum())
        return float(np.sqrt(found.sse[rows].sum() / floor)) if floor > 0 else 1.0

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
        if self.leaves_noise(found):
            return True
        return self.excess(found) < LEAST_LAST_CONTRIBUTION * self.excess(base)

    def leaves_nothing_of_account(
        self, found: CandidateFit, base: CandidateFit
    ) -> bool:
        """Whether what is left, of held-out recordings and of all, calls for nothing more.

        Many samples show it; it is a small part of the gap and drowns in the noise.

        Parameters
        ----------
        base : CandidateFit
            Re-fitted, without further effects.
        """
        is_near = self._over_noise_at_most(found) <= CLOSE_TO_NOISE
        return is_near and self.is_small_part(found, base)

    def leaves_next_to_nothing(self, found: CandidateFit, base: CandidateFit) -> bool:
        """Whether what is left is hardly above the noise, and next to nothing of the gap.

        Parameters
        ----------
        base : CandidateFit
            Re-fitted, without further effects.
        """
        is_near = self.ratio(found) <= SMALL_REMAINDER
        return is_near and self.is_small_part(found, base)

    def is_small_part(self, found: CandidateFit, base: CandidateFit) -> bool:
        """Whether too little is left for a name unless then nothing remains.

        Parameters
        ----------
        base : CandidateFit
            Re-fitted, without further effects.
        """
        return self.excess(found) < LEAST_CONTRIBUTION * self.excess(base)

    def is_alone(self, found: CandidateFit, tried: Sequence[CandidateFit]) -> bool:
        """Whether a set leaves far less than all others of its size, of many.

        Parameters
        ----------
        tried : sequence of CandidateFit
            Of its size. Those that are it but for another law of one effect do not count.
        """
        others = [one for one in tried if one is not found and one.is_usable]
        others = [one for one in others if not is_one_but_for_a_law(one, found)]
        most = ALONE * self.excess(found)
        return len(others) >= LEAST_OF_SIZE and all(
            self.excess(one) >= most for one in others
        )

    def may_be_named(
        self,
        found: CandidateFit,
        base: CandidateFit,
        tried: Sequence[CandidateFit] = (),
    ) -> bool:
        """Whether the evidence for a set of effects suffices.

        Parameters
        ----------
        base : CandidateFit
            Re-fitted, without further effects.
        tried : sequence of CandidateFit
            Of the set's size.

        References
        ----------
        docs/method_diagnosis.md, eq. (D24).
        """
        against = self.evidence(found, base)
        least = self._least_explained(found)
        explained = against.explained
        if self.ratio(base) <= SMALL_REMAINDER:
            # So little a sensor that drifts leaves, too, and half of it is soon explained.
            least = max(least, LEAST_EXPLAINED_SET)
            # Held-out recordings that leave next to nothing are explained by chance.
            explained = min(explained, self._explained(found, base, self._sides[1]))
        explains = explained >= least
        if not explains and explained >= LEAST_EXPLAINED_ALONE and self.is_far(found):
            explains = self.is_alone(found, tried)
        return (
            against.gain >= LEAST_GAIN
            and (explains or self.leaves_noise(found))
            and against.improved >= LEAST_IMPROVED
            and has_size(found)
            and not self.replaces(found)
            and self.is_beyond_stand_in(found, base)
            and not self.is_systematic(found)
            and not self.imitates_one_law(found)
        )

    def imitates_one_law(self, found: CandidateFit) -> bool:
        """Whether effects that look like each other leave something beside both."""
        return holds_look_alikes(found) and not self.leaves_noise(found)

    def _least_explained(self, found: CandidateFit) -> float:
        """Share that a set has to explain, from how much it leaves."""
        # Where much remains, a further effect makes up for a law that is not right.
        if len(found.effects) > 1:
            return LEAST_EXPLAINED_FAR if self.is_far(found) else LEAST_EXPLAINED_SET
        if self.ratio(found) <= STILL_LARGE:
            return LEAST_EXPLAINED
        # Beside a reading that errs, whatever is left moves the machine, and may be all.
        errs = any(CATALOGUE[one].enters == "output" for one in found.effects)
        is_free = has_own_values(found)
        is_far = self.rms(found, held_out=True) > LARGE_SHARE_OF_MOTION * self.motion
        is_doubtful = is_free or is_far or errs
        return LEAST_EXPLAINED_FAR if is_doubtful else LEAST_EXPLAINED_LARGE

    def is_far(self, found: CandidateFit) -> bool:
        """Whether a set of several effects leaves more than such sets may."""
        is_far = len(found.effects) > 1 and self.ratio(found) > MOST_LEFT_BY_SET
        return is_far and not self.leaves_noise(found)

    def beside(self, drive: Drive) -> "SelectionCriteria":
        """The same where another drive stands for the simulation.

        Parameters
        ----------
        drive : Drive
            Of a simulation whose own parameters have moved; another one changes nothing.
        """
        return replace(self, standing=drive) if isinstance(drive, StandIn) else self

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
        stiffness = max(values.get(_SPRING, 0.0), self.standing.stiffness_N_per_m)
        if stiffness < self.least_stiffness:
            values.pop(_SPRING, None)
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


def _least_stiffness(problem: DiagnosisProblem) -> float:
    """Stiffness at which a spring makes a share of the input's force, [N/m]."""
    pairs = ([one.output, one.driven_by] for one in problem.signals)
    way, pushed = (
        float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
        for parts in zip(*pairs, strict=True)
    )
    force = problem.drive.force_constant_N_per_A * pushed
    return LEAST_OF_FORCES * force / way if way > 0 else 0.0


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
