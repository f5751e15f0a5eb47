"""The same numbers, bit by bit, on repeat, with any workers, with and without a cache."""

import numpy as np
import pytest

from hwid_cli.store.cache import Hdf5Store
from hwid_cli.store.results import read_crossval, read_fits
from tests.bad_input import trial
from tests.diagnosis import small_drive
from tests.numerics.plants import identified, measured, settings, validated
from tests.stages.diagnosed_drive import FRICTION, diagnosed, parameters

CONFIG = """\
name: tiny
recordings:
  files: "*.csv"
  columns: {time: t, input: u, output: y}
orders: {nb: [1, 2], nk: [1, 2]}
fit: {units: 3, starts: 2, max_iterations: 5}
identify: {}
crossval: {threshold: 0.01}
"""


@pytest.fixture
def experiment(tmp_path):
    folder = tmp_path / "tiny"
    folder.mkdir()
    (folder / "config.yaml").write_text(CONFIG)
    for seed, name in enumerate("ab"):
        one = measured(name, seed)
        columns = (1e-3 * np.arange(one.n_samples), one.input, 1e3 * one.output)
        (folder / f"{name}.csv").write_text(trial.csv_text(columns))
    return folder


def numbers(folder, out):
    """Tensor and parameters of all models, as bytes."""
    path = folder / out / "results.h5"
    models = [fit.model for fit in read_fits(path)]
    return [
        read_crossval(path).rmsd.tobytes(),
        *(model.numerator.tobytes() for model in models),
        *(model.denominator.tobytes() for model in models),
        *(model.output_map.parameters.tobytes() for model in models),
    ]


def run(folder, out, *options):
    result = trial.run(folder, "crossval", out, options)
    assert result.exit_code == 0, result.stderr
    return numbers(folder, out)


@pytest.mark.thorough
def test_repeats_and_answers_from_the_cache_are_the_same_bits(experiment):
    first = run(experiment, "first")

    assert run(experiment, "first") == first
    assert run(experiment, "first", "--force") == first
    assert run(experiment, "second") == first
    cache = ("--cache", str(experiment / "first" / "cache"))
    assert run(experiment, "third", *cache) == first


@pytest.mark.slow
def test_two_workers_give_the_same_bits(experiment):
    first = run(experiment, "one")

    assert run(experiment, "two", "--jobs", "2") == first


@pytest.mark.thorough
def test_the_memory_and_the_disk_as_cache_give_the_same_bits(tmp_path):
    data = [measured("a", 1), measured("b", 2)]
    in_memory = validated(identified(data), data)
    store = Hdf5Store(tmp_path)
    for _ in range(2):
        fits = identified(data, store=store)
        on_disk = validated(fits, data, store=store)
        assert on_disk.rmsd.tobytes() == in_memory.rmsd.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_diagnosis_is_the_same_bits(jobs, tmp_path):
    data = small_drive.recordings(FRICTION)
    first = diagnosed(data)
    run = settings(Hdf5Store(tmp_path), jobs)
    for _ in range(2):
        second = diagnosed(data, run=run)
        assert parameters(second.effects[0]) == parameters(first.effects[0])
        assert second.after == first.after
