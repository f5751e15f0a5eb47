"""Effects of the user's own: formulas with parameters, as a configuration states them."""

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Annotated, Any

from hwid_cli.records.rules import Filled, Refusal, Refused

# What a formula gives, by the key that holds it.
ACTS_ON = {"force_N": "force", "input": "input", "output": "output"}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")


@dataclass(frozen=True)
class OwnParameter:
    """A parameter of a formula.

    Parameters
    ----------
    unit : str
        In SI units, such as ``N/m``; ``-`` for none.
    positive : bool
        Whether it is above 0; else it may have either sign.
    start : float or None, [unit]
        Where its search starts; None: found from what the simulation lacks.
    bounds : tuple of float, [unit]
        Lowest and highest value; empty for none.
    exponents : tuple of float
        Of kg, m, s and A in its unit; set by whoever reads the unit.
    """

    unit: str = "-"
    positive: bool = False
    start: float | None = None
    bounds: tuple[float, ...] = ()
    exponents: tuple[float, ...] = field(default=(), metadata={"is_key": False})

    def __post_init__(self) -> None:
        if self.bounds and (
            len(self.bounds) != 2 or not self.bounds[0] < self.bounds[1]
        ):
            expected = "two numbers, the lower one first"
            raise Refused(Refusal(list(self.bounds), expected, ("bounds",)))
        if self.positive and self.bounds and self.bounds[1] <= 0:
            expected = "bounds that reach above 0, because positive is true"
            raise Refused(Refusal(list(self.bounds), expected, ("bounds",)))
        if self.start is None:
            return
        if self.positive and self.start <= 0:
            expected = "a number > 0, because positive is true"
            raise Refused(Refusal(self.start, expected, ("start",)))
        if self.bounds and not self.bounds[0] <= self.start <= self.bounds[1]:
            low, high = self.bounds
            expected = f"a number within its bounds, {low:g} to {high:g}"
            raise Refused(Refusal(self.start, expected, ("start",)))


@dataclass(frozen=True)
class OwnEffect:
    """A formula that may be missing in a simulation.

    Parameters
    ----------
    force_N, input, output : str or None
        One of them: a formula in ``x``, ``v``, ``u``, ``t`` and the parameters for a
        force on the mass, for what stands for the input, or for what the sensor reads.
    sentence : str
        What it is, in plain words.
    parameters : dict of str to OwnParameter
        By the names that the formula has for them.
    """

    force_N: Annotated[str | None, Filled("a formula")] = None
    input: Annotated[str | None, Filled("a formula")] = None
    output: Annotated[str | None, Filled("a formula")] = None
    sentence: str = ""
    parameters: dict[str, OwnParameter] = field(default_factory=dict)

    def __post_init__(self) -> None:
        stated = [key for key in ACTS_ON if getattr(self, key) is not None]
        if len(stated) != 1:
            said = f"found {' and '.join(stated) or 'none'}"
            expected = "one of force_N, input and output, with a formula"
            raise Refused(Refusal(None, expected, said=said))
        if not self.parameters:
            expected = "at least one parameter, which the diagnosis fits"
            raise Refused(Refusal(None, expected, ("parameters",), said="missing"))
        for name in self.parameters:
            if not _NAME.fullmatch(name):
                expected = "letters, digits and _, a letter first"
                raise Refused(Refusal(name, expected, ("parameters",)))

    @property
    def key(self) -> str:
        """Which of its keys holds the formula."""
        return next(key for key in ACTS_ON if getattr(self, key) is not None)

    @property
    def formula(self) -> str:
        """The formula."""
        return str(getattr(self, self.key))


def own_id(name: str, effect: OwnEffect) -> str:
    """Id of an effect of the user's own: its name and all that it declares.

    Whoever gets an id needs nothing else, in another process too, and what is kept under
    an id is that of this formula.

    Examples
    --------
    >>> stated = OwnEffect(force_N="-a*x", parameters={"a": OwnParameter("N/m")})
    >>> own_id("soft", stated)
    'soft:{"force_N":"-a*x","parameters":{"a":{"unit":"N/m"}}}'
    """
    content: dict[str, Any] = {effect.key: effect.formula}
    if effect.sentence:
        content["sentence"] = effect.sentence
    default = asdict(OwnParameter())
    content["parameters"] = {
        name: {key: v for key, v in asdict(one).items() if v != default[key]}
        for name, one in effect.parameters.items()
    }
    return f"{name}:{json.dumps(content, separators=(',', ':'))}"


def is_own(identifier: str) -> bool:
    """Whether an id is that of an effect of the user's own."""
    return ":{" in identifier


def own_of(identifier: str) -> tuple[str, OwnEffect]:
    """Name and declaration that an id holds.

    Raises
    ------
    ValueError
        If it is none of ``own_id``.
    """
    name, _, text = identifier.partition(":")
    content = json.loads(text)
    stated = {}
    for key, one in content.pop("parameters").items():
        values: dict[str, Any] = {
            what: tuple(value) if isinstance(value, list) else value
            for what, value in one.items()
        }
        stated[key] = OwnParameter(**values)
    return name, OwnEffect(parameters=stated, **content)


def own_ids(effects: Mapping[str, OwnEffect]) -> tuple[str, ...]:
    """Ids of several effects."""
    return tuple(own_id(name, one) for name, one in effects.items())


def named_by_id(
    effects: Mapping[str, Any], own: Mapping[str, OwnEffect]
) -> dict[str, Any]:
    """Effects of a simulation, those of the user's own by their ids."""
    return {
        own_id(name, own[name]) if name in own else name: values
        for name, values in effects.items()
    }


def plain_name(identifier: str) -> str:
    """Name of an effect of the user's own; the id of any other.

    Examples
    --------
    >>> plain_name('soft:{"force_N":"-a*x"}'), plain_name("load_friction:spring")
    ('soft', 'load_friction:spring')
    """
    return identifier.partition(":")[0] if is_own(identifier) else identifier
