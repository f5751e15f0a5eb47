"""What a calibration took away gives the measurement back."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.data.as_measured import as_measured
from hwid_cli.stages.calibrate import calibrate_all
from hwid_cli.store.results import read_calibrated, write_calibrated
from tests.stages.test_calibrate import THESIS, measurement, raw
from tests.store.result_examples import PROVENANCE


def damaged(kind, seed=0):
    """A noisy measurement of unequal columns, damaged inside and outside of what stays."""
    input_, output = measurement(kind, offsets=(0.3, -0.2), noise=1e-3, seed=seed)
    for place in (40, 900, 1503):
        input_[place] += 9.0
    output[[17, 1200]] -= 7.0
    return raw(input_, output[:-25], kind, name=kind)


KINDS = ("step", "sine", "random")


@pytest.fixture(scope="module")
def calibrated():
    raws = [damaged(kind, n) for n, kind in enumerate(KINDS)]
    return raws, calibrate_all(raws, THESIS)


@pytest.mark.parametrize("place", range(len(KINDS)))
def test_the_measurement_comes_back_from_the_recording_and_its_log(calibrated, place):
    raws, (recordings, logs) = calibrated
    given, recording, log = raws[place], recordings[place], logs[place]
    input_, output = as_measured(recording, log)

    assert log.n_samples < output.size < input_.size
    assert log.repaired_input == (40, 900, 1503)
    assert log.repaired_output == (17, 1200)
    # An offset is subtracted and added again.
    np.testing.assert_allclose(input_, given.input, rtol=0, atol=1e-14)
    np.testing.assert_allclose(output, given.output, rtol=0, atol=1e-14)


def test_it_comes_back_from_the_file_too(calibrated, tmp_path):
    _, (recordings, logs) = calibrated
    path = tmp_path / "calibrated.h5"
    write_calibrated(path, recordings, logs, PROVENANCE)
    found = read_calibrated(path)

    for recording, log, before in zip(found.recordings, found.logs, logs, strict=True):
        np.testing.assert_array_equal(log.removed, before.removed)
        assert as_measured(recording, log) is not None


def test_a_log_of_an_older_program_gives_nothing_back(calibrated):
    _, (recordings, logs) = calibrated
    assert as_measured(recordings[0], replace(logs[0], removed=np.zeros(0))) is None
