"""A measurement in other units gives the same model, and numbers beyond sense none."""

import numpy as np
import pytest

from hwid_cli import FitOptions, Orders, Recording, fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.experiment import CalibrateOptions
from hwid_cli.records.recordings import RawRecording
from hwid_cli.stages.calibrate import calibrate_all
from tests.diagnosis.small_drive import recordings, simulation
from tests.numerics.plants import FEW, identified, measured, validated
from tests.stages.diagnosed_drive import FRICTION, diagnosed, parameters

# Current in mA and uA; displacement in mm, counts of a micrometre, nm, and far beyond.
UNITS = [
    (1.0, 1e-3),
    (1.0, 1e-6),
    (1.0, 1e-9),
    (1e-3, 1e-9),
    (1e6, 1e12),
    (1e40, 1e-40),
]
# Scaling by powers of ten rounds the samples' last bits, which the search amplifies.
ROUNDING = 1e-6


@pytest.mark.parametrize(("ampere", "metre"), UNITS, ids=str)
def test_a_fit_is_the_same_in_every_unit(ampere, metre):
    first = fit([measured()], Orders(1, 1, 1), FEW)
    second_data = measured(input_unit=ampere, output_unit=metre)
    second = fit([second_data], Orders(1, 1, 1), FEW)

    assert second.status == first.status
    assert second.fit_percent == pytest.approx(first.fit_percent, abs=ROUNDING)
    assert second.rmsd * metre == pytest.approx(first.rmsd, rel=ROUNDING)
    assert second.linear_rmsd * metre == pytest.approx(first.linear_rmsd, rel=ROUNDING)
    np.testing.assert_allclose(second.poles, first.poles, rtol=ROUNDING)
    outputs = simulate(second.model, second_data.input) * metre
    np.testing.assert_allclose(
        outputs, simulate(first.model, measured().input), rtol=0, atol=ROUNDING * 1e-3
    )


def test_powers_of_two_give_the_same_bits():
    first = fit([measured()], Orders(1, 1, 1), FEW)
    second = fit(
        [measured(input_unit=2.0**20, output_unit=2.0**-30)], Orders(1, 1, 1), FEW
    )

    assert second.fit_percent == first.fit_percent
    assert second.rmsd * 2.0**-30 == first.rmsd
    np.testing.assert_array_equal(second.model.denominator, first.model.denominator)


def cross_validated(metre):
    data = [
        measured(name, seed, output_unit=metre) for seed, name in ((1, "a"), (2, "b"))
    ]
    return validated(identified(data), data)


@pytest.mark.thorough
def test_cross_validation_is_the_same_in_nanometres():
    first, second = cross_validated(1.0), cross_validated(1e-9)

    assert (second.status == first.status).all()
    found = second.rmsd * 1e-9
    np.testing.assert_allclose(found[:, :, 0], first.rmsd[:, :, 0], rtol=ROUNDING)
    # The plant has one pole. What a second one does with the noise is flat: the search
    # may end a little elsewhere for other last bits.
    np.testing.assert_allclose(found[:, :, 1], first.rmsd[:, :, 1], rtol=1e-4)


@pytest.mark.thorough
@pytest.mark.parametrize("metre", [2.0**-30, 2.0**20])
def test_a_fit_that_begins_with_models_is_the_same_bits_in_every_unit(metre):
    """Of several recordings that begins with their models, as in groups."""

    def joined(unit):
        data = [measured("a", 1, output_unit=unit), measured("b", 2, output_unit=unit)]
        starts = [fit([one], Orders(1, 1, 1), FEW).model for one in data]
        return fit(data, Orders(1, 1, 1), FEW, starts=starts)

    assert joined(metre).rmsd * metre == joined(1.0).rmsd


@pytest.mark.thorough
def test_cross_validation_in_powers_of_two_gives_the_same_bits():
    first, second = cross_validated(1.0), cross_validated(2.0**-30)

    np.testing.assert_array_equal(second.rmsd * 2.0**-30, first.rmsd)


def raw(metre):
    """A step after a rest, with one damaged sample."""
    rng = np.random.default_rng(3)
    rest = np.r_[np.zeros(150), np.ones(250)]
    output = 0.01 * rest + 0.003 + 1e-5 * rng.standard_normal(400)
    output[220] += 0.3
    return RawRecording("s", 2 * rest, output / metre, 1e-3, kind="step")


@pytest.mark.parametrize("metre", [1e-3, 1e-6, 1e-9])
def test_calibration_is_the_same_in_every_unit(metre):
    options = CalibrateOptions(step=("cut", "output_offset"))
    (first,), (first_log,) = calibrate_all([raw(1.0)], options)
    (second,), (second_log,) = calibrate_all([raw(metre)], options)

    assert first_log.repaired_output == (220,)
    assert second_log.repaired_output == first_log.repaired_output
    assert second_log.first_sample == first_log.first_sample
    # Of 1 cm; sums of powers of ten differ in their last bits.
    np.testing.assert_allclose(second.output * metre, first.output, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_a_diagnosis_is_the_same_in_millimetres():
    metres = recordings(FRICTION)
    millimetres = [
        Recording(one.name, one.input, one.output * 1e3, one.sample_time_s, one.kind)
        for one in metres
    ]
    base = simulation()
    # The same forces move the same drive: all that is divided by a length is smaller.
    changes = {
        name: getattr(base, name) / 1e3
        for name in ("mass_kg", "damping_N_s_per_m", "stiffness_N_per_m")
    }
    first = diagnosed(metres)
    second = diagnosed(
        millimetres,
        simulation(**changes, reference_displacement_m=1e3 * 0.02),
    )

    assert second.verdict == first.verdict == "named"
    assert [one.id for one in second.effects] == [one.id for one in first.effects]
    force = parameters(first.effects[0])["force_N"]
    # The search stops within this of its end.
    assert parameters(second.effects[0])["force_N"] == pytest.approx(force, rel=1e-4)


@pytest.mark.parametrize(
    ("ampere", "metre", "said"),
    [
        (1.0, 1e-300, "the output reaches"),
        (1e-300, 1.0, "the input reaches"),
        (1.0, 1e300, "the output spans"),
        (1e300, 1.0, "the input spans"),
        (1e320, 1.0, "the input is constant"),
        (1.0, 1e317, "the output spans|the output is constant"),
    ],
)
def test_numbers_whose_squares_are_none_fail_in_words(ampere, metre, said):
    data = measured()
    # Division would leave the range of 64 bits on the way.
    with np.errstate(all="ignore"):
        data = Recording("a", data.input / ampere, data.output / metre, 1e-3)
    found = fit([data], Orders(1, 1, 1), FEW)

    assert found.status == "failed"
    assert found.model is None
    assert any(word in found.message for word in said.split("|")), found.message


@pytest.mark.parametrize("kind", ["piecewise_linear", "saturation", "polynomial"])
def test_constant_stretches_and_two_levels_leave_no_nan(kind):
    current = np.r_[np.zeros(200), np.full(100, 2.0), np.zeros(100), np.full(100, 2.0)]
    output = np.r_[np.zeros(210), np.full(100, 1e-3), np.zeros(100), np.full(90, 1e-3)]
    options = FitOptions(kind, kind, units=4, degree=3, starts=1, max_iterations=5)
    found = fit([Recording("a", current, output, 1e-3)], Orders(2, 2, 1), options)

    assert (
        np.isfinite([found.rmsd, found.fit_percent]).all() or found.status == "failed"
    )


@pytest.mark.parametrize("side", ["input", "output"])
def test_one_level_only_fails_in_words(side):
    data = {"input": measured().input, "output": measured().output}
    data[side] = np.full(300, 3.0)
    found = fit([Recording("a", **data, sample_time_s=1e-3)], Orders(1, 1, 1), FEW)

    assert found.status == "failed"
    assert found.message == f"the {side} is constant at 3"
