"""The one place where the gain shared by the three blocks is fixed.

``f -> a f, B -> B / a`` and ``B -> b B, g(x) -> g(x / b)`` leave the output as it is.
Here the input map gets the mean slope one and does not fall from one end of its domain
to the other, so that w is in the input's unit; the linear block gets the static gain one
where the output map can take up its gain. Maps without a free gain leave theirs in B.

References
----------
docs/method.md, eq. (15).
"""

from dataclasses import replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.linear_block import static_gain
from hwid_cli.model.static_map import RULES
from hwid_cli.records.model import HammersteinWiener

# A block whose static gain is below this share of its largest gain is a differentiator, and
# one whose other gains are all below it an integrator, whose static gain no recording
# tells; their numerator's norm is fixed instead.
_LEAST_STATIC_SHARE = 1e-3
_FREQUENCIES = np.linspace(0.0, np.pi, 128)


def normalise(
    model: HammersteinWiener, *, keeps_block: bool = False
) -> HammersteinWiener:
    """Same model with its shared gain in a fixed place.

    Parameters
    ----------
    keeps_block : bool
        Whether B and F stay as they are; the gain that the two maps share is fixed then.

    Returns
    -------
    HammersteinWiener
        Gives the same output for every input.

    Raises
    ------
    ValueError
        If a map is extrapolated already: that comes last.
    """
    maps = (model.input_map, model.output_map)
    if any(one.extrapolation is not None for one in maps):
        raise ValueError("a model is normalised before its maps are extrapolated")
    if keeps_block:
        return _around_block(model)
    model = _with_unit_input_map(model)
    rule = RULES[model.output_map.kind]
    gain = block_gain(model)
    if rule.compress is None or not np.isfinite(gain) or gain == 0.0:
        return model
    return replace(
        model,
        numerator=model.numerator / gain,
        free_response=model.free_response / gain,
        output_map=rule.compress(model.output_map, gain),
    )


def block_gain(model: HammersteinWiener) -> float:
    """Gain by which the linear block is measured.

    Returns
    -------
    float, [-]
        The static gain, or the norm of B for a block that hardly passes constants or
        integrates them.
    """
    if uses_static_gain(model):
        return static_gain(model.numerator, model.denominator)
    return float(np.linalg.norm(model.numerator))


def uses_static_gain(model: HammersteinWiener) -> bool:
    """Tell whether the block can be measured by what it makes of constants."""
    response = _gains(model)
    return bool(
        response[0] >= _LEAST_STATIC_SHARE * np.max(response)
    ) and not integrates(model)


def integrates(model: HammersteinWiener) -> bool:
    """Tell whether the block sums up constants, or all but does."""
    response = _gains(model)
    return bool(np.max(response[1:]) < _LEAST_STATIC_SHARE * response[0])


def _gains(model: HammersteinWiener) -> np.ndarray:
    """Gains of the block from zero frequency on; infinite at a pole."""
    delay_b = np.exp(-1j * np.outer(_FREQUENCIES, np.arange(model.numerator.size)))
    delay_f = np.exp(-1j * np.outer(_FREQUENCIES, np.arange(model.denominator.size)))
    with np.errstate(divide="ignore", invalid="ignore"):
        gains = np.abs((delay_b @ model.numerator) / (delay_f @ model.denominator))
    return np.asarray(np.where(np.isnan(gains), np.inf, gains))


def rescaled(
    model: HammersteinWiener, input_scale: float, output_scale: float
) -> HammersteinWiener:
    """Model for signals in other units.

    Parameters
    ----------
    model : HammersteinWiener
        For scaled signals.
    input_scale, output_scale : float
        Positive; one unit of the scaled signal in the new unit.
    """
    return replace(
        model,
        input_map=static_map.stretch(model.input_map, input_scale),
        numerator=model.numerator * (output_scale / input_scale),
        free_response=model.free_response * output_scale,
        output_map=static_map.stretch(model.output_map, output_scale),
    )


def with_zero_at_zero(model: HammersteinWiener) -> HammersteinWiener:
    """Same model whose input map is zero at zero, or at the nearest end of its domain.

    Returns
    -------
    HammersteinWiener
        As it was where its kinds of maps cannot move the constant on.

    References
    ----------
    docs/method.md, eq. (15).
    """
    before, after = RULES[model.input_map.kind], RULES[model.output_map.kind]
    if before.raised is None or after.displaced is None or after.passes_constants:
        return model
    at = np.clip(np.zeros(1), *model.input_map.domain)
    constant = -float(static_map.evaluate(model.input_map, at)[0])
    gain = static_gain(model.numerator, model.denominator)
    moved = _with_constant(
        replace(
            model,
            input_map=before.raised(model.input_map, constant),
            output_map=after.displaced(model.output_map, gain * constant),
        ),
        constant,
    )
    return model if moved is None else moved


def displaced(
    model: HammersteinWiener, input_by: float, output_by: float
) -> HammersteinWiener | None:
    """Model for signals with other zeros.

    Parameters
    ----------
    model : HammersteinWiener
        Its free response may be those of several experiments, one after the other.
    input_by, output_by : float
        What is added to both signals.

    Returns
    -------
    HammersteinWiener or None
        Gives the same output, plus `output_by`, for every input plus `input_by`; None
        where no model of the same kinds of maps does.

    References
    ----------
    docs/method.md, eqs. (15i)-(15j).
    """
    before, after = RULES[model.input_map.kind], RULES[model.output_map.kind]
    if input_by != 0.0:
        if before.displaced is None:
            return None
        model = replace(model, input_map=before.displaced(model.input_map, input_by))
        if before.passes_constants:
            gain = static_gain(model.numerator, model.denominator)
            if after.displaced is None or not uses_static_gain(model):
                return None
            output_map = after.displaced(model.output_map, gain * input_by)
            shifted = _with_constant(replace(model, output_map=output_map), input_by)
            if shifted is None:
                return None
            model = shifted
            output_by -= gain * input_by if after.passes_constants else 0.0
    if output_by == 0.0:
        return model
    if after.raised is not None:
        return replace(model, output_map=after.raised(model.output_map, output_by))
    return _raised_before(model, output_by)


def _raised_before(
    model: HammersteinWiener, output_by: float
) -> HammersteinWiener | None:
    """Model whose input map brings a constant to the output."""
    before, after = RULES[model.input_map.kind], RULES[model.output_map.kind]
    if not (after.passes_constants and after.displaced is not None):
        return None
    if before.raised is None or not uses_static_gain(model):
        return None
    constant = output_by / static_gain(model.numerator, model.denominator)
    return _with_constant(
        replace(
            model,
            input_map=before.raised(model.input_map, constant),
            output_map=after.displaced(model.output_map, output_by),
        ),
        constant,
    )


def _with_constant(
    model: HammersteinWiener, constant: float
) -> HammersteinWiener | None:
    """Model whose block is in equilibrium with a constant that its input has gained."""
    if model.initial_state == "zero":
        return None
    count = model.orders.n_state
    if model.initial_state == "steady" or count == 0:
        return model
    # Both polynomials, with as many coefficients as there are states, or one more.
    below, above = np.zeros(count + 1), np.zeros(count + 1)
    below[: model.denominator.size] = model.denominator
    above[model.delay : model.delay + model.numerator.size] = model.numerator
    gain = static_gain(model.numerator, model.denominator)
    start = constant * np.cumsum(gain * below - above)[:count]
    states = model.free_response.reshape(-1, count) + start
    return replace(model, free_response=states.ravel())


def _around_block(model: HammersteinWiener) -> HammersteinWiener:
    """Input map of mean slope one where the output map can take up its gain."""
    rule, factor = RULES[model.output_map.kind], _unit_factor(model)
    amplify = RULES[model.input_map.kind].amplify
    if factor is None or amplify is None or rule.compress is None:
        return model
    return replace(
        model,
        input_map=amplify(model.input_map, factor),
        free_response=model.free_response * factor,
        output_map=rule.compress(model.output_map, 1.0 / factor),
    )


def _unit_factor(model: HammersteinWiener) -> float | None:
    """Factor that gives the input map the mean slope one; None where there is none."""
    rule = RULES[model.input_map.kind]
    if rule.amplify is None or rule.size is None:
        return None
    size, _ = rule.size(model.input_map)
    if not np.isfinite(size) or size == 0.0:
        return None
    ends = static_map.evaluate(model.input_map, np.array(model.input_map.domain))
    return 1.0 / size if ends[1] >= ends[0] else -1.0 / size


def _with_unit_input_map(model: HammersteinWiener) -> HammersteinWiener:
    rule, factor = RULES[model.input_map.kind], _unit_factor(model)
    if factor is None or rule.amplify is None:
        return model
    return replace(
        model,
        input_map=rule.amplify(model.input_map, factor),
        numerator=model.numerator / factor,
    )
