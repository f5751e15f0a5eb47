"""What the claims are judged on, in one form for published tables and for results.

Published tables hold less than results do: some cells are rounded, lost or blank. Here
both become the same few records, so that one definition judges both.
"""

from dataclasses import dataclass

import numpy as np

N_BEST = 3


@dataclass(frozen=True, eq=False)
class SelfRmsd:
    """Lowest RMSDs of each recording's models on that recording.

    Parameters
    ----------
    recordings : tuple of str, length n
    lowest : ndarray, shape (n, N_BEST), [unit]
        Ascending; infinite where there are fewer usable models.
    threshold : float, [unit]
    """

    recordings: tuple[str, ...]
    lowest: np.ndarray
    threshold: float


@dataclass(frozen=True)
class Counts:
    """How many recordings each of several models covers.

    Parameters
    ----------
    values : tuple of int, [-]
    of : int, [-]
        Recordings that could be covered.
    recount : tuple of int, [-]
        The same, counted again in another published table; empty where there is none.
    """

    values: tuple[int, ...]
    of: int
    recount: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Matrix:
    """Models on recordings.

    Parameters
    ----------
    models : tuple of str, length n
        Names of the recordings that each was fitted to, joined by ``+``.
    recordings : tuple of str, length m
    rmsd : ndarray, shape (n, m), [unit]
        Infinite where a model's output is not finite; NaN where a published table says
        nothing.
    covered : ndarray of bool, shape (n, m)
    is_own : ndarray of bool, shape (n, m)
        Whether the model was fitted to the recording.
    """

    models: tuple[str, ...]
    recordings: tuple[str, ...]
    rmsd: np.ndarray
    covered: np.ndarray
    is_own: np.ndarray

    def __post_init__(self) -> None:
        shape = (len(self.models), len(self.recordings))
        found = {self.rmsd.shape, self.covered.shape, self.is_own.shape}
        if found != {shape}:
            raise ValueError(f"tables {sorted(found)} must have shape {shape}")

    @property
    def counts(self) -> Counts:
        """Recordings that each model covers, its own ones included."""
        return Counts(
            tuple(int(count) for count in self.covered.sum(axis=1)),
            len(self.recordings),
        )

    @property
    def singles(self) -> tuple[int, ...]:
        """Rows of single recordings' models; the first one where there are two."""
        names = [name for name in dict.fromkeys(self.models) if "+" not in name]
        return tuple(self.models.index(name) for name in names)

    def part(self, rows: tuple[int, ...], recordings: tuple[str, ...]) -> "Matrix":
        """Some of its models on some of its recordings.

        Parameters
        ----------
        rows : tuple of int
        recordings : tuple of str

        Returns
        -------
        Matrix
        """
        columns = [self.recordings.index(name) for name in recordings]
        place = np.ix_(rows, columns)
        return Matrix(
            tuple(self.models[row] for row in rows),
            recordings,
            self.rmsd[place],
            self.covered[place],
            self.is_own[place],
        )


@dataclass(frozen=True)
class Iteration:
    """Coverage of every join that one level tried (T3.3.3.1-2 and its like).

    Parameters
    ----------
    level : int, [-]
        Recordings in a group.
    cells : dict of (str, str) to int
        Coverage by base and add-on, in the order of the table.
    n_groups : int, [-]
        Different groups among the cells.
    by_coverage : dict of int to int
        Number of groups of each coverage.
    n_kept : int, [-]
        Groups that the next level grew from.
    of : int, [-]
        Recordings that validated.
    """

    level: int
    cells: dict[tuple[str, str], int]
    n_groups: int
    by_coverage: dict[int, int]
    n_kept: int
    of: int


@dataclass(frozen=True, eq=False)
class Evidence:
    """Everything that the claims are judged on; None where there are no results.

    Parameters
    ----------
    self_rmsd : SelfRmsd or None
        T3.2.2-1.
    singles : Counts or None
        Of every model of a single recording, T3.2.2.2-2.
    widest : Matrix or None
        Widest model of each recording, T3.2.2.2-3.
    levels : Counts or None
        Best coverage of each level of the search for Combination Model 1.
    chain_tests : Matrix or None
        Its chain on recordings that nothing else has used, T3.3.3.4-1.
    growth_1, growth_2 : Counts or None
        Coverage along the chains of Combination Models 1 and 2, T3.4.1-1 and T3.4.2-1.
    chain_1, chain_2 : Matrix or None
        The two chains on all recordings, T3.4.1-2 to T3.4.2-1.
    machine : Matrix or None
        All models on all recordings, T3.4.3-1.
    chosen : Matrix or None
        The few models that serve all recordings, T3.4.3-2.
    """

    self_rmsd: SelfRmsd | None = None
    singles: Counts | None = None
    widest: Matrix | None = None
    levels: Counts | None = None
    chain_tests: Matrix | None = None
    growth_1: Counts | None = None
    growth_2: Counts | None = None
    chain_1: Matrix | None = None
    chain_2: Matrix | None = None
    machine: Matrix | None = None
    chosen: Matrix | None = None

    @property
    def machine_counts(self) -> Counts | None:
        """Recordings that each of all models covers, its own ones included."""
        return None if self.machine is None else self.machine.counts


def own_cells(models: tuple[str, ...], recordings: tuple[str, ...]) -> np.ndarray:
    """Which models were fitted to which recordings, told by their names.

    Parameters
    ----------
    models : tuple of str, length n
    recordings : tuple of str, length m

    Returns
    -------
    ndarray of bool, shape (n, m)
    """
    return np.array(
        [[name in model.split("+") for name in recordings] for model in models],
        dtype=bool,
    ).reshape(len(models), len(recordings))
