"""Figures of the calibration: records in, figures out; those of the report are in ``figures``.

What all drawings share: sheets that are used again, and the PNG file.
"""

import io
import warnings
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.data.as_measured import as_measured
from hwid_cli.records.recordings import CalibrationLog, Recording

# Inches and dots: 800 x 500 pixels, fast to draw and sharp enough to judge a cut.
_SIZE, DOTS = (8.0, 5.0), 100
# Higher levels make files a tenth smaller in a third more time, [-].
_COMPRESSION = 3
# Sheets that were drawn on, by what they are for; None where each drawing gets its own.
_used: ContextVar[dict[Hashable, Figure] | None] = ContextVar("used", default=None)
_SHEETS: dict[Hashable, Figure] = {}


@contextmanager
def shared_sheets() -> Iterator[None]:
    """Draw on sheets that were used before: axes and their ticks take a third of the time.

    For figures that become a file at once; the next one of its kind wipes a sheet.
    """
    token = _used.set(_SHEETS)
    try:
        yield
    finally:
        _used.reset(token)


def sheet(kind: Hashable, make: Callable[[], Figure]) -> Figure:
    """Give a figure with empty axes.

    Parameters
    ----------
    kind : hashable
        What it is for. Whoever draws on a sheet of a kind sets the same labels, limits and
        formats each time: only what was drawn is wiped.
    make : callable
        Gives a new one.
    """
    used = _used.get()
    if used is None:
        return make()
    if kind in used:
        for axes in used[kind].axes:
            _wipe(axes)
    else:
        used[kind] = make()
    return used[kind]


def _wipe(axes: Axes) -> None:
    legend = axes.get_legend()
    drawn = (*axes.lines, *axes.patches, *axes.collections, *axes.texts)
    for one in (*drawn, *([] if legend is None else [legend])):
        one.remove()
    axes.relim()
    axes.autoscale()


def calibration_figure(recording: Recording, log: CalibrationLog) -> Figure:
    """Draw a recording before and after calibration.

    Returns
    -------
    Figure
        Input above output over time; what was cut is shaded, repaired samples are
        marked.

    Raises
    ------
    ValueError
        If the log does not hold what was removed.
    """
    measured = as_measured(recording, log)
    if measured is None:
        raise ValueError(f"{log.name}: the log does not hold what was removed")
    figure = sheet("calibration", _blank)
    upper, lower = figure.axes
    step = recording.sample_time_s
    columns = (
        (upper, recording.input, log.repaired_input),
        (lower, recording.output, log.repaired_output),
    )
    for (axes, after, repaired), before in zip(columns, measured, strict=True):
        _draw_column(axes, before, after, repaired, log, step)
    steps = ", ".join(log.steps) or "as it is"
    upper.set_title(f"{log.name}: {steps}", loc="left", fontsize="medium")
    upper.set_ylabel(f"input u [{recording.input_unit}]")
    lower.set_ylabel(f"output y [{recording.output_unit}]")
    lower.set_xlabel("time t in the raw record [s]")
    # Above the axes, where no curve is.
    upper.legend(
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=4,
        fontsize="small",
        frameon=False,
    )
    return figure


def _blank() -> Figure:
    figure = Figure(figsize=_SIZE, dpi=DOTS)
    # Fixed margins: a layout engine draws everything twice.
    figure.subplots_adjust(left=0.12, right=0.98, top=0.93, bottom=0.1, hspace=0.08)
    figure.subplots(2, 1, sharex=True)
    return figure


def _draw_column(
    axes: Axes,
    before: np.ndarray,
    after: np.ndarray,
    repaired: tuple[int, ...],
    log: CalibrationLog,
    step: float,
) -> None:
    first, last = log.first_sample, log.first_sample + log.n_samples
    axes.plot(step * np.arange(before.size), before, color="0.6", lw=0.8, label="raw")
    axes.plot(
        step * np.arange(first, last), after, color="C0", lw=0.8, label="calibrated"
    )
    stretches = [(0, first), (last, before.size)]
    for start, stop in [part for part in stretches if part[1] > part[0]]:
        label = "" if axes.patches else "cut"
        axes.axvspan(step * start, step * stop, color="0.9", lw=0, label=label)
    if repaired:
        axes.plot(
            step * np.array(repaired),
            before[list(repaired)],
            "x",
            color="C3",
            label="repaired",
        )


def as_png(figure: Figure) -> bytes:
    """Render a figure.

    Returns
    -------
    bytes
        A PNG file.
    """
    buffer = io.BytesIO()
    with warnings.catch_warnings():
        # Names of recordings may be Chinese: a box in a figure, whole in page and tables.
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from", UserWarning)
        # No software name or date: the same figure gives the same bytes.
        figure.savefig(
            buffer,
            format="png",
            metadata={"Software": None},
            pil_kwargs={"compress_level": _COMPRESSION},
        )
    return buffer.getvalue()
