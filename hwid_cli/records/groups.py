"""Results of the search for groups of recordings, and of the final test."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from hwid_cli.records.model import Fit
from hwid_cli.records.rules import ArrayOf, Distances
from hwid_cli.records.shown import Shown
from hwid_cli.records.stored import ADDED_LATER
from hwid_cli.records.trust import TrustOnTests


def _require_names(
    what: str, names: Sequence[str], known: Collection[str], count: int | None = None
) -> None:
    """Raise ValueError unless all names are known, and there are as many as there must."""
    if count is not None and len(names) != count:
        raise ValueError(f"{what} must be {count} names, got {len(names)}")
    for name in names:
        if name not in known:
            raise ValueError(
                f"{what}: {name!r} is none of {', '.join(known) or 'none'}"
            )


@dataclass(frozen=True)
class Join:
    """One group that the search tried: what was added to what.

    Parameters
    ----------
    level : int, [-]
        Recordings in the group.
    base : str
        Name of the group that grew; on the first level the recording itself.
    add_on : str
        Recording that joined it; empty on the first level.
    group : str
        Name of the result. With ``join: experiments`` several joins give one group.
    """

    level: int
    base: str
    add_on: str
    group: str


@dataclass(frozen=True)
class Group:
    """Recordings that share their models, and how the best of these did.

    Parameters
    ----------
    recordings : tuple of str
        In the order in which they are joined.
    coverage : int, [-]
        Validation recordings that its best model covers; 0 where no model is left.
        The best model is the widest; of equally wide ones that of the lowest
        ``validation_rmsd``.
    nb, nk : int, [-]
        Place of the best model in the order grid; 0 where no model is left.
    rmsd : float, [output unit]
        Of the best model on the group's own recordings; NaN where none is left.
    validation_rmsd : float, [output unit]
        Of the best model over all validation recordings; breaks ties of the coverage.
    n_models : int, [-]
        Models that were fitted.
    n_self_passed : int, [-]
        Of these, models below the threshold on the group's own recordings.
    n_cross_passed : int, [-]
        Of these, models that cover at least one validation recording.
    is_kept : bool
        Whether the next level grows from it.
    unseen_coverage : int, [-]
        Of the validation recordings that no group may hold, those that its best model
        covers; 0 where there are none.
    unseen_rmsd : float, [output unit]
        Of the best model over these; NaN where there are none.
    """

    recordings: tuple[str, ...]
    coverage: int
    nb: int
    nk: int
    rmsd: float
    validation_rmsd: float
    n_models: int
    n_self_passed: int
    n_cross_passed: int
    is_kept: bool
    unseen_coverage: int = field(default=0, metadata=ADDED_LATER)
    unseen_rmsd: float = field(default=float("nan"), metadata=ADDED_LATER)

    @property
    def name(self) -> str:
        """Name of the group, ``step_06+step_09``."""
        return "+".join(self.recordings)

    @property
    def level(self) -> int:
        """Number of recordings."""
        return len(self.recordings)

    @property
    def model_name(self) -> str:
        """Name of its best model, ``step_06+step_09/3/7``; empty where none is left."""
        return f"{self.name}/{self.nb}/{self.nk}" if self.nb else ""


@dataclass(frozen=True, eq=False, repr=False)
class GroupSearch(Shown):
    """A whole search: every group, level by level, and the winner.

    Parameters
    ----------
    groups : tuple of Group
        Level by level; on each in the order in which they were tried.
    joins : tuple of Join
        In the order in which they were tried.
    fits : tuple of Fit or None
        The best model's fit of each group, in the order of ``groups``.
    rmsd : ndarray, shape (n_groups, m), [unit]
        Of the best models on the validation recordings; NaN where no model is left.
    chain : tuple of str
        Names of groups: what the winner grew from, level by level, and the winner.
    reason : str
        Why the search stopped, for people.
    join : str
        How recordings were joined; one of ``model.JOINS``.
    unit : str
        Unit of the output.
    threshold : float, [unit]
    """

    groups: tuple[Group, ...]
    joins: tuple[Join, ...]
    fits: tuple[Fit | None, ...]
    validated_on: tuple[str, ...]
    rmsd: Annotated[np.ndarray, Distances()]
    chain: tuple[str, ...]
    reason: str
    join: str
    unit: str
    threshold: float

    def __post_init__(self) -> None:
        shape = (len(self.groups), len(self.validated_on))
        if self.rmsd.shape != shape or len(self.fits) != len(self.groups):
            raise ValueError(
                f"rmsd {self.rmsd.shape} must have shape {shape}, and every group a fit"
            )

    def check_stored(self) -> None:
        """Refuse names that none of the groups has.

        Raises
        ------
        ValueError
        """
        names = {group.name: None for group in self.groups}
        _require_names("chain", self.chain, names)
        _require_names("joins/group", [one.group for one in self.joins], names)
        for one in self.joins:
            if one.level > 1:
                _require_names("joins/base", [one.base], names)

    @property
    def chain_groups(self) -> tuple[Group, ...]:
        """The chain's groups, the winner last."""
        by_name = {group.name: group for group in self.groups}
        return tuple(by_name[name] for name in self.chain)

    @property
    def levels(self) -> tuple[int, ...]:
        """Levels that were searched."""
        return tuple(sorted({group.level for group in self.groups}))

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Name and what there is of it."""
        return (
            ("groups", str(len(self.groups))),
            ("levels", str(len(self.levels))),
            ("chain", " -> ".join(self.chain) or "none"),
            ("stopped because", self.reason),
        )


@dataclass(frozen=True)
class Prediction:
    """Which model to use for a recording, told from its input alone.

    Parameters
    ----------
    nearest : str
        The other recording whose input is most like its own.
    distance : float, [-]
        Between the two inputs; 0 for equal ones.
    model : str
        The model that serves ``nearest``.
    rmsd : float, [output unit]
        Of that model on ``recording``.
    best_model : str
        The model that would have served best.
    best_rmsd : float, [output unit]
    is_right : bool
        Whether the chosen model covers the recording.
    is_possible : bool
        Whether any model to choose from covers it.
    """

    recording: str
    nearest: str
    distance: float
    model: str
    rmsd: float
    best_model: str
    best_rmsd: float
    is_right: bool
    is_possible: bool


@dataclass(frozen=True, eq=False, repr=False)
class FinalTest(Shown):
    """Models of single recordings and of the chain of groups on all recordings.

    Parameters
    ----------
    models : tuple of str, length n
        ``step_06/3/7``: the widest model of each single recording, then the chain.
    chain : tuple of str
        The last of ``models``: those of the chain, level by level.
    recordings : tuple of str, length m
        All of them.
    tested_on : tuple of str
        Recordings that nothing else has used.
    rmsd : ndarray, shape (n, m), [unit]
        NaN where a model's output is not finite.
    is_own : ndarray of bool, shape (n, m)
        Whether the model was fitted to the recording.
    covers : ndarray of int, shape (n,), [-]
        Recordings below the threshold, a model's own left out.
    covered_by : ndarray of int, shape (m,), [-]
        Models below the threshold, those of the recording itself left out.
    uncovered : tuple of str
        Recordings that no model covers, not even their own.
    hard_to_cover : tuple of str
        Recordings that hardly any model of another recording covers.
    assigned : tuple of str, length m
        Model of lowest RMSD for each recording.
    smallest_set : tuple of str
        Fewest models that together cover whatever any model covers.
    assigned_in_set : tuple of str, length m
        Model of ``smallest_set`` of lowest RMSD for each recording.
    predictions : tuple of Prediction
        One for each recording.
    unit : str
        Unit of the output.
    threshold : float, [unit]
    trust : TrustOnTests
        How far the chain and ``smallest_set`` may be trusted on ``tested_on``.
    """

    models: tuple[str, ...]
    chain: tuple[str, ...]
    recordings: tuple[str, ...]
    tested_on: tuple[str, ...]
    rmsd: Annotated[np.ndarray, Distances()]
    is_own: Annotated[np.ndarray, ArrayOf("b", "truth values")]
    covers: Annotated[np.ndarray, ArrayOf("iu", "integers")]
    covered_by: Annotated[np.ndarray, ArrayOf("iu", "integers")]
    uncovered: tuple[str, ...]
    hard_to_cover: tuple[str, ...]
    assigned: tuple[str, ...]
    smallest_set: tuple[str, ...]
    assigned_in_set: tuple[str, ...]
    predictions: tuple[Prediction, ...]
    unit: str
    threshold: float
    trust: TrustOnTests = field(default_factory=TrustOnTests, metadata=ADDED_LATER)

    def __post_init__(self) -> None:
        shape = (len(self.models), len(self.recordings))
        if self.rmsd.shape != shape or self.is_own.shape != shape:
            raise ValueError(
                f"rmsd {self.rmsd.shape} and is_own {self.is_own.shape} must have "
                f"shape {shape}"
            )

    def check_stored(self) -> None:
        """Refuse counts of another length, and names that no model or recording has.

        Raises
        ------
        ValueError
        """
        shape = self.rmsd.shape
        if (self.covers.shape, self.covered_by.shape) != (shape[:1], shape[1:]):
            raise ValueError(
                f"covers {self.covers.shape} and covered_by {self.covered_by.shape} must "
                f"have shapes {shape[:1]} and {shape[1:]}"
            )
        count = len(self.recordings)
        for what in ("tested_on", "uncovered", "hard_to_cover"):
            _require_names(what, getattr(self, what), self.recordings)
        for what in ("chain", "smallest_set"):
            _require_names(what, getattr(self, what), self.models)
        # Empty where there is no model.
        _require_names("assigned", self.assigned, ("", *self.models), count)
        in_set = ("", *self.smallest_set)
        _require_names("assigned_in_set", self.assigned_in_set, in_set, count)
        predicted = [one.recording for one in self.predictions]
        _require_names("predictions/recording", predicted, self.recordings, count)

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Name and what there is of it."""
        return (
            ("models", str(len(self.models))),
            ("on recordings", str(len(self.recordings))),
            ("never used", str(len(self.tested_on))),
            ("threshold", f"{self.threshold:g} {self.unit}"),
        )


@dataclass(frozen=True)
class SingleModels:
    """Models of single recordings that stand beside one of several, on test recordings.

    Parameters
    ----------
    chosen : str
        Chosen as the group is, without a look at the test recordings.
    nearest : str
        The one that comes closest there; only these recordings could choose it.
    chosen_rmsd, nearest_rmsd : float, [output unit]
        Means over the test recordings.
    """

    chosen: str
    chosen_rmsd: float
    nearest: str
    nearest_rmsd: float


@dataclass(frozen=True)
class SpoiltJoin:
    """A model of several recordings that one of a single recording beats on their own.

    Parameters
    ----------
    model : str
        The joined one.
    rmsd, single_rmsd : float, [output unit]
        Geometric means over the joined one's own recordings that the single one has not
        seen.
    suspect : str
        Recording that no model of another one predicts and whose model predicts no other
        one; empty where none stands out.
    """

    model: str
    rmsd: float
    single_rmsd: float
    suspect: str = ""


@dataclass(frozen=True, eq=False)
class ChainTrend:
    """What happens along the chain of groups.

    Parameters
    ----------
    models : tuple of str, length n
        Those of the chain, level by level.
    tested_rmsd : tuple of float, length n, [output unit]
        Mean RMSD over the test recordings; NaN where one is missing.
    kinds : tuple of str, length k
        Kinds of recordings, in the order of the recordings.
    coverage : ndarray of int, shape (n, k), [-]
        Recordings of each kind below the threshold, a model's own ones included.
    singles : SingleModels or None
        Models of single recordings on the test recordings; None where there is none.
    """

    models: tuple[str, ...]
    tested_rmsd: tuple[float, ...]
    kinds: tuple[str, ...]
    coverage: np.ndarray
    singles: SingleModels | None = None

    @property
    def total(self) -> tuple[int, ...]:
        """Recordings of all kinds that each of the chain's models covers."""
        return tuple(self.coverage.sum(axis=1).tolist())
