"""Figures drawn on a sheet that was used before are those drawn on a new one."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from hwid_cli.data.calibration import removed_samples
from hwid_cli.records.recordings import CalibrationLog, RawRecording, Recording
from hwid_cli.report.figures.recordings import simulation_figure
from hwid_cli.report.figures.residuals import residuals_figure
from hwid_cli.report.figures.style import as_png, report_style
from hwid_cli.report.plots import calibration_figure, shared_sheets


def scaled(simulated, factor):
    """The same shape in another size, so that ticks, limits and factors differ."""
    recording = simulated.recording
    return replace(
        simulated,
        recording=replace(recording, output=factor * recording.output + factor),
        output=factor * simulated.output + factor,
        residual=-factor * simulated.residual,
    )


def with_lags(simulated):
    """An input of more than two levels: the third panel has something to show."""
    tests = replace(simulated.tests, with_square=simulated.tests.with_input)
    return replace(simulated, tests=tests)


def calibrated(scale, cut):
    time = np.arange(500.0)
    raw = RawRecording("r", scale * np.sin(time / 40), scale * np.cos(time / 9), 0.01)
    kept = slice(cut, 500 - cut)
    recording = Recording("r", raw.input[kept], raw.output[kept] - scale, 0.01)
    repaired = (cut + 7,) if cut else ()
    log = CalibrationLog(
        *("r", ("cut",), cut, 500 - 2 * cut, 500, 500),
        output_offset=scale,
        repaired_input=repaired,
    )
    return recording, replace(log, removed=removed_samples(raw, log))


@pytest.fixture
def drawings(contents):
    first, second = contents.simulated[:2]
    large = scaled(second, 4e7)
    return [
        *(
            partial(simulation_figure, one, is_detail=is_detail)
            for one in (first, large, second)
            for is_detail in (False, True, False)
        ),
        *map(
            partial(partial, residuals_figure),
            (first, with_lags(large), second, with_lags(first), first),
        ),
        *(
            partial(calibration_figure, *calibrated(*how))
            for how in ((1.0, 100), (1e6, 0), (2.0, 30), (1.0, 100))
        ),
    ]


@pytest.mark.thorough
def test_a_used_sheet_shows_nothing_of_the_drawing_before(drawings):
    with report_style():
        fresh = [as_png(draw()) for draw in drawings]
        with shared_sheets():
            shared = [as_png(draw()) for draw in drawings]

    # Five are there twice, among them those with others between.
    assert len(set(fresh)) == len(drawings) - 5
    assert shared == fresh


def test_sheets_are_shared_only_where_that_is_asked_for(drawings):
    draw, other = drawings[0], drawings[3]

    assert draw() is not draw()
    with shared_sheets():
        assert draw() is other()
    assert draw() is not draw()
