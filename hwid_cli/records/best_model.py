"""The model to take, and how good it is on recordings that it has not seen."""

from dataclasses import dataclass
from math import isfinite

# In front of a model's name: the linear one of these orders and recordings.
LINEAR = "linear:"
# What judged a model, the strictest first: recordings that nothing has used; recordings
# that no group may hold; all but its own; its own, for want of others.
JUDGES = ("test", "unseen", "others", "own")


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
    single : str
        Of a group: the best model of a single recording, told without ``judged_on``;
        empty where there is none.
    single_rmsd : float, [unit]
        Its mean over the same recordings.
    fit_percent, linear_fit_percent : float, [%]
        Medians over ``judged_on`` of the model and of the linear one; NaN where that is
        not known.
    linear_name : str
        Of that linear model, ``linear:step_06/2/4``; empty where there is none.
    has_estimated_starts : bool
        Whether each simulation started from a state that its measured output told: a
        prediction has none.
    """

    name: str
    judge: str
    judged_on: tuple[str, ...]
    rmsd: float
    unit: str
    threshold: float
    chosen_on: tuple[str, ...] = ()
    linear_rmsd: float = float("nan")
    single: str = ""
    single_rmsd: float = float("nan")
    fit_percent: float = float("nan")
    linear_fit_percent: float = float("nan")
    linear_name: str = ""
    has_estimated_starts: bool = False

    def __post_init__(self) -> None:
        if self.judge not in JUDGES:
            raise ValueError(f"judge {self.judge!r} is none of {', '.join(JUDGES)}")

    @property
    def is_accepted(self) -> bool:
        """Whether its mean RMSD lies below the threshold."""
        return self.rmsd < self.threshold

    @property
    def is_linear_better(self) -> bool:
        """Whether the linear model is closer on recordings that the fit has not seen."""
        if self.judge == "own" or not isfinite(self.linear_rmsd):
            return False
        return not self.rmsd <= self.linear_rmsd

    @property
    def is_usable(self) -> bool:
        """Whether the better of both is no worse than the mean of these recordings."""
        fit = self.linear_fit_percent if self.is_linear_better else self.fit_percent
        return not fit < 0.0
