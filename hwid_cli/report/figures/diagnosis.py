"""Figures of a diagnosis: all of them by their names, and the gap in every recording.

Figures of a diagnosis whose rows have names: the candidates, and where the error sits.

Figures of a diagnosis that show curves: simulations over measurements, missing forces.
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.candidates import RankedCandidate
from hwid_cli.records.diagnosis import (
    Diagnosis,
    LatentForce,
    Overlay,
    Place,
    RecordingGap,
)
from hwid_cli.records.units import behind
from hwid_cli.report.diagnosis import candidate_name, is_chosen
from hwid_cli.report.figures.style import (
    BLACK,
    BLUE,
    FULL_WIDTH,
    GREY,
    HALF_WIDTH,
    ORANGE,
    VERMILLION,
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
    needed = [one for one in fitted if not one.effects or is_chosen(one, diagnosis)]
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
    colours = [_colour(one, diagnosis) for one in shown]
    noise = diagnosis.noise.rms
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
        label.set_fontweight("bold" if is_chosen(one, diagnosis) else "normal")
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


def _colour(candidate: RankedCandidate, diagnosis: Diagnosis) -> str:
    if is_chosen(candidate, diagnosis):
        return BLUE
    rivals = [set(one.split("+")) for one in diagnosis.ambiguous_with]
    return ORANGE if set(candidate.effects) in rivals else GREY


def _explain_colours(figure: Figure, diagnosis: Diagnosis) -> None:
    """Above the axes, where no row is."""
    parts = [(BLUE, "chosen"), (ORANGE, "cannot be told from it"), (GREY, "others")]
    used = {_colour(one, diagnosis) for one in shown_candidates(diagnosis)}
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


# Recordings and variables that are drawn.
_MOST_OVERLAYS, _MOST_FORCES = 4, 3
# A recording with its residuals, one without effects, the legend above all, [inch].
_TALL, _TALL_WITHOUT, _LEGEND = 4.7, 3.8, 0.3
# The stretch that is shown holds this share of the squared error, and as much around it
# as this share of its length, [-].
_ERROR_SHARE, _AROUND = 0.8, 0.25
# It shows no more swings than the eye can follow, and no fewer samples than this.
_MOST_SWINGS, _FEWEST_SAMPLES = 6, 100
# A swing leaves the middle by this share of the whole range: noise does not, [-].
_SWING = 0.1
# A simulation so many times beyond the measurement is not drawn, [-].
_ASTRAY = 1e2


def telling_stretch(overlay: Overlay) -> tuple[int, int]:
    """Find the stretch of a recording where the simulation fails most.

    Returns
    -------
    first, end : int, [samples]
        The shortest one with most of the squared error, cut to some swings.
    """
    size = overlay.measured.size
    before = _usable(overlay.before, overlay.measured)
    error = np.nan_to_num(overlay.measured - before)
    total = np.append(0.0, np.cumsum(error**2))
    if size <= _FEWEST_SAMPLES or total[-1] <= 0.0:
        return 0, size
    ends = np.searchsorted(total, total[:-1] + _ERROR_SHARE * total[-1])
    lengths = np.where(ends <= size, ends - np.arange(size), size)
    length = int(lengths.min() * (1.0 + 2.0 * _AROUND))
    longest = _swing_samples(overlay.measured) * _MOST_SWINGS
    length = min(size, max(_FEWEST_SAMPLES, min(length, longest)))
    first = int(np.argmax(total[length:] - total[:-length]))
    # What holds most of the error stands in the middle.
    held = slice(first, first + length)
    weights = error[held] ** 2
    centre = first + int(np.average(np.arange(length), weights=weights + 1e-300))
    first = min(max(0, centre - length // 2), size - length)
    return first, first + length


def _usable(simulated: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """A simulation with NaN where it has gone astray, so that the rest stays readable."""
    most = _ASTRAY * max(np.nanmax(np.abs(measured)), np.finfo(float).tiny)
    return np.where(np.abs(simulated) < most, simulated, np.nan)


def _swing_samples(measured: np.ndarray) -> int:
    """Samples of one swing to both sides; all of them where there is none."""
    low, high = np.nanmin(measured), np.nanmax(measured)
    away = measured - 0.5 * (low + high)
    sides = np.sign(away[np.abs(away) > _SWING * (high - low)])
    changes = int(np.count_nonzero(np.diff(sides)))
    return math.ceil(2 * measured.size / changes) if changes > 1 else measured.size


@styled
def overlay_figure(diagnosis: Diagnosis) -> Figure:
    """Draw the simulation before and after over the worst held-out recordings.

    Parameters
    ----------
    diagnosis : Diagnosis
        With overlays.

    Returns
    -------
    Figure
        Beneath each recording the residuals with the band of the noise, two standard
        deviations to both sides; those with the effects once more in their own scale.
    """
    shown = [one for one in diagnosis.overlays if one.measured.size][:_MOST_OVERLAYS]
    columns = min(2, len(shown))
    # Rows of recordings, and of axes for each of them.
    rows, parts = -(-len(shown) // columns), 3 if diagnosis.effects else 2
    tall = _TALL if parts == 3 else _TALL_WITHOUT
    width, height = HALF_WIDTH * columns, tall * rows + _LEGEND
    figure = new_figure(width, height)
    for number, one in enumerate(shown):
        row, column = divmod(number, columns)
        grid = figure.add_gridspec(
            parts,
            1,
            height_ratios=(1.7, 1.0, 1.0)[:parts],
            hspace=0.16,
            left=(column * HALF_WIDTH + 0.85) / width,
            right=((column + 1) * HALF_WIDTH - 0.15) / width,
            top=1 - (_LEGEND + row * tall + 0.35) / height,
            bottom=1 - (_LEGEND + (row + 1) * tall - 0.5) / height,
        )
        axes = [figure.add_subplot(grid[part, 0]) for part in range(parts)]
        _draw_overlay(axes, one, diagnosis)
    handles = [*figure.axes[0].get_lines(), *figure.axes[1].patches]
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.1 / width, 1.0),
        ncols=4,
        handlelength=2.4,
        columnspacing=1.2,
    )
    return figure


def _draw_overlay(axes: list[Axes], overlay: Overlay, diagnosis: Diagnosis) -> None:
    first, end = telling_stretch(overlay)
    part = slice(first, end)
    time, measured = overlay.time_s[part], overlay.measured[part]
    axes[0].plot(time, measured, color="#b5b5b5", lw=3.2, label="measured")
    for place in axes[1:]:
        _draw_noise(place, overlay.noise_rms)
    curves: list[tuple[str, np.ndarray, dict[str, Any]]] = [
        ("re-fitted", overlay.before, {"color": VERMILLION})
    ]
    if diagnosis.effects:
        dashed = {"color": BLUE, "ls": (0, (5, 1.6))}
        curves.append(("with the effects", overlay.after, dashed))
    for number, (label, values, style) in enumerate(curves):
        shown = _usable(values, overlay.measured)[part]
        axes[0].plot(time, shown, lw=1.2, label=label, **style)
        # All of them together, and the last of them alone.
        for place in axes[1:] if number else axes[1:2]:
            place.plot(time, measured - shown, color=style["color"], lw=0.8)
    title = shortened(overlay.name)
    is_cut = end - first < overlay.measured.size
    # At the right: the scale of the axis stands at the left.
    axes[0].set_title(f"{title} (detail)" if is_cut else title, loc="right", pad=5)
    _label_overlay(axes, time, diagnosis.output_unit)


def _draw_noise(axes: Axes, noise: float) -> None:
    if np.isfinite(noise) and noise > 0.0:
        label = "noise, \N{PLUS-MINUS SIGN}2 sd"
        axes.axhspan(-2.0 * noise, 2.0 * noise, color="#cfcfcf", lw=0, label=label)
    axes.axhline(0.0, color="#555555", lw=0.7)


def _label_overlay(axes: list[Axes], time: np.ndarray, unit: str) -> None:
    axes[0].set_ylabel(f"output y [{unit}]")
    for place in axes[1:]:
        place.set_ylabel(f"residual e [{unit}]")
    axes[-1].set_xlabel("time t [s]")
    for place in axes:
        if time[-1] > time[0]:
            place.set_xlim(time[0], time[-1])
        place.tick_params(labelbottom=place is axes[-1])
        _write_powers_above(place)
        place.yaxis.set_label_coords(-0.125, 0.5)


def _write_powers_above(axes: Axes) -> None:
    axes.ticklabel_format(axis="y", scilimits=(-2, 3), useMathText=False)
    axes.yaxis.get_offset_text().set_fontsize(8.0)


@styled
def force_figure(diagnosis: Diagnosis) -> Figure:
    """Draw the force that the simulation lacks against what it follows.

    Parameters
    ----------
    diagnosis : Diagnosis
        With a latent force.

    Returns
    -------
    Figure
        The best variable first; with effects their law goes through it.
    """
    shown = [one for one in diagnosis.latent_force if one.at.size][:_MOST_FORCES]
    width = {1: HALF_WIDTH, 2: 8.4}.get(len(shown), FULL_WIDTH)
    figure = new_figure(width, 3.7)
    figure.subplots_adjust(
        left=0.8 / width, right=1 - 0.15 / width, top=0.88, bottom=0.15, wspace=0.12
    )
    panels = figure.subplots(1, len(shown), squeeze=False, sharey=True).ravel()
    for axes, force in zip(panels, shown, strict=True):
        _draw_force(axes, force)
    panels[0].set_ylim(*_force_limits(shown))
    what = "force F [N]" if diagnosis.axis == "linear" else "torque F [N m]"
    panels[0].set_ylabel(f"missing {what}")
    _write_powers_above(panels[0])
    figure.legend(
        handles=[*panels[0].get_lines()[1:], *panels[0].collections],
        loc="upper left",
        bbox_to_anchor=(0.1 / width, 1.0),
        ncols=3,
        columnspacing=1.2,
    )
    return figure


def _draw_force(axes: Axes, force: LatentForce) -> None:
    axes.axhline(0.0, color="#555555", lw=0.7)
    axes.plot(
        force.at, force.mean, "o-", color=BLACK, lw=1.0, ms=4, label="from measurements"
    )
    label = "spread, \N{PLUS-MINUS SIGN}1 sd"
    low, high = force.mean - force.spread, force.mean + force.spread
    axes.fill_between(force.at, low, high, color=GREY, alpha=0.25, lw=0, label=label)
    if force.law.size == force.at.size:
        axes.plot(
            force.at, force.law, "--", color=BLUE, lw=2.0, label="with the effects"
        )
    axes.set_xlabel(f"{shortened(force.variable)} [{force.unit}]")


def _force_limits(shown: Sequence[LatentForce]) -> tuple[float, float]:
    """All curves, and as much of the spread as leaves them readable."""

    def ends(*values: np.ndarray) -> tuple[float, float]:
        every = np.concatenate(values)
        every = every[np.isfinite(every)]
        return (every.min(), every.max()) if every.size else (0.0, 0.0)

    low, high = ends(*(values for one in shown for values in (one.mean, one.law)))
    bottom, _ = ends(*(one.mean - one.spread for one in shown))
    _, top = ends(*(one.mean + one.spread for one in shown))
    room = (high - low) or max(abs(low), 1.0)
    bottom, top = max(low - room, min(low, bottom)), min(high + room, max(high, top))
    return bottom - 0.05 * room, top + 0.05 * room


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
