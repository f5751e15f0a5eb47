"""How a claim is judged, and what the judgement says."""

from collections.abc import Mapping
from dataclasses import dataclass, field

HOLDS = "holds"
IN_PART = "in part"
FAILS = "does not hold"
NOT_JUDGED = "not judged"


@dataclass(frozen=True)
class Verdict:
    """Whether a claim holds on some evidence.

    Parameters
    ----------
    answer : str
        ``HOLDS``, ``IN_PART``, ``FAILS`` or ``NOT_JUDGED``.
    figure : str
        The number that decides, for a cell of a table.
    why : str
        One sentence that follows from the numbers.
    numbers : mapping of str to float
        What the answer was told from.
    """

    answer: str
    figure: str
    why: str
    numbers: Mapping[str, float] = field(default_factory=dict)


def graded(holds: bool, in_part: bool) -> str:
    """Choose the answer from two tests, the stricter one first.

    Parameters
    ----------
    holds : bool
    in_part : bool

    Returns
    -------
    str
    """
    return HOLDS if holds else IN_PART if in_part else FAILS


def not_judged(why: str) -> Verdict:
    """A claim that the evidence says nothing about.

    Parameters
    ----------
    why : str

    Returns
    -------
    Verdict
    """
    return Verdict(NOT_JUDGED, "-", why)
