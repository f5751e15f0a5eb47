"""Numbers and lists as words, and figures as blocks: what all sections share."""

import re
import struct
from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.figure import Figure

from hwid_cli.records.report import ReportContents
from hwid_cli.records.units import behind
from hwid_cli.report.figures.style import DOTS, as_png
from hwid_cli.report.page import Image, Text
from hwid_cli.report.simulation_words import HUBER_WORDS, simulation_words
from hwid_cli.report.text_table import MISSING

NOTHING_COVERED = "no group covers any recording."

_MOST_NAMED = 8
# Keeps a number and its unit on one line.
_GLUE = "\N{NO-BREAK SPACE}"


def with_unit(value: float, unit: str) -> str:
    """Write a number with three digits and its unit.

    Parameters
    ----------
    value : float, [unit]

    Examples
    --------
    >>> with_unit(0.0012345, "m").split(), with_unit(float("nan"), "m")
    (['0.00123', 'm'], '-')
    >>> with_unit(0.0012345, "-")
    '0.00123'
    """
    known = f"{value:.3g}{behind(unit).replace(' ', _GLUE)}"
    return known if np.isfinite(value) else MISSING


def percent(value: float) -> str:
    """Write a percentage with two decimals.

    Parameters
    ----------
    value : float, [%]
    """
    return f"{value:.2f}{_GLUE}%" if np.isfinite(value) else MISSING


def counted(count: int, one: str, many: str = "") -> str:
    """Write a number of things.

    Parameters
    ----------
    count : int, [-]
    one : str
        The thing.
    many : str
        Its plural; an s is added unless given.

    Examples
    --------
    >>> counted(1, "fit"), counted(2, "fit"), counted(0, "entry", "entries")
    ('1 fit', '2 fits', '0 entries')
    """
    return f"{count} {one if count == 1 else many or one + 's'}"


def listed(names: Sequence[str], most: int = _MOST_NAMED) -> str:
    """Write names one after the other.

    Parameters
    ----------
    most : int, [-]
        More are counted only.

    Examples
    --------
    >>> listed(["a", "b", "c"]), listed(["a", "b", "c"], most=2)
    ('a, b and c', 'a, b and 1 more')
    """
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def drawn(file: str, figure: Figure, alt: str) -> Image:
    """Render a figure for the page.

    Parameters
    ----------
    file : str
        Where it lies below ``figures/``; without ending.
    """
    return image(f"{file}.png", as_png(figure), alt, dots_per_inch=DOTS)


def image(file: str, png: bytes, alt: str, *, dots_per_inch: int) -> Image:
    """Take a finished PNG file into the page.

    Parameters
    ----------
    file : str
        Where it lies below ``figures/``.
    dots_per_inch : int, [pixels/inch]
    """
    # Width and height stand at a fixed place in every PNG file, behind its signature
    # and the head of its first part.
    width, height = struct.unpack(">II", png[16:24])
    return Image(file, png, alt, width, height, dots_per_inch)


def file_names(names: Iterable[str], endings: Sequence[str] = ("",)) -> dict[str, str]:
    """Make file names of recordings or models that every disk takes and tells apart.

    Parameters
    ----------
    endings : sequence of str
        What follows a name in the files that belong to it.

    Returns
    -------
    dict of str to str
        By the names; equal ones are numbered. Large and small letters count as equal,
        as they do on some disks.

    Examples
    --------
    >>> file_names(["step_06+step_09/3/7", "c#", "c_"])
    {'step_06+step_09/3/7': 'step_06+step_09_3_7', 'c#': 'c_', 'c_': 'c__2'}
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in dict.fromkeys(names):
        plain = re.sub(r"[^\w.+ -]", "_", name)
        file, number = plain, 1
        while taken & (files := {f"{file}{end}".casefold() for end in endings}):
            number += 1
            file = f"{plain}_{number}"
        taken |= files
        found[name] = file
    return found


def simulation_note(contents: ReportContents, *, is_validation: bool) -> list[Text]:
    """Say how the models of a section were fitted and simulated.

    Parameters
    ----------
    is_validation : bool
        As for ``simulation_words``.

    Returns
    -------
    list of Text
        Notes; none where there are no models.
    """
    fits = list(contents.stored.fits)
    if contents.stored.search is not None:
        fits += [one for one in contents.stored.search.fits if one is not None]
    rules = dict.fromkeys(one.options.initial_state for one in fits)
    words = [simulation_words(rule, is_validation=is_validation) for rule in rules]
    if any(one.options.loss == "huber" for one in fits):
        words.append(HUBER_WORDS)
    return [Text(one, is_note=True) for one in words]
