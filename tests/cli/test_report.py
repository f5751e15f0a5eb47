import json
import re

import h5py
import pytest

from hwid_cli.cli.options import Choices
from hwid_cli.cli.report import _is_complete, _last_line, _signed, read_stored
from hwid_cli.cli.session import open_session
from hwid_cli.files.figure_files import write_figure


def files_below(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*.png"))
    }


def test_without_results_it_says_in_one_line_what_to_run(hwid, out):
    result = hwid("report")

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert "holds no results" in result.stderr
    assert "run 'hwid run" in result.stderr
    assert not (out / "report.html").exists()


def test_a_report_of_all_stages(after_run, hwid, config, out):
    before = (out / "results.h5").read_bytes()
    result = hwid("report")

    assert result.exit_code == 0, result.output
    assert "shows calibrate, identify, crossval" in result.stderr
    # No stage is run.
    assert (out / "results.h5").read_bytes() == before
    html = (out / "report.html").read_text()
    figures = files_below(out / "figures")
    assert {"calibrate/step_02.png", "recordings/step_02_detail.png"} <= set(figures)
    names = json.loads(re.search(r"<!-- drawn from \w+ (\{.*\}) -->\n", html)[1])
    assert names
    assert set(names) <= set(figures)
    # A command of the page is one to copy.
    assert f"hwid group {config.name}" in html
    assert "CONFIG" not in re.sub(r"<(script|style).*?</\1>", "", html, flags=re.S)
    # Seconds and versions come from the results.
    row = re.search(r"<td class=\"text\">identify</td>(.*?)</tr>", html, re.DOTALL)
    assert re.search(r"<td>\d+\.\d</td>", row[1])
    assert "unknown" not in row[1]
    assert "as configured" in row[1]


@pytest.mark.thorough
def test_only_figures_of_results_that_changed_are_drawn_again(
    after_run, hwid, out, edit, monkeypatch
):
    drawn = []

    def count(self):
        drawn.append(self.file)
        return blank

    blank = (out / "figures" / "crossval" / "matrix.png").read_bytes()
    monkeypatch.setattr("hwid_cli.report.page.Drawing.png", property(count))
    (out / "figures" / "recordings" / "step_02.png").unlink()
    hwid("report")
    assert drawn == ["recordings/step_02.png"]
    drawn.clear()
    # The threshold decides what is covered and so the widest model, nothing else.
    edit("threshold: 0.01", "threshold: 0.02")
    assert hwid("crossval").exit_code == 0
    assert {file.split("/")[0] for file in drawn} == {"crossval", "models"}
    drawn.clear()
    hwid("report", "--force")
    assert {"recordings/step_02.png", "residuals/step_02.png"} <= set(drawn)


@pytest.mark.slow
def test_the_same_results_give_the_same_bytes(after_run, hwid, out):
    hwid("report")
    html, figures = (out / "report.html").read_bytes(), files_below(out)
    hwid("report")

    assert (out / "report.html").read_bytes() == html
    assert files_below(out) == figures


@pytest.mark.slow
def test_workers_draw_the_same_figures(after_run, hwid, out, monkeypatch):
    # Workers know nothing of blank figures.
    monkeypatch.undo()
    hwid("report", "--force", "--jobs", "1")
    alone = files_below(out)
    assert len(alone) > 4
    for name in alone:
        if not name.startswith("figures/calibrate/"):
            (out / name).unlink()
    monkeypatch.setattr("hwid_cli.cli.report._FEW_FIGURES", 0)
    result = hwid("report", "--force", "--jobs", "2")

    assert result.exit_code == 0, result.output
    assert files_below(out) == alone


@pytest.mark.slow
def test_models_newer_than_the_tensor_do_not_break_it(after_run, hwid, out, edit):
    edit("nk: [1, 2]", "nk: [2, 2]")
    hwid("identify")
    result = hwid("report")

    assert result.exit_code == 0, result.output
    assert "belongs to other models" in (out / "report.html").read_text()


def test_settings_that_changed_since_the_run_are_named(after_run, config, out, edit):
    edit("threshold: 0.01", "threshold: 0.02")
    session = open_session(Choices(config, out), "report")

    changed = {run.stage: run.changed for run in read_stored(session).stages}
    assert changed == {"calibrate": (), "identify": (), "crossval": ("crossval",)}


@pytest.mark.thorough
def test_calibration_alone_can_be_reported(hwid, out):
    hwid("calibrate")
    result = hwid("report")

    assert result.exit_code == 0, result.output
    assert "shows calibrate," in result.stderr


def test_a_broken_diagnosis_is_one_line(after_run, hwid, out):
    (out / "diagnosis.json").write_text("{")
    result = hwid("report")

    assert result.exit_code == 1
    assert "diagnosis.json: cannot be read" in result.stderr


@pytest.mark.slow
def test_a_page_is_drawn_again_only_when_its_results_have_changed(
    after_run, hwid, edit
):
    hwid("report")

    assert "shows calibrate, identify, crossval already" in hwid("report").stderr
    assert "already" not in hwid("report", "--force").stdout
    edit("crossval: {threshold: 0.01}", "crossval: {threshold: 0.02}")
    assert hwid("crossval").exit_code == 0
    assert "already" not in hwid("report").stdout


def damage_half(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def damage_first_bytes(path):
    path.write_bytes(bytes(16) + path.read_bytes()[16:])


def damage_stage(path):
    with h5py.File(path, "r+") as file:
        group = file if path.name == "calibrated.h5" else file["crossval"]
        del group.attrs["key"]


@pytest.mark.parametrize("file", ["results.h5", "calibrated.h5"])
@pytest.mark.parametrize("damage", [damage_half, damage_first_bytes, damage_stage])
def test_results_that_cannot_be_read_leave_the_old_page(
    after_run, hwid, out, damage, file
):
    (out / "report.html").write_text("the old page")
    figures = files_below(out)
    damage(out / file)
    result = hwid("report")

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert f"{file}: cannot be read" in result.stderr
    assert (out / "report.html").read_text() == "the old page"
    assert files_below(out) == figures


@pytest.mark.slow
def test_a_figure_that_was_deleted_is_written_again(after_run, hwid, out):
    hwid("report")
    figures = files_below(out)
    (out / "figures" / "crossval" / "matrix.png").unlink()

    assert "already" not in hwid("report").stderr
    assert files_below(out) == figures
    assert "already" in hwid("report").stderr


def test_the_last_line_stays_one_comment_whatever_figures_are_called(tmp_path):
    figures = {"models/a-->b.png": "key a", "recordings/\u00e4\n.png": "key b"}
    line = _last_line("key", figures)
    for name, about in figures.items():
        write_figure(tmp_path / "figures" / name, b"PNG" + bytes(12), about)
    page = tmp_path / "report.html"
    page.write_bytes(_signed(f"<html>\n{line}"))

    assert line.count("-->") == line.count("\n") == 1
    assert _is_complete(tmp_path, page, "key")
    assert not _is_complete(tmp_path, page, "other")
    (tmp_path / "figures" / "models" / "a-->b.png").unlink()
    assert not _is_complete(tmp_path, page, "key")


def test_an_answer_of_an_older_configuration_is_marked(after_run, hwid, edit, out):
    edit("threshold: 0.01", "threshold: 0.02")
    assert hwid("report").exit_code == 0

    page = (out / "report.html").read_text()
    screen = page[: page.index("</article>")]
    assert "Made with other settings of crossval: run hwid crossval again." in screen
