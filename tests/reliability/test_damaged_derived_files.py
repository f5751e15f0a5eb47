"""Files that are made from results: verified, and made again where they are damaged."""

import re
import shutil

import pytest

from tests.conftest import leave_figures_blank
from tests.reliability import harness


def empty(_):
    return b""


def half(content):
    return content[: len(content) // 2]


def bit(content):
    at = len(content) // 3
    return content[:at] + bytes([content[at] ^ 4]) + content[at + 1 :]


def bit_of_the_last_line(content):
    at = content.rindex(b"\n", 0, -1) + 12
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


def bit_of_the_line_before(content):
    at = content.rindex(b"drawn from") + 100
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


def digit(content):
    """Change the last digit of a number of a table."""
    places = list(re.finditer(rb"\d(?=</td>)|\d(?=\r?\n)", content))
    at = places[len(places) // 2].start()
    other = b"1" if content[at : at + 1] == b"7" else b"7"
    return content[:at] + other + content[at + 1 :]


PNG = [empty, half, bit]
CASES = [
    *(("figures/calibrate/step_02.png", damage) for damage in PNG),
    *(("figures/recordings/step_02.png", damage) for damage in PNG),
    *(("report.html", one) for one in (*PNG, digit)),
    ("report.html", bit_of_the_last_line),
    ("report.html", bit_of_the_line_before),
]
TABLES = [("crossval.csv", empty), ("groups.csv", half), ("test.csv", digit)]


@pytest.fixture(scope="session")
def reported(undisturbed, tmp_path_factory):
    """The undisturbed campaign with its page."""
    folder = tmp_path_factory.mktemp("reported")
    config = harness.write_config(folder)
    shutil.copytree(undisturbed, folder / "out")
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_figures_blank(monkeypatch)
        harness.run_here(config, folder / "out", command="run")
    return folder / "out"


def derived(folder):
    paths = [*folder.glob("*.csv"), *folder.rglob("*.png"), folder / "report.html"]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "damage"), CASES)
def test_report_draws_damaged_files_again(config, out, reported, name, damage):
    shutil.copytree(reported, out)
    (out / name).write_bytes(damage((out / name).read_bytes()))
    assert derived(out) != derived(reported)
    done = harness.run_here(config, out, command="report")

    assert "hwid: " not in done.stderr
    assert derived(out) == derived(reported)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "damage"), [CASES[0], CASES[4], CASES[8], *TABLES])
def test_run_makes_damaged_files_again(config, out, reported, name, damage):
    shutil.copytree(reported, out)
    (out / name).write_bytes(damage((out / name).read_bytes()))
    assert derived(out) != derived(reported)
    done = harness.run_here(config, out, command="run")

    assert harness.count_computed(done.stdout) == 0
    assert derived(out) == derived(reported)


@pytest.mark.thorough
def test_a_page_leaves_the_figures_of_calibration_alone(config, out, undisturbed):
    shutil.copytree(undisturbed, out)
    before = {path: path.read_bytes() for path in out.rglob("calibrate/*.png")}
    assert before
    harness.run_here(config, out, command="report")
    harness.run_here(config, out, command="calibrate")

    assert {path: path.read_bytes() for path in before} == before


@pytest.mark.thorough
def test_figure_of_another_recording_is_not_shown(config, out, reported):
    shutil.copytree(reported, out)
    folder = out / "figures" / "calibrate"
    shutil.copy(folder / "step_12.png", folder / "step_02.png")
    harness.run_here(config, out, command="report")

    assert derived(out) == derived(reported)


@pytest.mark.thorough
def test_damaged_figure_is_drawn_again_without_the_measurements(config, out, reported):
    shutil.copytree(reported, out)
    (out / "figures" / "calibrate" / "step_02.png").write_bytes(b"")
    shutil.rmtree(out / "raw")
    done = harness.run_here(config, out, command="report")

    assert "hwid: " not in done.stderr
    assert derived(out) == derived(reported)
