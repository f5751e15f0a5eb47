"""Which orders and maps to take, and what speaks for them."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class ResponseEstimate:
    """What a linear model of high order says about a recording, whatever the grid.

    Parameters
    ----------
    delay : int, [samples]
        Largest delay that the recording does not contradict; -1 where the output does not
        answer the input at all.
    hankel : ndarray, shape (n,), [-]
        Singular values of the impulse response's Hankel matrix, the first one 1; empty
        where the response does not decay.
    n_poles : int, [-]
        Singular values before their deepest fall; 0 where the response does not decay.
    """

    recording: str
    delay: int
    hankel: np.ndarray
    n_poles: int


@dataclass(frozen=True)
class SelectionEvidence:
    """How the smallest good candidate compares with the best one.

    Parameters
    ----------
    rmsd, best_rmsd : float, [output unit]
        Cross-validated: geometric mean over the pairs of model and validation recording.
    factor : float, [-]
        By how much the smallest good candidate is worse than the best one, on average.
    standard_error : float, [-]
        Of that factor, from its spread over the validation recordings; NaN with one.
    n_validation : int, [-]
        Validation recordings; 0 where only the own one is there.
    n_unexcited : int, [-]
        Pairs of model and recording that do not count, because most of the recording's
        input is beyond what the model has seen.
    n_outliers : int, [samples]
        Of the validation recordings, that do not count because the fits bear outliers too.
    output_spread : float, [output unit]
        Standard deviation of the validation recordings' outputs, geometric mean as of the
        RMSD; infinite in results of versions before it was looked at.
    """

    rmsd: float
    best_rmsd: float
    factor: float
    standard_error: float
    n_validation: int
    n_unexcited: int = 0
    n_outliers: int = 0
    output_spread: float = float("inf")

    @property
    def predicts(self) -> bool:
        """Whether the best candidate says more of other recordings than their mean does."""
        return self.best_rmsd < self.output_spread


@dataclass(frozen=True)
class OrderChoice:
    """The smallest orders of a grid that are as good as its best, and other opinions.

    Parameters
    ----------
    recording : str
        Whose models; empty for those of all recordings together.
    nb, nk : int, [-]
        The recommended place in the grid.
    best_nb, best_nk : int, [-]
        The place of the lowest cross-validated RMSD.
    aic_nb, aic_nk, bic_nb, bic_nk : int, [-]
        What AIC and BIC of the fits choose; 0 where no fit has them.
    """

    recording: str
    nb: int
    nk: int
    best_nb: int
    best_nk: int
    evidence: SelectionEvidence
    aic_nb: int
    aic_nk: int
    bic_nb: int
    bic_nk: int


@dataclass(frozen=True, eq=False)
class OrderAdvice:
    """Recommended orders, over all recordings and for each.

    Parameters
    ----------
    choices : tuple of OrderChoice
        One for each recording that has models.
    responses : tuple of ResponseEstimate
        One for each recording that was identified.
    delay : int, [samples]
        A quarter of the recordings contradict any longer one; -1 where none shows a delay.
    n_poles : int, [-]
        Median over the recordings; 0 where none shows it.
    tolerance : float, [-]
        Share by which smaller orders may be worse than the best ones.
    nb, nk : tuple of int
        The grid.
    nk_role : str
        ``poles`` or ``delay``.
    nf : int or None, [-]
        Number of poles where ``nk`` is the delay.
    unit : str
        Of the output.
    tried_delays : tuple of int, [samples]
        Delays of which every fit takes the best; empty where the grid says the delay.
    further_delays : tuple of int, [samples]
        For ``fit.delays``, where recordings allow a longer one than the grid reaches, and
        models that may take it are better; empty elsewhere.
    """

    overall: OrderChoice
    choices: tuple[OrderChoice, ...]
    responses: tuple[ResponseEstimate, ...]
    delay: int
    n_poles: int
    tolerance: float
    nb: tuple[int, ...]
    nk: tuple[int, ...]
    nk_role: str
    nf: int | None
    unit: str
    tried_delays: tuple[int, ...] = ()
    further_delays: tuple[int, ...] = ()


@dataclass(frozen=True)
class MapCandidate:
    """A pair of maps, and how its models predict.

    Parameters
    ----------
    input_map, output_map : str
        One of ``MAP_KINDS``.
    input_units, output_units : int, [-]
        Size of the maps; 0 for kinds that have none.
    n_parameters : int, [-]
        That the data determine; the most over the recordings, 0 where no fit has them.
    rmsd : float, [output unit]
        Cross-validated, as in ``SelectionEvidence``.
    factor : float, [-]
        Average over the validation recordings of RMSD over that of the best pair of maps.
    bic : float, [-]
        Sum over the fits of all recordings; infinite where one has none.
    """

    input_map: str
    input_units: int
    output_map: str
    output_units: int
    n_parameters: int
    rmsd: float
    factor: float
    bic: float


@dataclass(frozen=True)
class MapAdvice:
    """Recommended maps and their sizes, for models of all recordings with given orders.

    Parameters
    ----------
    orders : tuple of int, [-]
        nb, nf, nk of all models.
    candidates : tuple of MapCandidate
        The best first.
    chosen : MapCandidate
        The one to take.
    given : MapCandidate
        That of the configuration.
    evidence : SelectionEvidence
        The one to take against the best; without validation recordings, BIC has chosen.
    tolerance : float, [-]
    unit : str
        Of the output.
    """

    orders: tuple[int, int, int]
    candidates: tuple[MapCandidate, ...]
    chosen: MapCandidate
    given: MapCandidate
    evidence: SelectionEvidence
    tolerance: float
    unit: str
