import pytest

from hwid_cli.report.text_table import joined_names, number, split_table, text_table


def test_text_stands_left_and_numbers_right():
    text = text_table(
        "T", ("who", "n"), [("a", "1"), ("bcde", "234")], text_columns=(0,)
    )

    assert text.splitlines() == [
        "T",
        "who     n",
        "----  ---",
        "a       1",
        "bcde  234",
    ]


def test_a_table_without_a_title_begins_with_its_heads():
    assert text_table("", ("a",), [], text_columns=(0,)).splitlines() == ["a", "-"]


def wide_rows(n):
    return [("row", *(f"{c}.00" for c in range(10, 10 + n)), "7")]


@pytest.mark.parametrize("width", [20, 33, 80])
def test_a_wide_table_is_split_without_losing_a_column(width):
    n = 11
    heads = ("name", *(f"h{c}" for c in range(n)), "sum")
    text = split_table("Title", heads, wide_rows(n), width=width)

    assert max(map(len, text.splitlines())) <= width
    assert text.startswith("Title\n")
    assert text.count("Title") == 1
    for column in range(n):
        assert text.count(f"{10 + column}.00") == 1
    blocks = text.split("\n\n")
    assert all(block.count("row") == block.count("sum") == 1 for block in blocks)


def test_as_many_columns_as_fit_share_a_block():
    # 4 for the name, 5 columns of 7 with their gaps, 5 for the sum with its gap.
    heads = ("name", *(f"h{c}" for c in range(5)), "sum")

    assert split_table("", heads, wide_rows(5), width=44).count("name") == 1
    assert split_table("", heads, wide_rows(5), width=43).count("name") == 2


def test_a_column_wider_than_the_screen_stands_alone():
    text = split_table(
        "", ("a", "b" * 30, "c" * 30, "d"), [("1", "2", "3", "4")], width=9
    )

    assert text.count("a") == 2


def test_names_are_joined_to_lines_and_never_cut():
    names = [f"recording_{n}" for n in range(7)] + ["x" * 40]
    lines = joined_names(names, width=30)

    assert " ".join(lines) == ", ".join(names)
    assert max(map(len, lines[:-1])) <= 30
    assert lines[-1] == "x" * 40
    assert joined_names([]) == [""]


def test_what_is_not_finite_is_a_dash():
    assert [number(value) for value in (0.012345, float("nan"), float("inf"))] == [
        "1.23e-02", "-", "-",
    ]  # fmt: skip
