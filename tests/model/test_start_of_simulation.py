"""How a free run begins: the words for the initial state."""

import numpy as np
import pytest

from hwid_cli.model.simulate import simulate, validation_output
from hwid_cli.records.model import HammersteinWiener, StaticMap
from hwid_cli.records.recordings import Recording

NONE = StaticMap("none", np.zeros(0))
DENOMINATOR = np.poly([0.95, 0.9])


def model(rule="estimated"):
    return HammersteinWiener(NONE, [0.01], DENOMINATOR, 1, NONE, 1e-3, rule)


def moving(seed=1):
    """An input, and the output of a drive that was moving when the recording began."""
    u = np.repeat(np.random.default_rng(seed).uniform(-1, 1, 10), 30)
    return u, simulate(model(), u, initial_state=np.array([0.5, -0.4]))


@pytest.mark.parametrize("rule", ["zero", "steady", "estimated"])
def test_an_estimated_state_is_that_of_the_recording_whatever_the_models_rule(rule):
    u, y = moving()
    found = simulate(model(rule), u, initial_state="estimated", output=y)
    np.testing.assert_allclose(found, y, atol=1e-9)
    assert np.abs(simulate(model(rule), u, initial_state="steady") - y).max() > 0.1


def test_an_estimated_state_gives_what_a_validation_gives():
    u, y = moving()
    y = y + 0.01 * np.random.default_rng(2).standard_normal(u.size)
    found = simulate(model(), u, initial_state="estimated", output=y)
    expected = validation_output(model(), Recording("r", u, y, 1e-3))
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_the_measured_output_gives_the_state_and_nothing_else():
    u, y = moving()
    later = y.copy()
    later[200:] += 5.0
    until = simulate(model(), u, initial_state="estimated", output=y)
    beyond = simulate(model(), u, initial_state="estimated", output=later)
    # A linear block forgets its start: what differs in the end cannot be followed.
    assert np.abs(beyond[250:] - until[250:]).max() < 1e-2


@pytest.mark.parametrize("output", [None, np.zeros(3)])
def test_an_estimated_state_needs_an_output_of_the_same_length(output):
    u, _ = moving()
    with pytest.raises(ValueError, match="needs output, the measured one, of 300"):
        simulate(model(), u, initial_state="estimated", output=output)


def test_other_words_are_refused():
    with pytest.raises(ValueError, match="'rest'"):
        simulate(model(), np.ones(3), initial_state="rest")
