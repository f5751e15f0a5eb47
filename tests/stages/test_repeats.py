"""Which repeats are proposed, and which recordings count as repeats."""

import numpy as np
import pytest

from hwid_cli.records.experiment import NextOptions
from hwid_cli.records.next import PlannedInput
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.repeats import proposed_repeats

N = 300
SMALL = np.sin(np.arange(N) / 20.0)
LARGE = 3.0 * SMALL


def recording(name, command, gain, input_noise=0.0):
    rng = np.random.default_rng(list(name.encode()))
    measured = command + input_noise * rng.standard_normal(N)
    read = gain * command + 1e-3 * rng.standard_normal(N)
    return Recording(name, measured, read, 0.01)


def names(found):
    return [one.name for one in found.proposals]


def test_the_first_repeat_is_of_the_input_that_visits_most():
    taken = [recording("small", SMALL, 1.0), recording("large", LARGE, 1.0)]

    found = proposed_repeats(taken, [], NextOptions())

    assert found.spread is None
    assert names(found) == ["large_repeat_2"]


def test_inputs_are_repeated_in_turn():
    taken = [
        recording("small", SMALL, 1.0),
        recording("large", LARGE, 1.2),
        recording("large_repeat_2", LARGE, 0.8),
    ]

    found = proposed_repeats(taken, [], NextOptions(number=2))

    assert names(found) == ["small_repeat_2", "large_repeat_3"]
    assert found.proposals[0].gain > found.proposals[1].gain


@pytest.mark.parametrize("name", ["large_repeat_2", "again"])
def test_a_noisy_measured_input_is_a_repeat_by_its_name_or_by_the_plan(name):
    taken = [recording("large", LARGE, 1.0, 0.5), recording(name, LARGE, 1.3, 0.5)]
    plan = [PlannedInput("again", LARGE, ""), PlannedInput("large", LARGE, "")]
    plan = plan if name == "again" else []

    known = proposed_repeats(taken, plan, NextOptions())
    unknown = proposed_repeats(
        [taken[0], recording("x", LARGE, 1.3, 0.5)], [], NextOptions()
    )

    assert known.spread is not None
    assert unknown.spread is None


def test_a_spread_of_no_account_is_known_well_enough():
    gains = (1.0, 1.004)
    taken = [
        recording(f"large{'_repeat_2' * k}", LARGE, gain)
        for k, gain in enumerate(gains)
    ]

    # The band shrinks by more than a tenth, but by less than 5 % of what varies.
    assert not proposed_repeats(taken, [], NextOptions(enough=0.05)).proposals
    assert proposed_repeats(taken, [], NextOptions(enough=0.001)).proposals


def test_recordings_for_the_test_tell_nothing_and_keep_their_names():
    taken = [recording("large", LARGE, 1.0), recording("last", LARGE, 1.5)]
    plan = [PlannedInput(name, LARGE, "") for name in ("large", "last")]

    found = proposed_repeats(taken, plan, NextOptions(), tested=("last",))

    assert found.spread is None
    assert names(found) == ["large_repeat_2"]
