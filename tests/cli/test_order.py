import csv


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_stages_before_run_and_orders_are_recommended(hwid, out):
    result = hwid("order")

    assert result.exit_code == 0, result.output
    assert "identify: 0 fits from the cache, 6 computed" in result.stdout
    assert "crossval: 0 pairs from the cache, 9 computed" in result.stdout
    assert "order: 2 pairs of orders compared" in result.stdout
    assert "Take nb = 1, nk = " in result.stdout
    rows = rows_of(out / "order.csv")
    assert [row["recording"] for row in rows] == [
        "all recordings", "step_02", "step_12", "sine_12",
    ]  # fmt: skip
    assert rows[0]["judges"] == "3"


def test_a_second_run_says_the_same(after_run, hwid, out):
    hwid("order")
    first = (out / "order.csv").read_bytes()
    result = hwid("order", "--force")

    assert "identify: 6 fits from the cache, 0 computed" in result.stdout
    assert (out / "order.csv").read_bytes() == first


def test_the_tolerance_is_a_key_of_the_configuration(after_run, hwid, edit, out):
    edit("identify: {}", "identify: {}\norder: {tolerance: 1000.0}")
    hwid("order")

    assert {row["nk"] for row in rows_of(out / "order.csv")} == {"1"}


def test_a_tolerance_below_zero_is_refused(after_run, hwid, edit):
    edit("identify: {}", "identify: {}\norder: {tolerance: -0.1}")
    result = hwid("order")

    assert result.exit_code == 1
    assert "order.tolerance" in result.stderr


def test_run_recommends_orders_where_the_configuration_names_them(
    after_run, hwid, edit, out
):
    edit("identify: {}", "identify: {}\norder: {}")
    result = hwid("run")

    assert result.exit_code == 0, result.output
    assert "Take nb = 1" in result.stdout


def test_quiet_says_nothing(after_run, hwid, out):
    result = hwid("order", "--quiet")

    assert (result.exit_code, result.output) == (0, "")
    assert (out / "order.csv").is_file()


def test_without_a_model_the_user_is_told(after_run, hwid, edit):
    edit("nk: [1, 2]", "nk: [300, 301]")
    result = hwid("order")

    assert result.exit_code == 1
    assert "hwid: " in result.stderr


def test_wrong_usage_is_told_from_what_can_be_mended(hwid):
    assert hwid("order", "--jobs", "0").exit_code == 2
