"""RMSDs of models on recordings, and over the orders, as coloured tables of the page."""

import math
from collections.abc import Callable

import numpy as np

from hwid_cli.records.report import OrderGrid, RmsdMatrix
from hwid_cli.records.units import behind
from hwid_cli.report.formats import MISSING
from hwid_cli.report.table import Cell, Column, Row, Table
from hwid_cli.report.terms import NK_WORDS

# Digits of a power of ten.
_RAISED = str.maketrans(
    "-0123456789",
    "\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ZERO}\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT TWO}"
    "\N{SUPERSCRIPT THREE}\N{SUPERSCRIPT FOUR}\N{SUPERSCRIPT FIVE}\N{SUPERSCRIPT SIX}"
    "\N{SUPERSCRIPT SEVEN}\N{SUPERSCRIPT EIGHT}\N{SUPERSCRIPT NINE}",
)
# A number of a cell has so many digits at least.
_DIGITS = 2


def rmsd_matrix_table(matrix: RmsdMatrix, count: str = "covers") -> Table:
    """Show some models on some recordings; dark is a low RMSD, whatever the rest.

    Parameters
    ----------
    count : str
        What the last column counts: with the model's own recordings or without.

    Returns
    -------
    Table
        Models in the rows; what lies below the threshold and a model's own recordings are
        set apart.
    """
    factor, unit = _scale(matrix.rmsd, matrix.unit)
    depth = _depths(matrix.rmsd)
    rows: list[Row] = []
    for row, model in enumerate(matrix.models):
        cells = [
            _cell(
                value,
                factor,
                depth,
                is_own=bool(matrix.is_own[row, column]),
                is_below=bool(value < matrix.threshold),
            )
            for column, value in enumerate(matrix.rmsd[row])
        ]
        rows.append((model, *cells, str(matrix.covers[row])))
    return Table(
        f"RMSD{unit}: models in rows, recordings in columns; darker is better, underlined is "
        "below the threshold, dashed frames are recordings of the model's own fit",
        (
            Column("model", is_text=True),
            *(Column(name) for name in matrix.recordings),
            Column(count),
        ),
        tuple(rows),
        is_matrix=True,
    )


def order_grid_table(grid: OrderGrid, place: int) -> Table:
    """Show the RMSD of one recording's models over their orders, in its own colours.

    Parameters
    ----------
    place : int
        Of the recording.
    """
    values = grid.rmsd[place]
    factor, unit = _scale(values, grid.unit)
    depth = _depths(values)
    lowest = np.nanmin(values) if np.isfinite(values).any() else math.nan
    rows: tuple[Row, ...] = tuple(
        (
            f"nb = {nb}",
            *(_cell(value, factor, depth, is_best=value == lowest) for value in row),
        )
        for nb, row in zip(grid.nb, values, strict=True)
    )
    axis = NK_WORDS.get(grid.nk_role, grid.nk_role)
    return Table(
        f"{grid.recordings[place]}: RMSD{unit} on the own recording over nb (coefficients of "
        f"the numerator) and nk ({axis}); darker is better, the frame is the best",
        (
            Column("nb \\ nk", is_text=True),
            *(Column(f"nk = {nk}") for nk in grid.nk),
        ),
        rows,
        is_matrix=True,
    )


def _scale(values: np.ndarray, unit: str) -> tuple[float, str]:
    """A power of ten that leaves short numbers, and what stands in the brackets."""
    usable = values[np.isfinite(values) & (values > 0.0)]
    if not usable.size:
        return 1.0, f" [{unit}]"
    # Of logarithms: two that run away may be more together than a float holds.
    power = 3 * math.floor(float(np.median(np.log10(usable))) / 3)
    if power == 0:
        return 1.0, f" [{unit}]"
    raised = f"10{str(power).translate(_RAISED)}"
    return 10.0**-power, f" [{raised}{behind(unit)}]"


def _depths(values: np.ndarray) -> Callable[[float], float]:
    """Depth of a colour, on a logarithmic scale from the highest to the lowest number."""
    usable = values[np.isfinite(values) & (values > 0.0)]
    low, high = (usable.min(), usable.max()) if usable.size else (1.0, 1.0)
    span = math.log(high / low)

    def depth(value: float) -> float:
        if span == 0.0 or value <= 0.0:
            return 1.0
        return math.log(high / value) / span

    return depth


def _cell(
    value: float,
    factor: float,
    depth: Callable[[float], float],
    *,
    is_own: bool = False,
    is_below: bool = False,
    is_best: bool = False,
) -> Cell:
    if not np.isfinite(value):
        return Cell(MISSING)
    looks = [
        name
        for name, is_it in (("own", is_own), ("below", is_below), ("best", is_best))
        if is_it
    ]
    return Cell(_short(value * factor), share=depth(value), look=" ".join(looks))


def _short(value: float) -> str:
    """Two digits at least, and no powers of ten where four characters do.

    Examples
    --------
    >>> _short(0.1234), _short(3.456), _short(456.7), _short(123456.0)
    ('0.12', '3.5', '457', '1e+05')
    """
    if value >= 1e4 or 0.0 < value < 1e-2:
        return f"{value:.0e}"
    before = math.floor(math.log10(value)) + 1 if value > 0.0 else 1
    return f"{value:.{max(0, _DIGITS - max(before, 0))}f}"
