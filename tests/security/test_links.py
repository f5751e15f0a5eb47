"""Links and files that are no files, in the places that are written: refused, not followed."""

import os

import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.files.locks import RUN_LOCK, USERS_LOCK
from tests.bad_input import trial
from tests.conftest import leave_figures_blank

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links need rights there")


@pytest.fixture(autouse=True)
def _blank(monkeypatch):
    leave_figures_blank(monkeypatch)


@pytest.fixture
def victim(tmp_path):
    path = tmp_path / "elsewhere" / "victim"
    path.parent.mkdir()
    path.write_text("precious\n")
    return path


@pytest.fixture
def out(tmp_path):
    trial.make_good(tmp_path / "work")
    with (tmp_path / "work" / "config.yaml").open("a") as file:
        file.write("calibrate: {}\n")
    place = tmp_path / "work" / "out"
    place.mkdir()
    return place


def assert_refused(done, place, victim):
    assert done.exit_code == 1, done.output
    (line,) = done.stderr.splitlines()
    assert str(place) in line
    assert victim.read_text() == "precious\n"
    assert [one.name for one in victim.parent.iterdir()] == [victim.name]


@pytest.mark.parametrize("lock", [RUN_LOCK, USERS_LOCK])
@pytest.mark.parametrize("kind", ["link", "dangling", "hard link", "pipe"])
def test_lock_that_is_no_file_of_its_own_is_refused(out, victim, lock, kind):
    place = out / lock
    if kind == "link":
        place.symlink_to(victim)
    elif kind == "dangling":
        place.symlink_to(victim.with_name("new"))
    elif kind == "hard link":
        place.hardlink_to(victim)
    else:
        os.mkfifo(place)

    assert_refused(trial.run(out.parent), place, victim)


@pytest.mark.parametrize("kind", ["link", "dangling", "pipe"])
@pytest.mark.parametrize("name", ["calibrated.h5", "figures/calibrate/run.png"])
def test_result_that_is_no_plain_file_is_refused(out, victim, name, kind):
    place = out / name
    place.parent.mkdir(parents=True, exist_ok=True)
    if kind == "link":
        place.symlink_to(victim)
    elif kind == "dangling":
        place.symlink_to(victim.with_name("new"))
    else:
        os.mkfifo(place)

    assert_refused(trial.run(out.parent), place, victim)
    assert place.is_symlink() or place.is_fifo()


@pytest.mark.thorough
@pytest.mark.parametrize("is_readable", [True, False])
def test_results_of_a_stage_that_are_a_link_stay_a_link(out, victim, is_readable):
    place = out / "results.h5"
    place.symlink_to(victim if is_readable else victim.with_name("new"))
    done = trial.run(out.parent, "identify")

    assert_refused(done, place, victim)
    assert place.is_symlink()
    assert not list(out.glob("*.bad"))


@pytest.mark.parametrize(
    "name", ["figures", "figures/calibrate", "cache", "cache/0a", "next"]
)
def test_folder_below_the_results_that_is_a_link_is_refused(out, victim, name):
    place = out / name
    place.parent.mkdir(parents=True, exist_ok=True)
    place.symlink_to(victim.parent)

    assert_refused(trial.run(out.parent), place, victim)


def test_folders_that_the_user_names_may_be_links(out, tmp_path):
    (tmp_path / "disk").mkdir()
    out.rmdir()
    out.symlink_to(tmp_path / "disk")
    (tmp_path / "big").mkdir()
    (tmp_path / "cache").symlink_to(tmp_path / "big")
    done = trial.run(out.parent, options=("--cache", str(tmp_path / "cache")))

    assert done.exit_code == 0, done.output
    assert (tmp_path / "disk" / "calibrated.h5").is_file()


def test_starter_configuration_is_not_written_through_a_link(tmp_path, victim):
    trial.make_good(tmp_path / "measured")
    (tmp_path / "measured" / "config.yaml").unlink()
    place = tmp_path / "starter.yaml"
    place.symlink_to(victim)
    words = ["init", str(tmp_path / "measured"), "--out", str(place), "--force"]

    assert_refused(CliRunner().invoke(main, words), place, victim)


def test_half_written_files_behind_a_link_are_not_removed(out, victim):
    left = victim.with_name(f".x.{'0' * 32}.tmp")
    left.write_text("of somebody else")
    (out / "models").symlink_to(victim.parent)
    trial.run(out.parent)

    assert left.exists()
