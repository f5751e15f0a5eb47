import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.fit import fit, fit_without_standard_errors
from hwid_cli.model.simulate import simulate
from hwid_cli.model.static_map import evaluate
from hwid_cli.model.uncertainty import parameter_covariance, with_standard_errors
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording

ORDERS = Orders(1, 2, 1)
LINEAR = FitOptions(input_map="none", output_map="none")


def recording(f, *, noise=0.01, seed=0, samples=800):
    rng = np.random.default_rng(seed)
    u = 3.0 + lfilter([0.1], [1.0, -0.9], rng.standard_normal(samples))
    y = lfilter([0.0, 0.6], [1.0, -1.2, 0.5], f(u))
    return Recording("r", u, y + noise * rng.standard_normal(samples), 1.0)


def stairs(u):
    return np.round(2.0 * u) / 2.0


@pytest.mark.thorough
@pytest.mark.parametrize("output_map", ["none", "piecewise_linear", "saturation"])
def test_a_linear_plant_has_straight_maps_whatever_is_asked(output_map):
    one = recording(lambda u: u)
    options = FitOptions(input_map="piecewise_constant", output_map=output_map, units=4)
    found, linear = fit([one], ORDERS, options), fit([one], ORDERS, LINEAR)
    u = np.linspace(-9.0, 9.0, 300)

    assert found.rmsd <= linear.rmsd * (1.0 + 1e-9)
    assert found.model.input_map.kind == "piecewise_constant"
    assert "ask for no levels" in found.message
    if found.model.output_map.kind != "saturation":
        # The same model for every input, also at the lowest that it has seen.
        np.testing.assert_allclose(
            simulate(found.model, u), simulate(linear.model, u), rtol=1e-9, atol=1e-9
        )
    at = np.r_[one.input.min(), one.input.max(), u]
    np.testing.assert_allclose(evaluate(found.model.input_map, at), at, atol=1e-12)


def test_levels_of_the_output_are_straight_too():
    one = recording(lambda u: 5.0 * u)
    options = FitOptions(input_map="none", output_map="piecewise_constant", units=4)
    found, linear = fit([one], ORDERS, options), fit([one], ORDERS, LINEAR)

    np.testing.assert_allclose(
        simulate(found.model, one.input), simulate(linear.model, one.input), rtol=1e-9
    )


@pytest.mark.thorough
def test_parameters_that_say_nothing_have_no_standard_errors():
    one = recording(lambda u: u)
    options = FitOptions(input_map="piecewise_constant", output_map="none", units=4)
    fast = fit_without_standard_errors([one], ORDERS, options)
    found = with_standard_errors(fast, [one])

    assert found.uncertainty.names == ()
    assert "no levels" in found.uncertainty.reason
    with pytest.raises(ValueError, match="no levels"):
        parameter_covariance(found, [one])


@pytest.mark.thorough
def test_levels_that_the_plant_has_stay():
    one = recording(stairs, samples=3000)
    options = FitOptions(input_map="piecewise_constant", output_map="none", units=6)
    found = fit([one], ORDERS, options)

    assert found.rmsd < 0.5 * found.linear_rmsd
    assert np.unique(evaluate(found.model.input_map, one.input)).size <= 6


@pytest.mark.thorough
def test_larger_orders_stay_as_good_where_the_smaller_ones_became_linear():
    one = recording(lambda u: u)
    options = FitOptions(input_map="piecewise_constant", output_map="none", units=4)
    small = fit([one], Orders(1, 1, 1), options)
    for search_anew in (False, True):
        large = fit(
            [one], ORDERS, options, contained=[small.model], search_anew=search_anew
        )
        assert large.rmsd <= small.rmsd
