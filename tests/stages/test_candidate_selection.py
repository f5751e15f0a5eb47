import numpy as np
import pytest

from hwid_cli.records.recordings import Recording
from hwid_cli.stages.candidate_selection import scored, smallest_good


def recording(name, *levels):
    u = np.repeat(np.array(levels, dtype=float), 10)
    return Recording(name, u, u, 1.0)


SMALL, ALIKE = recording("small", 0.0, 1.0), recording("alike", 1.0, 0.5)
LARGE = recording("large", 0.0, 2.0)
NAMES = ("small", "alike", "large")


def tensor(values):
    """Two candidates; values[model, judge] is the second's RMSD, the first's is 1."""
    second = np.array(values, dtype=float)
    return np.stack([np.ones_like(second), second], axis=1)


FAR = recording("far", 3.0, 3.0, 3.0, 3.0, 0.5)


def test_inputs_that_a_model_has_hardly_seen_do_not_judge():
    # The second candidate goes astray on "far" only, of which a fifth is known to "small".
    rmsd = tensor([[0.1, 0.5, 8.0]])
    found = scored(rmsd, ("small",), ("small", "alike", "far"), (SMALL, ALIKE, FAR))

    assert found.n_unexcited == 1
    assert found.validation.tolist() == [1]
    assert smallest_good(found, np.array([1, 2]), 0.05).chosen == 1


def test_inputs_that_go_beyond_in_part_judge():
    # The second is better on "alike" and goes astray on "large", of which half is known.
    rmsd = tensor([[0.1, 0.5, 8.0]])
    found = scored(rmsd, ("small",), NAMES, (SMALL, ALIKE, LARGE))

    assert found.n_unexcited == 0
    assert found.validation.tolist() == [1, 2]
    assert smallest_good(found, np.array([2, 1]), 0.05).chosen == 0


def test_a_few_samples_beyond_do_not_matter():
    nearly = Recording("nearly", np.r_[SMALL.input, 1.5], np.r_[SMALL.output, 1.5], 1.0)
    found = scored(
        tensor([[0.1, 0.5]]), ("small",), ("small", "nearly"), (SMALL, nearly)
    )

    assert (found.n_unexcited, len(found.validation)) == (0, 1)


def test_where_all_inputs_go_beyond_all_judge():
    found = scored(tensor([[0.1, 8.0]]), ("small",), ("small", "far"), (SMALL, FAR))

    assert found.validation.tolist() == [1]
    assert found.n_unexcited == 0


def test_where_those_within_have_no_number_the_others_judge():
    rmsd = tensor([[0.1, 0.5, 8.0]])
    rmsd[0, :, 1] = np.nan
    found = scored(rmsd, ("small",), ("small", "alike", "far"), (SMALL, ALIKE, FAR))

    assert found.validation.tolist() == [2]


def test_a_lone_recording_judges_itself():
    found = scored(tensor([[0.1]]), ("small",), ("small",), (SMALL,))
    verdict = smallest_good(found, np.array([1, 2]), 0.05)

    assert found.validation.tolist() == [-1]
    assert (verdict.chosen, verdict.evidence.n_validation) == (1, 0)


def test_without_a_number_nobody_judges():
    assert scored(tensor([[np.nan]]) * np.nan, ("small",), ("small",), (SMALL,)) is None


def test_all_candidates_have_a_factor_and_a_typical_rmsd():
    rmsd = tensor([[0.1, 0.5, 2.0]])
    found = scored(
        rmsd, ("small",), ("small", "alike", "large"), (SMALL, ALIKE, ALIKE_2)
    )
    verdict = smallest_good(found, np.array([1, 2]), 0.05)

    # Logarithms of the factors: log 2 and 0 against 0 and log 2.
    assert verdict.factors == pytest.approx([1.0, 1.0])
    assert verdict.rmsd == pytest.approx([1.0, 1.0])


ALIKE_2 = recording("large", 0.5, 1.0)


def test_what_outputs_vary_by_says_whether_a_choice_is_one():
    found = scored(tensor([[0.1, 0.5]]), ("small",), ("small", "alike"), (SMALL, ALIKE))
    evidence = smallest_good(found, np.array([1, 2]), 0.05).evidence
    assert evidence.output_spread == pytest.approx(ALIKE.output.std())
    assert evidence.best_rmsd == 0.5
    assert not evidence.predicts
    near = scored(tensor([[0.1, 0.1]]), ("small",), ("small", "alike"), (SMALL, ALIKE))
    assert smallest_good(near, np.array([1, 2]), 0.05).evidence.predicts
