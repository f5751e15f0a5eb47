"""Figures of the calibration: records in, figures out; those of the report are in ``figures``."""

import io
import warnings

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.recordings import CalibrationLog, RawRecording, Recording

# Inches and dots: 800 x 500 pixels, fast to draw and sharp enough to judge a cut.
_SIZE, DOTS = (8.0, 5.0), 100


def calibration_figure(
    raw: RawRecording, recording: Recording, log: CalibrationLog
) -> Figure:
    """Draw a recording before and after calibration.

    Returns
    -------
    Figure
        Input above output over time; what was cut is shaded, repaired samples are
        marked.
    """
    figure = Figure(figsize=_SIZE, dpi=DOTS)
    # Fixed margins: a layout engine draws everything twice.
    figure.subplots_adjust(left=0.12, right=0.98, top=0.93, bottom=0.1, hspace=0.08)
    upper, lower = figure.subplots(2, 1, sharex=True)
    _draw_column(upper, raw.input, recording.input, log.repaired_input, log, raw)
    _draw_column(lower, raw.output, recording.output, log.repaired_output, log, raw)
    steps = ", ".join(log.steps) or "as it is"
    upper.set_title(f"{raw.name}: {steps}", loc="left", fontsize="medium")
    upper.set_ylabel(f"input u [{raw.input_unit}]")
    lower.set_ylabel(f"output y [{raw.output_unit}]")
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


def _draw_column(
    axes: Axes,
    before: np.ndarray,
    after: np.ndarray,
    repaired: tuple[int, ...],
    log: CalibrationLog,
    raw: RawRecording,
) -> None:
    step = raw.sample_time_s
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
        figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()
