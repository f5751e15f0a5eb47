import json
import math
from dataclasses import replace

import pytest

from hwid_cli.errors import CacheError
from hwid_cli.records.diagnosis import FittedEffect, FittedParameter, Gap
from hwid_cli.store.diagnosis_results import read_diagnosis, write_diagnosis_json
from hwid_cli.store.result_files import Provenance
from tests.report.diagnosis_examples import named, nothing_missing, unknown

NAN = float("nan")
ORIGIN = Provenance("k1", {"name": "tiny"}, {"step_00": "ab"}, 2.3, {"hwid": "0.1.0"})


@pytest.fixture
def written(tmp_path):
    """Write a diagnosis and give the file's content."""

    def write(diagnosis, **more):
        path = tmp_path / "diagnosis.json"
        write_diagnosis_json(path, diagnosis, 2.3, ORIGIN, **more)
        return json.loads(path.read_text(encoding="utf-8"), parse_constant=_refuse)

    return write


def _refuse(text):
    raise AssertionError(f"{text} is no JSON")


def test_a_diagnosis_comes_back(tmp_path):
    path = tmp_path / "diagnosis.json"
    path.write_text('{"verdict": "none"}')

    assert read_diagnosis(path) == {"verdict": "none"}


def test_no_file_is_no_diagnosis(tmp_path):
    assert read_diagnosis(tmp_path / "diagnosis.json") is None


@pytest.mark.parametrize("text", ["{", "[1]", '"named"'])
def test_anything_else_is_one_line_with_the_next_step(tmp_path, text):
    path = tmp_path / "diagnosis.json"
    path.write_text(text)

    with pytest.raises(CacheError, match=r"diagnosis\.json: .*run 'hwid diagnose'"):
        read_diagnosis(path)


def test_every_key_of_the_design_is_there(written):
    found = written(named())

    assert {
        "verdict",
        "complete",
        "effects",
        "ambiguous_with",
        "gap",
        "base",
        "where",
        "not_observable",
        "warnings",
        "next_experiment",
        "recordings",
        "seconds",
    } <= set(found)
    assert (found["verdict"], found["complete"], found["seconds"]) == (
        "named",
        True,
        2.3,
    )
    (effect,) = found["effects"]
    assert set(effect) == {"id", "sentence", "equation", "parameters"}
    assert effect["parameters"] == {
        "force_N": {"value": 0.8123, "ci95": [0.7902, 0.8344]}
    }
    assert set(found["gap"]) >= {"noise_rms", "before", "after", "explained_share"}
    assert found["gap"]["before"] == {
        "train_rms": 4.4e-4,
        "held_out_rms": 4.7e-4,
        "ratio_to_noise": 22.4,
    }
    assert found["gap"]["given"]["train_rms"] == 7.1e-4
    assert found["gap"]["noise_rms"] == 2.1e-5
    assert set(found["where"][0]) >= {"variable", "share", "sentence"}
    assert set(found["next_experiment"]) == {"input", "reason"}
    assert found["recordings"] == {
        "train": list(named().train),
        "held_out": list(named().held_out),
    }


@pytest.mark.parametrize(
    ("record", "same"),
    [(named(), "before"), (nothing_missing("parameters"), "after")],
)
def test_the_gap_of_the_refitted_base_stands_under_its_own_name(written, record, same):
    gap = written(record)["gap"]
    assert gap["refitted"] == gap[same]
    assert gap["given"]["ratio_to_noise"] == 35.2
    assert (gap["before"] == gap["given"]) == (record.verdict == "parameters")


def test_base_is_as_given_and_as_fitted_with_the_effects(written):
    base = written(named())["base"]

    assert base["before"]["damping_N_s_per_m"] == 15.0
    assert base["refitted"]["damping_N_s_per_m"] == 17.2
    assert base["after"]["damping_N_s_per_m"] == 15.1


def test_effects_that_were_there_and_references_are_told(written):
    diagnosis = named()
    found = written(
        replace(
            diagnosis,
            effects=(),
            present=diagnosis.effects,
            reference_current_A=4.5,
            reference_displacement_m=0.02,
        )
    )

    assert [one["id"] for one in found["present"]] == ["coulomb_friction"]
    assert found["reference"] == {"current_A": 4.5, "displacement_m": 0.02}


def test_effects_that_were_there_have_the_values_that_they_were_given_as(written):
    (effect,) = named().effects
    (parameter,) = effect.parameters
    moved = replace(parameter, before=0.5, refitted=0.9)
    present = replace(effect, parameters=(moved,))
    found = written(replace(named(), present=(present,)))["present"][0]["parameters"]

    assert found["force_N"]["given"] == 0.5
    assert found["force_N"]["refitted"] == 0.9


def test_all_places_are_there_in_their_order(written):
    found = written(named())["where"]

    assert [one["sentence"] for one in found] == [
        one.sentence for one in named().places
    ]


def test_a_set_of_effects_is_a_list_of_ids(written):
    found = written(named())["ambiguous_with"]

    assert found == ["stribeck_friction", ["hysteresis", "cogging"]]


def test_a_parameter_that_is_a_word_has_it_as_its_value(written):
    effect = FittedEffect(
        "parameter_change",
        "The stiffness differs.",
        "k (1 + s)",
        (
            FittedParameter("which", NAN, text="stiffness"),
            FittedParameter("spread", 0.05, NAN, 0.08),
        ),
    )
    (found,) = written(replace(named(), effects=(effect,)))["effects"]

    assert found["parameters"] == {
        "which": {"value": "stiffness", "ci95": None},
        "spread": {"value": 0.05, "ci95": [None, 0.08]},
    }


def test_what_is_missing_or_infinite_is_null(written):
    gap = Gap(math.inf, NAN, NAN)
    found = written(replace(unknown(), after=gap, explained_share=NAN))

    assert found["gap"]["after"] == {
        "train_rms": None,
        "held_out_rms": None,
        "ratio_to_noise": None,
    }
    assert found["gap"]["explained_share"] is None
    # A place without an RMS.
    assert None in [place["rms"] for place in found["where"]]


def test_where_nothing_is_missing_the_lists_are_empty(written):
    found = written(nothing_missing())

    assert (found["verdict"], found["effects"], found["where"]) == ("none", [], [])


def test_figures_and_provenance_are_told(written):
    found = written(named(), figures=["diagnosis_gap.png"])

    assert found["figures"] == ["diagnosis_gap.png"]
    assert found["provenance"]["key"] == "k1"
    assert found["provenance"]["inputs"] == {"step_00": "ab"}
    assert found["provenance"]["versions"] == {"hwid": "0.1.0"}
    assert len(found["provenance"]["config_sha256"]) == 64


def test_the_same_diagnosis_gives_the_same_bytes(written, tmp_path):
    written(named())
    before = (tmp_path / "diagnosis.json").read_bytes()
    written(named())

    assert (tmp_path / "diagnosis.json").read_bytes() == before


def test_a_changed_number_is_not_believed(tmp_path, written):
    written(named())
    path = tmp_path / "diagnosis.json"
    assert "sha256" not in read_diagnosis(path)
    text = path.read_text()
    path.write_text(text.replace('"seconds": ', '"seconds": 1'))

    with pytest.raises(CacheError, match="content and checksum do not match"):
        read_diagnosis(path)


def test_parameters_of_the_base_have_an_interval_or_null(written):
    first, *others = named().base
    found = written(replace(named(), base=(replace(first, low=1.0, high=2.0), *others)))
    intervals = found["base"]["ci95"]
    assert intervals.pop(first.name) == [1.0, 2.0]
    assert set(intervals.values()) == {None}
    assert set(found["base"]["after"]) == {first.name, *intervals}
