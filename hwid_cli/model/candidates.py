"""Candidate models of a fit: the parameters that move, and where they stand.

In the linear block the parameters of a step are the coefficients of ``(1 - q^-1)^j``
(see `linear_block.difference_basis`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.linear_block import as_loops_take_it
from hwid_cli.records.model import FitOptions, HammersteinWiener, StaticMap

# First samples, which always count.
_ALWAYS_COUNTED = 50


@dataclass(frozen=True, eq=False)
class FitData:
    """Input and measured output that start with one initial state.

    Parameters
    ----------
    input, output : ndarray, shape (n,)
    threshold : float
        Size from which on a residual counts in proportion instead of squared (see
        `loss`); the same for all experiments of a fit.
    counted : ndarray of int, shape (n_rows,), optional
        Samples at which the output is compared; all unless given.
    """

    input: np.ndarray
    output: np.ndarray
    threshold: float = float("inf")
    counted: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        if self.counted.size == 0:
            object.__setattr__(self, "counted", np.arange(self.output.size))
        for name in ("input", "output"):
            object.__setattr__(self, name, as_loops_take_it(getattr(self, name)))

    def at_counted(self, signal: np.ndarray) -> np.ndarray:
        """A signal at the samples that count.

        Parameters
        ----------
        signal : ndarray, shape (n,)

        Returns
        -------
        ndarray, shape (n_rows,)
            The signal itself where all count.
        """
        if self.counted.size == signal.size:
            return signal
        return signal[self.counted]


def thinned(experiments: Sequence[FitData], rows: int) -> tuple[FitData, ...]:
    """Experiments of which about so many samples count.

    The first ones all do: they alone tell the initial state.
    """
    stride = max(1, sum(one.output.size for one in experiments) // rows)
    if stride == 1:
        return tuple(experiments)
    return tuple(
        replace(
            one,
            counted=np.concatenate(
                [
                    np.arange(min(_ALWAYS_COUNTED, one.output.size)),
                    np.arange(_ALWAYS_COUNTED, one.output.size, stride),
                ]
            ),
        )
        for one in experiments
    )


@dataclass(frozen=True)
class Limits:
    """What a search may do with the linear block.

    Parameters
    ----------
    largest_pole_radius : float, [-]
        Every accepted step keeps all poles inside.
    is_block_frozen : bool
        Whether B and F stay as they are.
    """

    largest_pole_radius: float = 1.0
    is_block_frozen: bool = False


def limits_of(options: FitOptions) -> Limits:
    """Limits that the options of a fit set."""
    return Limits(options.largest_pole_radius, options.keeps_block)


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model together with the initial states of the experiments that it is fitted to.

    Parameters
    ----------
    model : HammersteinWiener
        Its ``initial_state`` rules how every experiment starts.
    free_responses : ndarray, shape (n_experiments, n_state) or (n_experiments, 0)
        Coefficients of C for each experiment.
    """

    model: HammersteinWiener
    free_responses: np.ndarray
    limits: Limits = Limits()


@dataclass(frozen=True)
class JacobianColumns:
    """Where each group of parameters stands; those of the maps come first."""

    output_map: slice
    input_map: slice
    free_responses: slice
    numerator: slice
    denominator: slice
    n_state: int
    with_positions: bool

    @property
    def total(self) -> int:
        """Number of parameters."""
        return int(self.denominator.stop)


def columns(candidate: Candidate, *, with_positions: bool) -> JacobianColumns:
    """Places of a candidate's parameters in a step.

    Parameters
    ----------
    with_positions : bool
        Whether break-points move.
    """
    model, moves = candidate.model, not candidate.limits.is_block_frozen
    sizes = [
        _count(model.output_map, with_positions),
        _count(model.input_map, with_positions),
        candidate.free_responses.size,
        model.numerator.size if moves else 0,
        model.denominator.size - 1 if moves else 0,
    ]
    stops = list(accumulate(sizes))
    slices = [slice(stop - size, stop) for stop, size in zip(stops, sizes, strict=True)]
    output_map, input_map, free_responses, numerator, denominator = slices
    return JacobianColumns(
        output_map,
        input_map,
        free_responses,
        numerator,
        denominator,
        n_state=candidate.free_responses.shape[1],
        with_positions=with_positions,
    )


def _count(one: StaticMap, with_positions: bool) -> int:
    active = static_map.active_parameters(one, with_positions=with_positions)
    return int(active.stop - active.start)
