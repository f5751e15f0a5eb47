"""What is wrong in a file, in the parts that a message is made of."""

from collections.abc import Iterable
from dataclasses import dataclass

from hwid_cli.files.messages import escaped, shown
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.rules import Refusal

Place = tuple[object, ...]

_LONGEST_KEY = 100


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong.

    Parameters
    ----------
    place : tuple
        Keys from the top of the file down.
    found : str
        ``found 3``, ``missing``, ``unknown key``.
    expected : str
        Empty where the next step tells.
    step : str
        What to do next; empty where the expectation tells.
    without : tuple or None
        Place of what has to go, for the rest of the file to be looked at; None means
        ``place``, or the section that holds it where there is nothing at that place.
    """

    place: Place
    found: str
    expected: str = ""
    step: str = ""
    without: Place | None = None

    def message(self, file: object) -> str:
        """One line for people."""
        keys = ".".join(escaped(str(key)[:_LONGEST_KEY]) for key in self.place)
        expected = f"expected {self.expected}" if self.expected else ""
        said = "; ".join(part for part in (self.found, expected, self.step) if part)
        return f"{file}: {keys}: {said}" if keys else f"{file}: {said}"


def wrong(place: Place, value: object, expected: str, step: str = "") -> Fault:
    """A value that cannot be used."""
    return Fault(place, f"found {_shown(value)}", expected, step)


def wrong_word(place: Place, word: object, known: Iterable[object]) -> Fault:
    """A word that is none of those that are known."""
    return Fault(place, f"found {_shown(word)}", step=did_you_mean(word, known))


def unknown_key(place: Place, known: Iterable[object]) -> Fault:
    """A key that a section does not have."""
    return Fault(place, "unknown key", step=did_you_mean(place[-1], known))


def missing(
    place: Place,
    expected: str,
    step: str = "add the key",
    *,
    without: Place | None = None,
) -> Fault:
    """A key that something cannot do without.

    Parameters
    ----------
    without : tuple, optional
        Place of what needs the key; its section where it is left out.
    """
    return Fault(place, "missing", expected, step, without)


def refused(place: Place, refusal: Refusal) -> Fault:
    """A value that a record refuses."""
    found = refusal.said.replace("{}", _shown(refusal.found))
    step = refusal.step
    if refusal.known and not refusal.expected:
        step = did_you_mean(refusal.found, refusal.known)
    return Fault((*place, *refusal.key), found, refusal.expected, step)


def _shown(value: object) -> str:
    if value is None:
        return "no value"
    return shown(list(value) if isinstance(value, tuple) else value)
