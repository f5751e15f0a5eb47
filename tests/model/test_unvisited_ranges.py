import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model import static_map
from hwid_cli.model.extrapolation import extrapolated_map, for_search
from hwid_cli.model.fit import fit
from hwid_cli.model.normalise import normalise
from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import simulate, validation_output
from hwid_cli.records.maps import Extrapolation
from hwid_cli.records.model import FitOptions, HammersteinWiener, Orders, StaticMap
from hwid_cli.records.recordings import Recording
from tests.model.plants import MAPS

SHAPED = [kind for kind in MAPS if kind not in ("none", "own_function")]


def levels(*values, spread=0.01, count=200):
    """Samples of a record that rests on levels, with the ripple of a measured input."""
    ripple = spread * np.linspace(-1.0, 1.0, count)
    return np.concatenate([value + ripple for value in values])


def value(one, *at):
    return static_map.evaluate(one, np.array(at, dtype=float))


def test_a_step_on_a_line_gives_the_line_whatever_the_search_left_between_the_levels():
    # True map: v = 3 a. The search left a swing in the gap that no sample saw.
    points = np.array([-0.01, 0.01, 0.7, 1.3, 1.99, 2.01])
    left = np.array([-0.03, 0.03, 9.0, -9.0, 5.97, 6.03])
    one = StaticMap("piecewise_linear", np.r_[points, left], (-0.01, 2.01))
    at = np.linspace(-4.0, 6.0, 301)

    found = static_map.evaluate(extrapolated_map(one, levels(0.0, 2.0)), at)

    np.testing.assert_allclose(found, 3.0 * at, rtol=1e-9, atol=1e-9)


def test_a_slope_inside_a_cluster_of_samples_is_not_carried_through_a_gap():
    # Levels lie on v = a; inside the cluster at 2 the map falls with a slope of -40.
    points = np.array([-0.01, 0.01, 1.99, 2.01])
    one = StaticMap(
        "piecewise_linear", np.r_[points, -0.01, 0.01, 2.4, 1.6], (-0.01, 2.01)
    )
    found = extrapolated_map(one, levels(0.0, 2.0))

    # By hand: from (0.01, 0.01) to (1.99, 2.4).
    assert value(found, 1.0) == pytest.approx([0.01 + 0.5 * 2.39])
    assert value(found, 0.5, 1.5) == pytest.approx(
        np.interp([0.5, 1.5], [0.01, 1.99], [0.01, 2.4])
    )


@pytest.mark.parametrize("kind", SHAPED)
def test_nothing_changes_where_samples_are(kind):
    one = MAPS[kind]
    argument = levels(-2.0, -0.4, 0.5, 2.2, spread=0.15)
    domain = (argument.min(), argument.max())
    one = static_map.RULES[kind].with_domain(one, domain)

    found = extrapolated_map(one, argument)

    np.testing.assert_allclose(
        static_map.evaluate(found, argument),
        static_map.evaluate(one, argument),
        rtol=0,
        atol=1e-12,
    )


@pytest.mark.parametrize("kind", SHAPED)
def test_between_stretches_of_samples_every_kind_is_a_straight_line(kind):
    argument = levels(-2.0, 0.5, 2.2)
    one = static_map.RULES[kind].with_domain(MAPS[kind], (-2.01, 2.21))
    found = extrapolated_map(one, argument)
    at = np.linspace(-1.99, 0.49, 50)

    ends = value(one, argument[:200].max(), argument[200:400].min())
    by_hand = np.interp(at, [argument[:200].max(), argument[200:400].min()], ends)
    np.testing.assert_allclose(static_map.evaluate(found, at), by_hand, atol=1e-9)


@pytest.mark.parametrize(
    "kind", [kind for kind in SHAPED if kind not in ("saturation", "dead_zone")]
)
def test_far_beyond_the_data_every_kind_is_the_line_through_its_samples(kind):
    argument = np.random.default_rng(4).normal(0.0, 1.0, 500)
    domain = (argument.min(), argument.max())
    one = static_map.RULES[kind].with_domain(MAPS[kind], domain)
    found = extrapolated_map(one, argument)
    at = np.array([-100.0, -30.0, 30.0, 100.0])

    slope, offset = np.polyfit(argument, static_map.evaluate(one, argument), 1)
    np.testing.assert_allclose(
        static_map.evaluate(found, at), slope * at + offset, rtol=1e-9
    )


# Slope 1 to the left of 1, slope 3 to the right of it.
BENT = StaticMap("piecewise_linear", np.array([0.0, 1, 8, 0, 1, 22]), (0.0, 8.0))


def test_a_slope_that_even_samples_tell_goes_on_for_twice_their_range():
    argument = np.linspace(0.0, 8.0, 8001)
    found = extrapolated_map(BENT, argument)
    line = np.polyfit(argument, static_map.evaluate(BENT, argument), 1)

    # To 8 + 16, then to the line over another 1; by hand 22 + 3 * 16 = 70.
    assert value(found, 9.0, 24.0) == pytest.approx([25.0, 70.0], rel=1e-3)
    assert value(found, -1.0, -16.0) == pytest.approx([-1.0, -16.0], rel=1e-3)
    assert value(found, 25.0) == pytest.approx([np.polyval(line, 25.0)], rel=1e-3)
    middle = 0.5 * (70.0 + np.polyval(line, 25.0))
    assert value(found, 24.5) == pytest.approx([middle], rel=1e-2)


def end_of_slope(argument):
    """Where the upper local slope ends and the map begins to return to its line."""
    return extrapolated_map(BENT, argument).extrapolation.arguments[-3]


def filled(resting):
    """By hand: seven eighths hold 1000 samples each, one the resting ones too.

    Of n pieces filled alike, one over the sum of squared shares is n; six are enough.
    """
    shares = np.full(8, 1000.0)
    shares[0] += resting
    shares /= shares.sum()
    return min(1.0, (1.0 / np.sum(shares**2) - 1.0) / 5.0)


def test_a_slope_is_trusted_less_the_less_samples_spread():
    # Nine of ten samples above 7 rest on 8. Variance of the mixture, over that of an
    # even spread, 1/12: 12 (0.1 * 0.9 * 0.5**2 + 0.1 / 12) = 0.37.
    argument = np.concatenate([np.linspace(0.0, 8.0, 8000), np.full(9000, 8.0)])
    told = (12 * 0.0225 + 0.1) * filled(9000)

    assert end_of_slope(argument) == pytest.approx(8.0 + 16.0 * told, rel=1e-3)


@pytest.mark.parametrize("resting", [0, 2000, 9000, 90_000])
def test_a_slope_is_trusted_less_the_more_samples_rest_on_one_level(resting):
    # They rest in the first eighth, so that those in the last one spread as before.
    argument = np.concatenate([np.linspace(0.0, 8.0, 8000), np.full(resting, 0.5)])

    expected = 8.0 + 16.0 * filled(resting)
    assert end_of_slope(argument) == pytest.approx(expected, rel=1e-3)


def test_levels_have_no_slope_to_go_on_with():
    edges, heights = np.array([0.0, 1.9]), np.array([-1.0, 1.0, 4.0])
    one = StaticMap("piecewise_constant", np.r_[edges, heights], (-2.0, 2.0))
    argument = np.linspace(-2.0, 2.0, 401)
    found = extrapolated_map(one, argument)
    line = np.polyfit(argument, static_map.evaluate(one, argument), 1)

    # The jump at 1.9 would be a slope of 6 over the last eighth.
    assert value(found, 2.5, 6.0) == pytest.approx(np.polyval(line, [2.5, 6.0]))


@pytest.mark.parametrize(
    ("kind", "parameters"), [("saturation", [-9.0, 2.0]), ("dead_zone", [-0.5, 0.0])]
)
def test_a_limit_inside_the_noise_of_a_level_is_none(kind, parameters):
    one = StaticMap(kind, np.array(parameters), (-0.01, 2.01))
    found = extrapolated_map(one, levels(0.0, 2.0))
    at = np.array([-4.0, -2.0, 3.0, 6.0])

    # The gain between the two levels, which is one but for the noise.
    np.testing.assert_allclose(static_map.evaluate(found, at), at, atol=0.05)


@pytest.mark.parametrize(("beyond", "holds"), [(0.2, True), (0.02, False)])
def test_a_limit_that_samples_hardly_passed_is_not_known(beyond, holds):
    one = StaticMap("saturation", np.array([-9.0, 2.0 - beyond]), (-1.0, 2.0))
    found = extrapolated_map(one, np.linspace(-1.0, 2.0, 3001))

    assert (value(found, 5.0)[0] < 2.0) == holds


def test_a_limit_that_samples_crossed_stays_a_limit():
    one = StaticMap("saturation", np.array([-1.2, 1.5]), (-1.0, 2.0))
    found = extrapolated_map(one, np.linspace(-1.0, 2.0, 301))

    assert value(found, 1.6, 2.0, 50.0) == pytest.approx([1.5, 1.5, 1.5])
    # Nothing was seen of the lower limit: slope one goes on where it would clip.
    assert value(found, -1.5) == pytest.approx([-1.5])
    assert value(found, -50.0)[0] < -30.0


def test_a_dead_zone_left_on_both_sides_stays_what_it_is_everywhere():
    one = StaticMap("dead_zone", np.array([-0.6, 0.4]), (-2.0, 2.0))
    found = extrapolated_map(one, np.linspace(-2.0, 2.0, 301))
    at = np.linspace(-90.0, 90.0, 181)

    np.testing.assert_allclose(
        static_map.evaluate(found, at), static_map.evaluate(one, at), atol=1e-9
    )


@pytest.mark.parametrize("kind", ["none", "own_function"])
def test_laws_of_the_user_stay(kind):
    assert extrapolated_map(MAPS[kind], levels(0.0, 2.0)) is MAPS[kind]


@pytest.mark.parametrize("kind", SHAPED)
def test_slope_and_value_of_the_derivatives_are_those_of_the_continued_map(kind):
    argument = levels(-2.0, 0.5, 2.2)
    one = static_map.RULES[kind].with_domain(MAPS[kind], (-2.01, 2.21))
    found = static_map.outlined(extrapolated_map(one, argument))
    at, step = np.array([-9.0, -1.0, 1.5, 2.8, 7.0]), 1e-6

    seen = static_map.derivatives(found, at, with_positions=False)

    numeric = (
        static_map.evaluate(found, at + step) - static_map.evaluate(found, at - step)
    ) / (2 * step)
    np.testing.assert_allclose(seen.value, static_map.evaluate(found, at), rtol=1e-12)
    np.testing.assert_allclose(seen.slope, numeric, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("kind", SHAPED)
def test_a_continued_map_in_another_unit_is_the_same_map(kind):
    argument = levels(-2.0, 0.5, 2.2)
    one = extrapolated_map(MAPS[kind], argument)
    at = np.linspace(-9.0, 9.0, 101)

    np.testing.assert_allclose(
        static_map.evaluate(static_map.stretch(one, 4.0), 4.0 * at),
        4.0 * static_map.evaluate(one, at),
        rtol=1e-12,
        atol=1e-12,
    )


def test_a_search_sees_nothing_of_it():
    one = extrapolated_map(MAPS["polynomial"], levels(-2.0, 0.5, 2.2))
    plain = static_map.move(one, np.zeros(one.parameters.size))

    assert one.extrapolation is not None
    assert plain.extrapolation is None


@pytest.mark.parametrize(
    ("visited", "arguments", "values", "match"),
    [
        ([0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 1.0], "pairs, got 3"),
        ([1.0, 0.0], [0.0, 1.0], [0.0, 1.0], "rise"),
        ([0.0, 1.0], [1.0, 0.0], [0.0, 1.0], "rise"),
        ([0.0, 1.0], [0.0, 1.0], [0.0], "as many values"),
    ],
)
def test_a_extrapolation_checks_itself(visited, arguments, values, match):
    with pytest.raises(ValueError, match=match):
        Extrapolation(np.array(visited), np.array(arguments), np.array(values))


# A second-order servo with a dead zone at its input.
F = np.real(np.poly([0.9 * np.exp(0.2j), 0.9 * np.exp(-0.2j)]))


def response(u):
    w = u - np.clip(u, -0.3, 0.3)
    return lfilter([0.0, F.sum()], F, w)


def step(level, *, seed):
    rng = np.random.default_rng(seed)
    u = np.where(np.arange(600) < 100, 0.0, level)
    y = response(u) + 0.01 * rng.standard_normal(u.size)
    return Recording("s", u + 0.005 * rng.standard_normal(u.size), y, 1e-3)


@pytest.mark.parametrize("kind", ["piecewise_linear", "polynomial", "sigmoid_network"])
def test_models_of_a_step_stay_near_their_linear_model_on_other_steps(kind):
    own = step(2.0, seed=1)
    found = fit([own], Orders(1, 2, 1), FitOptions(input_map=kind, output_map=kind))
    none = FitOptions(input_map="none", output_map="none")
    linear = fit([own], Orders(1, 2, 1), none)
    for level in (-2.0, 1.0, 3.0):
        other = step(level, seed=2)
        error, of_linear = (
            rmsd(other.output, validation_output(one.model, other))
            for one in (found, linear)
        )
        assert error < 2.0 * of_linear
    plain = for_search(found.model)
    assert found.rmsd == pytest.approx(
        rmsd(own.output, validation_output(plain, own)), rel=1e-9
    )
    assert np.isfinite(simulate(found.model, np.linspace(-9.0, 9.0, 50))).all()


def rests_on_two_levels(numerator, denominator, *, seed=3):
    """A step that shows two levels of the input, on a linear plant."""
    rng = np.random.default_rng(seed)
    u = np.where(np.arange(900) < 100, 0.0, 2.0)
    y = lfilter(numerator, denominator, u)
    y = y + 0.01 * np.std(y) * rng.standard_normal(u.size)
    return Recording("step", u, y, 1e-3)


@pytest.mark.parametrize("kind", ["saturation", "dead_zone"])
def test_limits_that_the_data_do_not_need_have_no_effect(kind):
    own = rests_on_two_levels([0.0, F.sum()], F)
    options = FitOptions(input_map=kind)
    found = fit([own], Orders(1, 2, 1), options)
    linear = fit(
        [own], Orders(1, 2, 1), FitOptions(input_map="none", output_map="none")
    )
    at = np.linspace(-6.0, 6.0, 40)
    u = np.repeat(at, 50)

    assert found.rmsd <= 1.01 * linear.rmsd
    np.testing.assert_allclose(
        static_map.evaluate(found.model.input_map, at), at, atol=1e-9
    )
    # A tenth of the noise, 1 % of an output of 2: where a search ends is not closer.
    np.testing.assert_allclose(
        simulate(found.model, u), simulate(linear.model, u), atol=2e-3
    )


def test_larger_orders_need_no_limits_either_and_are_never_worse():
    own = rests_on_two_levels([0.0, F.sum()], F, seed=7)
    options = FitOptions(input_map="saturation")
    smaller = fit([own], Orders(1, 2, 1), options)
    at = np.linspace(-6.0, 6.0, 40)
    for search_anew in (False, True):
        found = fit(
            [own],
            Orders(2, 2, 1),
            options,
            contained=[smaller.model],
            search_anew=search_anew,
        )
        assert found.rmsd <= smaller.rmsd * (1.0 + 1e-9)
        for one in (found.model.input_map, found.model.output_map):
            slopes = np.diff(static_map.evaluate(one, at)) / np.diff(at)
            np.testing.assert_allclose(slopes, slopes[0], rtol=1e-6)


@pytest.mark.parametrize("kind", ["saturation", "dead_zone"])
def test_limits_that_the_data_need_stay(kind):
    rng = np.random.default_rng(8)
    u = np.repeat(rng.uniform(-2.0, 2.0, 60), 15)
    clipped = np.clip(u, -1.0, 1.2)
    w = clipped if kind == "saturation" else u - clipped
    y = lfilter([0.0, F.sum()], F, w)
    own = Recording("levels", u, y + 0.01 * rng.standard_normal(u.size), 1e-3)

    found = fit([own], Orders(1, 2, 1), FitOptions(input_map=kind, output_map="none"))

    # Ten standard errors of a limit that hundreds of samples pass.
    assert found.model.input_map.parameters == pytest.approx([-1.0, 1.2], abs=0.02)


def test_a_model_is_normalised_before_it_is_extrapolated():
    one = extrapolated_map(MAPS["polynomial"], levels(-2.0, 0.5, 2.2))
    model = HammersteinWiener(one, np.ones(1), np.ones(1), 0, one, 1e-3)

    with pytest.raises(ValueError, match="before its maps are extrapolated"):
        normalise(model)


@pytest.mark.parametrize(
    ("plateau", "n_there", "beyond"),
    [
        # Seven hundredths of the range, flat: a limit that samples have met.
        (0.07, 100, 0.93),
        # As flat, but hardly a sample there; and less than samples tell.
        (0.07, 12, None),
        (0.02, 100, None),
    ],
)
def test_a_limit_that_samples_have_met_holds_beyond_them(plateau, n_there, beyond):
    last = 1.0 - plateau
    points = np.array([0.0, last, 1.0])
    one = StaticMap("piecewise_linear", np.r_[points, 0.0, last, last], (0.0, 1.0))
    rise, limit = np.linspace(0.0, last, 400), np.linspace(last, 1.0, n_there)
    found = value(extrapolated_map(one, np.r_[rise, limit]), 1.3)[0]
    if beyond is None:
        assert found > last + 0.03
    else:
        assert found == pytest.approx(beyond)
