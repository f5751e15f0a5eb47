"""Figure of what a model leaves of a recording: correlations with their bands."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.report import SimulatedRecording
from hwid_cli.records.residuals import Correlation
from hwid_cli.report.figures.style import (
    BLUE,
    FULL_WIDTH,
    VERMILLION,
    new_figure,
    styled,
)
from hwid_cli.report.plots import sheet

# Room above the largest value or band, [-].
_HEADROOM = 1.15


@styled
def residuals_figure(simulated: SimulatedRecording) -> Figure:
    """Draw the correlations of a residual with itself, with the input and its square.

    Parameters
    ----------
    simulated : SimulatedRecording
        With its tests.

    Returns
    -------
    Figure
        Values beyond the common band stand out.

    Raises
    ------
    ValueError
        If there are no tests.
    """
    tests = simulated.tests
    if tests is None:
        raise ValueError(
            f"{simulated.recording.name}: no tests of its residual to draw"
        )
    panels = (
        (tests.with_itself, "residual with itself"),
        (tests.with_input, "with the whitened input"),
        (tests.with_square, "with the input's square"),
    )
    # Axes without lags lose their ticks.
    has_lags = tuple(bool(one.lags.size) for one, _ in panels)
    figure = sheet(("residuals", has_lags), _blank)
    for axes, (correlation, title) in zip(figure.axes, panels, strict=True):
        _draw(axes, correlation)
        axes.set_title(title, pad=6)
        axes.set_xlabel("lag [samples]")
    figure.axes[0].set_ylabel("correlation [-]")
    return figure


def _blank() -> Figure:
    figure = new_figure(FULL_WIDTH, 2.7)
    figure.subplots_adjust(left=0.07, right=0.985, top=0.88, bottom=0.19, wspace=0.24)
    figure.subplots(1, 3)
    return figure


def _draw(axes: Axes, correlation: Correlation) -> None:
    lags, values = correlation.lags, correlation.values
    axes.axhline(0.0, color="#555555", lw=0.7)
    if lags.size == 0:
        axes.set(xlim=(0.0, 1.0), ylim=(-1.0, 1.0), xticks=[], yticks=[])
        axes.text(
            0.5, 0.5, "two levels: nothing new", ha="center", transform=axes.transAxes
        )
        return
    axes.fill_between(
        lags, -correlation.band, correlation.band, color=BLUE, alpha=0.14, lw=0
    )
    for sign in (-1.0, 1.0):
        axes.plot(lags, sign * correlation.common_band, color=BLUE, lw=0.8, ls="--")
    is_beyond = np.abs(values) > correlation.common_band
    for chosen, colour, marker in (
        (~is_beyond, BLUE, "o"),
        (is_beyond, VERMILLION, "s"),
    ):
        axes.vlines(lags[chosen], 0.0, values[chosen], color=colour, lw=1.1)
        axes.plot(lags[chosen], values[chosen], marker, color=colour, ms=3.2)
    highest = max(np.abs(values).max(), correlation.common_band.max(), 1e-3)
    axes.set_ylim(-_HEADROOM * highest, _HEADROOM * highest)
    axes.set_xlim(lags[0] - 1, lags[-1] + 1)
