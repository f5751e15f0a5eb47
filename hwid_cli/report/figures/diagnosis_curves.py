"""Figures of a diagnosis that show curves: simulations over measurements, missing forces."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.diagnosis import (
    Diagnosis,
    LatentForce,
    Overlay,
)
from hwid_cli.report.diagnosis import missing_force
from hwid_cli.report.figures.diagnosis_bars import shortened
from hwid_cli.report.figures.style import (
    BLACK,
    BLUE,
    FULL_WIDTH,
    GREY,
    HALF_WIDTH,
    VERMILLION,
    new_figure,
    styled,
)

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
    _label_overlay(axes, time, diagnosis)


def _draw_noise(axes: Axes, noise: float) -> None:
    if np.isfinite(noise) and noise > 0.0:
        label = "noise, \N{PLUS-MINUS SIGN}2 sd"
        axes.axhspan(-2.0 * noise, 2.0 * noise, color="#cfcfcf", lw=0, label=label)
    axes.axhline(0.0, color="#555555", lw=0.7)


def _label_overlay(axes: list[Axes], time: np.ndarray, diagnosis: Diagnosis) -> None:
    unit = diagnosis.output_unit
    axes[0].set_ylabel(f"{diagnosis.compared} [{unit}]")
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
    what, unit = missing_force(diagnosis)
    panels[0].set_ylabel(f"missing {what} [{unit}]")
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
