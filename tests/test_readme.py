"""The README is true: its code runs, its configuration loads, its links lead somewhere."""

import re
from pathlib import Path

import numpy as np

from hwid_cli.config.load import load_experiment

PROJECT = Path(__file__).parents[1]
TEXT = (PROJECT / "README.md").read_text()
OWN = (PROJECT / "docs" / "own_measurements.md").read_text()


def block(language, text=TEXT):
    found = re.search(rf"^( *)```{language}\n(.*?)^ *```", text, re.DOTALL | re.M)
    indent = len(found[1])
    return "\n".join(line[indent:] for line in found[2].splitlines())


def test_the_python_example_runs_and_fits():
    scope = {}
    exec(compile(block("python"), "README.md", "exec"), scope)

    assert scope["result"].fit_percent > 95
    assert scope["y_hat"].shape == scope["u"].shape
    assert np.isfinite(scope["y_hat"]).all()


def test_the_configuration_example_loads(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(block("yaml", OWN))
    experiment = load_experiment(path)

    assert experiment.name == "mine"
    assert experiment.crossval.threshold == 0.01


def test_every_link_leads_to_a_file():
    targets = re.findall(r"\]\(([^)#]+)\)", TEXT)
    assert "docs/figures/gap.png" in targets
    assert [one for one in targets if not (PROJECT / one).exists()] == []


def test_every_make_target_named_exists():
    makefile = (PROJECT / "Makefile").read_text()
    for target in re.findall(r"(?:^|`)make ([a-z0-9-]+)", TEXT, re.M):
        assert re.search(rf"^{target}:", makefile, re.M), target


def test_it_is_read_in_a_minute_and_a_half():
    assert len(TEXT.splitlines()) <= 95
    assert len(TEXT.split()) <= 900
