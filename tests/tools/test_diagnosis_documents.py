"""Documents of diagnoses: made from results folders, honest about what has not run."""

import csv
import json
import sys

import pytest

from tools import gun_diagnosis, real_diagnosis

FOUND = {
    "verdict": "named",
    "complete": False,
    "summary": "The simulation lacks coulomb_friction.",
    "effects": [
        {
            "id": "coulomb_friction",
            "parameters": {"force_N": {"value": 4.98, "ci95": [4.9, 5.1]}},
        }
    ],
    "gap": {
        "noise_rms": 1e-4,
        "before": {"held_out_rms": 2.5e-3},
        "after": {"held_out_rms": 2.7e-4},
        "explained_share": 0.99,
        "unit": "m",
    },
    "base": {
        "before": {"damping_N_s_per_m": 20.0},
        "after": {"damping_N_s_per_m": 15.0},
    },
    "where": [{"sentence": "the missing force goes with the velocity"}],
    "seconds": 12.3,
}
GAPS = [
    {"recording": "a", "is_held_out": "0", "rms_given": 1.0, "rms_before": 2e-3, "rms_after": 1e-4},
    {"recording": "b", "is_held_out": "1", "rms_given": 1.0, "rms_before": 3e-3, "rms_after": 5e-4},
]  # fmt: skip
RANKING = [
    {"effects": "coulomb_friction", "is_fitted": "1", "explained_share": 0.99},
    {"effects": "rate_limit", "is_fitted": "0", "explained_share": "nan"},
]


def write(path, rows):
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


@pytest.fixture
def results(tmp_path):
    for name in ("diagnose_gun", "diagnose_hsm150"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "diagnosis.json").write_text(json.dumps(FOUND))
        write(folder / "gaps.csv", GAPS)
        write(folder / "ranking.csv", RANKING)
    return tmp_path


def said_by(module, folder, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["document", str(folder)])
    module.main()
    return capsys.readouterr().out


def test_the_gun_is_told_with_what_is_inside(results, monkeypatch, capsys):
    said = said_by(gun_diagnosis, results / "diagnose_gun", monkeypatch, capsys)
    assert "| dry friction | 4.8 N sliding, 7.2 N to break away |" in said
    assert "- `coulomb_friction`: force_N 4.98 (4.9 to 5.1)" in said
    assert "25.0 times the noise before, 2.7 after" in said
    assert "| coulomb_friction | 99.0% |" in said
    assert "rate_limit" not in said
    # The worst first.
    assert said.index("| b | yes | 0.003 | 0.0005 |") < said.index("| a |  |")


def test_machines_without_results_are_said_to_have_none(results, monkeypatch, capsys):
    said = said_by(real_diagnosis, results, monkeypatch, capsys)
    assert "| emps | no results |" in said
    assert "| hsm150 | named, something remains | `coulomb_friction`" in said
    assert "## HSM150: each recording" in said
    assert "## EMPS" not in said


def test_what_has_no_name_and_what_is_a_law_have_rows_as_well():
    nothing = {
        **FOUND,
        "verdict": "unknown",
        "effects": [],
        "gap": {
            **FOUND["gap"],
            "after": {"held_out_rms": None},
            "explained_share": None,
        },
    }
    law = {
        **FOUND,
        "verdict": "law",
        "law": {"acts_on": "force", "formula": "-17.1*abs(x)*v"},
    }

    said = real_diagnosis.overview({"table": nothing, "oscillator": law})

    assert "| table | unknown | - | 0.0025 m | - | 0.0001 | - | 12 |" in said
    assert "| oscillator | law | force: `-17.1*abs(x)*v` | 0.0025 m |" in said
