"""A table as a record, and the one writer that shows such records as plain text.

The other modules of this room make tables and paragraphs of results. Screens show them by
``as_text``, pages by ``templates/report.html``: what is added to a table appears on both.
"""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from hwid_cli.report.simulation_note import simulation_note

# Characters in a line where no terminal says otherwise.
WIDTH = 80
_GAP = "  "
# Least room for names that may go on in the next line, [characters].
_LEAST_ROOM = 20
# Upright columns that stand together, so that the eye can count.
_TOGETHER = 5


@dataclass(frozen=True)
class Text:
    """A paragraph.

    Parameters
    ----------
    is_note : bool
        Whether it stands back on a page, as remarks and missing stages do.
    """

    kind: ClassVar[str] = "text"
    text: str
    is_note: bool = False


@dataclass(frozen=True)
class Code:
    """Text that is shown as it is, line by line."""

    kind: ClassVar[str] = "code"
    text: str


@dataclass(frozen=True)
class Heading:
    """A heading above what follows."""

    kind: ClassVar[str] = "heading"
    text: str


@dataclass(frozen=True)
class Column:
    """Head of a column, and what its cells are.

    Parameters
    ----------
    is_text : bool
        Whether its cells stand left; numbers stand right.
    stays : bool
        Whether it stands in every block of a table too wide for the screen. The first
        column always does.
    joint : str
        What joins names in a cell, such as ``", "``: behind it they may go on in the next
        line. Empty where cells stay whole.
    is_upright : bool
        Whether cells and head are read from top to bottom, one character in a line.
    is_detail : bool
        Whether only a page has room for it.
    is_thesis : bool
        Whether only those want it who asked for the thesis's names.
    """

    head: str
    is_text: bool = False
    stays: bool = False
    joint: str = ""
    is_upright: bool = False
    is_detail: bool = False
    is_thesis: bool = False


def texts(*heads: str) -> tuple[Column, ...]:
    """Give columns of text."""
    return tuple(Column(head, is_text=True) for head in heads)


def numbers(*heads: str) -> tuple[Column, ...]:
    """Give columns of numbers."""
    return tuple(map(Column, heads))


@dataclass(frozen=True)
class Cell:
    """A cell that is more than its text.

    Parameters
    ----------
    title : str
        Shown on a page when the pointer rests on it; empty for nothing.
    share : float or None, [-]
        Place between the table's lowest and highest number, for its colour on a page.
    is_marked : bool
        Whether it stands out.
    short : str
        Stands for it on the screen and is explained beneath; empty for the text itself.
    look : str
        How a page sets it apart: ``own``, ``below`` a threshold, both, or ``best``; empty
        for nothing.
    """

    text: str
    title: str = ""
    share: float | None = None
    is_marked: bool = False
    short: str = ""
    look: str = ""


Row = tuple[Cell | str, ...]


@dataclass(frozen=True)
class Table:
    """A table.

    Parameters
    ----------
    rows : tuple of tuple of Cell or str
        The first cell of each is its head.
    notes : tuple of str
        Sentences beneath.
    how : tuple of str
        How the numbers were got: beneath the caption on the screen. A section of a page
        says it once for all of its tables and figures.
    is_validation : bool or None
        Whether models are simulated after their fit, as for ``simulation_note``, which
        stands above ``how``; None where that says it all, or nothing is simulated.
    published : str
        The thesis's table whose form it has, if any.
    mark : str
        One character behind marked cells on the screen.
    is_matrix : bool
        Whether all columns but the first are of one kind: the page reads its cells aloud by
        row and column, and keeps their order.
    """

    kind: ClassVar[str] = "table"
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()
    how: tuple[str, ...] = ()
    is_validation: bool | None = None
    published: str = ""
    mark: str = "*"
    is_matrix: bool = False

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of all columns."""
        return tuple(column.head for column in self.columns)


def shown_part(table: Table, *, is_screen: bool, thesis_names: bool) -> Table:
    """Leave out the columns that a reader has no room for or did not ask for.

    Parameters
    ----------
    is_screen : bool
        Whether there is no room for details.
    thesis_names : bool
        Whether the reader knows the thesis's names and tables.
    """
    places = [
        place
        for place, column in enumerate(table.columns)
        if not (column.is_detail and is_screen)
        and (thesis_names or not column.is_thesis)
    ]
    form = f" (form of {table.published})" if table.published and thesis_names else ""
    return replace(
        table,
        caption=table.caption + form,
        columns=tuple(table.columns[place] for place in places),
        rows=tuple(tuple(row[place] for place in places) for row in table.rows),
    )


Block = Text | Code | Heading | Table


def as_text(
    blocks: Sequence[Block],
    *,
    width: int = WIDTH,
    initial_state: str = "",
    thesis_names: bool = False,
) -> str:
    """Show paragraphs and tables as plain text, for a screen, a file and a pipe.

    Parameters
    ----------
    blocks : sequence of Text, Code, Heading or Table
    width : int, [characters]
        Of a line. What a table has too much stands in further blocks beneath; a single
        column may be wider.
    initial_state : str
        Rule of the fits, which tables of simulations name; empty where there are none.
    thesis_names : bool
        Whether the reader asked for the thesis's names.

    Examples
    --------
    >>> columns = (*texts("kind"), *numbers("n"))
    >>> print(as_text([Table("Counts", columns, (("step", "15"),), ("All of them.",))]))
    Counts
    kind   n
    ----  --
    step  15
    All of them.
    """
    found = ""
    before: object = None
    for block in blocks:
        if isinstance(block, Table):
            part = shown_part(block, is_screen=True, thesis_names=thesis_names)
            if initial_state and part.is_validation is not None:
                note = simulation_note(initial_state, is_validation=part.is_validation)
                part = replace(part, how=(note, *part.how))
            text = _table_text(part, width)
        elif isinstance(block, Text):
            text = _paragraph(block.text, width, "  ")
        elif isinstance(block, Code | Heading):
            text = block.text
        else:
            raise TypeError(f"{type(block).__name__} cannot be shown on a screen")
        is_next = isinstance(block, Text) and isinstance(before, Text | Heading)
        found += "" if before is None else "\n" if is_next else "\n\n"
        found += text
        before = block
    return found


def _paragraph(text: str, width: int, indent: str = "") -> str:
    return textwrap.fill(
        text,
        width,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def _table_text(table: Table, width: int) -> str:
    grid = _grid(table, width)
    blocks = [
        _block_text(table.columns, grid, chosen)
        for chosen in _blocks(table.columns, grid, width)
    ]
    above = [line for line in (table.caption, *table.how) if line]
    cells = [cell for row in table.rows for cell in row if isinstance(cell, Cell)]
    short = {one.short: f"{one.short}: {one.text}" for one in cells if one.short}
    # C2 before C10.
    legend = [short[label] for label in sorted(short, key=lambda one: (len(one), one))]
    return "\n".join(
        [
            *(_paragraph(line, width) for line in above),
            "\n\n".join(blocks),
            *(_paragraph(line, width, "  ") for line in (*legend, *table.notes)),
        ]
    )


# Lines of each cell, row by row; the first row holds the heads.
_Grid = list[list[list[str]]]


def _grid(table: Table, width: int) -> _Grid:
    """Lines of all cells, those that may go on in as many lines as they need."""
    cells = [cell for row in table.rows for cell in row if isinstance(cell, Cell)]
    mark = table.mark if any(cell.is_marked for cell in cells) else ""
    texts_of = [
        [column.head, *(_shown(row[place], column, mark) for row in table.rows)]
        for place, column in enumerate(table.columns)
    ]
    sizes = [
        1 if column.is_upright else max(map(len, cells))
        for column, cells in zip(table.columns, texts_of, strict=True)
    ]
    over = _width(table.columns, sizes, range(len(sizes))) - width
    grid = []
    for row in zip(*texts_of, strict=True):
        upright = [
            len(t) for t, c in zip(row, table.columns, strict=True) if c.is_upright
        ]
        height = max(upright, default=0)
        lines = []
        for text, column, size in zip(row, table.columns, sizes, strict=True):
            if column.is_upright:
                lines.append(list(text.rjust(height)))
            elif column.joint and over > 0:
                room = max(_LEAST_ROOM, size - over)
                lines.append(_joined(text.split(column.joint), column.joint, room))
            else:
                lines.append([text])
        grid.append(lines)
    return grid


def _shown(cell: Cell | str, column: Column, mark: str) -> str:
    """Text of a cell; numbers without a mark keep room for that of others."""
    if isinstance(cell, str):
        return cell
    text = cell.short or cell.text
    if cell.is_marked:
        return text + mark
    return text if column.is_text else text + " " * len(mark)


def _joined(names: Sequence[str], joint: str, width: int) -> list[str]:
    """Join names to lines no longer than a width in characters, none of them cut."""
    lines = [names[0]]
    for name in names[1:]:
        # A line that goes on ends with what joins.
        if len(lines[-1]) + len(joint) + len(name) + len(joint.rstrip()) > width:
            lines[-1] += joint.rstrip()
            lines.append(f"  {name}")
        else:
            lines[-1] += joint + name
    return lines


def _width(
    columns: Sequence[Column], sizes: Sequence[int], chosen: Sequence[int]
) -> int:
    """Characters that some columns take side by side."""
    plain = [sizes[place] for place in chosen if not columns[place].is_upright]
    upright = len(chosen) - len(plain)
    if upright:
        plain.append(upright + (upright - 1) // _TOGETHER)
    return sum(plain) + len(_GAP) * (len(plain) - 1)


def _blocks(columns: Sequence[Column], grid: _Grid, width: int) -> list[list[int]]:
    """Columns that stand side by side, block by block."""
    sizes = [
        max(len(line) for row in grid for line in row[place])
        for place in range(len(columns))
    ]
    every = range(len(columns))
    kept = [place for place in every if place == 0 or columns[place].stays]
    parts: list[list[int]] = [[]]
    for place in every:
        if place in kept:
            continue
        if parts[-1] and _width(columns, sizes, [*kept, *parts[-1], place]) > width:
            parts.append([])
        parts[-1].append(place)
    return [sorted([*kept, *part]) for part in parts]


def _block_text(columns: Sequence[Column], grid: _Grid, chosen: Sequence[int]) -> str:
    """Some columns side by side, a rule beneath their heads."""
    # Upright ones that follow each other make one column.
    runs: list[list[int]] = []
    for place in chosen:
        if runs and columns[place].is_upright and columns[runs[-1][0]].is_upright:
            runs[-1].append(place)
        else:
            runs.append([place])
    is_left = [columns[run[0]].is_text or columns[run[0]].is_upright for run in runs]
    rows = [[_beside([row[place] for place in run]) for run in runs] for row in grid]
    widths = [
        max(len(line) for row in rows for line in row[n]) for n in range(len(runs))
    ]
    lines = []
    for number, row in enumerate(rows):
        height = max(map(len, row))
        for cells in row:
            # Heads end at the rule, cells begin in one line.
            blank = [""] * (height - len(cells))
            cells[:] = [*cells, *blank] if number else [*blank, *cells]
        for parts in zip(*row, strict=True):
            placed = [
                part.ljust(width) if left else part.rjust(width)
                for part, width, left in zip(parts, widths, is_left, strict=True)
            ]
            lines.append(_GAP.join(placed).rstrip())
        if not number:
            lines.append(_GAP.join("-" * width for width in widths))
    return "\n".join(lines)


def _beside(cells: Sequence[Sequence[str]]) -> list[str]:
    """Lines of cells that stand close together, in groups that the eye can count."""
    if len(cells) == 1:
        return list(cells[0])
    return [
        " ".join(
            "".join(line[first : first + _TOGETHER])
            for first in range(0, len(line), _TOGETHER)
        )
        for line in zip(*cells, strict=True)
    ]
