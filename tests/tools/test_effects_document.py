"""docs/effects.md says what the catalogue says."""

import pytest

from hwid_cli.config.simulation_checks import EFFECT_PARAMETERS
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from tools import effects_document
from tools.effects_document import DOCUMENT, FIGURES, document, main
from tools.effects_figures import EXAMPLES


def test_the_document_is_up_to_date():
    assert DOCUMENT.read_text() == document()


def test_every_effect_has_a_section_and_a_figure():
    sections = {line[3:] for line in document().splitlines() if line.startswith("## ")}
    assert sections == set(EFFECT_PARAMETERS) == {public_id(one) for one in CATALOGUE}
    assert {path.stem for path in FIGURES.glob("*.png")} == set(EXAMPLES)
    assert set(EXAMPLES) == sections - {"parameter_change"}


def test_figures_are_small():
    assert sum(path.stat().st_size for path in FIGURES.iterdir()) < 1.5e6


def test_a_check_tells_that_the_document_is_out_of_date(tmp_path, monkeypatch, capsys):
    old = tmp_path / "effects.md"
    monkeypatch.setattr(effects_document, "DOCUMENT", old)
    assert main(["--check"]) == 1
    assert "out of date" in capsys.readouterr().err
    old.write_text(document())
    assert main(["--check"]) == 0


@pytest.mark.parametrize(
    ("identifier", "row"),
    [
        ("quadratic_drag", "| drag_N_s2_per_m2 | N s^2/m^2 | 0.05, 0.2 x F / V^2 |"),
        (
            "rate_limit",
            "A/s | 0.01, 0.03, 0.08, 0.2, 0.4, 0.7 x R | 0.0001 x R to 1 x R |",
        ),
        ("cogging", "0.005 x S to 0.333 x S |"),
    ],
)
def test_rules_are_written_as_shares_of_the_scales(identifier, row):
    section = document().split(f"## {identifier}\n")[1].split("\n## ")[0]
    assert row in section
