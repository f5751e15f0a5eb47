import pytest

from hwid_cli.report.formats import number
from hwid_cli.report.page import Row
from hwid_cli.report.table import (
    Cell,
    Code,
    Column,
    Heading,
    Table,
    Text,
    as_text,
    numbers,
    texts,
)


def shown(table, **how):
    return as_text([table], **how)


def test_text_stands_left_and_numbers_right():
    columns = (*texts("who"), *numbers("n"))
    text = shown(Table("T", columns, (("a", "1"), ("bcde", "234"))))

    assert text.splitlines() == [
        "T",
        "who     n",
        "----  ---",
        "a       1",
        "bcde  234",
    ]


def test_a_table_without_a_caption_begins_with_its_heads():
    assert shown(Table("", numbers("a"), ())).splitlines() == ["a", "-"]


def test_a_table_stands_between_how_and_notes_that_fit_the_screen():
    table = Table("c " * 20, texts("a"), (("1",),), ("n " * 20,), ("first", "second"))

    assert shown(table, width=21).splitlines() == [
        *["c c c c c c c c c c c", "c c c c c c c c c"],
        *("first", "second", "a", "-", "1"),
        *["n n n n n n n n n n n", "  n n n n n n n n n"],
    ]


def test_paragraphs_follow_each_other_and_tables_are_set_off():
    blocks = [
        Text("one two"),
        Text("three"),
        Table("", texts("a"), (("1",),)),
        Heading("head"),
        Text("below"),
        Code("as  it  is"),
    ]

    assert as_text(blocks, width=5) == (
        "one\n  two\nthree\n\na\n-\n1\n\nhead\nbelow\n\nas  it  is"
    )


def test_what_only_a_page_can_show_is_refused():
    with pytest.raises(TypeError, match="Row cannot be shown on a screen"):
        as_text([Row(())])


def wide(count, *, rows=1):
    cells = [f"{one}.00" for one in range(10, 10 + count)]
    columns = (
        *texts("name"),
        *numbers(*(f"h{one}" for one in range(count))),
        Column("sum", stays=True),
    )
    return Table("Title", columns, tuple(("row", *cells, "7") for _ in range(rows)))


@pytest.mark.parametrize("width", [20, 33, 80])
def test_a_wide_table_is_split_without_losing_a_column(width):
    text = shown(wide(11), width=width)

    assert max(map(len, text.splitlines())) <= width
    assert text.startswith("Title\n")
    assert text.count("Title") == 1
    for column in range(11):
        assert text.count(f"{10 + column}.00") == 1
    blocks = text.split("\n\n")
    assert all(block.count("row") == block.count("sum") == 1 for block in blocks)


def test_as_many_columns_as_fit_share_a_block():
    # 4 for the name, 5 columns of 7 with their gaps, 5 for the sum with its gap.
    assert shown(wide(5), width=44).count("name") == 1
    assert shown(wide(5), width=43).count("name") == 2


def test_a_column_wider_than_the_screen_stands_alone():
    columns = (*texts("a"), *numbers("b" * 30, "c" * 30), Column("d", stays=True))

    text = shown(Table("", columns, (("1", "2", "3", "4"),)), width=9)
    assert text.count("a") == 2


def test_names_in_a_cell_go_on_in_the_next_line_and_are_never_cut():
    names = [f"recording {one}" for one in range(7)] + ["x" * 40]
    columns = (*texts("who"), Column("names", is_text=True, joint=", "))
    text = shown(Table("", columns, (("a", ", ".join(names)), ("b", "y"))), width=35)

    first, *more = text.splitlines()[2:]
    assert first == "a    recording 0, recording 1,"
    assert more[0] == "       recording 2, recording 3,"
    assert more[-2].strip() == "x" * 40
    assert more[-1] == "b    y"
    assert " ".join(line.strip() for line in [first[1:], *more[:-1]]) == ", ".join(
        names
    )


def test_names_in_a_cell_stay_together_where_there_is_room():
    columns = (*texts("who"), Column("names", is_text=True, joint=", "))

    assert shown(Table("", columns, (("a", "b, c"),))).endswith("a    b, c")


def test_marked_cells_bear_the_mark_and_others_keep_room_for_it():
    rows = (("a", Cell("1.0", is_marked=True), "2"), ("b", Cell("3.0"), "4"))
    table = Table("", (*texts("who"), *numbers("n", "m")), rows, mark="'")

    assert shown(table).splitlines()[2:] == ["a    1.0'  2", "b    3.0   4"]


def test_upright_columns_are_read_from_top_to_bottom_in_groups():
    names = [f"s{one}" for one in range(7)]
    columns = (
        *texts("who"),
        *(Column(name, is_upright=True) for name in names),
        Column("sum", stays=True),
    )
    table = Table("", columns, (("a", *"1.1.1.1", "4"), ("by", *(["12"] * 7), "")))

    assert shown(table).splitlines() == [
        "     sssss ss",
        "who  01234 56  sum",
        "---  --------  ---",
        "a    1.1.1 .1    4",
        "by   11111 11",
        "     22222 22",
    ]
    # 3 for the names, 5 upright ones without a gap, 3 for the sum, and two gaps.
    assert shown(table, width=15).count("who") == 2


def test_short_names_are_explained_beneath():
    rows = tuple((Cell(f"long {one}", short=f"C{one}"),) for one in (10, 2))
    lines = shown(Table("", texts("who"), rows, ("note",))).splitlines()

    assert lines[2:] == ["C10", "C2", "C2: long 2", "C10: long 10", "note"]


def test_details_are_for_pages_and_names_of_the_thesis_for_those_who_ask():
    columns = (
        *texts("a"),
        Column("b", is_detail=True),
        Column("c", is_thesis=True),
    )
    table = Table("T", columns, (("1", "2", "3"),), published="T9")

    assert shown(table).splitlines() == ["T", "a", "-", "1"]
    assert shown(table, thesis_names=True).splitlines() == [
        *("T (form of T9)", "a  c", "-  -", "1  3"),
    ]


def test_what_is_not_finite_is_a_dash():
    assert [number(value) for value in (0.012345, float("nan"), float("inf"))] == [
        "1.23e-02", "-", "-",
    ]  # fmt: skip
