"""Folders that other programs wrote: ``init`` finds what is in them, and it is right."""

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.config.load import load_experiment
from hwid_cli.data.recordings import read_recordings
from tests.cli.foreign_layouts import LAYOUTS, STEP_S, drives


def invoke(*arguments):
    return CliRunner().invoke(main, [str(one) for one in arguments])


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "Messung").mkdir()
    return tmp_path / "Messung"


@pytest.mark.parametrize("name", LAYOUTS)
def test_init_finds_columns_units_and_clock_and_the_numbers_are_the_writers(
    folder, tmp_path, name
):
    layout = LAYOUTS[name]
    layout.write(folder)
    out = tmp_path / "mine.yaml"
    result = invoke("init", folder, "--out", out)

    assert result.exit_code == 0, result.output
    experiment = load_experiment(out)
    options = experiment.recordings
    columns, units = options.columns, options.units
    assert (columns.time, columns.input, columns.output, columns.variable) == (
        layout.time,
        layout.input,
        layout.output,
        layout.variable,
    ), result.output
    assert (units.time, units.input, units.output) == layout.units
    found = {raw.name: raw for raw in read_recordings(experiment, tmp_path)}
    assert len(found) == 3
    for one in drives():
        raw = found[one.name]
        assert raw.sample_time_s == pytest.approx(layout.step_s, rel=1e-9)
        compare(raw, one, layout)


def compare(raw, written, layout):
    """What was read beside what was written, apart from lost samples."""
    every = round(layout.step_s / STEP_S)
    # Units that are known are converted to SI.
    position = 1e-3 * written.position if layout.units[2] else written.position
    lost = {int(k) for k in raw.bridged_output}
    there = [k for k in range(raw.output.size) if k not in lost]
    np.testing.assert_allclose(
        raw.output[there],
        position[::every][there],
        rtol=0,
        atol=layout.exact * np.ptp(position),
    )
    assert len(lost) <= 1
    if every == 1:
        np.testing.assert_allclose(
            raw.input, written.current, rtol=0, atol=layout.exact * 4.0
        )


@pytest.mark.slow
@pytest.mark.parametrize("name", LAYOUTS)
def test_a_foreign_folder_goes_through_the_first_stages_unedited(
    folder, tmp_path, name
):
    LAYOUTS[name].write(folder)
    out = tmp_path / "mine.yaml"
    assert invoke("init", folder, "--out", out).exit_code == 0
    for command in ("check", "calibrate", "identify"):
        result = invoke(command, out, "--out", tmp_path / "results", "--jobs", "1")
        assert result.exit_code == 0, (command, result.output)


@pytest.mark.parametrize(("lost", "kept"), [((0,), 399), ((0, 1, 2), 397)])
def test_rows_before_a_signal_begins_are_left_out(folder, tmp_path, lost, kept):
    for one in drives():
        rows = [
            f"{t:.6f},{u:.9f},{'' if k in lost else f'{y:.9f}'}"
            for k, (t, u, y) in enumerate(
                zip(one.time, one.current, one.position, strict=True)
            )
        ]
        head = "time_s,current_A,position_mm"
        (folder / f"{one.name}.csv").write_text("\n".join([head, *rows]))
    out = tmp_path / "mine.yaml"
    result = invoke("init", folder, "--out", out)

    assert result.exit_code == 0, result.output
    experiment = load_experiment(out)
    assert experiment.recordings.first_sample == len(lost)
    for raw, one in zip(read_recordings(experiment, tmp_path), drives(), strict=True):
        np.testing.assert_allclose(raw.input, one.current[-kept:], atol=1e-8)
