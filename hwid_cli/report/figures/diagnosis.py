"""Figures of a diagnosis: all of them by their names, and the gap in every recording."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.diagnosis import (
    Diagnosis,
    RecordingGap,
)
from hwid_cli.records.units import behind
from hwid_cli.report.figures.diagnosis_bars import (
    label_room,
    ranking_figure,
    set_log_limits,
    shortened,
    shown_candidates,
    shown_places,
    where_figure,
)
from hwid_cli.report.figures.diagnosis_curves import force_figure, overlay_figure
from hwid_cli.report.figures.style import (
    BLACK,
    BLUE,
    GREY,
    VERMILLION,
    new_figure,
    styled,
)

# Width, a row, the room above a panel for its title and below all, [inch].
_WIDTH, _GAP_ROW, _TITLE, _BELOW_GAPS = 7.2, 0.19, 0.34, 0.48
# The legend above all, [inch].
_GAP_LEGEND = 0.28


def diagnosis_figures(diagnosis: Diagnosis) -> dict[str, Figure]:
    """Draw a diagnosis.

    Returns
    -------
    dict of str to Figure
        ``diagnosis_gap``, ``_overlay``, ``_force``, ``_ranking`` and ``_where``, without
        those that there is nothing for.
    """
    return {name: draw() for name, draw in figure_makers(diagnosis).items()}


def figure_makers(diagnosis: Diagnosis) -> "dict[str, partial[Figure]]":
    """Give what draws each figure that there is something for, none of them drawn yet."""
    is_there = {
        gap_figure: bool(diagnosis.gaps),
        overlay_figure: any(one.measured.size for one in diagnosis.overlays),
        force_figure: any(one.at.size for one in diagnosis.latent_force),
        ranking_figure: bool(shown_candidates(diagnosis)),
        where_figure: bool(shown_places(diagnosis)),
    }
    return {
        f"diagnosis_{draw.__name__.removesuffix('_figure')}": partial(draw, diagnosis)
        for draw, is_it in is_there.items()
        if is_it
    }


@styled
def gap_figure(diagnosis: Diagnosis) -> Figure:
    """Draw the RMS gap of every recording: as given, re-fitted, with the effects.

    Parameters
    ----------
    diagnosis : Diagnosis
        With recordings.

    Returns
    -------
    Figure
        Held-out recordings above those that the fits have seen; a dashed line is the
        noise.
    """
    groups = [
        (title, [one for one in diagnosis.gaps if one.is_held_out == is_held_out])
        for title, is_held_out in (("held-out", True), ("trained on", False))
    ]
    groups = [group for group in groups if group[1]]
    names = [shortened(one.name, 30) for one in diagnosis.gaps]
    left = label_room(names)
    tall = [_GAP_ROW * len(gaps) + 0.1 for _, gaps in groups]
    height = _GAP_LEGEND + sum(tall) + _TITLE * len(groups) + _BELOW_GAPS
    figure = new_figure(_WIDTH, height)
    top = height - _GAP_LEGEND
    # Panels share their axis by its limits: only the lowest shows numbers.
    for number, (title, gaps) in enumerate(groups):
        bottom = top - _TITLE - tall[number]
        axes = figure.add_axes(
            (
                left / _WIDTH,
                bottom / height,
                1 - (left + 0.2) / _WIDTH,
                tall[number] / height,
            )
        )
        _draw_gaps(axes, gaps, diagnosis)
        axes.set_title(f"{title}: {len(gaps)}", pad=4)
        axes.tick_params(labelbottom=number == len(groups) - 1)
        top = bottom
    figure.axes[-1].set_xlabel(f"RMS of the residual [{diagnosis.output_unit}]")
    figure.legend(
        handles=figure.axes[0].get_lines(),
        loc="upper left",
        bbox_to_anchor=(0.1 / _WIDTH, 1.0),
        ncols=4,
        columnspacing=1.2,
        handletextpad=0.5,
    )
    return figure


def _draw_gaps(axes: Axes, gaps: Sequence[RecordingGap], diagnosis: Diagnosis) -> None:
    rows = np.arange(len(gaps))
    for label, every, style in _series(diagnosis.gaps, diagnosis):
        of_panel = [
            value
            for value, one in zip(every, diagnosis.gaps, strict=True)
            if one in gaps
        ]
        axes.plot(of_panel, rows, ls="", label=label, **style)
    noise = diagnosis.noise.rms
    has_noise = np.isfinite(noise) and noise > 0.0
    if has_noise:
        told = f"noise {noise:.2g}{behind(diagnosis.output_unit)}"
        axes.axvline(noise, color=BLACK, lw=1.1, ls=(0, (2, 2)), label=told)
    values = [every for _, every, _ in _series(diagnosis.gaps, diagnosis)]
    set_log_limits(axes, np.append(np.concatenate(values), noise))
    axes.set_yticks(rows, [shortened(one.name, 30) for one in gaps])
    axes.set_ylim(len(gaps) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)


def _series(
    gaps: Sequence[RecordingGap], diagnosis: Diagnosis
) -> list[tuple[str, np.ndarray, dict[str, Any]]]:
    """What is drawn, told apart by marker and colour; NaN where there is no number."""
    found = [
        (
            "as given",
            np.array([one.rms_given for one in gaps]),
            {"marker": "D", "color": GREY, "mfc": "w", "ms": 5},
        ),
        (
            "re-fitted",
            np.array([one.rms_before for one in gaps]),
            {"marker": "s", "color": VERMILLION, "ms": 5},
        ),
    ]
    if diagnosis.effects:
        after = np.array([one.rms_after for one in gaps])
        found.append(
            ("with the effects", after, {"marker": "o", "color": BLUE, "ms": 5.5})
        )
    # A logarithmic axis has no place for zero.
    return [
        (label, np.where(np.isfinite(values) & (values > 0.0), values, np.nan), style)
        for label, values, style in found
    ]
