from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model.candidates import Candidate, FitData
from hwid_cli.model.distinct import WHEN_FREE, WHILE_FIXED, distinct
from hwid_cli.model.phases import place, standing
from hwid_cli.records.model import FitOptions, HammersteinWiener, StaticMap

NONE = StaticMap("none", np.zeros(0))
N = 1000
RNG = np.random.default_rng(5)
INPUT, NOISE = RNG.standard_normal(N), RNG.standard_normal(N)


def search(gain, experiment):
    """A model that is nothing but a gain."""
    model = HammersteinWiener(NONE, np.array([gain]), np.ones(1), 0, NONE, 1.0, "zero")
    return standing(Candidate(model, np.zeros((1, 0))), [experiment])


# A gain that is off by d leaves noise and d times the input, both of size one.
PLAIN = FitData(INPUT, 2.0 * INPUT + NOISE)


def test_of_two_that_give_the_same_output_the_better_one_stays():
    best, near, far = (search(2.0 + off, PLAIN) for off in (0.0, 0.05, 0.5))
    assert distinct([near, far, best], [PLAIN], WHEN_FREE) == [far, best]


def test_a_model_is_compared_with_every_better_one():
    # In the order of their costs: the last is like the first, not like the second.
    best, other, like_best = (search(2.0 + off, PLAIN) for off in (0.2, -0.3, 0.28))
    assert best.cost < other.cost < like_best.cost
    assert distinct([like_best, other, best], [PLAIN], WHEN_FREE) == [other, best]


@pytest.mark.parametrize(
    ("off", "apart", "count"),
    [(0.05, WHEN_FREE, 1), (0.2, WHEN_FREE, 2), (0.2, WHILE_FIXED, 1)],
)
def test_the_residuals_tell_how_far_outputs_may_differ(off, apart, count):
    both = [search(2.0, PLAIN), search(2.0 + off, PLAIN)]
    assert len(distinct(both, [PLAIN], apart)) == count


def test_outliers_do_not_make_two_models_the_same():
    spoilt = NOISE.copy()
    spoilt[::100] += 1e4
    torn = FitData(INPUT, 2.0 * INPUT + spoilt)
    borne = replace(torn, threshold=3.0)
    for experiment, count in ((torn, 1), (borne, 2)):
        both = [search(2.0, experiment), search(2.5, experiment)]
        assert len(distinct(both, [experiment], WHEN_FREE)) == count


def test_a_model_that_is_not_finite_is_no_other_one():
    wild = search(1e200, PLAIN)
    assert wild.cost == np.inf
    assert distinct([search(2.0, PLAIN), wild], [PLAIN], WHEN_FREE)[1] is wild


def test_what_has_become_the_same_model_is_placed_once():
    # Both settle at the same gain, from either side.
    start = [search(1.0, PLAIN), search(3.0, PLAIN)]
    linear = FitOptions(input_map="none", output_map="none", initial_state="zero")
    (placed,) = place(start, [PLAIN], linear)
    gain = float(INPUT @ PLAIN.output / (INPUT @ INPUT))
    assert placed.candidate.model.numerator[0] == pytest.approx(gain, abs=1e-3)
