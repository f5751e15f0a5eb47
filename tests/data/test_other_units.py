"""Calibrated recordings in other units: what was measured must come back from both."""

import numpy as np
import pytest

from hwid_cli.data.as_measured import as_measured
from hwid_cli.data.other_units import in_other_units
from hwid_cli.records.recordings import CalibrationLog, Recording, SignalUnit

RECORDING = Recording(
    "a",
    np.array([1.0, -2.0, 4.0]),
    np.array([10.0, 20.0, 5.0]),
    1e-3,
    reference=np.array([11.0, 21.0, 6.0]),
    input_unit="mA",
    output_unit="mm",
)
LOG = CalibrationLog(
    "a", ("cut",), 2, 3, 5, 6, 0.5, -3.0, units=(
        SignalUnit("time", "ms", "a name", "s", 1e-3),
        SignalUnit("input", "A", "a name", "mA", 1e3),
        SignalUnit("output", "mm", "a name", "mm"),
    ),
    removed=np.array([0.1, 0.2, 1.0, 2.0, 3.0]),
)  # fmt: skip


def test_all_that_was_measured_is_converted():
    found, log = in_other_units(RECORDING, LOG, ("A", "m"))

    assert (found.input_unit, found.output_unit) == ("A", "m")
    assert found.input == pytest.approx(1e-3 * RECORDING.input)
    assert found.reference == pytest.approx(1e-3 * RECORDING.reference)
    for before, after in zip(
        as_measured(RECORDING, LOG), as_measured(found, log), strict=True
    ):
        assert after == pytest.approx(1e-3 * before)


def test_units_say_what_became_of_the_files_numbers():
    _, log = in_other_units(RECORDING, LOG, ("A", "m"))

    assert [(one.unit, one.factor) for one in log.units] == [
        ("s", 1e-3),
        ("A", pytest.approx(1.0)),
        ("m", pytest.approx(1e-3)),
    ]


def test_what_measures_something_else_stays_as_it_is():
    found, log = in_other_units(RECORDING, LOG, ("V", "rad"))

    assert found is RECORDING
    assert log is LOG
