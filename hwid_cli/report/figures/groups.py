"""Figures of the search for groups: its tree, and the coverage on each level."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hwid_cli.records.groups import Group, GroupSearch
from hwid_cli.report.figures.style import (
    BLACK,
    BLUE,
    FULL_WIDTH,
    GREY,
    SKY,
    new_figure,
    styled,
)

# Kept groups that are shown on a level; those that lead to them come on top.
_MOST_SHOWN = 12
# Height of a row, [inch], and width of a box as a share of its column, [-].
_ROW, _BOX = 0.27, 0.72
# What a box has room for besides its number, [characters].
_MOST_CHARACTERS = 24


@styled
def tree_figure(search: GroupSearch) -> Figure:
    """Draw the search from left to right, level by level.

    Returns
    -------
    Figure
        The kept groups of each level, widest on top, and the chain to the winner.
    """
    shown = _shown_groups(search)
    most = max(len(groups) for groups in shown.values())
    height = _ROW * (most + 1) + 0.95
    figure = new_figure(FULL_WIDTH, height)
    axes = figure.add_axes((0.005, 0.0, 0.99, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, len(shown))
    axes.set_ylim(-(height - 0.85) / _ROW, 0.85 / _ROW)
    places: dict[str, tuple[float, float]] = {
        group.name: (column, -(row + 0.5))
        for column, groups in enumerate(shown.values())
        for row, group in enumerate(groups)
    }
    for group_name, base in _edges(search, places):
        on_chain = group_name in search.chain and base in search.chain
        _draw_edge(axes, places[base], places[group_name], on_chain=on_chain)
    for column, (level, groups) in enumerate(shown.items()):
        _head(axes, search, column, level)
        for group in groups:
            _draw_group(axes, places[group.name], group, search)
        _foot(axes, search, column, level, len(groups))
    return figure


def _shown_groups(search: GroupSearch) -> dict[int, list[Group]]:
    """Widest kept groups of each level, the chain, and whatever they grew from."""
    by_name = {group.name: group for group in search.groups}
    names = set(search.chain)
    for level in search.levels:
        kept = [g for g in _widest_first(search.groups, level) if g.is_kept]
        # The last level keeps nothing, or what nothing could grow from any more.
        any_wide = [g for g in _widest_first(search.groups, level) if g.coverage]
        best = kept or any_wide
        names.update(group.name for group in best[:_MOST_SHOWN])
    for level in reversed(search.levels):
        for name in [name for name in names if by_name[name].level == level]:
            bases = {join.base for join in search.joins if join.group == name} - {""}
            if bases and not bases & names:
                names.add(max(bases, key=lambda base: by_name[base].coverage))
    return {
        level: sorted(
            (g for g in _widest_first(search.groups, level) if g.name in names),
            key=lambda group: (-group.coverage, group.name not in search.chain),
        )
        for level in search.levels
    }


def _widest_first(groups: tuple[Group, ...], level: int) -> list[Group]:
    found = [group for group in groups if group.level == level]
    return sorted(found, key=lambda group: -group.coverage)


def _edges(
    search: GroupSearch, places: dict[str, tuple[float, float]]
) -> list[tuple[str, str]]:
    """Pairs of a group and its base, those of the chain last and so on top."""
    pairs = dict.fromkeys(
        (join.group, join.base)
        for join in search.joins
        if join.group in places and join.base in places
    )
    return sorted(pairs, key=lambda pair: set(pair) <= set(search.chain))


def _draw_edge(
    axes: Axes,
    start: tuple[float, float],
    end: tuple[float, float],
    *,
    on_chain: bool,
) -> None:
    share = np.linspace(0.0, 1.0, 30)
    ease = 3 * share**2 - 2 * share**3
    left, right = start[0] + _BOX, end[0]
    axes.plot(
        left + (right - left) * share,
        start[1] + (end[1] - start[1]) * ease,
        color=BLUE if on_chain else "#bdbdbd",
        lw=2.4 if on_chain else 0.8,
        zorder=2 if on_chain else 1,
        solid_capstyle="butt",
    )


def _draw_group(
    axes: Axes, place: tuple[float, float], group: Group, search: GroupSearch
) -> None:
    column, row = place
    on_chain = group.name in search.chain
    share = group.coverage / max(1, len(search.validated_on))
    axes.barh(
        row,
        _BOX,
        left=column,
        height=0.78,
        color="w",
        edgecolor=BLUE if on_chain else GREY,
        lw=1.8 if on_chain else 0.7,
        zorder=3,
    )
    axes.barh(
        row,
        _BOX * share,
        left=column,
        height=0.78,
        color=SKY if on_chain else "#dcdcdc",
        alpha=0.75,
        zorder=4,
    )
    added = _added(search, group)
    if len(added) > _MOST_CHARACTERS:
        added = f"{added[: _MOST_CHARACTERS - 3]}..."
    weight = "bold" if on_chain else "normal"
    style: dict[str, Any] = {"va": "center", "size": 8.0, "weight": weight, "zorder": 5}
    axes.text(column + 0.012, row, added, **style)
    axes.text(column + _BOX - 0.012, row, str(group.coverage), ha="right", **style)


def _added(search: GroupSearch, group: Group) -> str:
    """What joined a group's base; of several bases the one on the chain, or the first."""
    joins = [join for join in search.joins if join.group == group.name]
    join = next((one for one in joins if one.base in search.chain), joins[0])
    return f"+ {join.add_on}" if join.add_on else join.base


def _head(axes: Axes, search: GroupSearch, column: int, level: int) -> None:
    many = f"{level} recordings" if level > 1 else "1 recording"
    best = max(g.coverage for g in search.groups if g.level == level)
    axes.text(column, 1.75, many, weight="bold", va="center", size=9.0)
    best_text = f"best covers {best} of {len(search.validated_on)}"
    axes.text(column, 0.75, best_text, va="center", size=8.0)


def _foot(
    axes: Axes, search: GroupSearch, column: int, level: int, n_shown: int
) -> None:
    of_level = [group for group in search.groups if group.level == level]
    n_kept = sum(group.is_kept for group in of_level)
    text = f"{len(of_level)} groups, {n_kept} kept"
    if n_shown < len(of_level):
        text += f", {n_shown} shown"
    axes.text(column, -(n_shown + 0.55), text, va="center", size=7.5, color="#444444")


_KEPT: dict[str, Any] = {"color": BLUE, "label": "kept"}
_DROPPED: dict[str, Any] = {
    "color": "#d9d9d9",
    "edgecolor": GREY,
    "hatch": "///",
    "lw": 0.5,
    "label": "dropped",
}
_LAST: dict[str, Any] = {
    "color": SKY,
    "edgecolor": BLUE,
    "lw": 0.8,
    "label": "last level",
}


@styled
def coverage_histogram_figure(search: GroupSearch) -> Figure:
    """Draw how many groups of each level cover how many recordings.

    Returns
    -------
    Figure
        Groups that go on are filled, dropped ones hatched and stand on them. Those of
        the last level are neither: the winner may be among them.
    """
    levels = search.levels
    figure = new_figure(FULL_WIDTH, 2.6)
    figure.subplots_adjust(left=0.06, right=0.99, top=0.84, bottom=0.2, wspace=0.2)
    every = figure.subplots(1, len(levels), sharex=True, squeeze=False)[0]
    counts = np.arange(len(search.validated_on) + 1)
    for axes, level in zip(every, levels, strict=True):
        of_level = [group for group in search.groups if group.level == level]
        kept = [sum(g.coverage == c and g.is_kept for g in of_level) for c in counts]
        rest = [
            sum(g.coverage == c and not g.is_kept for g in of_level) for c in counts
        ]
        if level != levels[-1]:
            axes.bar(counts, kept, width=0.8, **_KEPT)
        axes.bar(
            counts,
            rest,
            bottom=kept,
            width=0.8,
            **(_LAST if level == levels[-1] else _DROPPED),
        )
        axes.set_title(f"level {level}", color=BLACK)
        axes.set_xlabel("recordings covered [-]")
        axes.yaxis.get_major_locator().set_params(integer=True)
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.grid(visible=False, axis="x")
    every[0].set_ylabel("groups [-]")
    bars = [one for axes in every for one in axes.containers]
    handles = {str(one.get_label()): one for one in bars}
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="upper right",
        bbox_to_anchor=(0.99, 1.0),
        ncols=3,
    )
    return figure
