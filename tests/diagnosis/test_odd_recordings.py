"""Recordings that alone hold the gap are trained on, if nothing else speaks against it."""

import numpy as np
import pytest

from hwid_cli.diagnosis.odd_recordings import rows_of_few, with_odd_ones_trained
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.records.drive import Drive

SIZES = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
HELD_OUT = (1, 4, 6)


def problem(held_out=HELD_OUT, sizes=SIZES, kinds=None):
    kinds = kinds or ["step"] * len(sizes)
    wave = np.sin(np.linspace(0, 6, 50))
    signals = tuple(
        Signals(
            f"r{row}", kind, wave, size * wave, wave, size * wave, 0.01,
            is_held_out=row in held_out,
        )
        for row, (size, kind) in enumerate(zip(sizes, kinds, strict=True))
    )  # fmt: skip
    return DiagnosisProblem(signals, Drive(1.0, 1.0, 1.0, 1.0))


def gap_in(*rows, n=8):
    excess = np.full(n, 0.01)
    excess[list(rows)] = 5.0
    return excess


def held_out(found):
    return tuple(row for row, one in enumerate(found.signals) if one.is_held_out)


@pytest.mark.parametrize(
    ("excess", "few"),
    [
        (gap_in(4), [4]),
        (gap_in(6, 1), [1, 6]),
        (gap_in(0, 1, 2), []),
        (np.ones(8), []),
        (np.zeros(8), []),
        (np.array([np.inf, *np.ones(7)]), []),
    ],
)
def test_few_recordings_hold_nearly_all_of_the_gap(excess, few):
    assert rows_of_few(excess) == few


def test_the_odd_one_is_trained_on_and_the_others_still_judge():
    found = with_odd_ones_trained(problem(), gap_in(4))
    assert held_out(found) == (1, 6)


def test_as_many_as_needed_are_held_out_in_its_place_the_most_alike():
    # One of eight left: another as large as the odd one.
    found = with_odd_ones_trained(problem(held_out=(1, 4)), gap_in(4))
    assert held_out(found) == (1, 5)
    kinds = ["sine", "sine", "sine", "step", "step", "sine", "sine", "sine"]
    found = with_odd_ones_trained(problem((1, 4), kinds=kinds), gap_in(4))
    assert held_out(found) == (1, 3)


@pytest.mark.parametrize(
    "excess",
    [
        # Trained on already, or too many, or nothing at all.
        gap_in(0),
        gap_in(0, 4),
        gap_in(0, 1, 4, 6),
        np.zeros(8),
        # It went another way altogether.
        100 * gap_in(4),
    ],
)
def test_what_training_sees_or_cannot_use_changes_nothing(excess):
    given = problem()
    assert with_odd_ones_trained(given, excess) is given


def test_of_three_recordings_one_still_judges():
    found = with_odd_ones_trained(problem((1,), SIZES[:3]), gap_in(1, n=3))
    assert len(held_out(found)) == 1
    assert held_out(found) != (1,)
