"""One key stands for one computation, whatever a configuration asks.

A task's key is made beside its arguments. A key of the configuration that reaches the
arguments and not the key would take results of other settings from the cache.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.records.experiment import (
    CrossvalOptions,
    FinalTestOptions,
    GroupOptions,
    OrderOptions,
    OrdersOptions,
)
from hwid_cli.records.model import FitOptions
from hwid_cli.tasks.task import Task

HEAD = """
name: tiny
simulate:
  kind: gun
  plan: {samples: 300, only: [step_02, step_05, step_12, sine_12]}
recordings:
  files: raw/*.csv
  columns: {time: time_s, input: current_A, output: displacement_m}
calibrate:
  step: [cut, output_offset]
  sine: [cut, input_offset, output_offset, recut]
  samples: 300
"""
BASE = {
    "orders": {"nb": "[1, 2]", "nk": "1"},
    "fit": {"units": "3", "starts": "1", "max_iterations": "3"},
    "identify": {},
    "crossval": {"threshold": "0.01"},
    "order": {"maps": "[none]", "units": "[3]"},
    "group": {"max_level": "1"},
    "test": {"recordings": "[sine_12]"},
}
# Another value of every key, and what it needs beside it.
OTHER = {
    "orders": {
        "nb": ("[1, 3]", {}),
        "nk": ("2", {}),
        "nk_role": ("delay", {"nf": "1"}),
        "nf": ("2", {"nk_role": "delay"}),
    },
    "fit": {
        "input_map": ("none", {}),
        "output_map": ("polynomial", {}),
        "units": ("4", {}),
        "degree": ("3", {"output_map": "polynomial"}),
        "initial_state": ("steady", {}),
        "join": ("experiments", {}),
        "free_break_points": ("false", {}),
        "max_iterations": ("2", {}),
        "starts": ("2", {}),
        "input_units": ("4", {}),
        "output_units": ("2", {}),
        "loss": ("huber", {}),
        "linear_block": (
            "{numerator: [0.1], denominator: [1.0, -0.9], frozen: false}",
            {},
        ),
        "largest_pole_radius": ("0.9", {}),
        "delays": ("[1, 2]", {}),
    },
    "crossval": {"threshold": ("0.02", {}), "recordings": ("[step_02]", {})},
    "order": {
        "tolerance": ("0.5", {}),
        "maps": ("[saturation]", {}),
        "units": ("[4]", {}),
    },
    "group": {
        "start": ("[step_02]", {}),
        "candidates": ("[step_05]", {"start": "[step_02]"}),
        "validate": ("[step_12]", {}),
        "keep": ("{top: 1}", {}),
        "max_level": ("2", {}),
        "together": ("true", {}),
        "warm_start": ("false", {}),
    },
    "test": {"recordings": ("[step_12]", {})},
}
SECTIONS = {
    "orders": OrdersOptions,
    "fit": FitOptions,
    "crossval": CrossvalOptions,
    "order": OrderOptions,
    "group": GroupOptions,
    "test": FinalTestOptions,
}
# Functions of the user's own need a file; their content is the key's.
NOT_IN_FILES = {"fit": {"input_function", "output_function"}}


def test_every_key_of_a_section_has_another_value_here():
    for name, record in SECTIONS.items():
        known = {*OTHER[name], *NOT_IN_FILES.get(name, ())}
        assert known == {one.name for one in fields(record)}, name


def content(value):
    """What a value says, whatever it has cached beside it."""
    if is_dataclass(value):
        own = {one.name: content(getattr(value, one.name)) for one in fields(value)}
        return (type(value).__name__, tuple(sorted(own.items())))
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    if isinstance(value, Mapping):
        return tuple(sorted((str(key), content(one)) for key, one in value.items()))
    if isinstance(value, Sequence) and not isinstance(value, str):
        return tuple(map(content, value))
    return repr(value)


def written(section=None, key=None, value=None, beside=()):
    """A configuration with another value of one key."""
    asked = {name: dict(keys) for name, keys in BASE.items()}
    if section is not None:
        asked[section].update({key: value, **dict(beside)})
    lines = [
        f"{name}: {{{', '.join(f'{one}: {said}' for one, said in keys.items())}}}"
        for name, keys in asked.items()
    ]
    return HEAD + "\n".join(lines) + "\n"


@pytest.mark.thorough
@pytest.mark.usefixtures("blank_figures")
def test_a_key_never_stands_for_two_computations(monkeypatch, tmp_path):
    seen, clashes, plain = {}, [], Task.__init__

    def watched(self, *given, **named):
        plain(self, *given, **named)
        said = (self.function.__qualname__, content(self.arguments))
        if seen.setdefault(self.key, said) != said:
            clashes.append((asked, said[0]))

    monkeypatch.setattr(Task, "__init__", watched)
    runs = [(None, None, None, ())]
    runs += [
        (section, key, value, tuple(beside.items()))
        for section, keys in OTHER.items()
        for key, (value, beside) in keys.items()
    ]
    for number, asked in enumerate(runs):
        path = tmp_path / f"config_{number}.yaml"
        path.write_text(written(*asked))
        options = ["--out", str(tmp_path / str(number)), "--jobs", "1"]
        command = asked[0] if asked[0] in ("order", "group", "test") else "crossval"
        done = CliRunner().invoke(main, [command, str(path), *options])
        assert done.exit_code == 0, (asked, done.output)
    assert len(seen) > 100
    assert clashes == []
