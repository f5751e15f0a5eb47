"""Information criteria of a free-run (output-error) fit with Gaussian residuals.

With residuals that are white and Gaussian, -2 log of the likelihood at its maximum is
N (log(2 pi V) + 1), V = SSE / N. Every criterion adds a price for the parameters. The
variance of the residuals is no parameter, as in Ljung's book and in common toolboxes.

References
----------
docs/method.md, eqs. (24)-(27). Akaike, IEEE Trans. Automatic Control 19 (1974), p. 716.
Schwarz, Annals of Statistics 6 (1978), p. 461. Ljung (1999), sections 7.4 and 16.4.
"""

import math

from hwid_cli.records.model import Information


def information(squared_error: float, n_samples: int, n_parameters: int) -> Information:
    """Weigh the error of a fit against the number of its parameters.

    Parameters
    ----------
    squared_error : float, [output unit squared]
        Sum of the squared residuals.
    n_samples : int, [samples]
    n_parameters : int, [-]
        That the data determine, initial states included.

    Returns
    -------
    Information
        NaN where there are not more samples than parameters.

    References
    ----------
    docs/method.md, eqs. (24)-(27).

    Examples
    --------
    >>> found = information(100.0, 100, 4)
    >>> round(found.aic - 100 * (math.log(2 * math.pi) + 1), 9), round(found.fpe, 4)
    (8.0, 1.0833)
    """
    freedom = n_samples - n_parameters
    if freedom <= 0 or not math.isfinite(squared_error):
        return Information(n_samples, n_parameters)
    variance = squared_error / n_samples
    misfit = -math.inf
    if variance > 0.0:
        misfit = n_samples * (math.log(2.0 * math.pi * variance) + 1.0)
    aic = misfit + 2.0 * n_parameters
    correction = 2.0 * n_parameters * (n_parameters + 1)
    return Information(
        n_samples,
        n_parameters,
        aic=aic,
        aicc=aic + correction / (freedom - 1) if freedom > 1 else math.nan,
        bic=misfit + n_parameters * math.log(n_samples),
        fpe=variance * (n_samples + n_parameters) / freedom,
    )
