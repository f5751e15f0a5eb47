from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from hwid_cli.records.groups import Group, GroupSearch, Join
from hwid_cli.report.figures.final_test import trend_figure
from hwid_cli.report.figures.groups import coverage_histogram_figure, tree_figure
from tests.report.report_examples import group_search


def texts(figure):
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_the_tree_holds_the_chain_and_the_counts_of_each_level():
    search = group_search(12)
    found = texts(tree_figure(search))

    for group in search.chain_groups[1:]:
        assert f"+ {group.recordings[-1]}" in found
    for level in search.levels:
        of_level = [group for group in search.groups if group.level == level]
        kept = sum(group.is_kept for group in of_level)
        assert any(f"{len(of_level)} groups, {kept} kept" in text for text in found)


def test_the_tree_names_what_joined_where_names_keep_another_order():
    # Without order a group is named as the experiment orders its recordings: step_06
    # grew by step_03.
    groups = (
        Group(("step_06",), 1, 1, 1, 1e-3, 1e-2, 1, 1, 1, True),
        Group(("step_03", "step_06"), 2, 1, 1, 1e-3, 1e-2, 1, 1, 1, False),
    )
    search = GroupSearch(
        groups=groups,
        joins=(
            Join(1, "step_06", "", "step_06"),
            Join(2, "step_06", "step_03", "step_03+step_06"),
        ),
        fits=(None, None),
        validated_on=("step_03", "step_06"),
        rmsd=np.full((2, 2), 1e-3),
        chain=("step_06", "step_03+step_06"),
        reason="",
        join="experiments",
        unit="m",
        threshold=0.01,
    )

    found = texts(tree_figure(search))
    assert "step_06" in found
    assert "+ step_03" in found


def test_the_trend_names_what_each_level_added(contents):
    trend = replace(
        contents.trend,
        models=("step_06/3/7", "step_03+step_06/1/2"),
        rmsd=contents.trend.rmsd[:2],
        mean=contents.trend.mean[:2],
    )
    axes = trend_figure(trend).axes[0]

    ticks = [one.get_text() for one in axes.get_xticklabels()]
    assert ticks == ["1: step_06", "2: + step_03"]


@pytest.mark.thorough
def test_a_tree_of_hundreds_of_groups_stays_readable():
    search = group_search(12, kept=40)
    figure = tree_figure(search)

    assert len(search.groups) > 500
    # Room for a dozen groups and for what they grew from.
    assert figure.get_size_inches()[1] < 10.0


def test_histograms_count_every_group_once():
    search = group_search(12)
    figure = coverage_histogram_figure(search)

    counted = [
        sum(patch.get_height() for patch in axes.patches) for axes in figure.axes
    ]
    expected = [
        sum(group.level == level for group in search.groups) for level in search.levels
    ]
    assert counted == expected
    # Dropped groups stand on the kept ones.
    kept, dropped = np.split(np.array(figure.axes[1].patches), 2)
    assert [bar.get_y() for bar in dropped] == [bar.get_height() for bar in kept]


def test_groups_of_the_last_level_are_not_called_dropped():
    figure = coverage_histogram_figure(group_search(12))

    labels = [[bars.get_label() for bars in axes.containers] for axes in figure.axes]
    assert labels[:-1] == 3 * [["kept", "dropped"]]
    assert labels[-1] == ["last level"]
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert told == ["kept", "dropped", "last level"]
    colours = {axes.patches[-1].get_facecolor() for axes in figure.axes}
    assert len(colours) == 2


def test_the_legend_of_the_trend_stands_below_where_a_phone_shows_it(contents):
    trend = contents.trend
    names = tuple(f"random_{number:02d}" for number in range(10))
    many = replace(
        trend,
        recordings=names,
        rmsd=np.repeat(trend.rmsd[:, :1], 10, axis=1),
    )
    figure = trend_figure(many)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    legend = figure.legends[0].get_window_extent()
    axes = figure.axes[0]

    # A phone shows 360 of the 85 pixels that an inch has there.
    assert legend.x1 < 360 / 85 * figure.dpi
    assert legend.y0 >= 0
    assert legend.y1 < axes.xaxis.label.get_window_extent().y0


def test_the_trend_has_a_line_for_each_recording_their_mean_and_the_threshold(contents):
    trend = contents.trend
    axes = trend_figure(trend).axes[0]

    labels = [line.get_label() for line in axes.lines]
    assert labels == [*trend.recordings, "mean", "threshold 0.01 m"]
    assert axes.get_ylabel() == "RMSD [m]"
