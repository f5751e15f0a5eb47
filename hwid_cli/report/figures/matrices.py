"""Heat maps: RMSD over the orders, and of models on recordings."""

from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from hwid_cli.records.report import OrderGrid, RmsdMatrix
from hwid_cli.report.figures.style import (
    BLACK,
    FULL_WIDTH,
    HEAT,
    mark_missing,
    new_figure,
    number_decades,
    styled,
)

# Colours go from the lowest RMSD, or the threshold, to this many times of it, [-].
_MOST_COLOURS = 1e3
# Small maps in a row, the room of one of them and what stands beside them, [inch].
_MOST_COLUMNS, _ROOM, _MARGINS = 6, 1.55, 1.9
# Side of a cell of the matrix, at most and at least, [inch].
_LARGEST_CELL, _SMALLEST_CELL = 0.42, 0.17
# Right of a matrix, and from where its colour bar with numbers and label is, [inch].
_RIGHT, _BAR = 1.75, 1.05
# A character of a label, [inch].
_CHARACTER = 0.072


def _scale(values: np.ndarray, threshold: float | None = None) -> LogNorm:
    """Logarithmic colours over what there is, a threshold within.

    One model that goes astray must not take the colours from all others: they end above
    the lowest value, or the threshold, by a factor.
    """
    positive = values[np.isfinite(values) & (values > 0.0)]
    if positive.size == 0:
        return LogNorm(0.1, 1.0)
    low, high = float(positive.min()), float(positive.max())
    if threshold is not None:
        low, high = min(low, threshold), max(high, threshold)
    high = min(high, _MOST_COLOURS * (low if threshold is None else threshold))
    return LogNorm(low, high) if high > 1.01 * low else LogNorm(low / 2.0, high * 2.0)


def _ends(values: np.ndarray, scale: LogNorm) -> Literal["max", "neither"]:
    """Whether the colour bar needs an arrow for values beyond its end."""
    is_beyond = np.nanmax(values, initial=0.0) > (scale.vmax or np.inf)
    return "max" if is_beyond else "neither"


@styled
def order_grid_figure(grid: OrderGrid) -> Figure:
    """Draw a heat map of RMSD over the orders for each recording.

    Returns
    -------
    Figure
        One colour bar for all; a ring marks the best model of each.
    """
    count = len(grid.recordings)
    rows = -(-count // _MOST_COLUMNS)
    # As many in each row, so that no row is nearly empty.
    columns = -(-count // rows)
    width, height = _MARGINS + columns * _ROOM, rows * _ROOM + 1.0
    figure = new_figure(width, height)
    figure.subplots_adjust(
        left=0.6 / width,
        right=1 - 1.3 / width,
        top=1 - 0.3 / height,
        bottom=0.55 / height,
        wspace=0.22,
        hspace=0.38,
    )
    every = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    scale = _scale(grid.rmsd)
    second = "poles nk" if grid.nk_role == "poles" else "delay nk [samples]"
    for number, axes in enumerate(every.ravel()):
        if number >= count:
            axes.set_visible(False)
            continue
        mesh = _draw_grid(axes, grid, number, scale)
        is_lowest = number + columns >= count
        axes.tick_params(labelbottom=is_lowest)
        if is_lowest:
            axes.set_xlabel(second)
        if number % columns == 0:
            axes.set_ylabel("numerator nb")
    bar_height = min(0.8, 3.0 / height)
    place = figure.add_axes(
        (1 - _BAR / width, 0.5 - bar_height / 2, 0.15 / width, bar_height)
    )
    ends = _ends(grid.rmsd, scale)
    figure.colorbar(mesh, cax=place, label=f"RMSD [{grid.unit}]", extend=ends)
    number_decades(place.yaxis, *place.get_ylim())
    return figure


def _draw_grid(axes: Axes, grid: OrderGrid, number: int, scale: LogNorm) -> QuadMesh:
    """One recording's map; the lowest RMSD is ringed."""
    values = grid.rmsd[number]
    axes.grid(visible=False)
    mark_missing(axes)
    masked = np.ma.masked_invalid(values)
    mesh = axes.pcolormesh(masked, cmap=HEAT, norm=scale, edgecolor="w", lw=0.3)
    axes.set_title(grid.recordings[number], fontsize=8.5, pad=3)
    axes.set_xticks(*_thinned(grid.nk))
    axes.set_yticks(*_thinned(grid.nb))
    axes.tick_params(length=0)
    if np.isfinite(values).any():
        row, column = np.unravel_index(np.nanargmin(values), values.shape)
        axes.plot(column + 0.5, row + 0.5, "o", ms=5, mfc="none", mec="w", mew=2.6)
        axes.plot(column + 0.5, row + 0.5, "o", ms=5, mfc="none", mec=BLACK, mew=1.0)
    return mesh


def _thinned(orders: tuple[int, ...]) -> tuple[list[float], list[str]]:
    """Ticks in the middle of cells, few enough to be read."""
    step = -(-len(orders) // 6)
    places = range(0, len(orders), step)
    return [place + 0.5 for place in places], [str(orders[place]) for place in places]


@styled
def rmsd_matrix_figure(matrix: RmsdMatrix, *, with_margins: bool = True) -> Figure:
    """Draw the RMSD of models on recordings.

    Parameters
    ----------
    with_margins : bool
        Whether the numbers of what is covered stand at the right and on top.

    Returns
    -------
    Figure
        A white dot marks what a model covers, a square its own recordings.
    """
    rows, columns = matrix.rmsd.shape
    label_width = _CHARACTER * max(map(len, matrix.models)) + 0.35
    label_height = _CHARACTER * max(map(len, matrix.recordings)) + 0.2
    room = FULL_WIDTH - label_width - _RIGHT
    cell = float(np.clip(room / columns, _SMALLEST_CELL, _LARGEST_CELL))
    width = label_width + columns * cell + _RIGHT
    top, bottom = (0.6 if with_margins else 0.2), label_height + 0.3
    height = max(rows * cell, 1.1) + top + bottom
    figure = new_figure(width, height)
    axes = figure.add_axes(
        (
            label_width / width,
            1 - (top + rows * cell) / height,
            columns * cell / width,
            rows * cell / height,
        )
    )
    scale = _scale(matrix.rmsd, matrix.threshold)
    mesh = _draw_matrix(axes, matrix, cell, scale)
    if with_margins:
        _write_margins(axes, matrix)
    tall = min(2.6, max(rows * cell, 1.1))
    bar = figure.add_axes(
        (1 - _BAR / width, 1 - (top + tall) / height, 0.13 / width, tall / height)
    )
    # Beside the numbers: above the bar are its arrow and the counts.
    label = f"RMSD [{matrix.unit}]"
    figure.colorbar(mesh, cax=bar, label=label, extend=_ends(matrix.rmsd, scale))
    number_decades(bar.yaxis, *bar.get_ylim())
    bar.axhline(matrix.threshold, color="w", lw=3.0)
    bar.axhline(matrix.threshold, color=BLACK, lw=1.2)
    return figure


def _draw_matrix(
    axes: Axes, matrix: RmsdMatrix, cell: float, scale: LogNorm
) -> QuadMesh:
    rows, columns = matrix.rmsd.shape
    axes.grid(visible=False)
    mark_missing(axes)
    masked = np.ma.masked_invalid(matrix.rmsd)
    mesh = axes.pcolormesh(masked, cmap=HEAT, norm=scale, edgecolor="w", lw=0.4)
    size = 72.0 * cell
    row, column = np.nonzero(matrix.rmsd < matrix.threshold)
    # White with a dark rim: seen on every colour and in grey.
    axes.plot(column + 0.5, row + 0.5, "o", ms=0.38 * size, mfc="w", mec=BLACK, mew=0.7)
    own_row, own_column = np.nonzero(matrix.is_own)
    for colour, line in (("w", 2.0), (BLACK, 1.0)):
        axes.plot(
            own_column + 0.5,
            own_row + 0.5,
            "s",
            ms=0.78 * size,
            mfc="none",
            mec=colour,
            mew=line,
        )
    small = min(8.5, max(6.0, 0.62 * size))
    axes.set_xticks(np.arange(columns) + 0.5, matrix.recordings, rotation=90)
    axes.set_yticks(np.arange(rows) + 0.5, matrix.models)
    axes.tick_params(length=0, labelsize=small)
    axes.set_xlim(0, columns)
    axes.set_ylim(rows, 0)
    axes.set_xlabel("recording", labelpad=3)
    return mesh


def _write_margins(axes: Axes, matrix: RmsdMatrix) -> None:
    """Counts beside rows and above columns."""
    columns = len(matrix.recordings)
    size = axes.xaxis.get_ticklabels()[0].get_fontsize()
    for number, count in enumerate(matrix.covers):
        axes.text(columns + 0.35, number + 0.5, str(count), va="center", size=size)
    for number, count in enumerate(matrix.covered_by):
        axes.text(number + 0.5, -0.25, str(count), ha="center", va="bottom", size=size)
    axes.annotate(
        "covers",
        (columns, 0),
        xytext=(3, 5),
        textcoords="offset points",
        size=7.5,
        style="italic",
    )
    axes.annotate(
        "covered by",
        (0, 0),
        xytext=(-5, 5),
        textcoords="offset points",
        ha="right",
        size=7.5,
        style="italic",
    )
