from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.data.calibration import removed_samples
from hwid_cli.records.recordings import CalibrationLog, RawRecording, Recording
from hwid_cli.report.plots import as_png, calibration_figure

TIME = np.arange(500.0)
RAW = RawRecording("r1", np.sin(TIME), np.cos(TIME), 0.01, output_unit="rad")
RECORDING = Recording(
    "r1", np.sin(TIME[100:400]), np.cos(TIME[100:400]), 0.01, output_unit="rad"
)
LOG = CalibrationLog(
    "r1", ("cut",), 100, 300, 500, 500, repaired_input=(120, 130), repaired_output=()
)
LOG = replace(LOG, removed=removed_samples(RAW, LOG))


def test_the_figure_shows_both_columns_with_quantity_and_unit():
    figure = calibration_figure(RECORDING, LOG)

    upper, lower = figure.axes
    assert upper.get_ylabel() == "input u [A]"
    assert lower.get_ylabel() == "output y [rad]"
    assert lower.get_xlabel().endswith("[s]")


def test_what_was_cut_is_shaded_and_what_was_repaired_is_marked():
    upper, lower = calibration_figure(RECORDING, LOG).axes

    shaded = sorted(patch.get_x() for patch in upper.patches)
    assert shaded == [0.0, 4.0]
    marks = {line.get_label(): line for line in upper.lines}["repaired"]
    np.testing.assert_allclose(marks.get_xdata(), [1.2, 1.3])
    assert "repaired" not in {line.get_label() for line in lower.lines}


def test_the_calibrated_signal_lies_where_it_was_in_the_raw_record():
    upper, _ = calibration_figure(RECORDING, LOG).axes

    line = {line.get_label(): line for line in upper.lines}["calibrated"]
    assert line.get_xdata()[0] == 1.0


def test_names_in_any_script_are_drawn_without_a_warning():
    """Warnings are errors in tests: the figure's font has no sign for these."""
    log = replace(LOG, name="测量_ステップ_측정")

    assert as_png(calibration_figure(RECORDING, log)).startswith(b"\x89PNG")


def test_a_log_that_does_not_know_what_was_cut_is_refused():
    with pytest.raises(ValueError, match="r1: the log does not hold what was removed"):
        calibration_figure(RECORDING, replace(LOG, removed=LOG.removed[1:]))
