"""The reference of a controller goes through calibration with input and output."""

import numpy as np
import pytest

from hwid_cli.records.experiment import CalibrateOptions
from hwid_cli.records.recordings import RawRecording
from hwid_cli.stages import calibrate
from hwid_cli.stages.calibrate import calibrate_all, calibration_key

N, LEAD_IN = 1500, 230


def followed(kind="step", reference=True):
    """A recording whose reference runs ahead of its output, at rest first."""
    times = np.arange(N)
    moving = np.where(times < LEAD_IN, 0.0, np.sin((times - LEAD_IN) / 40.0))
    ahead = 3.0 * moving + 0.5
    return RawRecording(
        "r1",
        moving,
        2.0 * moving + 0.5,
        1e-3,
        kind,
        reference=ahead if reference else None,
    )


def test_a_cut_keeps_the_same_samples_of_the_reference():
    raw = followed()
    (cut,), (log,) = calibrate_all([raw], CalibrateOptions(step=("cut",)))
    kept = slice(log.first_sample, log.first_sample + log.n_samples)

    assert log.first_sample > 0
    np.testing.assert_array_equal(cut.reference, raw.reference[kept])


def test_whole_periods_of_a_sine_are_kept_of_the_reference_too():
    raw = followed("sine")
    (cut,), (log,) = calibrate_all([raw], CalibrateOptions(sine=("cut", "recut")))
    kept = slice(log.first_sample, log.first_sample + log.n_samples)

    assert log.n_samples < N - log.first_sample
    np.testing.assert_array_equal(cut.reference, raw.reference[kept])


def test_an_offset_of_the_output_leaves_the_distance_to_the_reference():
    raw = followed()
    options = CalibrateOptions(step=("cut", "output_offset"))
    (cut,), (log,) = calibrate_all([raw], options)
    kept = slice(log.first_sample, log.first_sample + log.n_samples)

    assert log.output_offset == pytest.approx(0.5, abs=1e-12)
    # Both lose the same number: what is left differs by rounding.
    np.testing.assert_allclose(
        cut.reference - cut.output, (raw.reference - raw.output)[kept], atol=1e-14
    )


def test_without_a_recipe_the_reference_is_as_it_was():
    raw = followed()
    (same,), _ = calibrate_all([raw], None)

    np.testing.assert_array_equal(same.reference, raw.reference)


def test_recordings_without_a_reference_stay_without():
    (cut,), _ = calibrate_all([followed(reference=False)], CalibrateOptions())

    assert cut.reference is None


def test_a_reference_that_is_not_there_is_no_part_of_the_key(monkeypatch):
    monkeypatch.setattr(calibrate, "STAGE_VERSION", 1)
    raws = [
        RawRecording(
            "r1",
            np.arange(4.0),
            np.ones(3),
            1e-3,
            "step",
            source="a.csv",
            sha256="ab",
        ),
        RawRecording("r2", np.zeros(4), np.ones(4), 1e-3),
    ]

    # Computed by version 0.1.0, which knew no references.
    assert calibration_key(raws, CalibrateOptions(step=("cut",))) == (
        "f264f012f178a066dca560f1af885a2c065618fc3ee9b599da9348b361e68c2b"
    )


def test_a_reference_and_each_of_its_samples_count_in_the_key():
    without = followed(reference=False)
    changed = followed().reference + 1e-9 * (np.arange(N) == 7)
    other = RawRecording(
        "r1", without.input, without.output, 1e-3, "step", reference=changed
    )

    keys = {calibration_key([one], None) for one in (without, followed(), other)}
    assert len(keys) == 3
