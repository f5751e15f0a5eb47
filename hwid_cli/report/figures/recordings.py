"""Figures of single recordings: measurement, simulation and what is left between."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.report import SimulatedRecording
from hwid_cli.report.figures.style import (
    BLUE,
    GREY,
    HALF_WIDTH,
    VERMILLION,
    label_with_factor,
    new_figure,
    styled,
)
from hwid_cli.report.plots import sheet

# Up to so many samples each of them is marked, [samples].
_MOST_MARKED = 250


@styled
def simulation_figure(simulated: SimulatedRecording, *, is_detail: bool) -> Figure:
    """Draw a simulation over its measurement, and the residual beneath.

    Parameters
    ----------
    is_detail : bool
        Whether only the stretch of ``simulated.detail`` is shown.

    Returns
    -------
    Figure
        The whole recording shades where the detail lies.
    """
    recording = simulated.recording
    step = recording.sample_time_s
    first, end = simulated.detail if is_detail else (0, recording.n_samples)
    time = step * np.arange(first, end)
    figure = sheet("simulation", _blank)
    upper, lower = figure.axes
    _draw_outputs(upper, simulated, time, slice(first, end))
    lower.axhline(0.0, color="#555555", lw=0.7)
    lower.plot(time, simulated.residual[first:end], color=VERMILLION, lw=0.9)
    upper.set_title("detail" if is_detail else recording.name, pad=6)
    upper.set_ylabel(f"output y [{recording.output_unit}]")
    lower.set_ylabel(f"residual e [{recording.output_unit}]")
    lower.set_xlabel("time t [s]")
    lower.set_xlim(time[0], time[-1])
    for axes in (upper, lower):
        if not is_detail:
            shown = (step * simulated.detail[0], step * simulated.detail[1])
            axes.axvspan(*shown, color=BLUE, alpha=0.10, lw=0)
        label_with_factor(axes)
        # One column of labels, whatever the width of the ticks.
        axes.yaxis.set_label_coords(-0.125, 0.5)
    # Above the axes, where no curve is.
    upper.legend(
        loc="lower right", bbox_to_anchor=(1.01, 0.99), ncols=2, handlelength=2.6
    )
    return figure


def _blank() -> Figure:
    figure = new_figure(HALF_WIDTH, 3.9)
    figure.subplots_adjust(left=0.15, right=0.97, top=0.86, bottom=0.125, hspace=0.12)
    figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    return figure


def _draw_outputs(
    axes: Axes, simulated: SimulatedRecording, time: np.ndarray, shown: slice
) -> None:
    """Thick and grey what was measured, thin and dashed on it what was simulated."""
    axes.plot(
        time,
        simulated.recording.output[shown],
        color="#b5b5b5",
        lw=3.2,
        marker="." if time.size <= _MOST_MARKED else "",
        ms=4.5,
        mec=GREY,
        mfc=GREY,
        label="measured y",
    )
    axes.plot(
        time,
        simulated.output[shown],
        color=BLUE,
        lw=1.2,
        ls=(0, (5, 1.6)),
        label="simulated",
    )
