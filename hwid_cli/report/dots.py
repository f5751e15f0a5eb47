"""Rows of dots and of bars on one axis, as a drawing that needs no program on the page."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

# Widths of the drawing, heights of a row, of a title, of the axis below, [pixels].
_WIDTH, _NARROW, _ROW, _TITLE, _AXIS = 720, 340, 20, 26, 40
# Room of a character of a name and of a number, of which a narrow drawing has less.
_CHARACTER, _MOST_NAME = 6.4, 240
# A bold letter over a plain one.
_BOLD = 1.12
# Numbers beyond this, or below its reciprocal on a logarithmic axis, have no place on one.
_LARGEST = 1e100
# A logarithmic axis reaches at least so far, [-].
_LEAST_RANGE = 6.0
_MARGIN = 0.06


@dataclass(frozen=True)
class Dot:
    """A value in a row.

    Parameters
    ----------
    role : str
        Its look; one of ``charts.ROLES``.
    text : str
        The value in words.
    """

    value: float
    role: str
    text: str


@dataclass(frozen=True)
class DotRow:
    """A row with its name left and its dots or its bar on the axis.

    Parameters
    ----------
    text : str
        Right of the last one; empty for nothing.
    """

    name: str
    dots: tuple[Dot, ...]
    text: str = ""
    is_bold: bool = False


@dataclass(frozen=True)
class DotGroup:
    """Rows beneath a title; empty for none."""

    title: str
    rows: tuple[DotRow, ...]


@dataclass(frozen=True)
class Dots:
    """Values of named rows on one horizontal axis.

    Parameters
    ----------
    label : str
        Quantity and unit of the axis.
    legend : tuple of (role, text)
    reference : tuple of (float, str) or None
        A value that a dashed line marks, and its name.
    is_bar : bool
        Whether bars lead to the dots, from the reference or else from zero.
    is_narrow : bool
        Whether it stands beside others.
    """

    kind: ClassVar[str] = "dots"
    label: str
    groups: tuple[DotGroup, ...]
    sentence: str
    alt: str
    legend: tuple[tuple[str, str], ...] = ()
    reference: tuple[float, str] | None = None
    is_log: bool = False
    is_bar: bool = False
    is_narrow: bool = False


@dataclass(frozen=True)
class PlacedDot:
    """A dot of the drawing: where it is, where its bar begins, and its look."""

    x: float
    start: float
    role: str
    text: str


@dataclass(frozen=True)
class PlacedRow:
    """A row of the drawing."""

    y: float
    name: str
    full_name: str
    dots: tuple[PlacedDot, ...]
    text: str
    text_x: float
    is_bold: bool


@dataclass(frozen=True)
class DotDrawing:
    """Everything at its place, in pixels from the upper left corner.

    Parameters
    ----------
    titles : tuple of (y, text)
    ticks : tuple of (x, text)
    """

    width: int
    height: float
    left: float
    right: float
    bottom: float
    rows: tuple[PlacedRow, ...] = ()
    titles: tuple[tuple[float, str], ...] = ()
    ticks: tuple[tuple[float, str], ...] = ()
    reference: tuple[float, str] | None = None
    label: str = ""


def dot_drawing(dots: Dots) -> DotDrawing:
    """Give everything in a drawing its place.

    Examples
    --------
    >>> row = DotRow("step_01", (Dot(2.0, "given", "2 m"),))
    >>> drawing = dot_drawing(Dots("RMS [m]", (DotGroup("", (row,)),), "", ""))
    >>> drawing.rows[0].name, drawing.ticks[0][1]
    ('step_01', '0')
    """
    rows = [row for group in dots.groups for row in group.rows]
    width = _NARROW if dots.is_narrow else _WIDTH
    most = int((0.44 * width if dots.is_narrow else _MOST_NAME) / _CHARACTER)
    longest = max(len(row.name) * (_BOLD if row.is_bold else 1.0) for row in rows)
    left = round(_CHARACTER * min(most, longest)) + 14
    beside = _CHARACTER * max(len(row.text) for row in rows)
    right = width - 14 - beside
    low, high, ticks = _axis(
        _values(dots), is_log=dots.is_log, is_narrow=dots.is_narrow
    )

    def place(value: float) -> float:
        # What has no logarithm stands at the lower end.
        at, first, last = (
            math.log(max(one, low)) if dots.is_log else one
            for one in (value, low, high)
        )
        share = (at - first) / (last - first)
        return round(left + min(max(share, 0.0), 1.0) * (right - left), 1)

    start = place(dots.reference[0]) if dots.reference and dots.is_log else left
    if not dots.is_log:
        start = place(min(max(0.0, low), high))
    y, placed, titles = 2.0, [], []
    for group in dots.groups:
        if group.title:
            titles.append((y + 18, group.title))
            y += _TITLE
        for row in group.rows:
            placed.append(_row(row, y + _ROW / 2, start, place, most))
            y += _ROW
    drawn = [(place(value), text) for value, text in ticks]
    return DotDrawing(
        width=width,
        height=y + _AXIS,
        left=left,
        right=right,
        bottom=y + 4,
        rows=tuple(placed),
        titles=tuple(titles),
        ticks=tuple(drawn),
        reference=dots.reference and (place(dots.reference[0]), dots.reference[1]),
        label=dots.label,
    )


def _row(
    row: DotRow, y: float, start: float, place: Callable[[float], float], most: int
) -> PlacedRow:
    dots = tuple(
        PlacedDot(place(one.value), start, one.role, one.text)
        for one in row.dots
        if math.isfinite(one.value)
    )
    last = max((one.x for one in dots), default=start)
    return PlacedRow(
        y, _cut(row.name, most), row.name, dots, row.text, last + 9, row.is_bold
    )


def _cut(name: str, most: int) -> str:
    """Leave out the middle of a long name."""
    if len(name) <= most:
        return name
    end = (most - 1) // 3
    return f"{name[: most - 1 - end]}\N{HORIZONTAL ELLIPSIS}{name[len(name) - end :]}"


def _values(dots: Dots) -> list[float]:
    found = [
        one.value for group in dots.groups for row in group.rows for one in row.dots
    ]
    if dots.reference is not None:
        found.append(dots.reference[0])
    return [
        one
        for one in found
        if abs(one) < _LARGEST and (one > 1.0 / _LARGEST or not dots.is_log)
    ]


def _axis(
    values: Sequence[float], *, is_log: bool, is_narrow: bool
) -> tuple[float, float, list[tuple[float, str]]]:
    """Ends of the axis, and where its numbers stand."""
    if is_log:
        low, high = (min(values), max(values)) if values else (1.0, 1.0)
        room = max((high / low) ** _MARGIN, (_LEAST_RANGE * low / high) ** 0.5, 1.2)
        low, high = low / room, high * room
        decades, most = math.log10(high / low), 4 if is_narrow else 8
        leading = (1.0,) if decades > (1.8 if is_narrow else 2.3) else (1.0, 2.0, 5.0)
        first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
        powers = range(first, last + 1, math.ceil(decades / most))
        marks = [lead * 10.0**power for power in powers for lead in leading]
        return low, high, [(one, f"{one:.3g}") for one in marks if low <= one <= high]
    low, high = min([0.0, *values]), max([0.0, *values])
    high = high if high > low else low + 1.0
    step = _even_step((high - low) / (3 if is_narrow else 5))
    first = math.floor(low / step)
    marks = [step * n for n in range(first, math.ceil(high / step) + 1)]
    return marks[0], max(marks[-1], high), [(one, f"{one:.6g}") for one in marks]


def _even_step(rough: float) -> float:
    """The next of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(rough))
    return power * next(one for one in (1, 2, 5, 10) if one * power >= rough * 0.999)
