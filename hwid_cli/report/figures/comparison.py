"""The figure of models side by side."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.comparison import Comparison
from hwid_cli.records.units import behind
from hwid_cli.report.comparison import model_letters, start_notes
from hwid_cli.report.figures.style import (
    BLACK,
    FULL_WIDTH,
    GREY,
    LINES,
    new_figure,
    number_decades,
    styled,
)
from hwid_cli.report.formats import number

# Of the figure, of that of one recording, and of a line of its legend, [inch].
_HEIGHT, _HEIGHT_OF_ONE, _LINE = 7.5, 5.0, 0.2
# More recordings than this leave no room for their names, [-].
_MOST_NAMES = 40
# Names of models are cut to this length in the legend, [characters].
_LONGEST = 60


@styled
def comparison_figure(comparison: Comparison) -> Figure:
    """Draw the RMSD of each model on each recording, and one recording in full.

    Returns
    -------
    Figure
        Above the RMSDs, filled where the model was identified on the recording; below
        measured and simulated outputs where the models differ most, and what they leave.
        A single recording is only shown in full.
    """
    is_single = len(comparison.recordings) == 1
    height = _HEIGHT_OF_ONE if is_single else _HEIGHT
    figure = new_figure(FULL_WIDTH, height)
    head = 1.0 - (0.55 + _LINE * len(comparison.models)) / height
    edges: dict[str, Any] = {"left": 0.075, "right": 0.99, "hspace": 0.12}
    if not is_single:
        upper = figure.add_subplot(
            figure.add_gridspec(1, 1, top=head, bottom=0.62, **edges)[0]
        )
        _draw_deviations(upper, comparison)
    below = figure.add_gridspec(
        2, 1, top=head if is_single else 0.48, bottom=0.6 / height, **edges
    )
    middle = figure.add_subplot(below[0])
    lower = figure.add_subplot(below[1], sharex=middle)
    middle.tick_params(labelbottom=False)
    _draw_outputs(middle, comparison)
    _draw_rests(lower, comparison)
    # Lines where there are no markers.
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper left", bbox_to_anchor=(0.07, 0.995))
    return figure


def _labels(comparison: Comparison) -> list[str]:
    """Names in the legend; the RMSD too where no panel shows it."""
    labels = []
    for n, letter in enumerate(model_letters(comparison)):
        name = comparison.models[n].name
        name = name if len(name) <= _LONGEST else f"...{name[-_LONGEST:]}"
        labels.append(f"{letter}: {name}")
        if len(comparison.recordings) == 1:
            unit = behind(comparison.output_unit)
            labels[-1] += f", RMSD {number(comparison.rmsd[n, 0])}{unit}"
    return labels


def _draw_deviations(axes: Axes, comparison: Comparison) -> None:
    places = np.arange(len(comparison.recordings))
    for n, label in enumerate(_labels(comparison)):
        line = LINES[n % len(LINES)]
        own = comparison.is_own[n]
        common = {"ls": "none", "marker": line["marker"], "color": line["color"]}
        axes.plot(places, comparison.rmsd[n], **common, mfc="none", label=label)
        axes.plot(places[own], comparison.rmsd[n][own], **common)
    axes.set_yscale("log")
    known = comparison.rmsd[np.isfinite(comparison.rmsd) & (comparison.rmsd > 0)]
    if known.size:
        low, high = 0.7 * float(known.min()), 1.4 * float(known.max())
        axes.set_ylim(low, high)
        number_decades(axes.yaxis, low, high)
    axes.set_ylabel(f"RMSD [{comparison.output_unit}]")
    start = start_notes(comparison)[0]
    axes.set_title(f"{start} Filled: identified on it.")
    if len(places) <= _MOST_NAMES:
        axes.set_xticks(places, comparison.recordings, rotation=30, ha="right")
    else:
        axes.set_xlabel("recording [-]")


def _draw_outputs(axes: Axes, comparison: Comparison) -> None:
    shown = comparison.shown
    axes.plot(shown.time_s, shown.measured, color=GREY, lw=2.0)
    for n, label in enumerate(_labels(comparison)):
        line, simulated = LINES[n % len(LINES)], _finite(shown.simulated[n])
        style = {"color": line["color"], "ls": line["ls"], "lw": 1, "label": label}
        axes.plot(shown.time_s, simulated, **style)
    axes.set_ylim(*_limits(shown.measured))
    axes.set_ylabel(f"output y [{comparison.output_unit}]")
    if len(comparison.recordings) > 1:
        axes.set_title(f"{shown.name}, where the models differ most (grey: measured)")
        return
    start = start_notes(comparison)[0]
    axes.set_title(f"{shown.name} (grey: measured). {start}")


def _draw_rests(axes: Axes, comparison: Comparison) -> None:
    shown = comparison.shown
    axes.axhline(0.0, color=BLACK, lw=0.6)
    for n, simulated in enumerate(shown.simulated):
        line = LINES[n % len(LINES)]
        rest = _finite(shown.measured - simulated)
        axes.plot(shown.time_s, rest, color=line["color"], ls=line["ls"], lw=1)
    low, high = _limits(shown.measured)
    axes.set_ylim(-0.5 * (high - low), 0.5 * (high - low))
    axes.set_ylabel(f"y - yh [{comparison.output_unit}]")
    axes.set_xlabel("time t [s]")


def _finite(values: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(values), values, np.nan)


def _limits(measured: np.ndarray) -> tuple[float, float]:
    """Room around the measured output: a model that diverges must not squeeze it."""
    low, high = float(measured.min()), float(measured.max())
    room = 0.25 * (high - low)
    return low - room, high + room
