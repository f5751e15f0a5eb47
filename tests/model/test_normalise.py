from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model import normalise, static_map
from hwid_cli.model.linear_block import static_gain
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import MAP_KINDS
from tests.model.plants import level_input, plant


def awkward(input_map, output_map, initial_state="estimated"):
    """A plant whose gains are spread over the blocks, with a negative one."""
    model = plant(input_map, output_map, initial_state)
    return replace(model, numerator=model.numerator * -0.37)


@pytest.mark.parametrize("output_map", MAP_KINDS)
def test_normalising_leaves_the_output(output_map):
    u = level_input(300, 4)
    for input_map in MAP_KINDS:
        model = awkward(input_map, output_map)
        before, after = simulate(model, u), simulate(normalise.normalise(model), u)
        # Products of rounded gains.
        close = 1e-11 * np.abs(before).max()
        np.testing.assert_allclose(after, before, atol=close, err_msg=input_map)


def test_gains_end_in_their_fixed_places():
    model = normalise.normalise(awkward("polynomial", "piecewise_linear"))
    rule = static_map.RULES["polynomial"]
    assert rule.size(model.input_map)[0] == pytest.approx(1.0)
    ends = static_map.evaluate(model.input_map, np.array(model.input_map.domain))
    assert ends[0] <= ends[1]
    assert static_gain(model.numerator, model.denominator) == pytest.approx(1.0)


def test_normalising_twice_changes_nothing_more():
    once = normalise.normalise(awkward("piecewise_linear", "polynomial"))
    twice = normalise.normalise(once)
    np.testing.assert_allclose(twice.numerator, once.numerator, rtol=1e-12)
    np.testing.assert_allclose(
        twice.output_map.parameters, once.output_map.parameters, rtol=1e-9, atol=1e-12
    )


def test_differentiator_is_measured_by_its_numerator():
    model = replace(plant("none", "polynomial"), numerator=np.array([3.0, -3.0]))
    assert not normalise.uses_static_gain(model)
    got = normalise.normalise(model)
    assert np.linalg.norm(got.numerator) == pytest.approx(1.0)


def test_block_with_a_pole_at_one_has_no_static_gain_to_fix():
    model = replace(plant("none", "polynomial"), denominator=np.array([1.0, -1.0]))
    assert not normalise.uses_static_gain(model)
    assert np.isfinite(normalise.normalise(model).numerator).all()


def test_maps_without_a_free_gain_leave_theirs_in_the_numerator():
    model = awkward("saturation", "none")
    np.testing.assert_array_equal(normalise.normalise(model).numerator, model.numerator)


@pytest.mark.parametrize("output_map", MAP_KINDS)
def test_rescaling_changes_the_units_of_input_and_output(output_map):
    u = level_input(300, 4)
    for input_map in MAP_KINDS:
        model = plant(input_map, output_map, "estimated")
        expected = 0.02 * simulate(model, u)
        found = simulate(normalise.rescaled(model, 50.0, 0.02), 50.0 * u)
        close = 1e-12 * np.abs(expected).max()
        np.testing.assert_allclose(found, expected, atol=close, err_msg=input_map)
