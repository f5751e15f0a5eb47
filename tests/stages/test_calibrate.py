import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hwid_cli.data.calibration import Draft, run_recipe
from hwid_cli.errors import ConfigError, MeasurementError
from hwid_cli.records.experiment import CalibrateOptions
from hwid_cli.records.recordings import CalibrationLog, RawRecording
from hwid_cli.stages.calibrate import calibrate_all

THESIS = CalibrateOptions(
    step=("cut", "output_offset"),
    sine=("cut", "input_offset", "output_offset", "recut"),
    random=("cut",),
)


def raw(input_, output, kind, name="r1"):
    return RawRecording(name, input_, output, 1e-3, kind, source=f"raw/{name}.csv")


def as_raw(recording):
    return raw(recording.input, recording.output, recording.kind, recording.name)


def measurement(kind, *, lead_in=230, n=2000, offsets=(0.0, 0.0), noise=0.0, seed=0):
    """A lead-in, an excitation, and an output that follows it with a lag of 20."""
    rng = np.random.default_rng(seed)
    times = np.arange(n)
    excitation = {
        "step": 4.0 * np.minimum(1.0, (times + 1) / 100),
        "sine": 2.0 * np.sin(2 * np.pi * times / 157.3),
        "random": np.interp(times, np.arange(0, n + 50, 50), _levels(n, rng)),
        "other": np.where(times % 700 < 350, 3.0, -1.0),
    }[kind]
    input_ = np.concatenate([np.zeros(lead_in), excitation])
    lag = np.exp(-1 / 20)
    output = np.zeros_like(input_)
    for k in range(1, output.size):
        output[k] = lag * output[k - 1] + (1 - lag) * input_[k - 1]
    noises = noise * rng.standard_normal((2, input_.size))
    return input_ + offsets[0] + noises[0], output + offsets[1] + noises[1]


def _levels(n, rng):
    levels = rng.uniform(-2, 2, n // 50 + 1)
    levels[0] = 0.0
    return levels


def test_a_step_is_cut_to_its_rest_and_its_output_starts_at_zero():
    input_, output = measurement("step", lead_in=230, offsets=(0.1, -0.5))
    (recording,), (log,) = calibrate_all([raw(input_, output[:-40], "step")], THESIS)

    assert log.first_sample == 130
    assert recording.n_samples == log.n_samples == 230 + 2000 - 40 - 130
    assert (log.n_raw_input, log.n_raw_output) == (2230, 2190)
    # No noise: the rest is -0.5 to rounding.
    assert log.output_offset == pytest.approx(-0.5, abs=1e-12)
    assert log.input_offset == 0.0
    np.testing.assert_allclose(recording.output[:100], 0.0, atol=1e-12)
    np.testing.assert_array_equal(recording.input, input_[130 : 130 + 2060])


def test_a_short_lead_in_is_kept_whole():
    input_, output = measurement("step", lead_in=60)
    (recording,), (log,) = calibrate_all([raw(input_, output, "step")], THESIS)

    assert log.first_sample == 0
    assert recording.n_samples == 2060


def test_a_sine_keeps_whole_periods_without_rest_or_offset():
    input_, output = measurement("sine", offsets=(0.3, 0.2))
    (recording,), (log,) = calibrate_all([raw(input_, output, "sine")], THESIS)

    # Sampled crossings, interpolated linearly: (2 pi / 157)^3 / 16 of a period.
    assert log.period_samples == pytest.approx(157.3, abs=1e-3)
    # The first sample of sin(0) is rest, the next is excitation.
    assert log.first_sample == 231
    assert log.n_samples == recording.n_samples == round(12 * 157.3)
    # The chord of the period's last part is off by the square of a step of 0.04.
    assert log.input_offset == pytest.approx(0.3, abs=1e-4)


def test_a_random_signal_is_only_cut():
    input_, output = measurement("random", offsets=(0.3, 0.2), seed=3)
    (recording,), (log,) = calibrate_all([raw(input_, output, "random")], THESIS)

    first = log.first_sample
    assert 230 <= first <= 232
    np.testing.assert_array_equal(recording.input, input_[first:])
    assert (log.input_offset, log.output_offset) == (0.0, 0.0)


def test_a_random_signal_with_an_offset_step_keeps_rest_for_it():
    options = CalibrateOptions(random=("cut", "output_offset"))
    input_, output = measurement("random", offsets=(0.3, 0.2), seed=3)
    _, (log,) = calibrate_all([raw(input_, output, "random")], options)

    assert 130 <= log.first_sample <= 132
    assert log.output_offset == pytest.approx(0.2, abs=1e-12)


def test_at_most_samples_are_kept():
    options = CalibrateOptions(step=("cut", "output_offset"), samples=500)
    input_, output = measurement("step")
    (recording,), _ = calibrate_all([raw(input_, output, "step")], options)

    assert recording.n_samples == 500


def test_no_section_and_an_empty_recipe_leave_a_recording_as_it_is():
    input_, output = measurement("step", offsets=(1.0, 1.0))
    input_[700] += 9.0
    for options in (None, CalibrateOptions(sine=("cut",))):
        (recording,), (log,) = calibrate_all([raw(input_, output, "step")], options)

        np.testing.assert_array_equal(recording.input, input_)
        np.testing.assert_array_equal(recording.output, output)
        assert log.repaired_input == ()


def test_damaged_samples_are_replaced_and_listed_by_their_raw_index():
    input_, output = measurement("step", noise=0.001)
    damaged_input, damaged_output = input_.copy(), output.copy()
    damaged_input[[150, 900]] += [7.0, -7.0]
    damaged_output[[100, 1200]] -= 3.0
    (recording,), (log,) = calibrate_all(
        [raw(damaged_input, damaged_output, "step")], THESIS
    )
    (clean,), _ = calibrate_all([raw(input_, output, "step")], THESIS)

    assert log.repaired_input == (150, 900)
    assert log.repaired_output == (100, 1200)
    # Interpolation adds the neighbours' noise: 5 sigma of 0.001 * sqrt(34/36 + 1).
    np.testing.assert_allclose(recording.input, clean.input, atol=0.007)


def test_damage_that_shows_after_a_cut_is_listed_by_its_raw_index_too():
    input_, output = measurement("step", lead_in=60)
    input_[400] += 7.0
    source = raw(input_, output, "step")
    log = CalibrationLog("r1", ("cut",), 50, input_.size, 9999, 9999)
    draft = Draft(source, CalibrateOptions(step=("cut",)), input_, output, log)

    assert run_recipe(draft).log.repaired_input == (450,)


def test_repair_can_be_switched_off():
    options = CalibrateOptions(step=("cut",), repair=False)
    input_, output = measurement("step")
    input_[900] += 7.0
    (recording,), (log,) = calibrate_all([raw(input_, output, "step")], options)

    assert log.repaired_input == ()
    assert np.max(recording.input) == 11.0


# The whole record is as quiet elsewhere; only within what is kept the lead-in stands out.
@pytest.mark.thorough
@example(kind="random", lead_in=20, offsets=(0.0, 0.0), noise=0.0, samples=800, seed=1)
@settings(max_examples=30, deadline=None)
@given(
    kind=st.sampled_from(["step", "sine", "random", "other"]),
    lead_in=st.integers(20, 400),
    offsets=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
    noise=st.sampled_from([0.0, 1e-3, 2e-2]),
    samples=st.sampled_from([None, 800]),
    seed=st.integers(0, 1000),
)
def test_calibrating_twice_is_calibrating_once(
    kind, lead_in, offsets, noise, samples, seed
):
    options = CalibrateOptions(
        step=("cut", "output_offset"),
        sine=("cut", "input_offset", "output_offset", "recut"),
        random=("cut",),
        other=("cut", "input_offset", "output_offset"),
        samples=samples,
    )
    columns = measurement(
        kind, lead_in=lead_in, offsets=offsets, noise=noise, seed=seed
    )
    (once,), _ = calibrate_all([raw(*columns, kind)], options)
    (twice,), (log,) = calibrate_all([as_raw(once)], options)

    assert log.first_sample == 0
    assert twice.n_samples == once.n_samples
    if samples is not None and kind != "sine":
        assert once.n_samples == samples
    # Subtracting a mean of rounding errors moves the last digits only.
    np.testing.assert_allclose(twice.input, once.input, rtol=0, atol=1e-11)
    np.testing.assert_allclose(twice.output, once.output, rtol=0, atol=1e-11)


@pytest.mark.thorough
@settings(max_examples=30, deadline=None)
@given(
    kind=st.sampled_from(["step", "sine"]),
    offset=st.floats(-5, 5),
)
def test_an_offset_of_the_output_does_not_show_in_the_result(kind, offset):
    input_, output = measurement(kind, noise=1e-3)
    (plain,), _ = calibrate_all([raw(input_, output, kind)], THESIS)
    (shifted,), _ = calibrate_all([raw(input_, output + offset, kind)], THESIS)

    np.testing.assert_allclose(shifted.output, plain.output, rtol=0, atol=1e-11)


def test_an_input_that_never_moves_is_refused():
    values = np.full(500, 1.5)
    with pytest.raises(
        MeasurementError,
        match=r"raw/r1\.csv \(recording r1\): the input stays at 1\.5 A over 500 samples",
    ):
        calibrate_all([raw(values, values, "step")], THESIS)


def test_a_step_without_rest_has_no_offset_to_subtract():
    input_, output = measurement("step", lead_in=0)
    with pytest.raises(
        MeasurementError, match="no rest before the excitation for 'out"
    ):
        calibrate_all([raw(input_, output, "step")], THESIS)


def test_a_sine_shorter_than_a_period_is_refused():
    input_, output = measurement("sine", lead_in=0, n=100)
    with pytest.raises(MeasurementError, match="no whole period was found"):
        calibrate_all([raw(input_, output, "sine")], THESIS)


def test_an_output_that_ends_before_the_excitation_is_refused():
    input_, output = measurement("sine")
    with pytest.raises(
        MeasurementError, match=r"'cut' leaves 0 samples \(input 2230, output 200"
    ):
        calibrate_all([raw(input_, output[:200], "sine")], THESIS)


def test_unequal_lengths_are_refused_where_nothing_cuts_them():
    input_, output = measurement("step")
    with pytest.raises(MeasurementError, match="input has 2230 samples, output 2200"):
        calibrate_all([raw(input_, output[:2200], "step")], None)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (CalibrateOptions(step=("trim",)), r"calibrate\.step: unknown step 'trim'"),
        (CalibrateOptions(step=("recut",)), r"calibrate\.step: 'recut' keeps whole"),
        (CalibrateOptions(samples=3), r"calibrate\.samples: 3; expected at least 20"),
        (
            CalibrateOptions(step=("cut", "output_offset"), rest_samples=5),
            r"calibrate\.rest_samples: 5; expected at least 20",
        ),
    ],
)
def test_options_that_make_no_sense_are_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        calibrate_all([], options)


def test_a_sine_of_less_than_two_periods_keeps_its_one_whole_period():
    times = np.arange(400)
    sine = np.where(times < 40, 0.0, np.sin(2 * np.pi * (times - 40) / 200.0))
    (recording,), (log,) = calibrate_all([raw(sine, 0.5 * sine, "sine")], THESIS)

    assert log.period_samples == pytest.approx(200.0, abs=0.5)
    assert recording.n_samples == 200


def test_a_sine_without_a_whole_period_is_told_with_the_samples_of_its_file():
    times = np.arange(400)
    sine = np.where(times < 240, 0.0, np.sin(2 * np.pi * (times - 240) / 400.0))
    with pytest.raises(MeasurementError, match="left of the file's 400") as error:
        calibrate_all([raw(sine, sine, "sine")], THESIS)
    assert "no whole period was found" in str(error.value)
