"""Python that results carry runs only where the configuration at hand names its text."""

import shutil

import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.model.maps import own_function
from hwid_cli.records.model import Fit
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.store.trusted_functions import allow_only
from tests.bad_input import trial
from tests.conftest import leave_figures_blank

# Each run of the text leaves a line in a file beside the configuration.
SOURCE = """
from pathlib import Path
import numpy as np
from hwid_cli import MapFunction

with Path({traces!r}).open("a") as file:
    file.write("ran\\n")
curve = MapFunction(
    value=lambda v, p: p[0] * np.tanh(v),
    by_argument=lambda v, p: p[0] * (1.0 - np.tanh(v) ** 2),
    by_parameters=lambda v, p: np.tanh(v)[:, None],
    start=[0.7],
)
"""
FIT = "fit: {units: 3, starts: 1, max_iterations: 2, output_map: none"
OWN = f"{FIT}, input_map: {{file: curve.py, name: curve}}}}\n"
PLAIN = f"{FIT}, input_map: none}}\n"
STAGES = "identify: {}\ncrossval: {threshold: 0.01}\n"
ORDERS = ("{nb: [1, 2], nk: [1, 2]}", "{nb: 1, nk: 1}")


@pytest.fixture(autouse=True)
def _blank(monkeypatch):
    leave_figures_blank(monkeypatch)


@pytest.fixture
def folder(tmp_path):
    trial.make_good(tmp_path)
    good = (tmp_path / "config.yaml").read_text().replace(*ORDERS)
    traces = tmp_path / "traces"
    (tmp_path / "curve.py").write_text(SOURCE.format(traces=str(traces)))
    (tmp_path / "own.yaml").write_text(good + OWN + STAGES)
    (tmp_path / "plain.yaml").write_text(good + PLAIN + STAGES)
    return tmp_path


def hwid(folder, *arguments, out="out"):
    own_function.load.cache_clear()
    arguments = [str(one) for one in arguments]
    more = ["--out", str(folder / out), "--jobs", "1"]
    if arguments[0] == "check":
        more = more[:2]
    return CliRunner().invoke(main, [*arguments, *more])


def forget(folder):
    (folder / "traces").unlink(missing_ok=True)


def has_run(folder):
    return (folder / "traces").exists()


@pytest.fixture
def after_own(folder):
    done = hwid(folder, "run", folder / "own.yaml")
    assert done.exit_code == 0, done.output
    assert has_run(folder)
    forget(folder)
    return folder


@pytest.mark.thorough
@pytest.mark.parametrize("command", ["check", "run", "crossval", "report"])
def test_each_run_of_a_function_is_announced_in_one_line(after_own, command):
    done = hwid(after_own, command, after_own / "own.yaml")

    assert done.exit_code == 0, done.output
    assert has_run(after_own)
    said = [line for line in done.stdout.splitlines() if " runs " in line]
    assert len(said) == 1
    assert "fit.input_map" in said[0]
    assert "'curve'" in said[0]
    assert "own.yaml" in said[0]


def test_report_of_a_plain_configuration_does_not_run_a_stored_function(after_own):
    done = hwid(after_own, "report", after_own / "plain.yaml")

    assert not has_run(after_own)
    assert done.exit_code == 1
    assert len(done.stderr.splitlines()) == 1
    assert "'curve'" in done.stderr
    assert "fit.input_map" in done.stderr


@pytest.mark.thorough
def test_function_of_another_text_does_not_run(after_own):
    text = (after_own / "curve.py").read_text()
    (after_own / "curve.py").write_text(text.replace("ran\\n", "new\\n"))
    done = hwid(after_own, "report", after_own / "own.yaml")

    # The text that the configuration names is tried out and checked, that of the
    # results, which leaves other traces, does not run.
    assert (after_own / "traces").read_text() == "new\nnew\n"
    assert done.exit_code == 1
    assert "with another text" in done.stderr


@pytest.mark.thorough
def test_planted_results_with_the_right_key_are_computed_again(folder):
    own = hwid(folder, "crossval", folder / "own.yaml", out="own")
    plain = hwid(folder, "crossval", folder / "plain.yaml", out="plain")
    assert own.exit_code == plain.exit_code == 0
    wanted = (folder / "plain" / "crossval.csv").read_bytes()
    plant_entries(folder / "own", folder / "plain")
    (folder / "plain" / "results.h5").unlink()
    forget(folder)
    done = hwid(folder, "crossval", folder / "plain.yaml", out="plain")

    assert not has_run(folder)
    assert done.exit_code == 0, done.output
    assert "set aside" in done.stderr
    assert (folder / "plain" / "crossval.csv").read_bytes() == wanted


def plant_entries(source, target):
    """Fits of one cache under the keys of another one, checksums and all."""
    allow_only((), has_leave=True)

    def fits(folder):
        store = Hdf5Store(folder / "cache", sets_aside=False)
        keys = [path.stem for path in (folder / "cache").glob("??/*.h5")]
        found = {key: store.get(key, Fit) for key in keys}
        return {key: fit for key, fit in found.items() if fit is not None}

    (fit,) = fits(source).values()
    (key,) = fits(target)
    Hdf5Store(target / "cache").put(key, fit)


def test_compare_runs_functions_of_another_folder_only_when_told(after_own):
    shutil.move(after_own / "out", after_own / "old")
    model = f"{after_own / 'old'}:run/1/1"
    words = ["compare", model, "linear:run/1/1", "--on", after_own / "plain.yaml"]
    refused = hwid(after_own, *words)

    assert refused.exit_code == 1
    assert not has_run(after_own)
    assert "--run-own-functions" in refused.stderr

    done = hwid(after_own, *words, "--run-own-functions")

    assert done.exit_code == 0, done.output
    assert has_run(after_own)
    assert done.stdout.count(": runs the Python function") == 1


@pytest.mark.thorough
def test_model_that_is_a_simulation_runs_no_function_that_is_not_named(after_own):
    exported = hwid(after_own, "export", after_own / "own.yaml", "--model", "run/1/1")
    assert exported.exit_code == 0, exported.output
    forget(after_own)
    text = (after_own / "plain.yaml").read_text()
    section = "simulation: {kind: model, file: out/models/run_1_1.json}\ndiagnose: {}\n"
    (after_own / "boxed.yaml").write_text(text + section)
    done = hwid(after_own, "diagnose", after_own / "boxed.yaml", out="boxed")

    assert not has_run(after_own)
    assert done.exit_code == 1
    assert "'curve'" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.thorough
def test_predict_announces_the_function_that_it_runs(after_own):
    exported = hwid(after_own, "export", after_own / "own.yaml", "--model", "run/1/1")
    assert exported.exit_code == 0, exported.output
    forget(after_own)
    model = after_own / "out" / "models" / "run_1_1.json"
    words = ["predict", str(model), str(after_own / "run.csv")]
    words += ["--out", str(after_own / "prediction.csv"), "--run-own-functions"]
    own_function.load.cache_clear()
    done = CliRunner().invoke(main, words)

    assert done.exit_code == 0, done.output
    assert has_run(after_own)
    assert done.stdout.count(": runs the Python function") == 1
