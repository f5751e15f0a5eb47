import os
from pathlib import Path

import numpy as np
import pytest
import scipy
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.config.load import load_experiment
from hwid_cli.data import formats
from hwid_cli.data.recordings import read_recordings
from hwid_cli.files.isolated_process import IsolatedReader
from tests.cli.measured_folders import (
    EXPECTED,
    LAYOUTS,
    STEP_S,
    N,
    answer,
    measurements,
    write_english_csv,
    write_german_csv,
)


def invoke(*arguments):
    return CliRunner().invoke(main, [str(one) for one in arguments])


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "Messung 1 [neu]"
    made.mkdir()
    return made


@pytest.mark.parametrize("layout", LAYOUTS)
def test_columns_clock_and_units_are_found(folder, tmp_path, layout):
    LAYOUTS[layout](folder)
    out = tmp_path / "configs" / "mine.yaml"
    result = invoke("init", folder, "--out", out)

    assert result.exit_code == 0, result.output
    experiment = load_experiment(out)
    options = experiment.recordings
    columns = options.columns
    assert (
        columns.time,
        columns.input,
        columns.output,
        options.units.time,
        options.units.input,
        options.units.output,
    ) == EXPECTED[layout]
    unknown = "-" if options.units.input is None else None
    assert (options.input_unit, options.output_unit) == (unknown, unknown)
    raws = read_recordings(experiment, tmp_path)
    assert len(raws) == 6
    if layout == "bare csv":
        assert "SAMPLE TIME IS NOT KNOWN" in result.stdout
        assert "SAMPLE TIME IS NOT KNOWN" in out.read_text()
    else:
        assert raws[0].sample_time_s == STEP_S
    wanted = {tuple(np.round(u, 5)) for _, u, _ in measurements().values()}
    assert {tuple(np.round(raw.input, 5)) for raw in raws} == wanted


@pytest.mark.parametrize("still", ["input", "output"])
@pytest.mark.parametrize("count", [1, 4])
def test_recordings_in_which_a_signal_stands_still_are_named_and_left_out(
    folder, tmp_path, still, count
):
    write_english_csv(folder)
    for number in range(count):
        rows = ["time_ms,current_A,position_m,position_ref_m"]
        for k in range(N):
            # What stands still in one file may be told from others, by the name even.
            u, y = (0.0, np.sin(k)) if still == "input" else (np.sin(k), 0.0)
            rows.append(f"{1e3 * k * STEP_S:.6g},{u},{y},{np.cos(0.1 * k)}")
        (folder / f"a_failed_{number}.csv").write_text("\n".join(rows))
    result = invoke("init", folder, "--out", tmp_path / "mine.yaml")

    assert result.exit_code == 0, result.output
    options = load_experiment(tmp_path / "mine.yaml").recordings
    assert (options.columns.input, options.columns.output) == (
        "current_A",
        "position_m",
    )
    assert options.exclude == tuple(f"a_failed_{number}" for number in range(count))
    assert "a_failed_0.csv" in result.stdout
    assert "# skipped:" in (tmp_path / "mine.yaml").read_text()


@pytest.mark.thorough
def test_the_configuration_is_sound_and_says_why(folder, tmp_path):
    write_german_csv(folder)
    out = tmp_path / "mine.yaml"
    invoke("init", folder, "--out", out)
    text = out.read_text()

    assert "step: [Sprung*]" in text
    assert "random:" in text
    assert "step: [cut, output_offset]" in text
    assert "% of the usual swing" in text
    assert "# simulation:" in text
    experiment = load_experiment(out)
    assert set(experiment.test.recordings) == {"Sprung_2"}
    assert "'hwid diagnose' uses them too" in text
    # A swing of 1e3 tanh(1.5) mm, converted; the threshold is rounded to one digit.
    assert experiment.crossval.threshold in (0.04, 0.05)
    assert "RMSD lies below, in m:" in text
    assert "# diagnose:" in text

    checked = invoke("check", out, "--no-timing")
    assert checked.exit_code == 0, checked.output
    assert "5 recordings x 12 orders = 60 fits" in checked.stdout


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_configuration_runs_at_once(folder, tmp_path, layout):
    LAYOUTS[layout](folder)
    out = tmp_path / "mine.yaml"
    assert invoke("init", folder, "--out", out).exit_code == 0
    # The guess stays; only the work is made small.
    text = out.read_text().replace("nb: [1, 3], nk: [1, 4]", "nb: 1, nk: 1")
    out.write_text(text.replace("units: 10", "units: 3, starts: 1, max_iterations: 3"))
    result = invoke("run", out, "--out", tmp_path / "results", "--jobs", "1")

    assert result.exit_code == 0, result.output
    assert (tmp_path / "results" / "report.html").is_file()


def test_the_marks_before_next_have_only_to_be_taken_off(folder, tmp_path):
    write_german_csv(folder)
    mine = tmp_path / "mine.yaml"
    invoke("init", folder, "--out", mine)
    text = mine.read_text()
    start = text.index("# next:")
    end = text.index("\n\n", start)
    mine.write_text(text[:start] + without_marks(text[start:end]) + text[end:])

    said = invoke("next", mine, "--out", tmp_path / "results", "--jobs", "1")

    assert said.exit_code == 0, said.output
    assert (tmp_path / "results" / "next.csv").is_file()


def test_an_existing_file_stays_unless_it_may_go(folder, tmp_path):
    write_english_csv(folder)
    out = tmp_path / "mine.yaml"
    out.write_text("mine")
    result = invoke("init", folder, "--out", out)

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert "exists already" in result.stderr
    assert "--force" in result.stderr
    assert out.read_text() == "mine"
    assert invoke("init", folder, "--out", out, "--force", "-q").stdout == ""
    assert load_experiment(out).recordings is not None


def test_a_reference_is_told_from_an_output(folder, tmp_path):
    write_english_csv(folder)
    invoke("init", folder, "--out", tmp_path / "mine.yaml")
    text = (tmp_path / "mine.yaml").read_text()

    assert "reference: position_ref_m" in text
    assert "output: position_m}" in text


def test_a_file_that_cannot_be_used_is_left_out_by_name(folder, tmp_path):
    write_english_csv(folder)
    constant = folder / "step_3.csv"
    head, *rows = [row.split(",") for row in constant.read_text().splitlines()]
    rows = [[time, current, "1", reference] for time, current, _, reference in rows]
    constant.write_text("\n".join(",".join(row) for row in [head, *rows]))
    out = tmp_path / "mine.yaml"
    result = invoke("init", folder, "--out", out)

    assert result.exit_code == 0, result.output
    assert "left out" in result.stdout
    assert "step_3" in load_experiment(out).recordings.exclude
    assert invoke("check", out, "--no-timing").exit_code == 0


def rows_of(path):
    return [row.split(",") for row in path.read_text().splitlines()]


def test_a_file_that_is_too_short_is_said_to_be(folder, tmp_path):
    write_english_csv(folder)
    short = folder / "step_3.csv"
    short.write_text("\n".join(short.read_text().splitlines()[:31]))
    result = invoke("init", folder, "--out", tmp_path / "mine.yaml")

    assert result.exit_code == 0, result.output
    said = "step_3.csv: has 30 rows, and at least 61 are needed"
    assert f"skipped: {said}" in result.stdout

    for path in folder.glob("*.csv"):
        path.write_text("\n".join(path.read_text().splitlines()[:31]))
    result = invoke("init", folder, "--out", tmp_path / "other.yaml")
    assert result.exit_code == 1
    assert ".csv: has 30 rows, and at least 61 are needed; " in result.stderr


def test_a_folder_without_a_changing_input_is_told_which_column_stays(folder, tmp_path):
    write_english_csv(folder)
    for path in folder.glob("*.csv"):
        head, *rows = rows_of(path)
        rows = [[time, "1.5", position] for time, _, position, _ in rows]
        path.write_text("\n".join(",".join(row) for row in [head[:3], *rows]))
    result = invoke("init", folder, "--out", tmp_path / "mine.yaml")

    assert result.exit_code == 1
    assert "has 1 column of more than 60 numbers that change" in result.stderr
    assert "; 'current_A' is 1.5 in every row; " in result.stderr


def test_a_single_file_is_cut_into_one_to_learn_from_and_one_to_judge(folder, tmp_path):
    rng = np.random.default_rng(2)
    u = np.repeat(rng.uniform(-1, 1, 90), 10)
    y = np.zeros(900)
    for k in range(1, 900):
        y[k] = 0.8 * y[k - 1] + 0.2 * u[k - 1]
    np.savez(folder / "long.npz", u=u, y=y, Ts=0.01)
    out = tmp_path / "mine.yaml"
    assert invoke("init", folder, "--out", out).exit_code == 0

    experiment = load_experiment(out)
    assert experiment.recordings.parts == {"first": (0, 600), "last": (600, 900)}
    assert experiment.test.recordings == ("last",)
    assert experiment.recordings.sample_time_s == 0.01


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda folder: folder / "no", "is no folder"),
        (lambda folder: folder, "holds no measurement file"),
        (
            lambda folder: (folder / "a.csv").write_text("a,b\n1,2\n") and folder,
            "expected a file with an input and an output",
        ),
        (
            lambda folder: (folder / "a.mat").write_text("no") and folder,
            "a.mat",
        ),
    ],
    ids=["no folder", "empty", "two rows", "damaged"],
)
def test_a_folder_that_cannot_be_used_is_one_line(tmp_path, folder, make, words):
    result = invoke("init", make(folder), "--out", tmp_path / "mine.yaml")

    assert result.exit_code == 1
    assert words in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "mine.yaml").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("cascaded_tanks", {"input": "uEst", "output": "yEst"}),
        ("ced", {"input": "u1", "output": "z1"}),
        ("emps", {"time": "t", "input": "vir"}),
        ("ffwheel_motor", {"input": "data.input", "output": "data.output"}),
        ("hsm150_motor", {"variable": "data", "time": 0}),
        ("pick_place", {"time": "t", "input": "u", "output": "y"}),
        (
            "rack_drive",
            {"time": "Time", "input": "Torque", "output": "Servo motor speed"},
        ),
        (
            "shaking_table",
            {"time": "time_s", "input": "command_clipped", "output": "position_mm"},
        ),
        ("silverbox", {"input": "u", "output": "y"}),
    ],
)
def test_real_folders_are_understood(tmp_path, name, columns):
    """What a name or a clock says; columns without a name are left to the reader."""
    place = os.environ.get("HWID_REALDATA")
    if not place or not (Path(place) / name).is_dir():
        pytest.skip("HWID_REALDATA names no folder with these data")
    out = tmp_path / "mine.yaml"
    result = invoke("init", Path(place) / name, "--out", out)

    assert result.exit_code == 0, result.output
    found = load_experiment(out).recordings.columns
    assert {role: getattr(found, role) for role in columns} == columns
    assert invoke("check", out, "--no-timing").exit_code == 0


def write_twins(folder, heads):
    """Three columns, of which the first two are multiples of each other."""
    for name, (time, u, y) in measurements().items():
        columns = (time, u, 2.5 * u + 0.1, y)
        table = np.column_stack(columns)
        rows = [",".join(f"{value:.9g}" for value in row) for row in table]
        (folder / f"{name}.csv").write_text("\n".join([*heads, *rows]))


@pytest.mark.parametrize(
    ("heads", "chosen", "other"),
    [
        ([], 1, "column 2 is a multiple of column 1"),
        (["time_s,Kanal1 [V],Kanal2 [A],position_m"], "Kanal2 [A]", "'Kanal1 [V]' is"),
        (["time_s,input [V],Kanal2 [A],position_m"], "Kanal2 [A]", "'input [V]' is"),
    ],
)
def test_a_multiple_of_the_input_is_told_and_a_current_preferred(
    folder, tmp_path, heads, chosen, other
):
    write_twins(folder, heads)
    out = tmp_path / "mine.yaml"
    result = invoke("init", folder, "--out", out)

    assert result.exit_code == 0, result.output
    assert load_experiment(out).recordings.columns.input == chosen
    text = " ".join(out.read_text().replace("#", " ").split())
    assert other in text
    assert "either may be the input" in text


def test_a_reference_is_no_second_input(folder, tmp_path):
    write_english_csv(folder)
    out = tmp_path / "mine.yaml"

    assert invoke("init", folder, "--out", out).exit_code == 0
    assert "either may be" not in out.read_text()


def write_sines(folder, *, rest):
    """Two sines, after a rest or not."""
    time = np.arange(N)
    for number in (1, 2):
        u = number * np.sin(2 * np.pi * np.maximum(time - rest, 0) / 60.0)
        rows = [
            f"{STEP_S * k:.3f},{a},{b}"
            for k, a, b in zip(time, u, answer(u), strict=True)
        ]
        (folder / f"sine_{number}.csv").write_text(
            "\n".join(["time_s,current_A,position_m", *rows])
        )


def without_marks(text):
    """The sections that a starter configuration proposes, as a user turns them on."""
    return "\n".join(
        line if "begin with" in line or "'cut'" in line else line.removeprefix("# ")
        for line in text.splitlines()
    )


@pytest.mark.parametrize(("rest", "rule"), [(60, "rest"), (0, "estimated")])
def test_the_diagnosis_begins_as_the_recordings_do(folder, tmp_path, rest, rule):
    write_sines(folder, rest=rest)
    out = tmp_path / "mine.yaml"

    assert invoke("init", folder, "--out", out).exit_code == 0
    text = out.read_text()
    said = "" if rule == "rest" else f", initial_state: {rule}"
    assert f"# diagnose: {{max_effects: 2{said}}}" in text
    assert "sine: []" in text
    # As a user does: the marks away.
    start = text.index("# simulation:")
    out.write_text(text[:start] + without_marks(text[start:]))
    assert load_experiment(out).diagnose.initial_state == rule


def test_stamps_of_whole_seconds_are_no_rows_to_sort(folder, tmp_path):
    time = np.arange(1700) * 0.002
    for number, size in enumerate((1.0, -2.0, 1.5)):
        u = size * (time > 0.2)
        y = size * np.clip((time - 0.2) / 0.5, 0.0, 1.0)
        rows = [
            f"2026-05-04 10:00:{int(t + 1e-9):02d},{a:.3f},{b:.5f}"
            for t, a, b in zip(time, u, y, strict=True)
        ]
        text = "\n".join(["timestamp,current_A,pos_mm", *rows])
        (folder / f"step_{number}.csv").write_text(text + "\n")
    out = tmp_path / "mine.yaml"
    result = invoke("init", folder, "--out", out)
    assert "sample time 0.002 s: 'timestamp' shows whole ticks" in result.stdout
    assert "sort the rows" not in result.stdout
    assert load_experiment(out).recordings.sample_time_s == 0.002


def test_steps_that_keep_their_rest_start_in_equilibrium(folder, tmp_path):
    write_german_csv(folder)
    (folder / "Rauschen_1.csv").unlink()
    out = tmp_path / "mine.yaml"

    assert invoke("init", folder, "--out", out).exit_code == 0
    assert "# diagnose: {max_effects: 2}\n" in out.read_text()


@pytest.mark.thorough
def test_no_name_of_a_file_folder_or_column_begins_a_key(tmp_path):
    """Line ends in names would put keys of their choice into the configuration."""
    evil = "x\nexport: {}\nidentify: {recordings: [evil]}\n# "
    folder = tmp_path / evil.replace("/", "")
    folder.mkdir()
    write_english_csv(folder)
    for path in list(folder.glob("*.csv")):
        text = path.read_text().replace("current_A", '"current\nname: evil\n[A]"')
        path.write_text(text)
    (folder / "notes\nname: evil.csv").write_text("nothing")
    (folder / "more\u2028name: evil.docx").write_text("nothing")
    outside = invoke("init", folder, "--out", tmp_path / "mine.yaml")
    assert (outside.exit_code, outside.stderr.count("\n")) == (1, 1)
    assert "has control characters in its path" in outside.stderr
    assert not (tmp_path / "mine.yaml").exists()

    out = folder / "mine.yaml"
    result = invoke("init", folder, "--out", out)

    assert result.exit_code == 0, result.output
    lines = out.read_text().splitlines()
    keys = [line.partition(":")[0] for line in lines if line[:1] not in ("", " ", "#")]
    expected = ["name", "recordings", "calibrate", "orders", "fit", "identify"]
    assert keys == [*expected, "crossval", "order", "test", "group"]
    assert "notes\\nname: evil.csv: no table of numbers" in " ".join(
        line.lstrip("# ") for line in lines
    )
    experiment = load_experiment(out)
    assert "evil" not in (experiment.identify.recordings or ())
    # Text with line ends is no key either.
    assert experiment.recordings.columns.input == 1
    assert len(read_recordings(experiment, tmp_path)) == 6


def test_every_file_is_named_with_what_became_of_it(folder, tmp_path):
    write_english_csv(folder)
    (folder / "photo.jpg").write_bytes(b"\xff\xd8")
    (folder / "README.txt").write_text("Measured on Monday.\nAll is well.\n")
    (folder / "damaged.mat").write_text("no")
    text = (folder / "step_1.csv").read_text()
    (folder / "in_A.csv").write_text(text.replace("current_A", "current_mA"))
    (folder / "in_um.csv").write_text(text.replace("position_m,", "position [um],"))
    out = tmp_path / "mine.yaml"
    result = invoke("init", folder, "--out", out)

    assert result.exit_code == 0, result.output
    for said in (result.stdout, " ".join(out.read_text().replace("#", " ").split())):
        assert "photo.jpg: no reader for files named *.jpg" in said
        assert "README.txt: no table of numbers" in said
        assert "damaged.mat: " in said
        assert "in_A.csv: has no column 'current_A' for the input" in said
    assert "# test: step_2 (about a quarter" in out.read_text()
    used = load_experiment(out).recordings.files
    assert len(used) == 6


def test_files_in_other_units_are_not_read_in_the_first_ones(folder, tmp_path):
    units = (("a", "A", 1), ("b", "A", 1), ("c", "mA", 1000), ("d", "V", 1))
    for name, unit, scale in units:
        time, u, y = measurements()["Rauschen_1"]
        y = y + 1e-3 * "abcd".index(name)
        rows = [f"{t:.4f},{scale * a},{b}" for t, a, b in zip(time, u, y, strict=True)]
        head = ["t,current,pos", f"s,{unit},mm"]
        (folder / f"{name}.csv").write_text("\n".join([*head, *rows]))
    out = tmp_path / "mine.yaml"
    result = invoke("init", folder, "--out", out)

    assert result.exit_code == 0, result.output
    assert "skipped: d.csv: its input is in 'V', not in 'A'" in result.stdout
    assert len(load_experiment(out).recordings.files) == 3
    raws = read_recordings(load_experiment(out), tmp_path)
    np.testing.assert_allclose(raws[2].input, raws[0].input, rtol=1e-12)
    assert {one.input_unit for one in raws} == {"A"}


@pytest.mark.thorough
def test_a_missing_library_is_one_line_with_the_command(folder, tmp_path, monkeypatch):
    """As in a process without the extra: the module cannot be imported there."""
    hidden = tmp_path / "hidden"
    (hidden / "nptdms").mkdir(parents=True)
    (hidden / "nptdms" / "__init__.py").write_text(
        "raise ImportError(\"No module named 'nptdms'\")"
    )
    monkeypatch.syspath_prepend(str(hidden))
    monkeypatch.setattr(formats, "_ISOLATED", IsolatedReader("hwid_cli.data.formats"))
    (folder / "run.tdms").write_bytes(b"TDSm")
    result = invoke("init", folder, "--out", tmp_path / "mine.yaml")

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert "is read by npTDMS, which is missing" in result.stderr
    assert "pip install 'hwid[formats]'" in result.stderr
    formats._ISOLATED.end()


def test_kinds_of_a_plan_do_not_ask_for_columns_of_one_length(tmp_path):
    # A plan.csv names the kind; the loggers of input and output stopped apart.
    time_s = np.arange(400) * 1e-3
    folder = tmp_path / "measured"
    folder.mkdir()
    for number in range(2):
        rows = ["time_s,current_A,position_m"]
        for n, t in enumerate(time_s):
            u = float(n >= 100) * (number + 1)
            rows.append(
                f"{t:.3f},{u if n < 380 else ''},{u * (1 - 0.9 ** max(n - 100, 0)):.6f}"
            )
        (folder / f"run_{number}.csv").write_text("\n".join(rows) + "\n")
    (folder / "plan.csv").write_text("name,kind\nrun_0,step\nrun_1,step\n")
    out = tmp_path / "experiment.yaml"

    done = CliRunner().invoke(main, ["init", str(folder), "--out", str(out)])

    assert done.exit_code == 0, done.output
    assert out.is_file()


@pytest.mark.parametrize(
    ("source", "column", "said"),
    [
        ("current_A", "speed_rpm", ("inertia_kg_m2: 0.01", "output: velocity")),
        ("voltage_V", "speed_rpm", ("inertia_kg_m2: 0.01", "output: velocity")),
        ("current_A", "angle_deg", ("torque_constant_N_m_per_A: 0.1",)),
        ("current_A", "speed [mm/s]", ("mass_kg: 1.0", "output: velocity")),
        ("current_A", "position_mm", ("force_constant_N_per_A: 10.0",)),
        # What pushes by itself needs no constant.
        ("torque [Nm]", "angle_deg", ("torque_constant_N_m_per_A: 1.0",)),
        ("force_kN", "position_mm", ("force_constant_N_per_A: 1.0",)),
    ],
)
def test_the_starting_simulation_is_of_the_axis_that_is_measured(
    tmp_path, source, column, said
):
    rng = np.random.default_rng(2)
    (tmp_path / "runs").mkdir()
    for number in range(3):
        u = np.repeat(rng.uniform(-1, 1, 60), 10)
        y = np.convolve(u, np.exp(-np.arange(80) / 20))[: u.size]
        rows = np.column_stack([1e-3 * np.arange(u.size), u, y])
        np.savetxt(
            tmp_path / f"runs/run_{number}.csv", rows, delimiter=",", comments="",
            header=f"time_s,{source},{column}",
        )  # fmt: skip
    out = tmp_path / "mine.yaml"
    result = CliRunner().invoke(
        main, ["init", str(tmp_path / "runs"), "--out", str(out)]
    )
    assert result.exit_code == 0, result.output
    text = out.read_text()
    assert all(f"#   {one}\n" in text for one in said)
    assert ("output: velocity" in text) == column.startswith("speed")
    # Of a winding, where a voltage may drive one; a second mark, because a piezo has none.
    assert ("#   # resistance_ohm: 1.0" in text) == source.startswith("voltage")
    pushes = {"torque [Nm]": "N m", "force_kN": "N"}
    assert ("# (The input is a " in text) == (source in pushes)
    if source not in pushes:
        return
    # As the line says, and with the marks away: the units are those of the simulation.
    assert f"also put  input_unit: {pushes[source]}  under" in text
    start = text.index("# simulation:")
    simulation = without_marks(text[start:])
    text = text[:start].replace(
        "recordings:\n", f"recordings:\n  input_unit: {pushes[source]}\n", 1
    )
    out.write_text(text + simulation)
    done = CliRunner().invoke(main, ["check", str(out), "--no-timing"])
    assert done.exit_code == 0, done.output + out.read_text()


def test_a_reference_in_millimetres_is_converted_as_its_position_is(folder, tmp_path):
    # A simulation of the loop counts both in m.
    time = 0.002 * np.arange(600)
    for number, size in enumerate((20.0, 5.0, -12.0)):
        reference = size * np.clip((time - 0.1) / 0.3, 0.0, 1.0)
        position = np.r_[np.zeros(9), reference[:-9]]
        table = np.column_stack([time, reference, position])
        head = "time_s,pos_ref_mm,pos_act_mm"
        path = folder / f"move_{number}.csv"
        np.savetxt(path, table, delimiter=",", header=head, comments="")
    out = tmp_path / "mine.yaml"
    result = invoke("init", folder, "--out", out)
    assert result.exit_code == 0, result.output
    options = load_experiment(out).recordings
    assert (options.units.input, options.units.output) == ("mm", "mm")
    raws = read_recordings(load_experiment(out), out)
    assert max(np.max(one.input) for one in raws) == pytest.approx(0.02)


def test_a_copy_of_a_recording_is_named_and_left_out(folder, tmp_path):
    """A model that was fitted to one of them would be tested on the other."""
    write_english_csv(folder)
    first = sorted(folder.glob("*.csv"))[0]
    copy = folder / f"{first.stem} - Copy.csv"
    copy.write_bytes(first.read_bytes())
    result = invoke("init", folder, "--out", tmp_path / "mine.yaml")

    assert result.exit_code == 0, result.output
    assert f"{copy.stem}: holds the same numbers as {first.stem}" in result.stdout
    raws = read_recordings(load_experiment(tmp_path / "mine.yaml"), tmp_path)
    assert copy.stem not in {one.name for one in raws}


def test_files_of_two_rates_are_put_on_the_slower_clock(tmp_path):
    measured = tmp_path / "measured"
    measured.mkdir()
    rng = np.random.default_rng(4)
    for number, every in enumerate((1, 2, 1, 2, 2)):
        current = np.repeat(rng.uniform(-1.0, 1.0, 20), 60)
        position = scipy.signal.lfilter([0.05], [1.0, -0.95], current)
        table = np.column_stack([0.005 * np.arange(1200), current, position])[::every]
        head = "time_s,current_mA,position_mm"
        path = measured / f"levels_{number}.csv"
        np.savetxt(path, table, delimiter=",", header=head, comments="")
    out = tmp_path / "mine.yaml"
    result = invoke("init", measured, "--out", out)

    assert result.exit_code == 0, result.output
    assert "2 recordings are sampled every 0.005 s or so, others every 0.01 s" in (
        result.stdout
    )
    raws = read_recordings(load_experiment(out), out)
    assert {one.sample_time_s for one in raws} == {0.01}
    assert [one.input.size for one in raws] == [600] * 5


def test_numbers_may_stay_in_the_units_of_the_files(tmp_path):
    measured = tmp_path / "measured"
    measured.mkdir()
    for number, size in enumerate((10.0, -20.0, 15.0)):
        current = np.r_[np.zeros(50), np.full(450, size)]
        position = scipy.signal.lfilter([0.1], [1.0, -0.95], current)
        table = np.column_stack([0.01 * np.arange(500), current, position])
        head = "time_s,current_mA,position_mm"
        np.savetxt(measured / f"step_{number}.csv", table, "%.6f", ",", header=head, comments="")  # fmt: skip
    found = {}
    for units in ("si", "file"):
        out = tmp_path / f"{units}.yaml"
        assert invoke("init", measured, "--out", out, "--units", units).exit_code == 0
        experiment = load_experiment(out)
        raws = read_recordings(experiment, out)
        found[units] = (raws[0], experiment.crossval.threshold)
    (si, in_m), (kept, in_mm) = found["si"], found["file"]

    assert (si.input_unit, si.output_unit) == ("A", "m")
    assert (kept.input_unit, kept.output_unit) == ("mA", "mm")
    assert kept.output == pytest.approx(1e3 * si.output)
    assert in_mm == pytest.approx(1e3 * in_m, rel=0.5)
