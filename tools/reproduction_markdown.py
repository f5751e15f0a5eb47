"""Numbers, names and tables in Markdown, narrow enough to be read as plain text too."""

import re
import textwrap
from collections.abc import Sequence

import numpy as np

WIDTH = 150
_GAP = " | "
# Below this a fixed number of decimals says nothing; above the other one it misleads.
_SMALLEST_FIXED, _LARGEST_FIXED = 0.001, 100.0


def short_number(value: float, decimals: int = 3) -> str:
    """Write an RMSD in a few characters, as the published tables do.

    Parameters
    ----------
    value : float, [any unit]
    decimals : int, [-]
        Of a number that is neither very small nor very large.

    Returns
    -------
    str

    Examples
    --------
    >>> short_number(0.0123), short_number(0.000123), short_number(12345.6)
    ('0.012', '1.2e-4', '1.2e4')
    >>> short_number(float("nan")), short_number(float("inf"))
    ('?', 'inf')
    """
    if np.isnan(value):
        return "?"
    if np.isinf(value):
        return "inf"
    if value == 0.0 or _SMALLEST_FIXED <= value < _LARGEST_FIXED:
        return f"{value:.{decimals}f}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def kind_and_number(name: str) -> tuple[str, str]:
    """Split the name of a recording into what it is and which one.

    Parameters
    ----------
    name : str

    Returns
    -------
    str, str
        The second one is empty where the name has no such form.

    Examples
    --------
    >>> kind_and_number("step_06"), kind_and_number("run7b")
    (('step', '6'), ('run7b', ''))
    """
    found = re.fullmatch(r"([A-Za-z]+)_0*(\d+)", name)
    return (found[1], found[2]) if found else (name, "")


def group_label(name: str) -> str:
    """Name of a group for people.

    Parameters
    ----------
    name : str
        Names of recordings joined by ``+``.

    Returns
    -------
    str

    Examples
    --------
    >>> group_label("step_06+step_09+sine_05"), group_label("run7b")
    ('step 6-9, sine 5', 'run7b')
    """
    return _joined(name.split("+"), "-", ", ")


def name_list(names: Sequence[str]) -> str:
    """Name some recordings for people.

    Parameters
    ----------
    names : sequence of str

    Returns
    -------
    str

    Examples
    --------
    >>> name_list(["step_05", "step_15", "sine_14"]), name_list([])
    ('step 5, 15; sine 14', 'none')
    """
    return _joined(names, ", ", "; ") or "none"


def _joined(names: Sequence[str], within: str, between: str) -> str:
    """Names of one kind that follow each other share the word for it."""
    parts: list[str] = []
    last = None
    for name in names:
        kind, number = kind_and_number(name)
        if number and kind == last:
            parts[-1] += f"{within}{number}"
        else:
            parts.append(f"{kind} {number}".strip())
        last = kind if number else None
    return between.join(parts)


def counted(number: int, word: str) -> str:
    """Write a number before what it counts.

    Parameters
    ----------
    number : int, [-]
    word : str
        In the singular.

    Returns
    -------
    str

    Examples
    --------
    >>> counted(1, "model"), counted(6, "model")
    ('1 model', '6 models')
    """
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def kinds_of(recordings: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Sort recordings by kind: steps, sines and so on.

    Parameters
    ----------
    recordings : sequence of str

    Returns
    -------
    dict of str to tuple of str
        In the order in which the kinds first occur; without a number a name is of the
        kind ``other``.

    Examples
    --------
    >>> kinds_of(["step_01", "sine_01", "step_02", "run7b"])
    {'step': ('step_01', 'step_02'), 'sine': ('sine_01',), 'other': ('run7b',)}
    """
    found: dict[str, tuple[str, ...]] = {}
    for name in recordings:
        kind, number = kind_and_number(name)
        key = kind if number else "other"
        found[key] = (*found.get(key, ()), name)
    return found


def paragraph(text: str, head: str = "") -> str:
    """Break text into lines that fit the page.

    Parameters
    ----------
    text : str
    head : str
        What the first line begins with; the others stand in by as much.

    Returns
    -------
    str
    """
    return textwrap.fill(
        text,
        WIDTH,
        initial_indent=head,
        subsequent_indent=" " * len(head),
        break_long_words=False,
        break_on_hyphens=False,
    )


def table(
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    text_columns: Sequence[int] = (0,),
) -> str:
    """Write a table in Markdown whose columns also line up as plain text.

    Parameters
    ----------
    heads : sequence of str
    rows : sequence of sequence of str
    text_columns : sequence of int
        Aligned to the left; the others to the right.

    Returns
    -------
    str
    """
    clean = [[cell.replace("|", r"\|") for cell in row] for row in (heads, *rows)]
    widths = [max(3, *map(len, column)) for column in zip(*clean, strict=True)]
    rules = [
        "-" * width if number in text_columns else "-" * (width - 1) + ":"
        for number, width in enumerate(widths)
    ]
    lines = []
    for row in (clean[0], rules, *clean[1:]):
        cells = [
            cell.ljust(width) if number in text_columns else cell.rjust(width)
            for number, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append(f"| {_GAP.join(cells)} |")
    return "\n".join(lines)


def wide_table(
    head: str,
    labels: Sequence[str],
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
) -> str:
    """Write a table of many columns in blocks that fit the page.

    Parameters
    ----------
    head : str
        Of the first column, which every block repeats.
    labels : sequence of str
        The first column.
    heads : sequence of str
        Of the other columns.
    rows : sequence of sequence of str

    Returns
    -------
    str
    """
    columns = list(zip(heads, *rows, strict=True))
    widths = [max(3, *map(len, column)) + len(_GAP) for column in columns]
    room = WIDTH - max(3, len(head), *map(len, labels)) - 2 * len(_GAP)
    per_block = max(1, room // max(widths))
    # As many blocks as it takes, all about as wide as each other.
    n_blocks = -(-len(columns) // per_block)
    per_block = -(-len(columns) // n_blocks)
    blocks = []
    for first in range(0, len(columns), per_block):
        part = slice(first, first + per_block)
        lines = [(label, *row[part]) for label, row in zip(labels, rows, strict=True)]
        blocks.append(table((head, *heads[part]), lines))
    return "\n\n".join(blocks)
