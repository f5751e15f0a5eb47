"""Figures of trust: a prediction with its band, and the map of what was visited."""

import numpy as np
from matplotlib.figure import Figure

from hwid_cli.records.next import InputMap
from hwid_cli.records.trust import ShownBand
from hwid_cli.report.figures.style import (
    BLACK,
    BLUE,
    FULL_WIDTH,
    GREEN,
    HALF_WIDTH,
    SKY,
    VERMILLION,
    label_with_factor,
    new_figure,
    number_decades,
    styled,
)

# Points of a curve that a page shows; more are told apart by nobody.
_MOST_POINTS = 2000


@styled
def band_figure(shown: ShownBand) -> Figure:
    """Draw a prediction and its band beside what was measured, and the trust strip.

    Returns
    -------
    Figure
        The strip below is green where the prediction rests on data in every respect.
    """
    every = max(1, shown.time_s.size // _MOST_POINTS)
    part = slice(None, None, every)
    time = shown.time_s[part]
    figure = new_figure(FULL_WIDTH, 3.6)
    figure.subplots_adjust(left=0.08, right=0.98, top=0.92, bottom=0.14, hspace=0.08)
    axes, strip = figure.subplots(2, 1, sharex=True, height_ratios=[12, 1])
    low, high = shown.lower[part], shown.upper[part]
    axes.fill_between(time, low, high, color=SKY, alpha=0.45, lw=0, label="90 % band")
    axes.plot(time, shown.measured[part], color=BLACK, lw=1.0, label="measured")
    output = shown.output[part]
    axes.plot(time, output, color=BLUE, lw=1.2, ls="--", label="predicted")
    axes.set_ylabel(f"output [{shown.unit}]")
    label_with_factor(axes)
    # Room for the legend above the curves.
    axes.margins(y=0.16)
    axes.set_title(f"{shown.model} on {shown.recording}")
    axes.legend(loc="upper right", ncols=3)
    inside = shown.is_inside[part]
    for is_in, colour in ((True, GREEN), (False, VERMILLION)):
        strip.fill_between(
            time, 0.0, 1.0, where=inside == is_in, color=colour, lw=0, step="post"
        )
    strip.set_yticks([])
    strip.set_ylim(0.0, 1.0)
    strip.grid(visible=False)
    strip.set_xlabel("time [s]; green: rests on data, red: beyond what was visited")
    return figure


@styled
def visited_figure(found: InputMap, unit: str) -> Figure:
    """Draw the largest amplitude in each octave: visited, proposed, on offer."""
    figure = new_figure(HALF_WIDTH, 3.2)
    figure.subplots_adjust(left=0.13, right=0.97, top=0.95, bottom=0.17)
    axes = figure.subplots()
    low = found.octaves_Hz / 2.0
    edges = np.append(found.octaves_Hz, low[-1])
    for table, colour, style, label in (
        (found.reachable, BLACK, ":", "on offer and visited"),
        (found.proposed, VERMILLION, "--", "with the proposals"),
        (found.visited, BLUE, "-", "visited"),
    ):
        largest = table.max(axis=1)
        heights = np.append(largest, largest[-1])
        axes.step(
            edges, heights, where="post", color=colour, ls=style, lw=1.6, label=label
        )
    axes.set_xscale("log")
    number_decades(axes.xaxis, edges[-1], edges[0])
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("frequency [Hz], in octaves; the lowest holds all that is slower")
    axes.set_ylabel(f"largest amplitude [{unit}]")
    axes.legend(loc="upper right")
    return figure
