"""Free-run simulation of a Hammerstein-Wiener model.

References
----------
docs/method.md, eqs. (1)-(7).
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.model.linear_block import (
    difference_basis,
    difference_columns,
    filtered,
    free_response,
    padded_signal,
)
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording

_ESTIMATE_ITERATIONS = 8
_MOST_HALVINGS = 8
# Damping of the initial state's equations against directions that the output does not
# show, and the share of the cost that an iteration must gain.
_DAMPING = 1e-9
# Share of its largest value below which an impulse response has died away.
_DIED_AWAY = 1e-9
# Share of a record in which it is looked for first, and the share of this that it may
# take: what is silent for so long stays silent.
_SHORT, _SILENT = 4, 0.75
_LEAST_GAIN = 1e-6


def simulate(
    model: HammersteinWiener,
    input: np.ndarray,  # noqa: A002 - the field's word
    *,
    initial_state: np.ndarray | Literal["steady", "estimated"] | None = None,
    output: np.ndarray | None = None,
) -> np.ndarray:
    """Output of a model for an input: a free run, which sees no measured output.

    Parameters
    ----------
    input : ndarray, shape (n_samples,), [input unit]
    initial_state : ndarray, shape (n_state,), "steady" or "estimated", optional, [x]
        Coefficients of the free response to start with, equilibrium with the first
        input, or the state with which the model comes closest to ``output``. Unless
        given, a model fitted with an estimated initial state starts like the first
        recording of its fit. Zeros are an empty linear block, which is no rest where the
        input map is not zero at rest.
    output : ndarray, shape (n_samples,), optional, [output unit]
        What was measured; needed, and used, to estimate the initial state only.

    Returns
    -------
    ndarray, shape (n_samples,), [output unit]

    Raises
    ------
    TypeError
        If a ``Fit`` is given for its model.
    ValueError
        If the input is not a 1-D array of at least one sample, the initial state is
        another word, or there is no output of the same length to estimate it from.

    References
    ----------
    docs/method.md, eqs. (1)-(7).

    Examples
    --------
    >>> from hwid_cli.records.model import StaticMap
    >>> none = StaticMap("none", np.zeros(0))
    >>> model = HammersteinWiener(none, [0.5], [1.0, -0.5], 1, none, 1e-3)
    >>> simulate(model, np.ones(3))
    array([0.  , 0.5 , 0.75])
    >>> simulate(model, np.ones(3), initial_state="steady")
    array([1., 1., 1.])
    """
    if isinstance(model, Fit):
        raise TypeError("simulate takes a model: give result.model")
    # Once for all the evaluations below.
    model = outlined_model(model)
    signal = np.ascontiguousarray(input, dtype=float)
    if signal.ndim != 1 or signal.size == 0:
        raise ValueError(f"input must be a 1-D array with samples, got {signal.shape}")
    with np.errstate(over="ignore", invalid="ignore"):
        if isinstance(initial_state, str):
            model, coefficients = _started(model, signal, initial_state, output)
        elif initial_state is None:
            coefficients = model.free_response
        else:
            coefficients = initial_state
        return static_map.evaluate_repeatably(
            model.output_map,
            _forced(model, signal) + _free(model, coefficients, signal),
        )


def _started(
    model: HammersteinWiener,
    signal: np.ndarray,
    word: str,
    output: np.ndarray | None,
) -> tuple[HammersteinWiener, np.ndarray]:
    """Model of another rule, and the free response that it begins with."""
    if word == "steady":
        return replace(model, initial_state="steady"), np.zeros(0)
    if word != "estimated":
        raise ValueError(
            f'initial_state must be an array, "steady" or "estimated", got {word!r}'
        )
    if output is None or np.shape(output) != signal.shape:
        raise ValueError(
            'initial_state "estimated" needs output, the measured one, of '
            f"{signal.size} samples"
        )
    model = replace(model, initial_state="estimated")
    measured = np.asarray(output, dtype=float)
    return model, _state_from(model, _forced(model, signal), measured)[0]


def validation_output(model: HammersteinWiener, recording: Recording) -> np.ndarray:
    """Output of a model for a recording, started by the model's own rule.

    Parameters
    ----------
    model : HammersteinWiener
        With ``estimated``, the initial state, and nothing else, is fitted to this
        recording first.

    Returns
    -------
    ndarray, shape (n_samples,), [output unit]
        Not finite where the model diverges.
    """
    if model.initial_state != "estimated":
        return simulate(model, recording.input, initial_state=np.zeros(0))
    model = outlined_model(model)
    with np.errstate(over="ignore", invalid="ignore"):
        x = _forced(model, np.ascontiguousarray(recording.input))
        state, lasts = _state_from(model, x, recording.output)
        # After twice the time that its responses last it is below the rounding of x.
        n = min(2 * lasts, x.size)
        x[:n] += free_response(state, model.denominator, n)
        return static_map.evaluate(model.output_map, x)


def estimated_state(model: HammersteinWiener, recording: Recording) -> np.ndarray:
    """Initial state with which a model comes closest to a recording.

    Gauss-Newton steps on the coefficients of the free response, each halved until it
    lowers the deviation. They begin at zero or at the state of the fit, whichever is
    closer, so that a model never does worse on its own recording than in its fit.

    Returns
    -------
    ndarray, shape (n_state,), [x]

    References
    ----------
    docs/method.md, eq. (7).
    """
    model = outlined_model(model)
    forced = _forced(model, np.ascontiguousarray(recording.input))
    return _state_from(model, forced, recording.output)[0]


def _state_from(
    model: HammersteinWiener, forced: np.ndarray, output: np.ndarray
) -> tuple[np.ndarray, int]:
    """The same from the output of an empty linear block, and for how long it counts."""
    best = np.zeros(model.orders.n_state)
    if best.size == 0 or not np.isfinite(forced).all():
        return best, 0
    responses = _free_responses(model, forced.size)
    # Where the free responses have died away, the initial state changes nothing.
    n = responses.shape[0]
    forced_head, measured = forced[:n], output[:n]
    basis = difference_basis(best.size)

    def compared(coefficients: np.ndarray) -> tuple[float, np.ndarray]:
        # The basis is its own inverse.
        x = forced_head + responses @ (basis @ coefficients)
        residual = measured - static_map.evaluate(model.output_map, x)
        return float(residual @ residual), x

    cost, x = compared(best)
    if model.free_response.size == best.size:
        of_fit, x_of_fit = compared(model.free_response)
        if of_fit < cost:
            best, cost, x = model.free_response, of_fit, x_of_fit
    for _ in range(_ESTIMATE_ITERATIONS):
        step, promised = _state_step(model, x, measured, responses)
        if promised < _LEAST_GAIN * cost:
            break
        step = basis @ step
        tried = (best + 0.5**halvings * step for halvings in range(_MOST_HALVINGS))
        better = ((one, *compared(one)) for one in tried)
        found = next((each for each in better if each[1] < cost), None)
        if found is None:
            break
        gain = cost - found[1]
        best, cost, x = found
        # What was promised has come where the output map is straight: nothing is left.
        if min(gain, abs(promised - gain)) < _LEAST_GAIN * cost:
            break
    return best, n


def _free_responses(model: HammersteinWiener, n_samples: int) -> np.ndarray:
    """Differences of the impulse response of 1/F, shape (n, n_state), while they last."""
    n_state = model.orders.n_state
    short = max(1, n_samples // _SHORT)
    impulse, n = _lasting_impulse(model.denominator, short)
    if n > _SILENT * short:
        impulse, n = _lasting_impulse(model.denominator, n_samples)
    n = min(n_samples, n + n_state)
    columns = np.empty((n, n_state))
    padded = padded_signal(impulse[:n], n_state + 1, 0.0)
    difference_columns(padded, n_state + 1, 0, np.ones(n), 0, n_state, columns)
    return columns


def _lasting_impulse(denominator: np.ndarray, n: int) -> tuple[np.ndarray, int]:
    """Impulse response of 1/F, and how many samples pass until it has died away."""
    impulse = free_response(np.ones(1), denominator, n)
    size = np.abs(impulse)
    lasting = np.flatnonzero(size > _DIED_AWAY * size.max(initial=0.0))
    return impulse, int(lasting[-1]) + 1 if lasting.size else n


def _state_step(
    model: HammersteinWiener, x: np.ndarray, output: np.ndarray, responses: np.ndarray
) -> tuple[np.ndarray, float]:
    """Gauss-Newton step of the free response, in the basis of differences, and its gain.

    The gain is what the sum of squares would lose if the output map were straight.
    """
    found = static_map.derivatives(model.output_map, x, with_positions=False)
    jacobian = found.slope[:, None] * responses
    matrix, vector = jacobian.T @ jacobian, jacobian.T @ (output - found.value)
    scale = np.sqrt(matrix.diagonal())
    scale[scale == 0.0] = 1.0
    matrix /= scale
    matrix /= scale[:, None]
    matrix.flat[:: scale.size + 1] += _DAMPING
    step = np.linalg.solve(matrix, vector / scale) / scale
    return step, float(step @ vector)


def _forced(model: HammersteinWiener, signal: np.ndarray) -> np.ndarray:
    return filtered(
        static_map.evaluate_repeatably(model.input_map, signal),
        model.numerator,
        model.denominator,
        model.delay,
        steady=model.initial_state == "steady",
    )


def _free(
    model: HammersteinWiener, coefficients: np.ndarray, like: np.ndarray
) -> np.ndarray:
    return free_response(np.asarray(coefficients), model.denominator, like.size)
