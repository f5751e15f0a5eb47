"""Figure of the final test: the chain of groups on recordings that nobody used."""

from collections.abc import Sequence
from itertools import pairwise

from matplotlib.figure import Figure

from hwid_cli.records.report import ChainOnTests
from hwid_cli.records.units import behind
from hwid_cli.report.figures.style import (
    BLACK,
    LINES,
    new_figure,
    number_decades,
    styled,
)

# Lines with a legend of their own; more are told apart by nobody.
_MOST_NAMED = 10
# Width, room left of the axes, and height of a row of the legend, [inch].
_WIDTH, _LEFT, _ROW = 7.2, 0.75, 0.19


@styled
def trend_figure(trend: ChainOnTests) -> Figure:
    """Draw the RMSD on the test recordings along the chain of groups.

    Returns
    -------
    Figure
        One line for each recording, their mean, and the threshold.
    """
    is_named = len(trend.recordings) <= _MOST_NAMED
    # Below the axes two entries in a row, which a narrow screen shows at once.
    rows = -(-((len(trend.recordings) if is_named else 0) + 2) // 2)
    below = 0.75 + _ROW * rows
    height = 3.2 + below
    figure = new_figure(_WIDTH, height)
    figure.subplots_adjust(
        left=_LEFT / _WIDTH, right=0.98, top=1 - 0.12 / height, bottom=below / height
    )
    axes = figure.subplots()
    levels = list(range(1, len(trend.models) + 1))
    for number, name in enumerate(trend.recordings):
        label = name if is_named else ""
        style = LINES[number % len(LINES)]
        axes.plot(levels, trend.rmsd[:, number], lw=1.2, ms=5, label=label, **style)
    axes.plot(levels, trend.mean, color=BLACK, lw=2.8, marker="o", ms=6, label="mean")
    told = f"threshold {trend.threshold:g}{behind(trend.unit)}"
    axes.axhline(trend.threshold, color=BLACK, lw=1.0, ls=(0, (2, 2)), label=told)
    axes.set_yscale("log")
    number_decades(axes.yaxis, *axes.get_ylim())
    axes.set_xticks(levels, _ticks(trend.models))
    axes.set_xlim(levels[0] - 0.2, levels[-1] + 0.2)
    axes.set_xlabel("recordings in the group, added one by one")
    axes.set_ylabel(f"RMSD [{trend.unit}]")
    figure.legend(
        loc="lower left", bbox_to_anchor=(0.1 / _WIDTH, 0.0), ncols=2, columnspacing=1.2
    )
    return figure


def _ticks(models: Sequence[str]) -> list[str]:
    """``1: step_06``, ``2: + step_09``: what each level added to the one before."""
    groups = [model.rsplit("/", 2)[0].split("+") for model in models]
    ticks = [f"{len(groups[0])}: {'+'.join(groups[0])}"] if groups else []
    for before, group in pairwise(groups):
        added = [name for name in group if name not in before]
        ticks.append(f"{len(group)}: + {', '.join(added)}")
    return ticks
