"""Which candidate wins: gain, parsimony between ties, what includes what."""

import numpy as np
import pytest

from hwid_cli.diagnosis.selection import LEAST_ADDED, TIE, is_part_of, rivals, winner
from tests.diagnosis.judged_fits import JUDGE, base, made_up

COULOMB = ("coulomb_friction",)
STRIBECK = ("stribeck_friction",)
DEAD_ZONE = ("input_dead_zone",)


def after(gain, effects, than=200.0, **options):
    """A fit whose criterion is lower by ``gain`` than that of one parameter's."""
    more = options.get("parameters", 1) - 1
    # gain = 600 ln(than / sse) - more ln 600
    sse = than * np.exp(-(gain + more * np.log(600.0)) / 600.0)
    return made_up(effects, sse, **options)


def test_the_largest_gain_wins():
    fits = [made_up(COULOMB, 200.0), made_up(DEAD_ZONE, 180.0)]
    assert winner(JUDGE, fits, base()).effects == DEAD_ZONE


def test_what_could_not_be_simulated_never_wins():
    fits = [made_up(COULOMB, np.inf), made_up(DEAD_ZONE, 399.0)]
    assert winner(JUDGE, fits, base()).effects == DEAD_ZONE
    assert winner(JUDGE, fits[:1], base()) is None
    assert winner(JUDGE, [], base()) is None


@pytest.mark.parametrize(
    ("gain", "chosen"), [(TIE - 0.5, COULOMB), (TIE + 0.5, ("second_mode",))]
)
def test_between_ties_the_one_with_fewer_parameters_wins(gain, chosen):
    simple = made_up(COULOMB, 200.0)
    fits = [after(gain, ("second_mode",), parameters=3), simple]
    assert JUDGE.gain(*fits) == pytest.approx(gain)
    assert winner(JUDGE, fits, base()).effects == chosen


def test_of_equal_numbers_of_parameters_the_better_one_wins_however_close():
    fits = [made_up(COULOMB, 200.0), after(0.1, DEAD_ZONE)]
    assert winner(JUDGE, fits, base()).effects == DEAD_ZONE


def larger_by(share, **options):
    """Stribeck, which adds a share of what both gain over the base, beside Coulomb."""
    larger = made_up(STRIBECK, 150.0, parameters=3, **options)
    smaller = made_up(COULOMB, 150.0 + share * 250.0)
    return [larger, smaller]


def test_an_effect_that_includes_another_must_add_enough():
    fits = larger_by(0.9 * LEAST_ADDED)
    # Far from a tie: without the rule the larger one would win.
    assert JUDGE.gain(*fits) > TIE
    assert winner(JUDGE, fits, base()).effects == COULOMB

    fits = larger_by(1.1 * LEAST_ADDED)
    assert winner(JUDGE, fits, base()).effects == STRIBECK


def test_it_wins_without_where_it_alone_leaves_white_noise():
    fits = larger_by(0.9 * LEAST_ADDED, whiteness=0.5)
    assert winner(JUDGE, fits, base()).effects == STRIBECK


def test_white_noise_does_not_save_it_from_a_tie():
    fits = [
        after(TIE - 0.5, STRIBECK, parameters=3, whiteness=0.5),
        made_up(COULOMB, 200.0),
    ]
    assert winner(JUDGE, fits, base()).effects == COULOMB


@pytest.mark.parametrize(
    ("smaller", "larger", "holds"),
    [
        (COULOMB, STRIBECK, True),
        (STRIBECK, COULOMB, False),
        (COULOMB, COULOMB, True),
        (COULOMB, DEAD_ZONE, False),
        (COULOMB, ("hysteresis", "input_delay"), True),
        (("coulomb_friction", "input_delay"), ("hysteresis", "input_delay"), True),
        (("coulomb_friction", "input_delay"), ("hysteresis",), False),
        (("coulomb_friction", "coulomb_friction"), STRIBECK, False),
        (("input_saturation",), ("voltage_limit",), True),
    ],
)
def test_what_is_part_of_what(smaller, larger, holds):
    assert is_part_of(made_up(smaller, 1.0), made_up(larger, 1.0)) is holds


def test_rivals_are_those_that_cannot_be_told_apart():
    best = made_up(COULOMB, 200.0)
    near = after(-TIE + 0.5, ("output_backlash",))
    far = after(-TIE - 0.5, DEAD_ZONE)
    lost = made_up(("quadratic_drag",), np.inf)
    assert rivals(JUDGE, [best, near, far, lost], best) == [near]


def test_what_includes_the_best_one_is_no_rival():
    best = made_up(COULOMB, 200.0)
    assert rivals(JUDGE, [best, after(-1.0, STRIBECK)], best) == []
    best = made_up(STRIBECK, 200.0)
    assert rivals(JUDGE, [best, after(-1.0, COULOMB)], best) == []
