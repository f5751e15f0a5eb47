"""Columns of plain text: what every printed table is made of."""

from collections.abc import Sequence

import numpy as np

WIDTH = 80
GAP = "  "
# Shown where there is no number.
MISSING = "-"


def text_table(
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    text_columns: Sequence[int],
) -> str:
    """Show rows in columns as wide as their content.

    Parameters
    ----------
    title : str
        Lines above the table; none if empty.
    heads : sequence of str
        One for each column.
    rows : sequence of sequence of str
        Each as long as ``heads``.
    text_columns : sequence of int, [-]
        Columns that hold text and stand left; the others hold numbers and stand right.

    Examples
    --------
    >>> print(text_table("Counts", ("kind", "n"), [("step", "15")], text_columns=(0,)))
    Counts
    kind   n
    ----  --
    step  15
    """
    widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
    lines = [title] if title else []
    for row in (heads, ["-" * width for width in widths], *rows):
        cells = [
            cell.ljust(width) if number in text_columns else cell.rjust(width)
            for number, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append(GAP.join(cells).rstrip())
    return "\n".join(lines)


def split_table(
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    width: int = WIDTH,
) -> str:
    """Show a wide table in blocks, one below the other.

    Parameters
    ----------
    title : str
        Lines above the first block.
    heads : sequence of str
        One for each column.
    rows : sequence of sequence of str
        Each as long as ``heads``. The first column is text and, like the last one,
        stands in every block; those between are divided.
    width : int, [characters]
        Of the screen; a block of one column may be wider.
    """
    sizes = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
    middle = range(1, len(heads) - 1)
    column = max([sizes[i] for i in middle], default=0) + len(GAP)
    room = width - sizes[0] - sizes[-1] - len(GAP)
    per_block = max(1, room // column)
    blocks: list[str] = []
    for first in range(1, max(2, len(heads) - 1), per_block):
        part = slice(first, min(first + per_block, len(heads) - 1))
        blocks.append(
            text_table(
                "" if blocks else title,
                (heads[0], *heads[part], heads[-1]),
                [(row[0], *row[part], row[-1]) for row in rows],
                text_columns=(0,),
            )
        )
    return "\n\n".join(blocks)


def joined_names(names: Sequence[str], *, width: int = WIDTH) -> list[str]:
    """Join names to lines, none of them cut.

    Parameters
    ----------
    width : int, [characters]
        Of a line; a single longer name is a line of its own.

    Examples
    --------
    >>> joined_names(["step_01", "step_02", "step_03"], width=18)
    ['step_01, step_02,', 'step_03']
    """
    lines = [""]
    for name in names:
        longer = f"{lines[-1]}, {name}" if lines[-1] else name
        # A line that goes on ends with a comma.
        if lines[-1] and len(longer) >= width:
            lines[-1] += ","
            lines.append(name)
        else:
            lines[-1] = longer
    return lines


def number(value: float) -> str:
    """Show a number with three digits.

    Parameters
    ----------
    value : float, [-]
        Of any unit.

    Returns
    -------
    str
        A dash where the value is not finite.

    Examples
    --------
    >>> number(0.00123), number(float("nan"))
    ('1.23e-03', '-')
    """
    return f"{value:.2e}" if np.isfinite(value) else MISSING
