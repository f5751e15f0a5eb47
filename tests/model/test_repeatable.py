import numpy as np
import pytest

from hwid_cli.model import static_map
from tests.export.model_examples import KINDS, example_map


@pytest.mark.parametrize("kind", KINDS)
def test_values_are_those_of_the_map_but_for_rounding(kind):
    one = example_map(kind, np.random.default_rng(3))
    # Knots and ends themselves, inside and far outside.
    at = np.concatenate([one.parameters[:2], np.linspace(-5.0, 5.0, 1001)])
    expected = static_map.evaluate(one, at)
    found = static_map.evaluate_repeatably(one, at)

    assert np.max(np.abs(found - expected)) <= 1e-13 * np.max(np.abs(expected))


@pytest.mark.parametrize("kind", KINDS)
def test_a_value_does_not_depend_on_its_neighbours(kind):
    one = example_map(kind, np.random.default_rng(3))
    at = np.linspace(-1.5, 1.5, 37)
    together = static_map.evaluate_repeatably(one, at)

    alone = [
        static_map.evaluate_repeatably(one, at[n : n + 1])[0] for n in range(at.size)
    ]
    assert np.array_equal(together, alone)
