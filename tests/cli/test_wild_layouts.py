"""Folders of other laboratories: ``init`` and ``calibrate`` unedited, and what is said."""

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.config.load import load_experiment
from hwid_cli.data.recordings import read_recordings
from tests.cli.wild_layouts import HEAD, LAYOUTS, NAMES, RUNS, STEP_S, N


def invoke(*arguments):
    return CliRunner().invoke(main, [str(one) for one in arguments])


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "Messung").mkdir()
    return tmp_path / "Messung"


def read(folder, out):
    """What the configuration that ``init`` writes reads, and what ``init`` says."""
    result = invoke("init", folder, "--out", out)
    assert result.exit_code == 0, result.output
    return read_recordings(load_experiment(out), out.parent), result.output


@pytest.mark.parametrize("name", LAYOUTS)
def test_numbers_clock_and_units_of_a_wild_folder_are_the_writers(
    folder, tmp_path, name
):
    written = LAYOUTS[name](folder)
    raws, said = read(folder, tmp_path / "mine.yaml")

    assert len(raws) == len(written), said
    for one in written:
        raw = min(raws, key=lambda raw: distance(raw.input, one.input))
        assert raw.sample_time_s == pytest.approx(one.step_s, rel=1e-9), said
        assert (raw.input_unit, raw.output_unit) == (one.input_unit, one.output_unit)
        assert distance(raw.input, one.input) < 1e-9 * np.ptp(one.input)
        assert distance(raw.output, one.output) < 1e-9 * np.ptp(one.output)


def distance(found, expected):
    """Largest difference; infinite between signals of different length."""
    if found.size != expected.size:
        return np.inf
    return float(np.max(np.abs(found - expected)))


@pytest.mark.slow
@pytest.mark.parametrize("name", LAYOUTS)
def test_a_wild_folder_goes_through_the_first_stages_unedited(folder, tmp_path, name):
    LAYOUTS[name](folder)
    out = tmp_path / "mine.yaml"
    assert invoke("init", folder, "--out", out).exit_code == 0
    for command in ("calibrate", "identify"):
        result = invoke(command, out, "--out", tmp_path / "results", "--jobs", "1")
        assert result.exit_code == 0, (command, result.output)


def rows(run, written=repr):
    return [
        ",".join(written(float(cell)) for cell in cells)
        for cells in zip(*run, strict=True)
    ]


def put(folder, name, lines):
    (folder / name).write_text("\n".join(lines) + "\n")


def test_counts_beside_a_factor_are_said_to_be_counts(folder, tmp_path):
    for name, (t, u, y) in zip(NAMES, RUNS, strict=True):
        counts = (t, np.round(1e3 * u), np.round(2e3 * y))
        head = ["Scale,0.001,0.0005", "Unit,A,mm", "t_s,u_raw,y_raw"]
        put(folder, f"{name}.csv", [*head, *rows(counts, "{:g}".format)])
    _, said = read(folder, tmp_path / "mine.yaml")

    assert "NOT SURE: the file states a factor of 0.001 for 'u_raw'" in said
    assert "write output_scale: 0.0005" in said
    assert "write input_scale: 0.001" in (tmp_path / "mine.yaml").read_text()


def test_factors_of_numbers_that_are_not_whole_are_no_matter(folder, tmp_path):
    for name, run in zip(NAMES, RUNS, strict=True):
        head = ["Scale,0.001,0.0005", "Unit,A,mm", "t_s,u,y"]
        put(folder, f"{name}.csv", [*head, *rows(run)])
    _, said = read(folder, tmp_path / "mine.yaml")

    assert "NOT SURE" not in said


@pytest.mark.parametrize("word", ["9.9E37", "9.91E+37", "#DIV/0!", "#WERT!", "-1.#IND"])
def test_what_stands_for_no_number_is_bridged(folder, tmp_path, word):
    for name, run in zip(NAMES, RUNS, strict=True):
        lines = rows(run)
        lines[100] = ",".join([*lines[100].split(",")[:2], word])
        put(folder, f"{name}.csv", [HEAD, *lines])
    raws, _ = read(folder, tmp_path / "mine.yaml")

    assert [raw.bridged_output for raw in raws] == [(100,)] * 3
    for raw, (_, _, y) in zip(raws, RUNS, strict=True):
        assert raw.output[100] == pytest.approx(5e-4 * (y[99] + y[101]))


def test_stamps_of_single_precision_give_the_mean_step(folder, tmp_path):
    """Beyond 1000 s, steps of 2 ms are 1.95 or 2.01 ms in 32 bits, most of them 2.01."""
    for name, (t, u, y) in zip(NAMES, RUNS, strict=True):
        stamps = (1000.0 + t).astype(np.float32)
        np.savez(folder / f"{name}.npz", time=stamps, current=u, position=y)
    raws, _ = read(folder, tmp_path / "mine.yaml")

    assert [raw.sample_time_s for raw in raws] == [pytest.approx(STEP_S)] * 3
    assert [raw.input.size for raw in raws] == [N] * 3


def test_rows_of_words_and_values_are_refused_in_one_line(folder, tmp_path):
    t, u, y = RUNS[0]
    lines = [
        f"{when},{tag},{value}"
        for when, *values in zip(t, u, y, strict=True)
        for tag, value in zip(("current_A", "position_mm"), values, strict=True)
    ]
    put(folder, "all.csv", ["timestamp,who,what", *lines])
    result = invoke("init", folder, "--out", tmp_path / "mine.yaml")

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert "side by side in one file" in result.stderr


def test_segments_without_a_clock_are_not_joined(folder, tmp_path):
    head = ["Channels\t2\t", "Date\t2024/05/01\t2024/05/01", "Y_Unit_Label\tA\tmm"]
    head += ["X_Dimension\tTime\tTime", "Delta_X\t0.002\t0.002"]
    head += ["***End_of_Header***\t\t", "X_Value\tCurrent\tPosition"]
    for name, (_, u, y) in zip(NAMES, RUNS, strict=True):
        plain = [f"\t{a!r}\t{b!r}" for a, b in zip(u.tolist(), y.tolist(), strict=True)]
        put(folder, f"{name}.lvm", [*head, *plain[:180], *head, *plain[180:]])
    result = invoke("init", folder, "--out", tmp_path / "mine.yaml")

    assert result.exit_code == 1
    assert "which is not a number" in result.stderr


def test_a_number_of_the_recording_cuts_where_nothing_tells_the_time(folder, tmp_path):
    lines = [
        f"{number},{row}"
        for number, (_, u, y) in enumerate(RUNS, 1)
        for row in rows((u, y))
    ]
    put(folder, "all.csv", ["run,i [A],x [mm]", *lines])
    raws, said = read(folder, tmp_path / "mine.yaml")

    assert [raw.name for raw in raws] == ["part_1", "part_2", "part_3"]
    for raw, (_, u, _) in zip(raws, RUNS, strict=True):
        assert (raw.input == u).all()
    assert "THE SAMPLE TIME IS NOT KNOWN" in said


def test_files_cut_at_other_samples_are_named_and_the_others_used(folder, tmp_path):
    for name, (t, u, y) in zip(NAMES, RUNS, strict=True):
        put(folder, f"{name}.csv", [HEAD, *rows((t, u, y))])
    t, u, y = RUNS[0]
    put(folder, "two.csv", [HEAD, *rows((np.where(t < 0.2999, t, t - 0.3), u, y))])
    raws, said = read(folder, tmp_path / "mine.yaml")

    assert [raw.name for raw in raws] == list(NAMES)
    assert "two.csv: holds 2 recordings, the second from sample 150" in said


def test_a_time_that_runs_backwards_is_named(folder, tmp_path):
    for name, run in zip(NAMES, RUNS, strict=True):
        put(folder, f"{name}.csv", [HEAD, *rows(run)[::-1]])
    _, said = read(folder, tmp_path / "mine.yaml")

    assert (
        "NOT USED: 't [s]' is named after time, but does not grow at sample 1" in said
    )


def test_tables_of_a_file_are_recordings_with_their_names(folder, tmp_path):
    LAYOUTS["recordings in groups of hdf5"](folder)
    raws, said = read(folder, tmp_path / "mine.yaml")

    assert sorted(raw.name for raw in raws) == list(NAMES)
    options = load_experiment(tmp_path / "mine.yaml").recordings
    assert (options.columns.variable, options.columns.input) == ("*", "current")
    assert "each is a recording" in said


def test_a_pattern_of_tables_chooses_among_them(folder, tmp_path):
    LAYOUTS["recordings in members of a struct"](folder)
    read(folder, tmp_path / "mine.yaml")
    text = (tmp_path / "mine.yaml").read_text()
    path = tmp_path / "two.yaml"
    head = text.split("\ntest:")[0]
    path.write_text(head.replace("variable: '*'", "variable: 'data.run_[ab]*'"))

    raws = read_recordings(load_experiment(path), tmp_path)
    assert [raw.name for raw in raws] == ["run_a", "run_b"]


@pytest.mark.thorough
def test_a_pattern_without_a_table_is_refused_with_its_columns(folder, tmp_path):
    LAYOUTS["recordings in sheets"](folder)
    read(folder, tmp_path / "mine.yaml")
    path = tmp_path / "mine.yaml"
    path.write_text(path.read_text().replace("variable: '*'", "variable: 'no*'"))
    result = invoke("calibrate", path)

    assert result.exit_code == 1
    assert "has no table like 'no*' with 'I [A]' and 'x [mm]'" in result.stderr
