"""Information criteria of a fit: how its error weighs against its parameters."""

from dataclasses import dataclass

_NAN = float("nan")


@dataclass(frozen=True)
class Information:
    """Criteria that weigh a fit's error against the number of its parameters.

    Only differences between models of the same recordings mean anything. They take the
    residuals for white; where these are not, they choose too many parameters.

    Parameters
    ----------
    n_samples : int, [samples]
        Of all recordings of the fit.
    n_parameters : int, [-]
        That the data determine: shared gains, a shared offset, outermost break-points and
        flat directions do not count, initial states do.
    aic, aicc, bic : float, [-]
        Criteria of Akaike, the same corrected for few samples, and of Schwarz. The lowest
        is the best; minus infinity where nothing is left of the residuals.
    fpe : float, [output unit squared]
        Variance of the error on new data of the same kind (Akaike's final prediction
        error), here of the free-run simulation.
    """

    n_samples: int = 0
    n_parameters: int = 0
    aic: float = _NAN
    aicc: float = _NAN
    bic: float = _NAN
    fpe: float = _NAN
