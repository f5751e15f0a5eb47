"""How far a fit's own parameters pull the correlations of its residuals.

Residuals of white noise e are ``(I - P) e`` with P the projection on the derivatives of
the simulated output by the parameters that the data determine.

References
----------
docs/method.md, eq. (30).
"""

import numpy as np
import scipy

from hwid_cli.model import static_map
from hwid_cli.model.linear_block import difference_basis, filtered
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.recordings import Recording

# Singular values of the scaled derivatives below this share of the largest are rounding.
_SINGULAR = 1e-7


def pull(
    model: HammersteinWiener,
    recording: Recording,
    n_lags: int,
    *,
    free_break_points: bool,
) -> np.ndarray:
    """Sums of the projection's diagonals, ``tr(P S_k)``.

    Parameters
    ----------
    model : HammersteinWiener
        Fitted to this recording alone.
    n_lags : int, [samples]
    free_break_points : bool
        Whether break-points were fitted.

    Returns
    -------
    ndarray, shape (n_lags + 1,), [-]
        For lags 0 (the number of parameters that the data determine) to ``n_lags``;
        zeros where the output map has no slope to tell by.

    References
    ----------
    docs/method.md, eq. (30).
    """
    if not static_map.RULES[model.output_map.kind].has_slope:
        return np.zeros(n_lags + 1)
    derivatives = output_derivatives(
        model, recording.input, free_break_points=free_break_points
    )
    size = np.linalg.norm(derivatives, axis=0)
    scaled = derivatives[:, size > 0.0] / size[size > 0.0]
    if not np.isfinite(scaled).all() or scaled.shape[1] == 0:
        return np.zeros(n_lags + 1)
    left, strength, _ = scipy.linalg.svd(scaled, full_matrices=False)
    basis = left[:, strength > _SINGULAR * strength[0]]
    n_samples = basis.shape[0]
    return np.array(
        [
            np.einsum("ti,ti->", basis[: n_samples - lag], basis[lag:])
            for lag in range(n_lags + 1)
        ]
    )


def output_derivatives(
    model: HammersteinWiener,
    input: np.ndarray,  # noqa: A002 - the field's word
    *,
    free_break_points: bool,
) -> np.ndarray:
    """Derivatives of a simulated output by all that a fit to one recording moves.

    Parameters
    ----------
    input : ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    ndarray, shape (n_samples, n_parameters)
        Output map, initial state, input map, B and F; those of the linear block for the
        coefficients of ``(1 - q^-1)^j``.

    References
    ----------
    docs/method.md, eqs. (11)-(14).
    """
    b, f = model.numerator, model.denominator
    steady = model.initial_state == "steady"
    w = static_map.evaluate(model.input_map, input)
    x = filtered(w, b, f, model.delay, steady=steady)
    pulse = np.zeros(input.size)
    pulse[0] = 1.0
    x = x + filtered(pulse, _state(model), f, 0)
    by_output_map, slope = _by_map(model.output_map, x, free_break_points)
    by_input_map, _ = _by_map(model.input_map, input, free_break_points)
    n_state = model.orders.n_state if model.initial_state == "estimated" else 0
    inner = [
        _delayed(pulse, f, 0, n_state, steady=False),
        *(
            filtered(column, b, f, model.delay, steady=steady)[:, None]
            for column in by_input_map.T
        ),
        _delayed(w, f, model.delay, b.size, steady=steady),
        _delayed(-x, f, 1, f.size - 1, steady=steady),
    ]
    return np.hstack([by_output_map, slope[:, None] * np.hstack(inner)])


def _state(model: HammersteinWiener) -> np.ndarray:
    """Coefficients of the free response; one zero where there is none."""
    return model.free_response if model.free_response.size else np.zeros(1)


def _by_map(
    one: static_map.StaticMap, argument: np.ndarray, free_break_points: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of a map by its active parameters, and its slope."""
    active = static_map.active_parameters(one, with_positions=free_break_points)
    out = np.zeros((argument.size, active.stop - active.start))
    _, slope = static_map.differentiate(
        one, argument, out, 0, with_positions=free_break_points
    )
    return out, slope


def _delayed(
    signal: np.ndarray, denominator: np.ndarray, first: int, count: int, *, steady: bool
) -> np.ndarray:
    """Columns ``q^-(first + j) signal / F`` as differences of rising order."""
    if count == 0:
        return np.zeros((signal.size, 0))
    one = np.ones(1)
    shifted = [
        filtered(signal, one, denominator, first + j, steady=steady)
        for j in range(count)
    ]
    return np.column_stack(shifted) @ difference_basis(count)
