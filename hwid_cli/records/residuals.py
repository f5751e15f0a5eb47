"""What the residuals of a fit still contain: correlations, their bands, and verdicts."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Correlation:
    """A correlation over lags, and how large it may be by chance.

    Parameters
    ----------
    lags : ndarray of int, shape (n,), [samples]
        Of the residual behind the other signal.
    values : ndarray, shape (n,), [-]
    band : ndarray, shape (n,), [-]
        95 % of values without any correlation lie within plus and minus this, lag by lag.
    common_band : ndarray, shape (n,), [-]
        In 95 % of cases without any correlation all values lie within this.
    p_value : float, [-]
        Probability of values as large without any correlation; negative lags do not count.
        NaN where there is no such test.
    last_lag : int, [samples]
        Largest lag, not negative, with a value beyond ``common_band``; -1 for none.
    """

    lags: np.ndarray
    values: np.ndarray
    band: np.ndarray
    common_band: np.ndarray
    p_value: float
    last_lag: int


@dataclass(frozen=True, eq=False)
class ResidualTests:
    """Tests of the residuals of a model's free-run simulation on one recording.

    Parameters
    ----------
    with_itself : Correlation
        Of the residual, from lag 1; ``p_value`` is that of Ljung and Box.
    with_input : Correlation
        With the whitened input.
    with_square : Correlation
        With what the squared input has beyond the input itself, whitened; without lags
        where the input has two levels, whose square says nothing new.
    ljung_box : float, [-]
        Statistic of Ljung and Box.
    is_white : bool
        Whether ``with_itself`` is no larger than chance allows (5 %).
    follows_input, follows_square : bool
        Whether the residual depends on the input, or on its square, at the same or a
        later time (5 %).
    leads_input : bool
        Whether the input follows the residual, as it does in a closed loop (5 %).
    """

    with_itself: Correlation
    with_input: Correlation
    with_square: Correlation
    ljung_box: float
    is_white: bool
    follows_input: bool
    follows_square: bool
    leads_input: bool


@dataclass(frozen=True, eq=False)
class ModelResiduals:
    """What is left of a recording after the best of its own models.

    Parameters
    ----------
    model : str
        ``step_06/3/7``.
    flat : tuple of str
        As in ``Uncertainty``.
    rmsd : float, [unit]
    unit : str
        Of the output.
    """

    model: str
    tests: ResidualTests
    flat: tuple[str, ...]
    recording: str
    rmsd: float
    unit: str
