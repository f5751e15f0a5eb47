"""Coloured tables: each recording has its own scale, and the numbers are still true."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.report import OrderGrid, RmsdMatrix
from hwid_cli.report.matrices import order_grid_table, rmsd_matrix_table

GRID = OrderGrid(
    ("a", "b"),
    (1, 2),
    (1, 2, 3),
    "poles",
    np.array([[[1e-6, 2e-6, 4e-6], [8e-6, 3e-6, 5e-6]], [[1.0, 2, 4], [8, 3, np.nan]]]),
    "m",
)


def cells(table):
    return [row[1:] for row in table.rows]


@pytest.mark.parametrize("place", [0, 1])
def test_every_recording_goes_through_all_colours(place):
    depths = [
        cell.share
        for row in cells(order_grid_table(GRID, place))
        for cell in row
        if cell.share is not None
    ]

    # The lowest RMSD is the darkest.
    assert max(depths) == depths[0] == 1.0
    assert min(depths) == 0.0
    # 2 of 1 to 8 lies a third of the way, logarithmically.
    assert depths[1] == pytest.approx(2 / 3)


def test_the_best_orders_are_framed_and_a_missing_fit_has_no_colour():
    first, second = cells(order_grid_table(GRID, 1))

    assert [cell.look for cell in first] == ["best", "", ""]
    assert (second[2].text, second[2].share) == ("-", None)


@pytest.mark.parametrize("place", [0, 1])
def test_short_numbers_and_their_factor_make_the_values(place):
    table = order_grid_table(GRID, place)
    power = -6 if "10\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT SIX} m" in table.caption else 0

    assert power == (-6, 0)[place]
    for row, values in zip(cells(table), GRID.rmsd[place], strict=True):
        for cell, value in zip(row, values, strict=True):
            if np.isfinite(value):
                # Two digits.
                assert float(cell.text) * 10.0**power == pytest.approx(value, rel=0.05)


MATRIX = RmsdMatrix(
    models=("a/1/2", "b/1/2"),
    recordings=("a", "b"),
    rmsd=np.array([[1e-3, 2e-2], [np.nan, 3e-3]]),
    is_own=np.array([[True, False], [False, True]]),
    covers=np.array([0, 1]),
    covered_by=np.array([0, 0]),
    unit="m",
    threshold=0.01,
)


def test_own_recordings_and_what_lies_below_the_threshold_are_set_apart():
    (first, above, count), (missing, below, _) = cells(rmsd_matrix_table(MATRIX))

    assert (first.look, above.look, below.look) == ("own below", "", "own below")
    assert missing.text == "-"
    assert count == "0"


def test_equal_numbers_have_one_colour():
    same = replace(MATRIX, rmsd=np.full((2, 2), 2.0))

    assert {row[1].share for row in rmsd_matrix_table(same).rows} == {1.0}


def test_models_that_run_away_have_a_scale_too():
    far = replace(GRID, rmsd=np.where(GRID.rmsd > 0.0, 1.5e308, np.nan))

    assert "10³⁰⁶" in order_grid_table(far, 0).caption
