import numpy as np
import pytest

from hwid_cli.model import scores
from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate, validation_output
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording
from tests.model.plants import ORDERS, measured, options, plant


def test_wrong_initial_state_costs_accuracy_and_estimating_it_does_not():
    recording = measured(plant("none", "polynomial", "estimated"), n_samples=400)
    empty = fit([recording], ORDERS, options("none", "polynomial", "zero"))
    estimated = fit([recording], ORDERS, options("none", "polynomial", "estimated"))
    assert empty.rmsd > 1e-3 * np.std(recording.output)
    assert estimated.rmsd < 1e-9 * np.std(recording.output)


def two_recordings_that_start_in_motion():
    """Parts of one long run: each part's initial state is the end of what went before."""
    whole = measured(plant("saturation", "none"), n_samples=2000)
    return [
        Recording("a", whole.input[1200:], whole.output[1200:], 1e-3),
        Recording("b", whole.input[300:1000], whole.output[300:1000], 1e-3),
    ]


@pytest.mark.thorough
def test_experiments_have_initial_states_of_their_own():
    parts = two_recordings_that_start_in_motion()
    separate = fit(
        parts, ORDERS, options("saturation", "none", "estimated", join="experiments")
    )
    joined = fit(
        parts, ORDERS, options("saturation", "none", "estimated", join="concatenate")
    )
    size = np.std(parts[0].output)
    assert separate.rmsd < 1e-9 * size
    # At the joint the state jumps, which no one model can follow.
    assert joined.rmsd > 1e-3 * size
    assert separate.name == "a+b"


@pytest.mark.thorough
def test_order_of_experiments_does_not_matter():
    parts = two_recordings_that_start_in_motion()
    kind = options("saturation", "none", "estimated", join="experiments")
    forward, backward = fit(parts, ORDERS, kind), fit(parts[::-1], ORDERS, kind)
    np.testing.assert_allclose(
        forward.model.denominator, backward.model.denominator, atol=1e-9
    )


@pytest.mark.thorough
def test_concatenation_is_the_fit_of_the_joined_record():
    parts = two_recordings_that_start_in_motion()
    joined = Recording(
        "ab",
        np.concatenate([one.input for one in parts]),
        np.concatenate([one.output for one in parts]),
        1e-3,
    )
    kind = options("saturation", "none", join="concatenate")
    first, second = fit(parts, ORDERS, kind), fit([joined], ORDERS, kind)
    assert first.rmsd == second.rmsd


def test_validation_estimates_the_initial_state_of_the_recording():
    parts = two_recordings_that_start_in_motion()
    result = fit(parts[:1], ORDERS, options("saturation", "none", "estimated"))
    other = parts[1]
    told = scores.rmsd(other.output, simulate(result.model, other.input))
    estimated = scores.rmsd(other.output, validation_output(result.model, other))
    assert told > 1e-3
    assert estimated < 1e-8


def test_validation_on_its_own_recording_is_never_worse_than_the_fit():
    # Starting in motion, through an output map: the Gauss-Newton steps overshoot.
    for seed in range(6):
        true = plant("dead_zone", "saturation", "estimated")
        whole = measured(true, n_samples=500, seed=seed, noise=0.01)
        part = Recording("part", whole.input[37:], whole.output[37:], 1e-3)
        result = fit([part], ORDERS, FitOptions(units=5, max_iterations=15))
        own = scores.rmsd(part.output, validation_output(result.model, part))
        # The fit's own state is where the estimate may begin: rounding.
        assert own <= result.rmsd * (1.0 + 1e-12)


def test_validation_of_a_steady_model_starts_in_equilibrium_with_the_recording():
    true = plant("none", "polynomial", "steady")
    result = fit([measured(true)], ORDERS, options("none", "polynomial", "steady"))
    # Half as large, so that no map has to go on beyond its data.
    u = 0.5 * measured(true, seed=7).input
    output = validation_output(result.model, Recording("r7", u, 0.0 * u, 1e-3))
    assert scores.rmsd(simulate(true, u), output) < 1e-8


def test_a_steady_start_is_equilibrium_whatever_the_rule_of_the_fit():
    model = plant("piecewise_linear", "polynomial", "estimated")
    resting = simulate(model, np.full(50, 1.3), initial_state="steady")
    np.testing.assert_allclose(resting, resting[0], rtol=1e-12)
    long = simulate(model, np.full(900, 1.3), initial_state=np.zeros(0))
    assert resting[0] == pytest.approx(long[-1], rel=1e-9)


def test_a_word_for_the_initial_state_that_is_none_is_refused():
    with pytest.raises(
        ValueError, match='array, "steady" or "estimated", got \'rest\''
    ):
        simulate(plant(), np.ones(5), initial_state="rest")
