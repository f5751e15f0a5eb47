import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.maps.piecewise_linear import break_points_and_values
from hwid_cli.model.placing import cut, thinner
from hwid_cli.records.model import StaticMap

ARGUMENT = np.sort(np.random.default_rng(1).standard_normal(900))


def piecewise(points, values):
    return StaticMap("piecewise_linear", np.r_[points, values], (-3.0, 3.0))


def test_a_cut_map_is_the_same_map_with_thirds_of_its_segments():
    points, values = np.array([-4.0, -1.0, 0.5, 4.0]), np.array([0.0, 1.0, -1.0, 2.0])
    found = cut(piecewise(points, values), ARGUMENT)
    new, _ = break_points_and_values(found)

    assert new.size == 4 + 3 * 2
    counts, _ = np.histogram(ARGUMENT, new)
    for segment in range(3):
        third = counts[3 * segment : 3 * segment + 3]
        assert np.ptp(third) <= 2
    np.testing.assert_allclose(
        static_map.evaluate(found, ARGUMENT),
        static_map.evaluate(piecewise(points, values), ARGUMENT),
        atol=1e-12,
    )


def test_segments_of_few_samples_stay_whole():
    narrow = ARGUMENT[450] + np.array([0.0, 1e-9])
    points = np.r_[-4.0, narrow, 4.0]
    new, _ = break_points_and_values(cut(piecewise(points, np.arange(4.0)), ARGUMENT))

    assert new.size == 4 + 2 * 2
    assert not ((new > narrow[0]) & (new < narrow[1])).any()


def test_a_jump_is_found_by_cutting_and_thinning_again_and_again():
    def jump(v):
        return np.where(v < 0.1, -1.0, 1.0)

    one = piecewise(np.array([-4.0, -1.0, 0.0, 1.0, 4.0]), np.zeros(5))
    for _ in range(6):
        fine = cut(one, ARGUMENT)
        points, _ = break_points_and_values(fine)
        one = thinner(piecewise(points, jump(points)), ARGUMENT, 3)
    points, _ = break_points_and_values(one)
    before = points[points < 0.1].max()

    assert points[points >= 0.1].min() - before < 0.05


def test_other_kinds_are_not_cut():
    none = StaticMap("none", np.zeros(0))
    assert cut(none, ARGUMENT) is none
