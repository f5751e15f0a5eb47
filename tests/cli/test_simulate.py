def test_virtual_measurements_and_their_plan_are_written(hwid, out):
    result = hwid("simulate")

    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in (out / "raw").glob("*.csv")) == [
        "plan.csv",
        "sine_12.csv",
        "step_02.csv",
        "step_12.csv",
    ]
    assert result.stdout.startswith("simulate: 3 measurements computed")


def test_an_unchanged_simulation_is_not_repeated(after_run, hwid, out):
    before = (out / "raw" / "step_02.csv").stat().st_mtime_ns
    result = hwid("simulate")

    assert result.stdout.startswith("simulate: measurements from the cache")
    assert (out / "raw" / "step_02.csv").stat().st_mtime_ns == before
    assert hwid("simulate", "--force").stdout.startswith("simulate: 3 measurements")


def test_another_option_simulates_again(after_run, hwid, edit):
    edit("kind: gun", "kind: gun\n  seed: 5")

    assert "3 measurements computed" in hwid("simulate").stdout


def test_a_configuration_without_a_machine_is_refused(hwid, edit):
    edit(
        "simulate:\n  kind: gun\n  plan: {samples: 400, only: [step_02, step_12, sine_12]}",
        "",
    )
    result = hwid("simulate")

    assert result.exit_code == 1
    assert "simulate: missing; expected a machine" in result.stderr
