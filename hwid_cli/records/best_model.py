"""The model to take, and how good it is on recordings that it has not seen."""

from dataclasses import dataclass
from math import isfinite

from hwid_cli.records.groups import SingleModels, SpoiltJoin

# In front of a model's name: the linear one of these orders and recordings.
LINEAR = "linear:"
# What judged a model, the strictest first: recordings that nothing has used; recordings
# that no group may hold; all but its own; its own, for want of others.
JUDGES = ("test", "unseen", "others", "own")
# Fewer recordings alone do not say that a linear model is better.
FEWEST_TO_REFUSE_MAPS = 3


def is_linear_preferred(
    rmsd: float, linear_rmsd: float, n_judges: int, ratio: float
) -> bool:
    """Whether a linear model is better than one with maps.

    It has to be closer on the recordings that judge and, where these are few, over all
    but those of the other fit: one step farther than all others says little of maps.

    Parameters
    ----------
    rmsd, linear_rmsd : float, [unit]
        Mean over the recordings that judge.
    ratio : float, [-]
        RMSD of the model with maps over the linear one's, over all recordings but those of
        its fit; NaN where that is not known.
    """
    if not isfinite(linear_rmsd) or rmsd <= linear_rmsd:
        return False
    return n_judges >= FEWEST_TO_REFUSE_MAPS or not ratio < 1.0


@dataclass(frozen=True)
class BestModel:
    """The model to take.

    Parameters
    ----------
    name : str
        ``step_06/3/7``; recordings of a group are joined with ``+``.
    judge : str
        One of ``JUDGES``: which recordings ``rmsd`` is of.
    judged_on : tuple of str
        Their names.
    rmsd, linear_rmsd : float, [unit]
        Mean over these recordings: of the model, and of the best linear output-error model
        of the same recordings and order grid; NaN where that is not known.
    unit : str
        Of the output.
    threshold : float, [unit]
        Largest RMSD that is accepted.
    chosen_on : tuple of str
        Recordings that chose it among others; empty where its own fit did.
    singles : SingleModels or None
        Of a group: models of single recordings on the same recordings; None where there
        is none.
    spoilt : SpoiltJoin or None
        The model of several recordings that was not taken, if a single one beats it.
    fit_percent, linear_fit_percent : float, [%]
        Medians over ``judged_on`` of the model and of the linear one; NaN where that is
        not known.
    linear_name : str
        Of that linear model, ``linear:step_06/2/4``; empty where there is none.
    linear_ratio : float, [-]
        RMSD over the linear one's: geometric mean over all recordings that chose or judge;
        NaN where that is not known.
    has_estimated_starts : bool
        Whether each simulation started from a state that its measured output told: a
        prediction has none.
    held : tuple of (str, float)
        Recordings that nothing has used, and the share of each that the model's band of
        90 % holds, [-]; empty where there is no band.
    own_maps : tuple of (str, int)
        Kind and units of its maps, input and output, where it was given others than the
        configuration's; empty else. No units where a kind has none.
    """

    name: str
    judge: str
    judged_on: tuple[str, ...]
    rmsd: float
    unit: str
    threshold: float
    chosen_on: tuple[str, ...] = ()
    linear_rmsd: float = float("nan")
    singles: SingleModels | None = None
    spoilt: SpoiltJoin | None = None
    fit_percent: float = float("nan")
    linear_fit_percent: float = float("nan")
    linear_name: str = ""
    linear_ratio: float = float("nan")
    has_estimated_starts: bool = False
    held: tuple[tuple[str, float], ...] = ()
    own_maps: tuple[tuple[str, int], ...] = ()

    def __post_init__(self) -> None:
        if self.judge not in JUDGES:
            raise ValueError(f"judge {self.judge!r} is none of {', '.join(JUDGES)}")

    @property
    def is_accepted(self) -> bool:
        """Whether its mean RMSD lies below the threshold."""
        return self.rmsd < self.threshold

    @property
    def place(self) -> tuple[int, int]:
        """Its place in the order grid, [-]."""
        _, nb, nk = self.name.rsplit("/", 2)
        return int(nb), int(nk)

    @property
    def is_linear_better(self) -> bool:
        """Whether the linear model is closer on recordings that the fit has not seen."""
        if self.judge == "own":
            return False
        return is_linear_preferred(
            self.rmsd, self.linear_rmsd, len(self.judged_on), self.linear_ratio
        )

    @property
    def taken_name(self) -> str:
        """Name of the better of both."""
        return self.linear_name if self.is_linear_better else self.name

    @property
    def is_usable(self) -> bool:
        """Whether the better of both is no worse than the mean of these recordings."""
        fit = self.linear_fit_percent if self.is_linear_better else self.fit_percent
        return not fit < 0.0
