import numpy as np
import pytest

from hwid_cli.model import static_map
from hwid_cli.records.maps import MapOptions, StaticMap
from tests.model.plants import MAPS

NETWORKS = ("sigmoid_network", "wavelet_network")


def with_one_unit(kind):
    """A unit at 0.5 of width 0.2 and height 3 on the line v / 2 + 1."""
    return StaticMap(kind, np.array([0.5, 0.2, 3.0, 0.5, 1.5]), (-1.0, 1.0))


def test_a_unit_of_a_sigmoid_network_is_a_logistic_step_about_zero():
    v = np.linspace(-1.0, 2.0, 31)
    step = 3.0 / (1.0 + np.exp(-(v - 0.5) / 0.2)) - 1.5
    value = static_map.evaluate(with_one_unit("sigmoid_network"), v)
    np.testing.assert_allclose(value, 0.5 * v + 1.0 + step, atol=1e-13)


def test_a_unit_of_a_wavelet_network_is_a_mexican_hat():
    v = np.linspace(-1.0, 2.0, 31)
    z = (v - 0.5) / 0.2
    hat = 3.0 * (1.0 - z**2) * np.exp(-(z**2) / 2.0)
    value = static_map.evaluate(with_one_unit("wavelet_network"), v)
    np.testing.assert_allclose(value, 0.5 * v + 1.0 + hat, atol=1e-13)


@pytest.mark.parametrize("kind", NETWORKS)
def test_far_out_a_network_is_straight_with_the_slope_of_its_line(kind):
    one = MAPS[kind]
    left, right = one.parameters[-2:]
    far = np.array([-90.0, -80.0, 70.0, 100.0])
    value = static_map.evaluate(one, far)
    slopes = np.diff(value)[[0, 2]] / np.diff(far)[[0, 2]]
    np.testing.assert_allclose(slopes, (right - left) / 6.0, rtol=1e-12)


@pytest.mark.parametrize("kind", NETWORKS)
def test_without_positions_a_network_is_linear_in_what_moves(kind):
    one = MAPS[kind]
    active = static_map.active_parameters(one, with_positions=False)
    assert static_map.parameter_names(one)[active] == (
        *(f"height[{i}]" for i in range(3)),
        "line[0]",
        "line[1]",
    )


@pytest.mark.parametrize("kind", NETWORKS)
def test_a_start_follows_a_bent_shape(kind):
    options = MapOptions(kind, units=10)
    (one,) = static_map.starting_maps(kind, options, -1.0, 1.0, shape=np.abs)
    v = np.linspace(-1.0, 1.0, 101)
    # Ten smooth units cannot have a corner: they round it off.
    assert np.abs(static_map.evaluate(one, v) - np.abs(v)).max() < 0.1


@pytest.mark.parametrize("kind", NETWORKS)
@pytest.mark.parametrize("change", [-50.0, 50.0])
def test_widths_stay_positive_and_centres_near_the_range_whatever_the_step(
    kind, change
):
    one = MAPS[kind]
    step = np.zeros(one.parameters.size)
    step[:6] = change
    for _ in range(20):
        one = static_map.move(one, step)
    centres, widths = one.parameters[:3], one.parameters[3:6]
    assert (np.abs(centres) <= 6.0).all()
    assert (widths >= 6e-3).all()
    assert (widths <= 6.0).all()


@pytest.mark.parametrize("kind", NETWORKS)
def test_a_network_may_have_a_single_unit(kind):
    one = static_map.identity(kind, MapOptions(kind, units=1), np.array([0.0, 2.0]))
    assert one.parameters.size == 5
