"""What a field of a record may hold, said once as metadata of its annotation.

``mass_kg: Annotated[float, POSITIVE] = 1.0``. A record that checks itself when it is built
calls ``check_fields``; a configuration file and stored results are read by the same rules.
"""

import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Any, get_args, get_type_hints

import numpy as np

# Metadata of a field that the program sets: no key of a configuration.
NO_KEY = MappingProxyType({"is_key": False})


@dataclass(frozen=True)
class Refusal:
    """Why a value is refused, in the parts that a message is made of.

    Parameters
    ----------
    found : object
        The value, or the one inside of it that is at fault.
    expected : str
        Empty where ``known`` says it.
    key : tuple of str
        Where in the refused value it stands; empty for the value itself.
    said : str
        How it is told what was found; ``{}`` stands for the value.
    known : tuple of str
        Words that would have been understood.
    step : str
        What to do next, where the expectation does not tell.
    """

    found: object
    expected: str = ""
    key: tuple[str, ...] = ()
    said: str = "found {}"
    known: tuple[str, ...] = ()
    step: str = ""


class Refused(ValueError):
    """A value that a field cannot hold."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal)
        self.refusal = refusal

    def __str__(self) -> str:
        one = self.refusal
        end = f"; {one.step}" if one.step else ""
        if one.said != "found {}":
            return f"{'.'.join(one.key)} {one.said}{end}".replace("{}", repr(one.found))
        expected = one.expected or f"one of {', '.join(one.known)}"
        if len(one.known) == 1:
            expected = repr(one.known[0])
        return f"{'.'.join(one.key)} must be {expected}, got {one.found!r}{end}"

    def below(self, key: str) -> "Refused":
        """Give the same refusal as the one of a record that holds the value."""
        return Refused(replace(self.refusal, key=(key, *self.refusal.key)))


class Rule:
    """What must hold for a value; a list is checked item by item, None never."""

    def read(self, value: Any) -> Any:
        """Value as the field holds it.

        Raises
        ------
        Refused
        """
        if value is not None:
            self._check(value)
        return value

    def _check(self, value: Any) -> None:
        raise NotImplementedError


class Reading(Rule):
    """A rule for what stands in a file; a program may hold other values."""


@dataclass(frozen=True)
class Number(Rule):
    """Finite, at least ``least``, above ``above``, at most ``most``.

    Parameters
    ----------
    words : str
        What was expected, where there are better words than the limits.
    """

    least: float | None = None
    above: float | None = None
    most: float | None = None
    words: str = ""

    noun = "a number"

    @property
    def expected(self) -> str:
        """What was expected, in words."""
        if self.words:
            return self.words
        lower = self.least if self.above is None else self.above
        if lower is None:
            return "a finite number"
        if self.most is None:
            return f"{self.noun} {'>' if self.above is not None else '>='} {lower:g}"
        if self.above is None:
            return f"{self.noun} from {lower:g} to {self.most:g}"
        return f"{self.noun} above {lower:g} and at most {self.most:g}"

    def _check(self, value: Any) -> None:
        for number in _items(value):
            # Where a number or text may stand, text is left alone.
            if not isinstance(number, str) and not self._holds(number):
                raise Refused(Refusal(number, self.expected))

    def _holds(self, number: Any) -> bool:
        return (
            math.isfinite(number)
            and (self.least is None or number >= self.least)
            and (self.above is None or number > self.above)
            and (self.most is None or number <= self.most)
        )


class Integer(Number):
    """The same without a fraction."""

    noun = "an integer"

    def _holds(self, number: Any) -> bool:
        return super()._holds(number) and number == int(number)


@dataclass(frozen=True)
class Numbers(Rule):
    """An array or a tuple of numbers, none further from zero than ``most``.

    Parameters
    ----------
    may_be_missing : bool
        Whether some may be NaN.
    """

    most: float
    may_be_missing: bool = False

    def _check(self, value: Any) -> None:
        sizes = np.abs(np.asarray(value))
        is_wrong = sizes > self.most if self.may_be_missing else ~(sizes <= self.most)
        if is_wrong.any():
            found = np.asarray(value)[is_wrong].flat[0].item()
            raise Refused(Refusal(found, f"finite numbers up to {self.most:g}"))


@dataclass(frozen=True)
class ArrayOf(Rule):
    """An array of one of numpy's kinds, and this in words."""

    kinds: str
    words: str

    def _check(self, value: Any) -> None:
        if value.dtype.kind not in self.kinds:
            raise Refused(Refusal(str(value.dtype), self.words))


@dataclass(frozen=True)
class Distances(ArrayOf):
    """Distances between outputs: none below zero, NaN where there is none."""

    kinds: str = "f"
    words: str = "numbers >= 0"

    def _check(self, value: Any) -> None:
        super()._check(value)
        if (value < 0.0).any():
            raise Refused(Refusal(float(np.nanmin(value)), self.words))


# Signals have at most 1e60 and span at least 1e-60 (docs/security.md): gains stay below
# this. Beyond it the squares of what a model computes are more than a float holds.
STORED_NUMBERS = Numbers(most=1e130)
STORED_OR_MISSING = Numbers(most=1e130, may_be_missing=True)
# What a simulation gives may be of any size: some run away.
STORED_CURVE = ArrayOf("f", "numbers")
# A measurement has no other; ``data.checks`` says so of files.
SAMPLE_TIME = Number(least=1e-12, most=1e9)
POSITIVE = Number(above=0)
NOT_NEGATIVE = Number(least=0)
SHARE = Number(least=0, most=1)


@dataclass(frozen=True)
class OneOf(Rule):
    """A word, a list of words or the keys of a section, out of those that are known."""

    known: Collection[str]

    def __post_init__(self) -> None:
        object.__setattr__(self, "known", tuple(self.known))

    def _check(self, value: Any) -> None:
        for word in _items(value):
            if word not in self.known:
                raise Refused(Refusal(word, known=tuple(self.known)))


@dataclass(frozen=True)
class Each(Rule):
    """Values for which a function holds, and this in words."""

    holds: Callable[[Any], object]
    expected: str

    def _check(self, value: Any) -> None:
        for item in _items(value):
            if not self.holds(item):
                raise Refused(Refusal(item, self.expected))


@dataclass(frozen=True)
class Filled(Rule):
    """A list that is not empty, and this in words."""

    expected: str

    def _check(self, value: Any) -> None:
        if len(value) == 0:
            raise Refused(Refusal([], self.expected))


@dataclass(frozen=True)
class Distinct(Rule):
    """A list in which nothing comes twice."""

    def _check(self, value: Any) -> None:
        seen = set()
        for item in _items(value):
            if item in seen:
                said, step = "{} is listed twice", "remove one"
                raise Refused(Refusal(item, "every value once", said=said, step=step))
            seen.add(item)


@dataclass(frozen=True)
class Interval(Rule):
    """Two finite numbers, the lower one first."""

    def _check(self, value: Any) -> None:
        if len(value) != 2 or not -math.inf < value[0] < value[1] < math.inf:
            raise Refused(Refusal(list(value), "two numbers, the lower one first"))


@dataclass(frozen=True)
class FileLimit(Reading):
    """The largest number that a file may ask for, far beyond any use.

    A slip of six zeros would else fill the memory, or compute for years.
    """

    most: int

    def _check(self, value: Any) -> None:
        for number in _items(value):
            if number > self.most:
                step = "correct the key"
                raise Refused(Refusal(number, f"at most {self.most}", step=step))


@dataclass(frozen=True)
class StandsFor(Reading):
    """A word of a file, and the value that a record holds for it."""

    word: str
    value: object

    def read(self, value: Any) -> Any:
        """Value as the record holds it."""
        return self.value if value == self.word else value


class OtherForm(Reading):
    """Another form in which a file may hold a value, read before its type is checked."""


@dataclass(frozen=True)
class NamesFor(OtherForm):
    """A list of names of a file, and the value that a record holds for each."""

    value: object

    def read(self, value: Any) -> Any:
        """Value as the record holds it."""
        if isinstance(value, str):
            return {value: self.value}
        is_list = isinstance(value, list | tuple)
        if is_list and all(isinstance(name, str) for name in value):
            return dict.fromkeys(value, self.value)
        return value


@dataclass(frozen=True)
class OrderAxis(Reading):
    """Orders of a grid, at most ``most``: ``[first, last]`` is a range."""

    most: int

    def read(self, value: Any) -> Any:
        """Value as the record holds it, the range written out."""
        for order in value:
            if order > self.most:
                raise Refused(Refusal(order, f"orders <= {self.most}"))
        if len(value) != 2:
            return value
        first, last = value
        if first > last:
            expected = "[first, last] with first <= last"
            step = f"write [{last}, {first}]"
            raise Refused(Refusal([first, last], expected, step=step))
        return tuple(range(first, last + 1))


def _items(value: Any) -> Iterable[Any]:
    return value if isinstance(value, tuple | list | dict) else (value,)


def check_fields(record: object) -> None:
    """Refuse a record with a field that its rules do not allow.

    Raises
    ------
    Refused
        For the first one.
    """
    for name, rules in _rules(type(record)):
        for rule in rules:
            try:
                rule.read(getattr(record, name))
            except Refused as refused:
                raise refused.below(name) from None


def _read_rules(record_type: Any) -> list[tuple[str, list[Rule]]]:
    """Rules of each field that has some, but those for reading a file."""
    found = []
    for name, hint in get_type_hints(record_type, include_extras=True).items():
        known = [one for one in get_args(hint)[1:] if isinstance(one, Rule)]
        rules = [one for one in known if not isinstance(one, Reading)]
        if rules:
            found.append((name, rules))
    return found


# mypy does not take a class for hashable, hence the plain annotation.
_rules: Callable[[Any], list[tuple[str, list[Rule]]]] = cache(_read_rules)
