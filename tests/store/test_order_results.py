import csv
from dataclasses import replace

from hwid_cli.store.order_results import (
    MAP_COLUMNS,
    ORDER_COLUMNS,
    write_maps_csv,
    write_order_csv,
)
from tests.report.test_map_choice import ADVICE as MAP_ADVICE
from tests.report.test_orders import ADVICE


def test_all_recordings_come_first_and_unknown_cells_are_blank(tmp_path):
    path = tmp_path / "order.csv"
    write_order_csv(path, replace(ADVICE, delay=-1))
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))

    assert tuple(rows[0]) == ORDER_COLUMNS
    assert [row["recording"] for row in rows] == [
        "all recordings", "step_00", "step_01", "step_02",
    ]  # fmt: skip
    assert (rows[0]["delay"], rows[1]["delay"], rows[1]["poles"]) == ("", "1", "2")
    assert (rows[0]["nb"], rows[0]["nk"], rows[0]["bic_nk"]) == ("2", "3", "3")


def test_maps_have_a_row_each_and_one_is_to_take(tmp_path):
    path = tmp_path / "maps.csv"
    write_maps_csv(path, MAP_ADVICE)
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))

    assert tuple(rows[0]) == MAP_COLUMNS
    assert [row["take"] for row in rows[:3]] == ["0", "1", "0"]
    assert (rows[1]["input_units"], rows[1]["output_units"]) == ("3", "")
    assert (rows[1]["output_map"], rows[1]["parameters"]) == ("none", "9")
    assert float(rows[-1]["bic"]) == float("inf")
