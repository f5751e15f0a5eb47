from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from hwid_cli.report.figures.matrices import order_grid_figure, rmsd_matrix_figure
from hwid_cli.report.figures.models import bode_figure, maps_figure, poles_figure
from hwid_cli.report.figures.recordings import simulation_figure
from hwid_cli.report.figures.style import as_png


def texts(figure):
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def points(axes, marker):
    """Places of a marker, one pair for each."""
    found = [line for line in axes.lines if line.get_marker() == marker]
    return {tuple(point) for line in found for point in line.get_xydata()}


def test_a_simulation_has_the_residual_beneath_with_quantities_and_units(contents):
    upper, lower = simulation_figure(contents.simulated[0], is_detail=False).axes

    assert upper.get_ylabel() == "output y [m]"
    assert lower.get_ylabel() == "residual e [m]"
    assert lower.get_xlabel() == "time t [s]"
    np.testing.assert_array_equal(
        lower.lines[1].get_ydata(), contents.simulated[0].residual
    )


def test_large_numbers_leave_the_title_alone(contents):
    shown = contents.simulated[0]
    large = replace(
        shown,
        recording=replace(shown.recording, output=4e7 * shown.recording.output),
        output=4e7 * shown.output,
        residual=4e7 * shown.residual,
    )
    figure = simulation_figure(large, is_detail=False)
    as_png(figure)
    upper, lower = figure.axes

    for axes, quantity in ((upper, "output y"), (lower, "residual e")):
        assert not axes.yaxis.get_offset_text().get_visible()
        factor = axes.yaxis.get_major_formatter().get_offset()
        assert factor
        assert axes.get_ylabel() == f"{quantity} [{factor} m]"


def test_the_detail_shows_its_stretch_only(contents):
    shown = contents.simulated[0]
    upper, _ = simulation_figure(shown, is_detail=True).axes
    first, end = shown.detail

    time = upper.lines[0].get_xdata()
    assert time.size == end - first
    assert time[0] == pytest.approx(first * shown.recording.sample_time_s)


def test_each_order_grid_rings_its_best_orders(contents):
    grid = contents.grid
    figure = order_grid_figure(grid)

    for number, axes in enumerate(figure.axes[: len(grid.recordings)]):
        row, column = np.unravel_index(
            np.nanargmin(grid.rmsd[number]), grid.rmsd[number].shape
        )
        assert points(axes, "o") == {(column + 0.5, row + 0.5)}
    assert figure.axes[-1].get_ylabel() == "RMSD [m]"


@pytest.mark.parametrize("count", [1, 7, 13])
def test_order_grids_of_any_number_are_drawn(contents, count):
    grid = contents.grid
    names = tuple(f"r{n}" for n in range(count))
    values = np.resize(grid.rmsd, (count, *grid.rmsd.shape[1:]))
    figure = order_grid_figure(replace(grid, recordings=names, rmsd=values))

    visible = [axes for axes in figure.axes if axes.get_visible()]
    assert len(visible) == count + 1


def test_large_numbers_leave_the_label_of_the_order_grids_inside(contents):
    values = np.geomspace(2e3, 1e6, contents.grid.rmsd.size)
    values = values.reshape(contents.grid.rmsd.shape)
    grid = replace(contents.grid, rmsd=values, unit="micrometre")
    figure = order_grid_figure(grid)
    FigureCanvasAgg(figure).draw()

    label = figure.axes[-1].yaxis.label.get_window_extent()
    # A fiftieth of an inch is left to the edge.
    assert label.x1 < figure.bbox.x1 - 0.02 * figure.dpi


def test_a_failed_fit_stays_blank_over_the_hatching(contents):
    grid = contents.grid
    values = grid.rmsd.copy()
    values[0, 1, 0] = np.nan
    axes = order_grid_figure(replace(grid, rmsd=values)).axes[0]

    assert axes.collections[0].get_array().mask[1, 0]
    assert axes.patch.get_hatch()


def test_a_dot_marks_what_is_covered_and_a_square_what_is_own(contents):
    matrix = contents.full_matrix
    axes = rmsd_matrix_figure(matrix).axes[0]

    row, column = np.nonzero(matrix.rmsd < matrix.threshold)
    assert points(axes, "o") == set(zip(column + 0.5, row + 0.5, strict=True))
    row, column = np.nonzero(matrix.is_own)
    assert points(axes, "s") == set(zip(column + 0.5, row + 0.5, strict=True))


def test_the_matrix_counts_in_its_margins(contents):
    matrix = contents.full_matrix
    found = texts(rmsd_matrix_figure(matrix))

    counts = [*matrix.covers, *matrix.covered_by]
    assert found[: len(counts)] == [str(count) for count in counts]


def test_the_threshold_is_marked_in_the_colour_bar(contents):
    matrix = contents.cross
    bar = rmsd_matrix_figure(matrix).axes[1]

    assert {line.get_ydata()[0] for line in bar.lines} == {matrix.threshold}
    assert bar.get_ylabel() == "RMSD [m]"
    # Above the bar are its arrow and the counts.
    assert bar.get_title() == ""


@pytest.mark.thorough
@pytest.mark.parametrize("factor", [1.0, 1e-5, 1e6])
def test_nothing_beside_the_matrix_touches_whatever_the_numbers(contents, factor):
    matrix = contents.full_matrix
    values = matrix.rmsd * factor
    values[0, 0] = 1e9 * factor
    large = replace(
        matrix,
        rmsd=values,
        threshold=matrix.threshold * factor,
        unit="counts",
        covers=matrix.covers + 1000,
    )
    figure = rmsd_matrix_figure(large)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    axes, bar = figure.axes
    left = max(one.get_window_extent().x1 for one in axes.texts)
    label = bar.yaxis.label.get_window_extent()
    low, high = bar.get_ylim()
    numbers = [
        text.get_window_extent()
        for place, text in zip(bar.get_yticks(), bar.get_yticklabels(), strict=True)
        if low <= place <= high
    ]

    # With its label, wherever that stands.
    assert left < bar.get_tightbbox().x0
    assert max(one.x1 for one in numbers) < label.x0
    assert label.x1 < figure.bbox.x1
    # Beside the bar, not above it where its arrow is.
    assert label.y1 < bar.get_window_extent().y1


def test_a_matrix_without_any_number_is_drawn(contents):
    matrix = contents.cross
    nothing = replace(matrix, rmsd=np.full(matrix.rmsd.shape, np.nan))

    assert rmsd_matrix_figure(nothing).axes


def test_maps_show_their_break_points(contents):
    left, right = maps_figure(contents.models[0]).axes

    assert (left.get_xlabel(), left.get_ylabel()) == ("input u [A]", "w [A]")
    assert (right.get_xlabel(), right.get_ylabel()) == ("x [A]", "output y [m]")
    assert len(points(left, "o")) == contents.models[0].input_curve.corners.size


def test_the_bode_plot_ends_at_half_the_sampling_frequency(contents):
    upper, lower = bode_figure(contents.models[0]).axes

    assert lower.get_xlim()[1] == pytest.approx(100.0)
    assert upper.get_ylabel() == "|B/F| [A/A]"
    assert lower.get_xlabel() == "frequency [Hz]"


def test_poles_and_zeros_are_marked_and_far_zeros_counted(contents):
    view = replace(contents.models[0], zeros=np.array([0.5, 80.0], dtype=complex))
    axes = poles_figure(view).axes[0]

    assert len(points(axes, "x")) == view.poles.size
    assert axes.get_title(loc="left") == "poles and zeros; 1 further out"
    assert axes.get_xlim()[1] < 3.0


def test_names_with_dollars_are_no_formulas(contents):
    named = replace(contents.simulated[0].recording, name="$\\nothing{$")
    figure = simulation_figure(
        replace(contents.simulated[0], recording=named), is_detail=False
    )

    # A formula that cannot be read would raise here.
    assert as_png(figure)


@pytest.mark.thorough
def test_figures_do_not_depend_on_the_settings_of_the_user(contents):
    expected = as_png(bode_figure(contents.models[0]))
    with mpl.rc_context({"font.size": 30.0, "axes.grid": False, "savefig.dpi": 20}):
        found = as_png(bode_figure(contents.models[0]))

    assert found == expected


def test_a_model_that_goes_astray_does_not_take_the_colours_from_the_others(contents):
    matrix = contents.cross
    astray = matrix.rmsd.copy()
    astray[0, 1] = 1e30
    axes = rmsd_matrix_figure(replace(matrix, rmsd=astray)).axes

    assert axes[0].collections[0].norm.vmax == 1000 * matrix.threshold
    assert axes[0].collections[0].colorbar.extend == "max"
