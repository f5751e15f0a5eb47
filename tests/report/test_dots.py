"""Rows of dots and bars: everything at its place."""

import math

import numpy as np
import pytest

from hwid_cli.report.dots import Dot, DotGroup, DotRow, Dots, dot_drawing


def drawing_of(*values, names=None, **settings):
    rows = tuple(
        DotRow(name, (Dot(value, "given", f"{value}"),), str(value))
        for name, value in zip(names or map(str, values), values, strict=True)
    )
    return dot_drawing(Dots("RMS [m]", (DotGroup("", rows),), "s", "a", **settings))


def dots_of(drawing):
    return [row.dots[0].x for row in drawing.rows]


def test_places_of_a_logarithmic_axis_go_by_factors():
    first, second, third = dots_of(drawing_of(1.0, 10.0, 100.0, is_log=True))

    # Places are rounded to tenths of a pixel.
    assert second - first == pytest.approx(third - second, abs=0.11)
    assert third > second > first


def test_places_of_an_even_axis_go_by_differences():
    drawing = drawing_of(10.0, 20.0, 40.0)
    first, second, third = dots_of(drawing)
    zero = {text: x for x, text in drawing.ticks}["0"]

    assert third - second == pytest.approx(2 * (second - first), abs=0.2)
    assert second - zero == pytest.approx(2 * (first - zero), abs=0.2)


@pytest.mark.parametrize("is_narrow", [True, False])
@pytest.mark.parametrize("values", [(1e-5, 3e-2), (0.9, 1.1), (2.0,), (1e-9, 1e9)])
def test_numbers_of_a_logarithmic_axis_stand_where_they_say(values, is_narrow):
    drawing = drawing_of(*values, is_log=True, is_narrow=is_narrow)
    ticks = [(x, float(text)) for x, text in drawing.ticks]

    assert 1 <= len(ticks) <= 9
    known = [(row.dots[0].x, float(row.dots[0].text)) for row in drawing.rows] + ticks
    if len(known) > 2:
        x, logs = np.array([(x, math.log(value)) for x, value in known]).T
        slope, start = np.polyfit(logs, x, 1)
        np.testing.assert_allclose(slope * logs + start, x, atol=0.3)


def test_everything_lies_inside_the_drawing():
    names = ("a" * 60, "b")
    drawing = drawing_of(1e-3, 1.0, names=names, is_log=True, reference=(1e-4, "noise"))

    for x in (*dots_of(drawing), drawing.reference[0], *(x for x, _ in drawing.ticks)):
        assert drawing.left <= x <= drawing.right <= drawing.width
    assert len(drawing.rows[0].name) < 45
    assert drawing.rows[0].full_name == names[0]
    assert all(0 < row.y < drawing.bottom < drawing.height for row in drawing.rows)


def test_bars_begin_at_the_reference_or_at_zero():
    noise = drawing_of(5.0, 1.5, is_log=True, is_bar=True, reference=(1.0, "noise"))
    assert {row.dots[0].start for row in noise.rows} == {noise.reference[0]}
    shares = drawing_of(-5.0, 40.0, is_bar=True)
    zero = {text: x for x, text in shares.ticks}["0"]
    assert shares.rows[0].dots[0].start == pytest.approx(zero, abs=0.11)
    assert shares.rows[0].dots[0].x < zero < shares.rows[1].dots[0].x


def test_what_is_no_number_is_left_out():
    drawing = drawing_of(1.0, float("nan"), is_log=True)

    assert [len(row.dots) for row in drawing.rows] == [1, 0]


@pytest.mark.parametrize("value", [0.0, -1.0])
def test_what_has_no_logarithm_stands_at_the_lower_end(value):
    drawing = drawing_of(value, 2.0, 9.0, is_log=True)
    lowest, middle, highest = dots_of(drawing)

    assert lowest == drawing.left
    assert lowest < middle < highest


def test_a_bold_name_has_more_room():
    def left(*, is_bold):
        row = DotRow(
            "with parameter change", (Dot(2.0, "given", "2"),), is_bold=is_bold
        )
        return dot_drawing(Dots("RMS [m]", (DotGroup("", (row,)),), "", "")).left

    assert left(is_bold=True) > left(is_bold=False) + 10
