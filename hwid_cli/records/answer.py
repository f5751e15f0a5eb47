"""What a report answers first: which model to take, and how good it is where it was not fitted."""

from dataclasses import dataclass

import numpy as np

from hwid_cli.records.best_model import is_linear_preferred
from hwid_cli.records.groups import SpoiltJoin
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.order import OrderChoice


@dataclass(frozen=True)
class ChosenMaps:
    """Maps that ``hwid order`` has recommended, and the orders at which it compared them.

    Parameters
    ----------
    nb, nk : int, [-]
        Place in the order grid.
    input_units, output_units : int, [-]
        Sizes; 0 for kinds that have none.
    """

    nb: int
    nk: int
    input_map: str
    output_map: str
    input_units: int = 0
    output_units: int = 0

    @property
    def has_maps(self) -> bool:
        """Whether it is a nonlinear model."""
        return {self.input_map, self.output_map} != {"none"}


@dataclass(frozen=True, eq=False)
class ModelAnswer:
    """The model to take, beside a linear one, on recordings that it was not fitted to.

    Parameters
    ----------
    name : str
        ``step_06+step_09/3/7``.
    linear : HammersteinWiener or None
        The best linear output-error model of the same recordings and order grid; None where
        the model itself is linear or all linear fits failed.
    chosen_on : tuple of str
        Recordings that chose it among others; empty where its own fit did.
    recordings : tuple of str, length m
        Recordings of which its fit has seen nothing.
    is_unused : bool
        Whether nothing else has used them either.
    rmsd, linear_rmsd : ndarray, shape (m,), [unit]
        NaN where there is no such model or its output is not finite.
    fit_percent, linear_fit_percent : ndarray, shape (m,), [%]
    input_range : tuple of float, [input unit]
        What the input has visited in the fit.
    beyond : ndarray, shape (m,), [-]
        Share of the samples whose input lies outside of that by more than its noise.
    threshold : float, [unit]
        NaN where there is none.
    linear_name : str
        ``linear:step_06/2/4``; empty without a linear model.
    linear_ratio : float, [-]
        RMSD over the linear one's: geometric mean over all recordings that chose or judge;
        NaN where that is not known.
    advice : OrderChoice or None
        Recommended orders; None without a cross-validation.
    maps : ChosenMaps or None
        Recommended maps; None where nobody has compared any at the recommended orders.
    has_these_maps : bool
        Whether the model has the recommended maps.
    own_maps : tuple of (str, int)
        Kind and units of its maps where they were chosen for it alone; empty else.
    place : tuple of int, [-]
        Its place in the order grid.
    spoilt : SpoiltJoin or None
        The model of several recordings that was not taken, if a single one beats it.
    held : tuple of (str, float)
        Recordings that nothing has used, and the share of each that its band of 90 %
        holds, [-]; empty where there is no band.
    advised_rmsd : float, [unit]
        Mean over ``recordings`` of the model of the same recordings at the recommended
        orders; NaN where there is none.
    advised_name : str
        Of that model; empty where there is none.
    noise_rms : float, [unit]
        White noise of ``recordings``, from differences of high order; NaN without any.
    """

    name: str
    model: HammersteinWiener
    linear: HammersteinWiener | None
    own: tuple[str, ...]
    chosen_on: tuple[str, ...]
    recordings: tuple[str, ...]
    is_unused: bool
    rmsd: np.ndarray
    linear_rmsd: np.ndarray
    fit_percent: np.ndarray
    linear_fit_percent: np.ndarray
    input_range: tuple[float, float]
    beyond: np.ndarray
    unit: str
    threshold: float
    linear_name: str = ""
    linear_ratio: float = float("nan")
    advice: OrderChoice | None = None
    maps: ChosenMaps | None = None
    has_these_maps: bool = True
    own_maps: tuple[tuple[str, int], ...] = ()
    place: tuple[int, int] = (0, 0)
    spoilt: SpoiltJoin | None = None
    held: tuple[tuple[str, float], ...] = ()
    advised_rmsd: float = float("nan")
    advised_name: str = ""
    noise_rms: float = float("nan")

    @property
    def median_place(self) -> int:
        """Place of the recording whose fit is the median: one to show."""
        values = np.where(np.isfinite(self.fit_percent), self.fit_percent, -np.inf)
        return int(np.argsort(values)[values.size // 2])

    @property
    def mean_rmsd(self) -> float:
        """Mean over the recordings that the fit has not seen, [unit]; NaN without any."""
        return float(np.mean(self.rmsd)) if self.rmsd.size else np.nan

    @property
    def linear_mean_rmsd(self) -> float:
        """The same of the linear model, [unit]; NaN without one."""
        return float(np.mean(self.linear_rmsd)) if self.linear_rmsd.size else np.nan

    @property
    def is_linear_better(self) -> bool:
        """Whether the linear model is closer on recordings that the fit has not seen."""
        return is_linear_preferred(
            self.mean_rmsd, self.linear_mean_rmsd, self.rmsd.size, self.linear_ratio
        )

    @property
    def is_above_threshold(self) -> bool:
        """Whether its mean RMSD where it was not fitted is not accepted."""
        return bool(self.mean_rmsd >= self.threshold)

    @property
    def is_usable(self) -> bool:
        """Whether the better of both is no worse than the mean of these recordings."""
        values = self.linear_fit_percent if self.is_linear_better else self.fit_percent
        known = values[np.isfinite(values)]
        return not (known.size and np.median(known) < 0.0)
