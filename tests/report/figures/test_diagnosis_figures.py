from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from hwid_cli.records.diagnosis import LatentForce
from hwid_cli.report.figures.diagnosis import diagnosis_figures, gap_figure
from hwid_cli.report.figures.diagnosis_curves import (
    force_figure,
    overlay_figure,
    telling_stretch,
)
from hwid_cli.report.figures.style import as_png
from tests.report.diagnosis_examples import (
    NAN,
    NOISE,
    named,
    nothing_missing,
    overlay,
    unknown,
)

ALL = ["gap", "overlay", "force", "ranking", "where"]


def names_of(figures):
    return [name.removeprefix("diagnosis_") for name in figures]


def rows_of(axes):
    return [label.get_text() for label in axes.get_yticklabels()]


def legend_of(figure):
    return [text.get_text() for one in figure.legends for text in one.get_texts()]


@pytest.mark.thorough
@pytest.mark.parametrize(
    "count",
    # Nine are rendered for the page of tests/report as well.
    [1, *(pytest.param(count, marks=pytest.mark.slow) for count in (9, 43))],
)
def test_any_number_of_recordings_gives_all_figures(count):
    figures = diagnosis_figures(named(count))

    assert names_of(figures) == ALL
    for figure in figures.values():
        assert as_png(figure).startswith(b"\x89PNG")


def test_what_there_is_nothing_for_is_left_out():
    assert names_of(diagnosis_figures(nothing_missing())) == ["gap"]
    assert diagnosis_figures(replace(nothing_missing(), gaps=())) == {}


def test_the_gap_tells_held_out_recordings_from_those_trained_on():
    found = named(43)
    held_out, train = gap_figure(found).axes

    assert held_out.get_title(loc="left") == "held-out: 15"
    assert train.get_title(loc="left") == "trained on: 28"
    assert rows_of(held_out) == [one.name for one in found.gaps if one.is_held_out]
    assert train.get_xlabel() == "RMS of the residual [m]"
    assert held_out.get_xscale() == "log"
    assert held_out.get_xlim() == train.get_xlim()


def test_the_gap_shows_each_rms_and_the_noise():
    found = named()
    figure = gap_figure(found)
    given, before, after, noise = figure.axes[0].lines
    gaps = [one for one in found.gaps if one.is_held_out]

    np.testing.assert_array_equal(given.get_xdata(), [one.rms_given for one in gaps])
    np.testing.assert_array_equal(before.get_xdata(), [one.rms_before for one in gaps])
    np.testing.assert_array_equal(after.get_xdata(), [one.rms_after for one in gaps])
    assert set(noise.get_xdata()) == {NOISE}
    assert legend_of(figure) == [
        "as given",
        "re-fitted",
        "with the effects",
        "noise 2.1e-05 m",
    ]
    low, high = figure.axes[0].get_xlim()
    assert low < NOISE < max(one.rms_given for one in found.gaps) < high


@pytest.mark.parametrize("middle", [1e-5, 2.9e-5, 7.1, 3e4])
def test_values_close_together_have_numbers_on_their_axis(middle):
    found = named(3)
    same = [
        replace(one, rms_given=middle, rms_before=middle, rms_after=1.01 * middle)
        for one in found.gaps
    ]
    noise = replace(found.noise, rms=middle)
    axes = gap_figure(replace(found, gaps=tuple(same), noise=noise)).axes[-1]
    low, high = axes.get_xlim()

    assert sum(low <= place <= high for place in axes.get_xticks()) >= 2


def test_without_effects_or_noise_the_gap_has_fewer_marks():
    found = unknown()
    figure = gap_figure(replace(found, noise=replace(found.noise, rms=0.0)))

    assert legend_of(figure) == ["as given", "re-fitted"]


def test_a_gap_without_any_number_is_drawn_blank():
    found = named(3)
    blank = [
        replace(one, rms_given=NAN, rms_before=0.0, rms_after=np.inf)
        for one in found.gaps
    ]
    noise = replace(found.noise, rms=0.0)
    figure = gap_figure(replace(found, gaps=tuple(blank), noise=noise))

    assert as_png(figure)
    for line in figure.axes[0].lines:
        assert np.isnan(line.get_xdata()).all()


def test_the_overlays_show_measurement_simulations_and_residuals():
    found = replace(named(), overlays=named().overlays[:2])
    figure = overlay_figure(found)
    upper, both, after = figure.axes[:3]
    one = found.overlays[0]
    first, end = telling_stretch(one)

    assert len(figure.axes) == 3 * len(found.overlays)
    assert upper.get_title(loc="right") == "step_00 (detail)"
    assert upper.get_ylabel() == "output y [m]"
    assert both.get_ylabel() == after.get_ylabel() == "residual e [m]"
    assert after.get_xlabel() == "time t [s]"
    for line, values in zip(
        upper.lines, (one.measured, one.before, one.after), strict=True
    ):
        np.testing.assert_array_equal(line.get_ydata(), values[first:end])
    # The first line of each is the zero.
    left = [one.measured - values for values in (one.before, one.after)]
    for line, values in zip(both.lines[1:], left, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), values[first:end])
    np.testing.assert_array_equal(after.lines[1].get_ydata(), left[1][first:end])


def test_the_residuals_lie_on_a_band_of_two_standard_deviations():
    one = replace(named(), overlays=named().overlays[:1])
    for axes in overlay_figure(one).axes[1:3]:
        (band,) = axes.patches
        assert band.get_y() == pytest.approx(-2.0 * NOISE)
        assert band.get_height() == pytest.approx(4.0 * NOISE)


def test_without_effects_the_overlays_show_one_simulation():
    figure = overlay_figure(unknown())

    assert len(figure.axes) == 2 * len(unknown().overlays)
    assert legend_of(figure)[:2] == ["measured", "re-fitted"]
    assert "with the effects" not in legend_of(figure)


@pytest.mark.parametrize(("count", "drawn"), [(1, 1), (4, 4), (6, 4)])
def test_at_most_four_overlays_are_drawn(count, drawn):
    found = replace(named(), overlays=tuple(overlay(f"r{n}") for n in range(count)))

    assert len(overlay_figure(found).axes) == 3 * drawn


def test_the_stretch_that_is_shown_is_where_the_simulation_fails():
    one = overlay(n_samples=20000)
    wrong = one.measured.copy()
    wrong[12000:12300] += 1e-3
    first, end = telling_stretch(replace(one, before=wrong))

    assert 11500 < first < 12000
    assert 12300 < end < 12800


def test_of_many_swings_a_few_are_shown():
    time = np.arange(20000) / 1e3
    swings = np.sin(2 * np.pi * 10.0 * time)
    one = replace(
        overlay(n_samples=20000), time_s=time, measured=swings, before=0.9 * swings
    )
    first, end = telling_stretch(one)

    # Six periods of a hundred samples, up to one for where swings are counted.
    assert 550 <= end - first <= 650


@pytest.mark.parametrize("size", [1, 2, 50])
def test_a_short_recording_is_shown_as_a_whole(size):
    one = overlay(n_samples=size)

    assert telling_stretch(one) == (0, size)
    assert as_png(overlay_figure(replace(named(), overlays=(one,))))


def test_a_simulation_that_goes_astray_leaves_the_rest_readable():
    one = overlay()
    astray = one.before.copy()
    astray[700:800], astray[800:900], astray[900:] = 1e300, np.inf, np.nan
    strange = replace(one, before=astray, after=np.full(1500, np.nan), noise_rms=0.0)
    figure = overlay_figure(replace(named(), overlays=(strange,)))

    assert as_png(figure)
    assert figure.axes[0].get_ylim()[1] < 0.1


def test_the_force_stands_against_its_variables_with_the_law():
    found = named()
    figure = force_figure(found)
    left, right = figure.axes
    force = found.latent_force[0]

    assert left.get_xlabel() == "velocity [m/s]"
    assert right.get_xlabel() == "direction [-]"
    assert left.get_ylabel() == "missing force F [N]"
    _, mean, law = left.lines
    np.testing.assert_array_equal(mean.get_ydata(), force.mean)
    np.testing.assert_array_equal(law.get_ydata(), force.law)
    spread = left.collections[0].get_paths()[0].vertices[:, 1]
    assert spread.max() == (force.mean + force.spread).max()
    assert set(legend_of(figure)) == {
        "from measurements",
        "with the effects",
        "spread, \N{PLUS-MINUS SIGN}1 sd",
    }


def test_without_a_law_only_the_measurements_are_drawn():
    assert "with the effects" not in legend_of(force_figure(unknown()))


@pytest.mark.parametrize("value", [0.0, NAN, 3.0])
def test_a_force_of_one_value_is_drawn(value):
    flat = np.full(4, value)
    force = LatentForce("t", "s", np.arange(4.0), flat, flat, np.empty(0))

    assert as_png(force_figure(replace(named(), latent_force=(force,))))


def test_a_wide_spread_leaves_the_curves_readable():
    force = replace(named().latent_force[0], spread=np.full(16, 1e3))
    low, high = force_figure(replace(named(), latent_force=(force,))).axes[0].get_ylim()

    assert high - low < 4.0 * np.ptp(force.mean)


@pytest.mark.thorough
def test_hostile_and_long_names_stay_inside_the_figures():
    found = named(3)
    name = "$\\bad{_<b>%" + 80 * "n"
    hostile = replace(
        found,
        gaps=tuple(replace(one, name=name) for one in found.gaps),
        overlays=tuple(replace(one, name=name) for one in found.overlays[:1]),
        places=tuple(replace(one, variable=name) for one in found.places),
        latent_force=(replace(found.latent_force[0], variable=name, unit="$"),),
        candidates=tuple(replace(one, effects=(name,)) for one in found.candidates),
        output_unit="$\\bad",
    )
    for figure in diagnosis_figures(hostile).values():
        FigureCanvasAgg(figure).draw()
        for axes in figure.axes:
            for label in axes.get_yticklabels():
                assert label.get_window_extent().x0 >= 0.0
            assert axes.get_tightbbox().x1 <= figure.bbox.x1 + 1.0
