from itertools import combinations

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.fit import fit
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.trust.choice import chosen_by_gain, information_gain, information_of
from hwid_cli.trust.content import content, joined, value_edges, visited_share
from hwid_cli.trust.judged import model_trust

N = 800
TIME = np.arange(N)


def sine(size, period, middle=0.0):
    return middle + size * np.sin(2 * np.pi * TIME / period)


EDGES = np.linspace(-2.0, 2.0, 13)


def test_a_share_grows_with_every_input_and_ends_at_one():
    tables = [content(sine(s, p), EDGES) for s, p in ((1, 400), (2, 100), (0.5, 9))]
    reachable = joined(tables)
    shares = [visited_share(joined(tables[:k]), reachable) for k in range(4)]

    assert shares[0] == 0.0
    assert shares[3] == 1.0
    assert shares == sorted(shares)


def test_the_same_input_again_adds_nothing():
    one, other = (content(sine(1, p), EDGES) for p in (100, 10))
    reachable = joined([one, other])

    assert visited_share(joined([one, one]), reachable) == visited_share(one, reachable)


@pytest.mark.parametrize(
    "new", [sine(2.0, 100), sine(1.0, 10), sine(0.5, 100, middle=1.4)]
)
def test_another_amplitude_frequency_or_middle_adds_something(new):
    before = content(sine(1.0, 100), EDGES)
    reachable = joined([before, content(new, EDGES)])

    assert visited_share(before, reachable) < 0.95


def test_greedy_is_near_the_best_pair():
    rng = np.random.default_rng(3)
    inputs = [
        sine(rng.uniform(0.2, 2), rng.uniform(5, 400), rng.uniform(-0.5, 0.5))
        for _ in range(8)
    ]
    edges = value_edges(inputs)
    tables = [content(one, edges) for one in inputs]
    reachable, none = joined(tables), joined([])

    def gain(known, more):
        both = visited_share(joined([known, more]), reachable)
        return both - visited_share(known, reachable)

    found = chosen_by_gain(none, tables, gain, lambda a, b: joined([a, b]), 2)
    best = max(
        visited_share(joined([tables[i], tables[j]]), reachable)
        for i, j in combinations(range(8), 2)
    )

    # The share is submodular: greedy reaches 1 - 1/e of the best (Nemhauser 1978).
    assert sum(by for _, by in found) >= (1 - 1 / np.e) * best
    assert found[0][1] >= found[1][1]


@pytest.fixture(scope="module")
def linear():
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1, 1, N // 10), 10)
    y = lfilter([0.0, 0.3], [1.0, -0.7], u) + 0.05 * rng.standard_normal(N)
    own = Recording("own", u, y, 0.01)
    options = FitOptions(input_map="none", output_map="none", initial_state="zero")
    found = fit([own], Orders(1, 1, 1), options)
    return own, found, model_trust(found, [own], [])


def test_a_recording_like_the_first_doubles_the_information(linear):
    own, found, trust = linear

    more = information_of(found.model, trust, own.input)

    # The covariance divides by N less the parameters, the noise here by N.
    assert np.allclose(more, np.eye(2), atol=0.02)
    assert information_gain(np.eye(2), more) == pytest.approx(2 * np.log(2), rel=0.02)


def test_information_is_that_of_the_sensitivities_by_hand(linear):
    _, found, trust = linear
    u = sine(1.0, 30)
    b, f = found.model.numerator[0], found.model.denominator[1]
    by_b = lfilter([0.0, 1.0], [1.0, f], u)
    y = b * by_b
    by_f = -lfilter([0.0, 1.0], [1.0, f], y)
    slopes = np.column_stack([by_b, by_f]) @ trust.steps.T
    expected = slopes.T @ slopes / trust.noise_rms**2

    # Differences of a thousandth of a standard deviation.
    assert np.allclose(information_of(found.model, trust, u), expected, rtol=1e-3)


def test_a_silent_recording_teaches_nothing(linear):
    _, found, trust = linear

    more = information_of(found.model, trust, np.zeros(N))

    assert information_gain(np.eye(2), more) == pytest.approx(0.0, abs=1e-9)
