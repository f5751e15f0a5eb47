"""Which few of the named terms make the force that a simulation lacks.

Along the measured motion the error obeys the base's own equation with the missing force
as its input: each term is put through that equation, and what the sensor would show of
it is compared with the error. All subsets of up to three terms, and those of four on top
of the best of three, are ranked; what goes with displacement, velocity and input is left
to the base. docs/method_diagnosis.md, eq. (D35), (D36).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
import scipy

from hwid_cli.diagnosis.latent_force import Smoothed, finite
from hwid_cli.diagnosis.law_terms import Term
from hwid_cli.diagnosis.problem import Compared
from hwid_cli.records.drive import Drive

MOST_TERMS = 4
# Subsets of three that a fourth term is added to, and subsets that are kept of each size.
_EXTENDED, _KEPT = 400, 300
# A speed below this share of a high quantile is standing, for so many samples.
_STANDING, _LEAST_STAND = 0.02, 8
# What is left of a column beside the base's must exceed this share of it.
_VISIBLE = 1e-4
# Pieces of each recording that a resampling draws.
_BLOCKS = 4
_RIDGE = 1e-9
_AT_ONCE = 100_000


@dataclass(frozen=True, eq=False)
class Regression:
    """Terms beside the error, as the sensor shows both.

    Parameters
    ----------
    terms : tuple of Term
    sizes : ndarray, shape (n_base + n_terms,)
        By which columns were divided.
    grams : ndarray, shape (n_blocks, n_columns, n_columns)
        Of base, terms and error, in this order, for each piece of a recording.
    n_base : int
    motion : mapping of str to ndarray, shape (n_samples,)
        ``x``, ``v``, ``u`` and ``t`` that the terms were computed with.
    """

    terms: tuple[Term, ...]
    sizes: np.ndarray
    grams: np.ndarray
    n_base: int
    motion: Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Subset:
    """A few terms, and what they leave.

    Parameters
    ----------
    places : tuple of int
        In the terms of the regression.
    left : float
        Share of the squares that the base leaves.
    """

    places: tuple[int, ...]
    left: float


def regression(
    compared: Sequence[Compared],
    smoothed: Sequence[Smoothed],
    drive: Drive,
    terms: Sequence[Term],
    *,
    through: bool,
) -> Regression:
    """Put terms through the base's equation, and beside the error.

    Parameters
    ----------
    compared, smoothed : sequence
        Training recordings: the fitted base, and the motion as measured.
    drive : Drive
        With the fitted base.
    through : bool
        Whether terms are forces; else they add to what the sensor reads.
    """
    blocks: list[np.ndarray] = []
    motions = []
    for one, motion in zip(compared, smoothed, strict=True):
        motions.append(_motion(one, motion, through=through))
        columns = _columns(one, motion, drive, terms, motions[-1], through=through)
        blocks += np.array_split(columns, _BLOCKS)
    together = sum(np.sum(one**2, axis=0) for one in blocks)
    sizes = np.sqrt(np.maximum(together, 1e-300))
    grams = np.array([(one / sizes).T @ (one / sizes) for one in blocks])
    return Regression(
        terms=tuple(terms),
        sizes=sizes,
        grams=grams,
        n_base=grams.shape[1] - len(terms) - 1,
        motion={
            name: np.concatenate([one[name] for one in motions]) for name in motions[0]
        },
    )


def _motion(one: Compared, motion: Smoothed, *, through: bool) -> dict[str, np.ndarray]:
    """Variables along one recording; a sensor errs on the way that the drive takes."""
    x, v = motion.position, motion.velocity
    if not through:
        x, v = finite(one.position), finite(one.velocity)
    t = one.signals.sample_time_s * np.arange(x.size)
    return {"x": x, "v": v, "u": one.signals.driven_by, "t": t}


def _columns(
    one: Compared,
    motion: Smoothed,
    drive: Drive,
    terms: Sequence[Term],
    at: Mapping[str, np.ndarray],
    *,
    through: bool,
) -> np.ndarray:
    """Base, terms and error of one recording as columns."""
    signals = one.signals
    dt, n = signals.sample_time_s, signals.compared.size
    error = finite(signals.compared - one.simulated)
    plain = [np.broadcast_to(term.values(at), (n,)) for term in terms]
    base = [np.ones(n), motion.position, motion.velocity, signals.driven_by]
    is_moving = _moving(motion.velocity) if through else np.ones(n, dtype=bool)
    responses = _Responses(drive, dt)
    moved = responses.of(np.column_stack([*base, *plain]) * is_moving[:, None])
    error = error - responses.of((motion.force * ~is_moving)[:, None])[:, 0]
    if not through:
        moved = np.column_stack([moved[:, : len(base)], *plain])
    columns = np.column_stack([moved, error])[signals.evaluated]
    free = responses.free(n)[signals.evaluated]
    # How the recording starts is its own affair; a speed does not show where that was.
    sizes = np.max(np.abs(free), axis=0)
    along = np.linalg.qr(free[:, sizes > 0] / sizes[sizes > 0])[0]
    return np.asarray(columns - along @ (along.T @ columns))


def _moving(velocity: np.ndarray) -> np.ndarray:
    """Where the drive is not standing, as friction may hold it with any force."""
    fast = float(np.quantile(np.abs(velocity), 0.99)) if velocity.size else 0.0
    slow = np.abs(velocity) <= _STANDING * fast
    edges = np.flatnonzero(np.diff(np.r_[0, slow.astype(int), 0]))
    moving = np.ones(velocity.size, dtype=bool)
    for first, last in edges.reshape(-1, 2):
        if last - first >= _LEAST_STAND:
            moving[first:last] = False
    return moving


class _Responses:
    """What the sensor shows of forces on the base, a straight line between samples."""

    def __init__(self, drive: Drive, dt: float) -> None:
        mass, damping = drive.mass_kg, drive.damping_N_s_per_m
        if drive.resistance_ohm is not None:
            gain = drive.force_constant_N_per_A
            back = drive.back_emf_V_s_per_m
            damping += gain * (gain if back is None else back) / drive.resistance_ohm
        rates = np.zeros((4, 4))
        rates[0, 1] = rates[2, 3] = 1.0
        rates[1, :3] = -drive.stiffness_N_per_m / mass, -damping / mass, 1 / mass
        # The third state is the force, the fourth its slope.
        self._step = scipy.linalg.expm(rates * dt)
        self._seen = 1 if drive.output == "velocity" else 0
        moves = self._step[:2, :2]
        self._poles = np.r_[1.0, -np.trace(moves), np.linalg.det(moves)]
        impulse = self._impulse(dt)
        self._zeros = np.convolve(impulse, self._poles)[:3]

    def _impulse(self, dt: float) -> np.ndarray:
        """First answers to a force that is a triangle around the first sample."""
        state, found = np.zeros(2), []
        forces = [0.0, 1.0, 0.0, 0.0]
        for before, after in pairwise(forces):
            whole = np.r_[state, before, (after - before) / dt]
            state = (self._step @ whole)[:2]
            found.append(state[self._seen])
        return np.array(found)

    def of(self, forces: np.ndarray) -> np.ndarray:
        return np.asarray(
            scipy.signal.lfilter(self._zeros, self._poles, finite(forces), axis=0)
        )

    def free(self, n: int) -> np.ndarray:
        """Motion from either state without any force."""
        states = np.empty((n, 2))
        moves, row = self._step[:2, :2], np.eye(2)
        for k in range(n):
            states[k] = row[self._seen]
            row = moves @ row
        return states


def best_subsets(found: Regression, most_terms: int = MOST_TERMS) -> list[list[Subset]]:
    """Best subsets of each size, the best first.

    Parameters
    ----------
    most_terms : int
        Of the largest ones.

    Returns
    -------
    list of list of Subset
        For sizes from 1 on.
    """
    matrix, vector, whole = _reduced(found, found.grams.sum(axis=0))
    usable = [place for place in range(len(found.terms)) if matrix[place, place] > 0]
    ranked: list[list[Subset]] = []
    for size in range(1, most_terms + 1):
        if size < MOST_TERMS:
            sets = np.array(list(combinations(usable, size)), dtype=int)
        else:
            sets = _extended(ranked[-1], usable)
        if sets.size == 0:
            break
        left = 1 - _explained(matrix, vector, sets) / whole
        order = np.argsort(left)[: _KEPT if size < MOST_TERMS - 1 else _EXTENDED]
        ranked.append(
            [
                Subset(tuple(int(p) for p in sets[row]), float(left[row]))
                for row in order
            ]
        )
    return ranked


def _extended(smaller: Sequence[Subset], usable: Sequence[int]) -> np.ndarray:
    sets = {
        tuple(sorted((*one.places, other)))
        for one in smaller
        for other in usable
        if other not in one.places
    }
    return np.array(sorted(sets), dtype=int)


def _reduced(
    found: Regression, gram: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Gram matrix of terms, their products with the error, and the error, without base."""
    n = found.n_base
    inner = gram[:n, :n] + _RIDGE * np.eye(n)
    taken = np.linalg.solve(inner, gram[:n, n:])
    rest = gram[n:, n:] - gram[:n, n:].T @ taken
    matrix, vector = rest[:-1, :-1].copy(), rest[:-1, -1]
    hidden = np.diag(matrix) <= _VISIBLE**2 * np.diag(gram)[n:-1]
    matrix[hidden] = matrix[:, hidden] = 0.0
    return matrix, vector, max(float(rest[-1, -1]), 1e-300)


def _explained(matrix: np.ndarray, vector: np.ndarray, sets: np.ndarray) -> np.ndarray:
    """Squares that each subset takes off the error."""
    size = sets.shape[1]
    parts = []
    for first in range(0, len(sets), _AT_ONCE):
        some = sets[first : first + _AT_ONCE]
        inner = matrix[some[:, :, None], some[:, None, :]]
        sides = np.sqrt(np.maximum(inner[:, range(size), range(size)], 1e-300))
        scaled = inner / sides[:, :, None] / sides[:, None, :]
        scaled[:, range(size), range(size)] += _RIDGE
        right = vector[some] / sides
        weights = np.linalg.solve(scaled, right[:, :, None])[:, :, 0]
        parts.append(np.sum(weights * right, axis=1))
    return np.concatenate(parts)


def coefficients(
    found: Regression, places: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of a subset, and what the base has to change with it.

    Returns
    -------
    of_terms : ndarray, shape (n_terms of the subset,)
    of_base : ndarray, shape (n_base,)
        Of a constant, of displacement, velocity and input.
    """
    gram, n = found.grams.sum(axis=0), found.n_base
    chosen = np.r_[np.arange(n), n + np.array(places, dtype=int)]
    matrix = gram[np.ix_(chosen, chosen)] + _RIDGE * np.eye(chosen.size)
    weights = np.linalg.solve(matrix, gram[chosen, -1])
    weights = weights * found.sizes[-1] / found.sizes[chosen]
    return weights[n:], weights[:n]


def inclusion(
    found: Regression, ranked: Sequence[Sequence[Subset]], places: Sequence[int],
    rng: np.random.Generator, *, draws: int,
) -> np.ndarray:  # fmt: skip
    """Share of resamplings in which each term's family is chosen again.

    Pieces of recordings are drawn with replacement; the best subset of the same size
    wins.

    Returns
    -------
    ndarray, shape (n_terms of the subset,)
    """
    sets = np.array([one.places for one in ranked[len(places) - 1]], dtype=int)
    kinds = [term.kind for term in found.terms]
    wanted = [kinds[place] for place in places]
    counts = np.zeros(len(places))
    n = len(found.grams)
    for _ in range(draws):
        gram = found.grams[rng.integers(0, n, n)].sum(axis=0)
        matrix, vector, _ = _reduced(found, gram)
        winner = sets[int(np.argmax(_explained(matrix, vector, sets)))]
        chosen = {kinds[place] for place in winner}
        counts += [kind in chosen for kind in wanted]
    return counts / draws
