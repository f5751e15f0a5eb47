"""Figures of one model: its static maps, its frequency response, its poles and zeros."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.report import MapCurve, ModelView
from hwid_cli.report.figures.style import (
    BLACK,
    BLUE,
    HALF_WIDTH,
    VERMILLION,
    label_with_factor,
    new_figure,
    number_decades,
    styled,
)

# A zero on the unit circle would stretch the axis without end, [-].
_DEEPEST = 1e-5
_HEIGHT = 3.4
_WIDTH = 0.66 * HALF_WIDTH


@styled
def maps_figure(view: ModelView) -> Figure:
    """Draw the two static maps with their corners: break-points, knots or edges.

    Returns
    -------
    Figure
        Input map f on the left, output map g on the right.
    """
    figure = new_figure(HALF_WIDTH, _HEIGHT)
    figure.subplots_adjust(left=0.13, right=0.98, top=0.9, bottom=0.13, wspace=0.42)
    left, right = figure.subplots(1, 2)
    _draw_map(left, view.input_curve)
    _draw_map(right, view.output_curve)
    left.set_title("input map w = f(u)")
    left.set_xlabel(f"input u [{view.input_unit}]")
    left.set_ylabel(f"w [{view.input_unit}]")
    right.set_title("output map y = g(x)")
    right.set_xlabel(f"x [{view.input_unit}]")
    right.set_ylabel(f"output y [{view.output_unit}]")
    for axes in (left, right):
        label_with_factor(axes)
    return figure


def _draw_map(axes: Axes, curve: MapCurve) -> None:
    axes.plot(curve.argument, curve.value, color=BLUE, lw=1.5)
    axes.plot(curve.corners, curve.corner_values, "o", color=BLUE, ms=4, mfc="w")
    axes.locator_params(nbins=5)


@styled
def bode_figure(view: ModelView) -> Figure:
    """Draw magnitude and phase of the linear block up to half the sampling frequency."""
    response = view.response
    figure = new_figure(_WIDTH, _HEIGHT)
    figure.subplots_adjust(left=0.19, right=0.96, top=0.9, bottom=0.13, hspace=0.14)
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.loglog(response.frequency_Hz, response.magnitude, color=BLUE, lw=1.4)
    lower.semilogx(response.frequency_Hz, response.phase_deg, color=BLUE, lw=1.4)
    top = float(response.magnitude.max())
    least = float(response.magnitude.min())
    upper.set_ylim(max(0.7 * least, _DEEPEST * top), 1.5 * top)
    upper.set_title("linear block from w to x")
    upper.set_ylabel(f"|B/F| [{view.input_unit}/{view.input_unit}]")
    lower.set_ylabel("phase [deg]")
    lower.set_xlabel("frequency [Hz]")
    lower.locator_params(axis="y", nbins=5)
    lower.set_xlim(response.frequency_Hz[0], response.frequency_Hz[-1])
    number_decades(lower.xaxis, *lower.get_xlim())
    number_decades(upper.yaxis, *upper.get_ylim())
    for axes in (upper, lower):
        axes.yaxis.set_label_coords(-0.15, 0.5)
    return figure


@styled
def poles_figure(view: ModelView) -> Figure:
    """Draw poles and zeros of the linear block and the unit circle.

    Returns
    -------
    Figure
        Zeros far outside are left out and named in the title.
    """
    figure = new_figure(_WIDTH, _HEIGHT)
    axes = figure.add_axes((0.17, 0.13, 0.8, 0.77))
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(np.cos(angle), np.sin(angle), color="#555555", lw=0.9)
    axes.axhline(0.0, color="#bbbbbb", lw=0.7)
    axes.axvline(0.0, color="#bbbbbb", lw=0.7)
    far = int(np.sum(np.abs(view.zeros) > _FAR))
    axes.plot(
        view.zeros.real, view.zeros.imag, "o", color=VERMILLION, mfc="none", ms=6.5
    )
    axes.plot(view.poles.real, view.poles.imag, "x", color=BLUE, ms=7, mew=1.8)
    # Drawn without data, so that a legend is there even where nothing is.
    axes.plot([], [], "x", color=BLUE, ms=7, mew=1.8, label="poles")
    axes.plot([], [], "o", color=VERMILLION, mfc="none", ms=6.5, label="zeros")
    near = np.abs(view.zeros[np.abs(view.zeros) <= _FAR])
    reach = 1.12 * max([1.05, *near, *np.abs(view.poles)])
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    axes.set_xlabel("real part [-]")
    axes.set_ylabel("imaginary part [-]")
    more = f"; {far} further out" if far else ""
    axes.set_title(f"poles and zeros{more}", color=BLACK)
    axes.legend(loc="upper left", fontsize=7.5, handletextpad=0.1, borderpad=0.1)
    return figure


# Zeros beyond this distance from the origin would squeeze the unit circle, [-].
_FAR = 2.5
