import csv
import re

import pytest


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.thorough
def test_stages_before_run_and_orders_are_recommended(hwid, out):
    result = hwid("order", "-v")

    assert result.exit_code == 0, result.output
    assert "identify: 0 fits from the cache, 6 computed" in result.stderr
    assert "crossval: 0 tasks from the cache, 12 computed" in result.stderr
    assert "order: 2 pairs of orders compared" in result.stderr
    assert "Take nb = 1, nk = " in result.stdout
    rows = rows_of(out / "order.csv")
    assert [row["recording"] for row in rows] == [
        "all recordings", "step_02", "step_12", "sine_12",
    ]  # fmt: skip
    # In none of the six pairs three quarters of the input are beyond what a model has seen.
    assert (rows[0]["judges"], rows[0]["beyond"]) == ("3", "0")


@pytest.mark.thorough
def test_a_second_run_says_the_same(after_run, hwid, out):
    hwid("order", "-v")
    first = (out / "order.csv").read_bytes()
    result = hwid("order", "--force")

    assert "identify: 6 fits from the cache, 0 computed" in result.stderr
    assert (out / "order.csv").read_bytes() == first


@pytest.mark.thorough
def test_the_tolerance_is_a_key_of_the_configuration(after_run, hwid, edit, out):
    edit("identify: {}", "identify: {}\norder: {tolerance: 1000.0}")
    hwid("order", "-v")

    assert {row["nk"] for row in rows_of(out / "order.csv")} == {"1"}


@pytest.mark.thorough
def test_outliers_of_the_judges_do_not_count_where_fits_bear_them(
    after_run, hwid, edit, out
):
    edit("fit: {", "order: {units: [4]}\nfit: {loss: huber, ")
    result = hwid("order", "-v")

    assert result.exit_code == 0, result.output
    # Three recordings' models on three, twice; the maps once more, with the outliers.
    for part, total in (("outliers", 18), ("maps", 27)):
        found = re.search(
            rf"order {part}: (\d+) pairs from the cache, (\d+) computed", result.stderr
        )
        assert sum(map(int, found.groups())) == total
    assert int(rows_of(out / "order.csv")[0]["outliers"]) < 5


def test_a_tolerance_below_zero_is_refused(after_run, hwid, edit):
    edit("identify: {}", "identify: {}\norder: {tolerance: -0.1}")
    result = hwid("order", "-v")

    assert result.exit_code == 1
    assert "order.tolerance" in result.stderr


def test_quiet_says_nothing(after_run, hwid, out):
    result = hwid("order", "--quiet")

    assert (result.exit_code, result.output) == (0, "")
    assert (out / "order.csv").is_file()


def test_without_a_model_the_user_is_told(after_run, hwid, edit):
    edit("nk: [1, 2]", "nk: [300, 301]")
    result = hwid("order", "-v")

    assert result.exit_code == 1
    assert "hwid: " in result.stderr


def test_wrong_usage_is_told_from_what_can_be_mended(hwid):
    assert hwid("order", "--jobs", "0").exit_code == 2


MAPS = "identify: {}\norder: {maps: [none], units: [2]}"


@pytest.mark.thorough
def test_maps_are_recommended_and_come_from_the_cache_the_second_time(
    after_run, hwid, edit, out
):
    edit("identify: {}", MAPS)
    result = hwid("order", "-v")

    assert result.exit_code == 0, result.output
    # Sizes 3 and 2, and none, on both sides; three recordings.
    assert "order maps: 0 fits from the cache, 27 computed" in result.stderr
    assert "order maps: 0 pairs from the cache, 9 computed" in result.stderr
    assert "Put input_map: " in result.stdout
    assert "order.csv, maps.csv" in result.stdout
    rows = rows_of(out / "maps.csv")
    assert (len(rows), [row["take"] for row in rows].count("1")) == (9, 1)

    first = (out / "maps.csv").read_bytes()
    result = hwid("order", "-v")

    assert "order maps: 27 fits from the cache, 0 computed" in result.stderr
    assert (out / "maps.csv").read_bytes() == first


@pytest.mark.thorough
def test_check_counts_the_fits_of_maps(after_run, hwid, edit):
    edit("identify: {}", MAPS)
    result = hwid("check")

    assert result.exit_code == 0, result.output
    assert "3 recordings x 9 pairs of maps = 27 fits" in result.stdout


@pytest.mark.parametrize(
    ("section", "key", "words"),
    [
        ("{maps: [nonne]}", "order.maps", "did you mean 'none'"),
        ("{maps: [own_function]}", "order.maps", "expected"),
        ("{units: [1]}", "order.units", "integers >= 2"),
        ("{units: [2000]}", "order.units", "at most 1000"),
        ("{nb: [1]}", "order.nb", "orders.nb"),
    ],
)
def test_maps_that_cannot_be_are_refused(after_run, hwid, edit, section, key, words):
    edit("identify: {}", f"identify: {{}}\norder: {section}")
    result = hwid("order", "-v")

    assert result.exit_code == 1
    assert key in result.stderr
    assert words in result.stderr
