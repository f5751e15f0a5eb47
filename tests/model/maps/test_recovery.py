"""Plants whose own map is of a kind are found again by a fit of that kind."""

import numpy as np
import pytest

from hwid_cli.model import scores
from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.model import FitOptions
from tests.model.plants import MAPS, ORDERS, measured, plant

# Units of the fit: networks get a few more than the plant has, because units that begin
# in equal distances have to find their places; the others just as many.
UNITS = {
    "sigmoid_network": 7,
    "wavelet_network": 7,
    "cubic_spline": 5,
    "piecewise_constant": 4,
    "own_function": 2,
}
# Edges can be found to within the distance of samples only.
SAMPLES = {"piecewise_constant": 10_000}

LONG = (
    ("sigmoid_network", "output"),
    ("wavelet_network", "input"),
    ("piecewise_constant", "input"),
)


def fitted(kind, side, *, noise=0.0, **others):
    maps = (kind, "none") if side == "input" else ("none", kind)
    recording = measured(plant(*maps), SAMPLES.get(kind, 1500), noise=noise)
    options = FitOptions(
        input_map=maps[0],
        output_map=maps[1],
        units=UNITS[kind],
        initial_state="zero",
        input_function=MAPS[maps[0]].function,
        output_function=MAPS[maps[1]].function,
        **others,
    )
    return fit([recording], ORDERS, options), measured(plant(*maps), seed=2)


@pytest.mark.parametrize(
    ("kind", "side"),
    [
        # Each kind on one side, and the cheap ones on both.
        pytest.param(kind, side, marks=pytest.mark.slow if (kind, side) in LONG else ())
        for kind in UNITS
        for side in ("input", "output")
    ],
)
def test_plant_with_a_map_of_its_kind_is_recovered(kind, side):
    result, other = fitted(kind, side)
    simulated = simulate(result.model, other.input)
    if kind == "piecewise_constant":
        # Exact but for the few samples between the edge and the nearest one of the fit.
        wrong = np.abs(other.output - simulated) > 1e-3 * np.ptp(other.output)
        assert np.mean(wrong) < 0.002
    else:
        assert scores.fit_percent(other.output, simulated) > 99.5


@pytest.mark.parametrize("side", ["input", "output"])
@pytest.mark.parametrize("kind", ["cubic_spline", "own_function"])
def test_noisy_fit_comes_down_to_the_noise(kind, side):
    result, _ = fitted(kind, side, noise=0.02)
    # A dozen parameters of 1500 samples take a few tenths of a percent off.
    assert result.fit_percent == pytest.approx(98.0, abs=0.1)
    assert np.isfinite(result.uncertainty.standard_errors).all()


def test_own_function_gets_its_parameters_in_the_units_of_the_data():
    result, _ = fitted("own_function", "input")
    found = result.model.input_map
    np.testing.assert_allclose(
        found.parameters, MAPS["own_function"].parameters, rtol=1e-4
    )
    assert found.function.unit == pytest.approx(1.0, rel=1e-15)


@pytest.mark.thorough
@pytest.mark.parametrize("kind", UNITS)
def test_a_fit_can_begin_with_a_model_of_its_kind(kind):
    first, _ = fitted(kind, "input", max_iterations=3)
    recording = measured(plant(kind, "none"), seed=3)
    again = fit([recording], ORDERS, first.options, starts=[first.model])
    assert again.status != "failed"
    assert (
        again.model.input_map.parameters.size == first.model.input_map.parameters.size
    )


def test_maps_have_as_many_units_as_their_sides_ask_for():
    recording = measured(plant("piecewise_linear", "polynomial"), noise=0.02)
    options = FitOptions(units=5, input_units=4, initial_state="zero")
    model = fit([recording], ORDERS, options).model
    assert model.input_map.parameters.size == 2 * (4 + 2)
    assert model.output_map.parameters.size == 2 * (5 + 2)


@pytest.mark.thorough
def test_no_standard_errors_behind_a_map_without_slope():
    result, _ = fitted("piecewise_constant", "output", max_iterations=2)
    assert result.uncertainty.standard_errors.size == 0
    assert "no slope" in result.uncertainty.reason


def test_edges_count_as_known_in_the_standard_errors_of_levels():
    result, _ = fitted("piecewise_constant", "input", noise=0.02)
    errors = dict(
        zip(result.uncertainty.names, result.uncertainty.standard_errors, strict=True)
    )
    # A place between samples, not a parameter: no number, and the reason says so.
    assert np.isnan(errors["input_map.edge[0]"])
    assert "edge[0]" in result.uncertainty.reason
    assert errors["input_map.level[1]"] > 0.0


def test_a_kind_that_cannot_pass_everything_on_has_the_cost_of_its_own_model():
    recording = measured(plant("none", "none"), noise=0.01)
    options = FitOptions(
        input_map="piecewise_constant", output_map="none", units=2, initial_state="zero"
    )
    result = fit([recording], ORDERS, options)
    simulated = simulate(result.model, recording.input)
    assert result.rmsd == pytest.approx(scores.rmsd(recording.output, simulated))
    # Two levels are no such plant; what is said of the linear model is true of this one.
    assert "no levels" in result.message
    assert result.rmsd == pytest.approx(result.linear_rmsd)
    assert isinstance(result.model.input_map, StaticMap)
