"""docs/effects.md says what the catalogue says."""

from dataclasses import replace

import pytest

from hwid_cli.drive.catalogue import CATALOGUE, configured_effects
from tools import effects_document
from tools.effects_document import (
    DOCUMENT,
    FIGURES,
    README,
    document,
    effects_by_public_id,
    main,
    readme,
)
from tools.effects_figures import EXAMPLES, OVER, draw, example


def test_the_documents_are_up_to_date():
    assert DOCUMENT.read_text() == document(), "run 'make effects'"
    assert README.read_text() == readme(README.read_text()), "run 'make effects'"


def test_every_effect_has_a_section_and_a_figure():
    sections = {line[3:] for line in document().splitlines() if line.startswith("## ")}
    assert sections == set(configured_effects())
    assert {path.stem for path in FIGURES.glob("*.png")} == set(effects_by_public_id())


def test_what_figures_choose_by_hand_is_of_the_catalogue():
    for identifier, values in EXAMPLES.items():
        names = {one.name for one in CATALOGUE[identifier].parameters}
        assert set(values) <= names
    assert set(OVER) <= set(CATALOGUE)


def test_an_effect_without_an_entry_of_its_own_is_drawn_at_its_last_start(tmp_path):
    new = replace(CATALOGUE["quadratic_drag"], id="new")
    # A fifth of 25 N at 1 m/s.
    assert example(new) == {"drag_N_s2_per_m2": pytest.approx(5.0)}
    assert example(CATALOGUE["quadratic_drag"]) == EXAMPLES["quadratic_drag"]

    target = tmp_path / "new.png"
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(CATALOGUE, "new", new)
        draw(new, target)
    assert target.stat().st_size > 5000


def test_the_table_of_the_configuration_names_every_key():
    text = readme(README.read_text())
    rows = [line for line in text.splitlines() if line.startswith("| `cogging` |")]
    assert len(rows) == 1
    assert rows[0].endswith(
        "| `amplitude_N`, `period_m` (`phase_rad`, `zero_at` (`mean`)) |"
    )
    assert r"F = -d v \|v\| |" in text


def test_figures_are_small():
    assert sum(path.stat().st_size for path in FIGURES.iterdir()) < 1.5e6


def test_a_check_tells_that_the_document_is_out_of_date(tmp_path, monkeypatch, capsys):
    old = tmp_path / "effects.md"
    table = tmp_path / "README.md"
    table.write_text(README.read_text().replace(" F = F0 |", " F = F1 |"))
    monkeypatch.setattr(effects_document, "README", table)
    monkeypatch.setattr(effects_document, "DOCUMENT", old)
    assert main(["--check"]) == 1
    assert capsys.readouterr().err.count("out of date") == 2
    old.write_text(document())
    assert main(["--check"]) == 1
    table.write_text(README.read_text())
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
