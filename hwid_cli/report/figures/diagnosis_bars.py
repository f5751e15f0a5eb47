"""Figures of a diagnosis whose rows have names: the candidates, and where the error sits."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.candidates import RankedCandidate
from hwid_cli.records.diagnosis import (
    Diagnosis,
    Place,
)
from hwid_cli.report.diagnosis import candidate_name, is_chosen
from hwid_cli.report.figures.style import (
    BLACK,
    BLUE,
    FULL_WIDTH,
    GREY,
    ORANGE,
    new_figure,
    number_decades,
    styled,
)

# Candidates, and places of one sort, that are drawn.
_MOST_CANDIDATES, _MOST_PLACES = 12, 8
# Characters of a name that are shown, and the room of one, [inch].
_MOST_CHARACTERS, _CHARACTER = 38, 0.072
# A row, what stands above and below the rows, and right of the axes, [inch].
_ROW, _ABOVE, _BELOW, _RIGHT = 0.24, 0.55, 0.5, 0.2
# What a share may be on the axis: a candidate that makes all worse ends there, [-].
_LOWEST_SHARE = -0.1
# Between its ends a logarithmic axis has two numbers at least, [-].
_LEAST_RANGE = 6.0
# Sorts of places, and what they are of.
PLACES = {
    "variable": "what the missing force follows",
    "segment": "segments of the steps",
    "harmonic": "harmonics of the sines",
    "recording": "recordings",
}


def shortened(name: str, most: int = _MOST_CHARACTERS) -> str:
    """Leave out the middle of a long name.

    Parameters
    ----------
    most : int, [characters]

    Examples
    --------
    >>> shortened("a_very_long_name_01", most=9), shortened("step_01")
    ('a_ve...01', 'step_01')
    """
    if len(name) <= most:
        return name
    end = (most - 3) // 3
    return f"{name[: most - 3 - end]}...{name[-end:]}"


def label_room(names: Sequence[str]) -> float:
    """Room that names need left of the axes.

    Returns
    -------
    float, [inch]
    """
    return _CHARACTER * max(map(len, names)) + 0.25


def set_log_limits(axes: Axes, values: np.ndarray) -> None:
    """Make the horizontal axis logarithmic, with room for some positive values.

    Parameters
    ----------
    values : ndarray
        What is not finite and positive does not count.
    """
    usable = values[np.isfinite(values) & (values > 0.0)]
    low, high = (usable.min(), usable.max()) if usable.size else (1.0, 1.0)
    room = max((high / low) ** 0.05, (_LEAST_RANGE * low / high) ** 0.5, 1.15)
    axes.set_xscale("log")
    axes.set_xlim(low / room, high * room)
    number_decades(axes.xaxis, *axes.get_xlim())


def shown_candidates(diagnosis: Diagnosis) -> tuple[RankedCandidate, ...]:
    """Choose the candidates that are drawn.

    Returns
    -------
    tuple of RankedCandidate
        The first ones that were fitted; the chosen one and the base alone always.
    """
    fitted = [one for one in diagnosis.candidates if one.is_fitted]
    needed = [one for one in fitted if not one.effects or is_chosen(one)]
    others = [one for one in fitted if one not in needed]
    kept = needed + others[: max(0, _MOST_CANDIDATES - len(needed))]
    return tuple(one for one in fitted if one in kept)


@styled
def ranking_figure(diagnosis: Diagnosis) -> Figure:
    """Draw how well the candidates do on held-out recordings.

    Parameters
    ----------
    diagnosis : Diagnosis
        With candidates that were fitted.

    Returns
    -------
    Figure
        The chosen one is blue with a bold name, those that fit as well are orange.
    """
    shown = shown_candidates(diagnosis)
    names = [shortened(candidate_name(one.effects)) for one in shown]
    left, width = label_room(names), 8.4
    height = _ROW * len(shown) + _ABOVE + _BELOW
    figure = new_figure(width, height)
    figure.subplots_adjust(
        left=left / width,
        right=1 - _RIGHT / width,
        top=1 - _ABOVE / height,
        bottom=_BELOW / height,
        wspace=0.08,
    )
    errors, shares = figure.subplots(1, 2, sharey=True)
    rows = np.arange(len(shown))
    colours = [_colour(one) for one in shown]
    noise = diagnosis.noise.judging_rms
    has_noise = np.isfinite(noise) and noise > 0.0
    rms = np.array([one.held_out_rms for one in shown]) / (noise if has_noise else 1.0)
    errors.scatter(rms, rows, c=colours, s=38, zorder=3)
    set_log_limits(errors, np.append(rms, 1.0) if has_noise else rms)
    if has_noise:
        errors.axvline(1.0, color=BLACK, lw=1.0, ls=(0, (2, 2)))
        errors.set_xlabel("held-out RMS over noise [-]")
    else:
        errors.set_xlabel(f"held-out RMS [{diagnosis.output_unit}]")
    _draw_shares(shares, shown, colours)
    errors.set_yticks(rows, names)
    errors.set_ylim(len(shown) - 0.5, -0.5)
    for axes in (errors, shares):
        axes.tick_params(axis="y", length=0)
    for label, one in zip(errors.get_yticklabels(), shown, strict=True):
        label.set_fontweight("bold" if is_chosen(one) else "normal")
    _explain_colours(figure, diagnosis)
    return figure


def _draw_shares(
    axes: Axes, shown: Sequence[RankedCandidate], colours: Sequence[str]
) -> None:
    explained = np.array([one.explained_share for one in shown])
    lengths = 100.0 * np.clip(explained, _LOWEST_SHARE, 1.0)
    axes.barh(np.arange(len(shown)), lengths, height=0.62, color=colours)
    for row in np.flatnonzero(explained < _LOWEST_SHARE):
        # A bar that ends at the edge goes on.
        axes.text(
            2.0, float(row), f"{100.0 * explained[row]:.0f} %", va="center", size=8.0
        )
    lowest = 100.0 * _LOWEST_SHARE if (lengths < 0.0).any() else 0.0
    axes.set_xlim(lowest, 104.0)
    axes.set_xlabel("share of the excess error explained [%]")


def _colour(candidate: RankedCandidate) -> str:
    if is_chosen(candidate):
        return BLUE
    return ORANGE if candidate.role == "rival" else GREY


def _explain_colours(figure: Figure, diagnosis: Diagnosis) -> None:
    """Above the axes, where no row is."""
    parts = [(BLUE, "chosen"), (ORANGE, "cannot be told from it"), (GREY, "others")]
    used = {_colour(one) for one in shown_candidates(diagnosis)}
    axes = figure.axes[1]
    handles = [
        axes.barh([0], [np.nan], color=colour, label=label)
        for colour, label in parts
        if colour in used and len(used) > 1
    ]
    if handles:
        figure.legend(handles=handles, loc="upper left", ncols=3)


def shown_places(diagnosis: Diagnosis) -> dict[str, list[Place]]:
    """Choose the places that are drawn.

    Returns
    -------
    dict of str to list of Place
        The largest of each sort that has any share.
    """
    found: dict[str, list[Place]] = {}
    for sort in PLACES:
        usable = [
            one
            for one in diagnosis.places
            if one.about == sort and np.isfinite(one.share)
        ]
        if usable:
            found[sort] = sorted(usable, key=lambda one: -one.share)[:_MOST_PLACES]
    return found


@styled
def where_figure(diagnosis: Diagnosis) -> Figure:
    """Draw which part of the error sits where.

    Parameters
    ----------
    diagnosis : Diagnosis
        With places that have a share.

    Returns
    -------
    Figure
        One panel for each sort of place, at most two in a row.
    """
    sorts = shown_places(diagnosis)
    panels = list(sorts.items())
    columns = min(2, len(panels))
    lines = [
        panels[first : first + columns] for first in range(0, len(panels), columns)
    ]
    width = FULL_WIDTH * columns / 2
    heights = [
        _ROW * max(len(places) for _, places in line) + _ABOVE + _BELOW
        for line in lines
    ]
    figure = new_figure(width, sum(heights))
    top = sum(heights)
    for line, height in zip(lines, heights, strict=True):
        for column, (sort, places) in enumerate(line):
            names = [shortened(one.variable, 26) for one in places]
            left, tall = label_room([*names, "0" * 11]), _ROW * len(places)
            axes = figure.add_axes(
                (
                    column / columns + left / width,
                    (top - _ABOVE - tall) / sum(heights),
                    1 / columns - (left + _RIGHT) / width,
                    tall / sum(heights),
                )
            )
            _draw_places(axes, sort, places, names)
        top -= height
    return figure


def _draw_places(
    axes: Axes, sort: str, places: Sequence[Place], names: Sequence[str]
) -> None:
    shares = [max(0.0, 100.0 * one.share) for one in places]
    rows = np.arange(len(places))
    axes.barh(rows, shares, height=0.62, color=BLUE)
    for row, share in zip(rows, shares, strict=True):
        axes.annotate(
            f"{share:.0f} %",
            (share, row),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            size=8.0,
        )
    axes.set_title(PLACES[sort])
    axes.set_yticks(rows, names)
    axes.set_ylim(len(places) - 0.5, -0.5)
    # Room for the number behind the longest bar.
    axes.set_xlim(0.0, 1.15 * max(10.0, *shares))
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    of = "the missing force's variance" if sort == "variable" else "the excess error"
    axes.set_xlabel(f"share of {of} [%]")
