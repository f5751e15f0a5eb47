"""Inputs that keep the output within a range, such as a travel.

What an input does is told before it is played: by the model that comes closest to the
recordings of others, or by every candidate that a diagnosis leaves.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hwid_cli.errors import ConfigError
from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.next import PlannedInput
from hwid_cli.records.units import behind
from hwid_cli.trust.band import inner_and_output

# From inputs to the outputs that are foreseen for each of them, at least one.
Foresee = Callable[[Sequence[np.ndarray]], Sequence[Sequence[np.ndarray]]]
Reach = tuple[float, float]


def foreseen_by(model: HammersteinWiener) -> Foresee:
    """What a model that starts at rest answers to inputs."""
    outlined, rest = outlined_model(model), np.zeros(0)
    return lambda inputs: [
        (inner_and_output(outlined, np.asarray(one, dtype=float), rest)[1],)
        for one in inputs
    ]


def reaches(plan: Sequence[PlannedInput], foresee: Foresee) -> dict[str, Reach]:
    """Lowest and highest output that is foreseen for each input, by its name.

    Returns
    -------
    dict of str to tuple of float, [output unit]
        Infinite where an output runs away.
    """
    outputs = foresee([one.values for one in plan])
    return {one.name: _reach(found) for one, found in zip(plan, outputs, strict=True)}


def _reach(outputs: Sequence[np.ndarray]) -> Reach:
    values = np.concatenate(outputs)
    if not np.isfinite(values).all():
        return (-np.inf, np.inf)
    return (float(values.min()), float(values.max()))


def within(
    plan: Sequence[PlannedInput],
    reached: dict[str, Reach],
    limits: Reach,
    unit: str,
    source: str,
) -> tuple[PlannedInput, ...]:
    """Inputs of a plan that are not foreseen to leave a range.

    Parameters
    ----------
    reached : dict of str to tuple of float, [output unit]
        Of inputs that were not played yet; the others stay.
    limits : tuple of float, shape (2,), [output unit]
    unit : str
        Of the output.
    source : str
        Of the configuration.

    Raises
    ------
    ConfigError
        If all inputs are foreseen to leave it.
    """
    low, high = limits
    out = {
        name: max(low - least, most - high)
        for name, (least, most) in reached.items()
        if least < low or most > high
    }
    if reached and len(out) == len(reached):
        mildest = min(out, key=out.__getitem__)
        raise ConfigError(
            f"{source}: next.output_range: found {in_words(limits, unit)}, which every one "
            f"of {len(out)} inputs on offer is foreseen to leave (the mildest, {mildest}, "
            f"reaches {in_words(reached[mildest], unit)}); expected one that stays within; "
            "offer smaller, shorter or faster ones"
        )
    return tuple(one for one in plan if one.name not in out)


def in_words(reach: Reach, unit: str) -> str:
    """A range as people write it.

    Examples
    --------
    >>> in_words((-0.5, 2.25), "mm")
    '-0.5 to 2.25 mm'
    """
    low, high = reach
    return f"{low:.3g} to {high:.3g}{behind(unit)}"
