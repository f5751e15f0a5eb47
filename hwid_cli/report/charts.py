"""Interactive charts of the page as records, and the compact JSON that a browser draws.

templates/report.js draws them with uPlot: panels above each other share their horizontal
axis, its zoom and its cursor. Colours and dashes of a curve come from its role.
"""

import itertools
import json
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from markupsafe import Markup

# What a curve may be; report.js gives each a colour and dashes.
ROLES = (
    *("measured", "simulated", "taken", "linear", "given", "refitted", "extended"),
    *("input", "estimate", "law", "map", "corner", "pole", "zero", "chance", "beyond"),
    *("noise", "frame"),
)
STYLES = ("line", "points", "line+points", "stems", "cross", "band")
# Steps in the range of a curve: rounding to them is finer than a pixel, also zoomed in.
_STEPS = 40_000
# Numbers of short curves are written as they are, with these digits.
_SHORT, _DIGITS = 64, 6
# Samples of a curve that a page holds, and of all curves of a chart that has many of
# them; see ``points_of_each``.
MOST_POINTS, LEAST_POINTS, _ALL_POINTS = 4000, 800, 600_000
# The horizontal axis and a double line of text; the room that the style knows, [pixels].
_AXIS, _DOUBLE_LINE, _LEAST_ROOM, _MOST_ROOM, _SQUARE_ROOM = 40, 32, 4, 21, 11


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve of a panel.

    Parameters
    ----------
    label : str
        In the legend; curves of equal labels are hidden together. Empty for none.
    values : ndarray, shape (n,), [unit of the panel]
        Over the chart's ``at``; NaN leaves a gap.
    role : str
        One of ``ROLES``.
    style : str
        One of ``STYLES``. A band reaches from ``values`` to ``upper``.
    model : str
        Curves of one model are hidden together, and a menu shows one model alone.
    """

    label: str
    values: np.ndarray
    role: str
    style: str = "line"
    upper: np.ndarray | None = None
    model: str = ""
    is_hidden: bool = False

    def __post_init__(self) -> None:
        if self.role not in ROLES or self.style not in STYLES:
            raise ValueError(f"no such curve: {self.role!r}, {self.style!r}")
        if (self.style == "band") != (self.upper is not None):
            raise ValueError("a band, and nothing else, has an upper end")


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves with a vertical axis of their own.

    Parameters
    ----------
    label : str
        Quantity and unit of the vertical axis.
    height_px : int, [pixels]
    lines : tuple of float
        Values that a thin line marks, such as zero.
    spans : tuple of (float, float)
        Stretches of the horizontal axis that are shaded.
    limits : tuple of float or None
        Ends of the vertical axis; None for those of what is shown.
    """

    label: str
    curves: tuple[Curve, ...]
    height_px: int = 220
    lines: tuple[float, ...] = ()
    spans: tuple[tuple[float, float], ...] = ()
    limits: tuple[float, float] | None = None
    is_log: bool = False


@dataclass(frozen=True, eq=False)
class Chart:
    """Panels above each other that share their horizontal axis.

    Parameters
    ----------
    name : str
        Of a saved picture.
    at : ndarray, shape (n,)
        Along the horizontal axis, never falling.
    label : str
        Quantity and unit of the horizontal axis.
    sentence : str
        What the chart shows.
    alt : str
        What a reader who does not see it should know.
    window : tuple of float or None
        What is shown first; None for all.
    detail : tuple of float or None
        Stretch that a button shows.
    has_gaps_closed : bool
        Whether lines go on over missing values, as where curves have samples of their own.
    is_square : bool
        Whether both axes have the same length.
    has_model_menu : bool
        Whether a menu shows one model alone.
    """

    kind: ClassVar[str] = "chart"
    name: str
    at: np.ndarray
    label: str
    panels: tuple[Panel, ...]
    sentence: str
    alt: str
    window: tuple[float, float] | None = None
    detail: tuple[float, float] | None = None
    is_log: bool = False
    has_gaps_closed: bool = False
    is_square: bool = False
    has_model_menu: bool = False

    @property
    def room(self) -> int:
        """Room that the page keeps for it before it is drawn, in double lines."""
        if self.is_square:
            return _SQUARE_ROOM
        tall = sum(one.height_px for one in self.panels) + _AXIS
        return min(_MOST_ROOM, max(_LEAST_ROOM, int(tall / _DOUBLE_LINE)))


def points_of_each(n_curves: int) -> int:
    """Points that each of so many curves may have on one page.

    Examples
    --------
    >>> points_of_each(8), points_of_each(300), points_of_each(10_000)
    (4000, 2000, 800)
    """
    return max(LEAST_POINTS, min(MOST_POINTS, _ALL_POINTS // max(1, n_curves)))


@dataclass(frozen=True, eq=False)
class Thinning:
    """Which samples of a long recording a chart keeps.

    Parameters
    ----------
    stretches : tuple of (int, int, int), [samples]
        First sample, the one after the last, and how many make a bin; a bin of one is the
        sample itself, of larger ones the lowest and the highest value stay.
    """

    stretches: tuple[tuple[int, int, int], ...]

    @property
    def is_complete(self) -> bool:
        """Whether every sample stays."""
        return all(size == 1 for _, _, size in self.stretches)

    @property
    def largest_bin(self) -> int:
        """Samples that make the largest bin."""
        return max(size for _, _, size in self.stretches)


def thinning(n_samples: int, most: int, detail: tuple[int, int]) -> Thinning:
    """Choose the samples of a chart: all, or all of a detail and bins of the rest.

    Parameters
    ----------
    most : int, [-]
        Points that the chart may have, about.
    detail : tuple of int, [samples]
        First sample of the stretch that stays whole, where half of the points suffice,
        and the one after its last.

    Examples
    --------
    >>> thinning(10_000, 4000, (1000, 2000)).stretches
    ((0, 1000, 6), (1000, 2000, 1), (2000, 10000, 6))
    """
    if n_samples <= most:
        return Thinning(((0, n_samples, 1),))
    first, end = detail
    if end - first > most // 2:
        first = end = 0
    size = -(-2 * (n_samples - (end - first)) // (most - (end - first)))
    parts = ((0, first, size), (first, end, 1), (end, n_samples, size))
    return Thinning(tuple(one for one in parts if one[1] > one[0]))


def thinned(values: np.ndarray, chosen: Thinning) -> np.ndarray:
    """Keep the lowest and the highest value of each bin, in their order.

    Parameters
    ----------
    values : ndarray, shape (n_samples,)

    Returns
    -------
    ndarray, shape (n_points,)

    Examples
    --------
    >>> thinned(np.array([0.0, 5.0, 1.0, 3.0, 2.0, 2.0]), Thinning(((0, 6, 3),)))
    array([0., 5., 3., 2.])
    """
    parts = []
    for first, end, size in chosen.stretches:
        part = values[first:end]
        if size == 1:
            parts.append(part)
            continue
        # The last bin may be shorter: it is filled with its last value.
        bins = np.pad(part, (0, -part.size % size), mode="edge").reshape(-1, size)
        blank = np.isnan(bins).all(axis=1)
        safe = np.where(blank[:, None], 0.0, bins)
        low, high = np.nanargmin(safe, axis=1), np.nanargmax(safe, axis=1)
        ends = np.sort(np.stack([low, high], axis=1), axis=1)
        kept = np.take_along_axis(bins, ends, axis=1)
        kept[blank] = np.nan
        parts.append(kept.ravel())
    return np.concatenate(parts)


def thinned_places(chosen: Thinning) -> np.ndarray:
    """Where the points that ``thinned`` keeps are drawn: two in each bin.

    Returns
    -------
    ndarray, shape (n_points,), [samples]
    """
    parts = []
    for first, end, size in chosen.stretches:
        if size == 1:
            parts.append(np.arange(first, end, dtype=float))
            continue
        starts = np.arange(first, end, size, dtype=float)
        parts.append((starts[:, None] + np.array([0.0, 0.5 * size])).ravel())
    return np.concatenate(parts)


def thinned_note(chosen: Thinning) -> str:
    """Say what a chart leaves out; empty where it shows every sample."""
    if chosen.is_complete:
        return ""
    return (
        f" Long recordings are thinned on the page: of each {chosen.largest_bin} samples the "
        "lowest and the highest stay; the detail keeps all of them where it is short."
    )


def on_common_axis(
    *curves: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Put curves with samples of their own on one axis.

    Parameters
    ----------
    *curves : tuple of ndarray
        Places and values of each.

    Returns
    -------
    at : ndarray, shape (n,)
        All places in their order.
    values : list of ndarray, shape (n,)
        NaN where a curve has no sample.

    Examples
    --------
    >>> at, values = on_common_axis(([0.0, 2.0], [1.0, 1.0]), ([1.0], [5.0]))
    >>> at, values[1]
    (array([0., 1., 2.]), array([nan,  5., nan]))
    """
    every = np.concatenate([np.asarray(places, float) for places, _ in curves])
    order = np.argsort(every, kind="stable")
    found, start = [], 0
    for places, values in curves:
        line = np.full(every.size, np.nan)
        line[start : start + len(places)] = values
        found.append(line[order])
        start += len(places)
    return every[order], found


def chart_data(chart: Chart) -> Markup:
    """Write what report.js draws a chart from.

    Returns
    -------
    Markup
        JSON in which no character can end the element that holds it.
    """
    spec: dict[str, Any] = {
        "xl": chart.label,
        "panels": [_panel(one) for one in chart.panels],
    }
    runs = _runs(chart.at)
    if len(runs) * 8 < chart.at.size:
        spec["runs"] = runs
    else:
        spec["x"] = packed(chart.at)
    flags = {
        "log": chart.is_log,
        "gaps": chart.has_gaps_closed,
        "square": chart.is_square,
        "models": chart.has_model_menu,
        "window": chart.window,
        "detail": chart.detail,
    }
    spec |= {name: value for name, value in flags.items() if value}
    return as_data(spec)


def as_data(value: object) -> Markup:
    r"""Write a value as JSON that may stand inside an element of a page.

    Examples
    --------
    >>> "<" in as_data({"name": "</script>"})
    False
    """
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)


def _panel(panel: Panel) -> dict[str, Any]:
    found: dict[str, Any] = {
        "yl": panel.label,
        "h": panel.height_px,
        "curves": [_curve(one) for one in panel.curves],
    }
    flags = {
        "lines": panel.lines,
        "spans": panel.spans,
        "range": panel.limits,
        "log": panel.is_log,
    }
    return found | {name: value for name, value in flags.items() if value}


def _curve(curve: Curve) -> dict[str, Any]:
    found: dict[str, Any] = {"l": curve.label, "r": curve.role, "k": curve.style}
    if curve.upper is not None:
        found |= {"low": packed(curve.values), "high": packed(curve.upper)}
    else:
        found["y"] = packed(curve.values)
    if curve.model:
        found["g"] = curve.model
    if curve.is_hidden:
        found["off"] = True
    return found


def packed(values: np.ndarray) -> list[float | None] | dict[str, Any]:
    """Write numbers in few characters: rounded, and as steps from one to the next.

    Parameters
    ----------
    values : ndarray, shape (n,), [any]

    Returns
    -------
    list or dict
        Short curves with six digits; of longer ones an offset ``o``, the size ``s`` of a
        step, and the steps ``d``; None for what is not finite.

    Examples
    --------
    >>> packed(np.array([1.0, np.nan, 2.5]))
    [1.0, None, 2.5]
    """
    numbers = np.asarray(values, float)
    is_known = np.isfinite(numbers)
    if numbers.size <= _SHORT or not is_known.any():
        return [
            float(f"{one:.{_DIGITS}g}") if ok else None
            for one, ok in zip(numbers.tolist(), is_known.tolist(), strict=True)
        ]
    known = numbers[is_known]
    low, high = float(known.min()), float(known.max())
    size = (high - low) / _STEPS or 1.0
    size = float(f"{size:.6g}") or 1.0
    places = np.rint((known - low) / size).astype(int)
    steps = iter(np.diff(places, prepend=0).tolist())
    return {
        "o": low,
        "s": size,
        "d": [next(steps) if ok else None for ok in is_known.tolist()],
    }


def _runs(at: np.ndarray) -> list[list[float]]:
    """Stretches of even steps: first value, step, count."""
    if at.size < 2:
        return [[float(one), 0.0, 1] for one in at]
    steps = np.diff(at)
    # Rounding of a product is no new step.
    close = 1e-6 * np.abs(steps).max()
    starts = [0]
    while starts[-1] < at.size:
        first = starts[-1]
        same = np.flatnonzero(
            np.abs(steps[first:] - steps[min(first, steps.size - 1)]) > close
        )
        starts.append(first + int(same[0]) + 1 if same.size else at.size)
        # So many are no runs any more.
        if 8 * len(starts) > at.size + 16:
            break
    found = []
    for first, end in itertools.pairwise(starts):
        part = at[first:end]
        step = (part[-1] - part[0]) / (part.size - 1) if part.size > 1 else 0.0
        found.append([float(f"{part[0]:.12g}"), float(f"{step:.12g}"), int(part.size)])
    return found
