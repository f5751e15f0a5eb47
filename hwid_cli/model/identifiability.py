"""Directions of a fit's parameters, and how firmly the data hold each.

``J'J`` at the optimum is singular in the directions of the shared gains (see
`normalise`): they are held (`held_directions`). What is singular beyond that is flat: the
data do not tell it.

Everything is worked out for the coefficients of ``(1 - q^-1)^j``, whose signals are not
nearly equal, and turned into those of B and F at the end.

References
----------
Ljung, System Identification (1999), section 9.2. docs/method.md, eqs. (16), (28).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from hwid_cli.model import sensitivities, static_map
from hwid_cli.model.candidates import Candidate, FitData, JacobianColumns, columns
from hwid_cli.model.held_directions import held_gradients
from hwid_cli.model.linear_block import difference_basis
from hwid_cli.model.sensitivities import end_gradients
from hwid_cli.model.static_map import RULES

# Eigenvalues of the scaled equations below this share of the largest are zero within
# rounding.
_SINGULAR = 1e-11
# Shift of a domain's ends by which derivatives are taken, as a share of it.
_SHIFT_OF_ENDS = 1e-6
# A parameter with this share of a flat direction's largest part is not determined.
_LEAST_SHARE = 1e-3


@dataclass(frozen=True, eq=False)
class Directions:
    """Directions that keep what is held, from the weakest to the strongest.

    Parameters
    ----------
    place : JacobianColumns
        Where each group of parameters stands.
    steps : ndarray, shape (n_parameters, n_directions)
        Step of the parameters in each direction, B and F as coefficients.
    strength : ndarray, shape (n_directions,), [output unit squared]
        By how much a unit step raises the sum of squares.
    size : ndarray, shape (n_parameters,)
        Size of what each parameter belongs to: of B, F, an initial state, the range of a
        map or of its break-points. Never zero.
    """

    place: JacobianColumns
    steps: np.ndarray
    strength: np.ndarray
    size: np.ndarray

    @property
    def is_flat(self) -> np.ndarray:
        """Which directions the data do not tell at all, shape (n_directions,)."""
        return self.strength <= _SINGULAR * self.strength[-1]

    @property
    def n_effective(self) -> int:
        """Parameters that the data determine, initial states included."""
        return int(np.sum(~self.is_flat))

    @property
    def flat_parts(self) -> np.ndarray:
        """Flat directions in shares of the sizes, shape (n_parameters, n_flat).

        Eigenvectors of equal eigenvalues are any mixture; one parameter each parts them.
        """
        flat = self.steps[:, self.is_flat] / self.size[:, None]
        count = flat.shape[1]
        if count == 0:
            return flat
        _, _, order = scipy.linalg.qr(flat.T, mode="economic", pivoting=True)
        return flat @ np.linalg.pinv(flat[order[:count]])

    @property
    def is_moved_by_flat(self) -> np.ndarray:
        """Which parameters a flat direction moves, shape (n_parameters,).

        Measured by their size: one that stays while another grows a thousandfold is
        known for all purposes.
        """
        parts = np.abs(self.flat_parts)
        return (parts > _LEAST_SHARE * parts.max(axis=0, initial=0.0)).any(axis=1)

    def covariance(self, variance: float) -> np.ndarray:
        """Covariance of all parameters, flat directions left out.

        Parameters
        ----------
        variance : float, [output unit squared]
            Of the residuals.

        Returns
        -------
        ndarray, shape (n_parameters, n_parameters)
        """
        firm = ~self.is_flat
        scaled = self.steps[:, firm] * np.sqrt(variance / self.strength[firm])
        return scaled @ scaled.T


def directions(
    candidate: Candidate, experiments: Sequence[FitData], *, free_break_points: bool
) -> Directions | None:
    """Directions of the parameters of a normalised model at its optimum.

    Parameters
    ----------
    candidate : Candidate
        Normalised, in the units of the experiments.
    free_break_points : bool
        Whether break-points were fitted; fixed ones are left out.

    Returns
    -------
    Directions or None
        None where the equations are not finite, or nothing is free.
    """
    system = sensitivities.equations(
        candidate, experiments, with_positions=free_break_points
    )
    place = columns(candidate, with_positions=free_break_points)
    change = _coefficients(place)
    diagonal = np.diag(system.matrix)
    # A parameter without any effect keeps its own scale.
    scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    held = held_gradients(candidate, place)
    if not np.isfinite(system.matrix).all() or len(held) >= place.total:
        return None
    free = np.eye(place.total)
    if held:
        # A basis of all steps that keep what is held.
        _, _, basis = np.linalg.svd(np.array(held) @ change / scale)
        free = basis[len(held) :].T
    strength, parts = np.linalg.eigh(
        free.T @ (system.matrix / scale / scale[:, None]) @ free
    )
    steps = change @ ((free @ parts) / scale[:, None])
    ends = end_gradients(candidate, experiments, place)
    steps[place.output_map] += _change_of_ends(candidate, place) @ (
        ends @ ((free @ parts) / scale[:, None])
    )
    return Directions(place, steps, strength, _sizes(candidate, place))


def _change_of_ends(candidate: Candidate, place: JacobianColumns) -> np.ndarray:
    """Derivatives of the output map's parameters by the ends of its domain.

    The ends are those of the signal that reaches the map, so they move with the block.
    Parameters that lie at the ends, or count from them, move along.
    """
    one = candidate.model.output_map
    low, high = one.domain
    count = place.output_map.stop - place.output_map.start
    if not low < high:
        return np.zeros((count, 2))
    by = _SHIFT_OF_ENDS * (high - low)
    rule = RULES[one.kind]
    # Inwards at either end: outwards a map goes on with slopes of its own.
    moved = [
        (rule.with_domain(one, domain).parameters - one.parameters) / signed
        for domain, signed in (((low + by, high), by), ((low, high - by), -by))
    ]
    return np.column_stack(moved)[one.parameters.size - count :]


def n_free(candidate: Candidate, *, free_break_points: bool) -> int:
    """Parameters less what is held, whatever the data tell of them."""
    place = columns(candidate, with_positions=free_break_points)
    return place.total - len(held_gradients(candidate, place))


def parameter_names(candidate: Candidate, place: JacobianColumns) -> tuple[str, ...]:
    """Names of all parameters, initial states included.

    Returns
    -------
    tuple of str
        In the order of the columns; those of an initial state are named after it.
    """
    model = candidate.model
    names = [""] * place.total
    for label, one, part in (
        ("input_map", model.input_map, place.input_map),
        ("output_map", model.output_map, place.output_map),
    ):
        labels = static_map.parameter_names(one)
        active = labels[len(labels) - (part.stop - part.start) :]
        names[part] = [f"{label}.{name}" for name in active]
    if not candidate.limits.is_block_frozen:
        names[place.numerator] = [f"b[{i}]" for i in range(model.numerator.size)]
        names[place.denominator] = [f"f[{i}]" for i in range(1, model.denominator.size)]
    n_experiments = len(candidate.free_responses)
    names[place.free_responses] = [
        f"initial state {i}" + (f" of record {k + 1}" if n_experiments > 1 else "")
        for k in range(n_experiments)
        for i in range(place.n_state)
    ]
    return tuple(names)


def listed(place: JacobianColumns) -> np.ndarray:
    """Places of the parameters that a fit lists: all but the initial states.

    Returns
    -------
    ndarray of int, shape (n_listed,)
        Input map, output map, B, F.
    """
    parts = (place.input_map, place.output_map, place.numerator, place.denominator)
    return np.concatenate([np.arange(part.start, part.stop) for part in parts])


def _coefficients(place: JacobianColumns) -> np.ndarray:
    """Matrix from the parameters of a step to the coefficients of B and F."""
    change = np.eye(place.total)
    for part in (place.numerator, place.denominator, *_initial_states(place)):
        change[part, part] = difference_basis(part.stop - part.start)
    return change


def _sizes(candidate: Candidate, place: JacobianColumns) -> np.ndarray:
    """Size of what each parameter belongs to; one where that is zero."""
    model = candidate.model
    size = np.zeros(place.total)
    size[place.numerator] = np.linalg.norm(model.numerator)
    size[place.denominator] = np.linalg.norm(model.denominator[1:])
    size[place.free_responses] = np.linalg.norm(candidate.free_responses)
    for one, part in (
        (model.input_map, place.input_map),
        (model.output_map, place.output_map),
    ):
        if part.stop > part.start:
            count = RULES[one.kind].n_positions(one)
            positions, values = one.parameters[:count], one.parameters[count:]
            of_values = np.ptp(values) or np.max(np.abs(values))
            sizes = np.full(one.parameters.size, of_values)
            sizes[:count] = np.ptp(positions) if count else 0.0
            if not RULES[one.kind].has_common_sizes:
                sizes = np.abs(one.parameters)
            size[part] = sizes[sizes.size - (part.stop - part.start) :]
    return np.where(size > 0.0, size, 1.0)


def _initial_states(place: JacobianColumns) -> list[slice]:
    """Columns of each experiment's initial state."""
    part, size = place.free_responses, place.n_state
    if size == 0:
        return []
    return [slice(at, at + size) for at in range(part.start, part.stop, size)]
