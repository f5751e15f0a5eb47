import numpy as np
import pytest

from hwid_cli.model.pole_bound import drawn_in, radii_held

RADIUS = 0.8
PAIR = RADIUS * np.exp(0.4j * np.array([1, -1]))


@pytest.mark.parametrize("others", [[0.3], [0.3, 0.5 + 0.2j, 0.5 - 0.2j], []])
@pytest.mark.parametrize("at_bound", [PAIR, [RADIUS], [-RADIUS]])
def test_gradients_are_those_of_the_largest_radius(others, at_bound):
    denominator = np.real(np.poly([*at_bound, *others]))
    # The first coefficient that moves decides on which side; it shall be outwards.
    (row,) = [
        one
        for sign in (1.0, -1.0)
        for one in radii_held(
            denominator, np.eye(1, denominator.size - 1)[0] * sign, RADIUS
        )
    ]

    def largest(change):
        return np.max(np.abs(np.roots(denominator + np.concatenate([[0.0], change]))))

    differences = [
        (largest(1e-6 * one) - largest(-1e-6 * one)) / 2e-6 * RADIUS
        for one in np.eye(row.size)
    ]
    np.testing.assert_allclose(row, differences, rtol=1e-5, atol=1e-8)


def test_what_moves_inwards_or_stands_further_in_is_free():
    inside = np.real(np.poly(0.99 * PAIR))
    outwards = np.array([0.0, 1.0])
    assert len(radii_held(inside, outwards, RADIUS)) == 0
    at_bound = np.real(np.poly(PAIR))
    assert len(radii_held(at_bound, -outwards, RADIUS)) == 0
    assert len(radii_held(at_bound, outwards, RADIUS)) == 1


def test_poles_beyond_the_bound_come_back_to_it():
    denominator = np.real(np.poly([*(1.1 * PAIR), 0.3]))
    found = np.sort(np.abs(np.roots(drawn_in(denominator, RADIUS))))
    np.testing.assert_allclose(found, [0.3, RADIUS, RADIUS], rtol=1e-5)
    assert found[-1] < RADIUS
