import csv
from dataclasses import replace

import h5py
import numpy as np
import pytest

from hwid_cli.errors import CacheError
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.store.diagnosis_results import (
    write_diagnosis_tables,
    write_simulated_csv,
)
from hwid_cli.store.result_files import Provenance, read_provenance, read_stage_key
from hwid_cli.store.stage_records import read_stage_record, write_stage_record
from tests.report.diagnosis_examples import named, nothing_missing, unknown
from tests.store.record_examples import assert_same, plant


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("make", [named, unknown, nothing_missing])
def test_a_diagnosis_comes_back_bit_by_bit(tmp_path, make):
    path = tmp_path / "results.h5"
    write_stage_record(path, "diagnose", make(), Provenance("k1", seconds=2.5))

    assert_same(read_stage_record(path, "diagnose", Diagnosis), make())
    assert read_stage_key(path, "diagnose") == "k1"
    assert read_provenance(path, "diagnose").seconds == 2.5


def test_a_later_diagnosis_takes_the_place_of_the_first(tmp_path):
    path = tmp_path / "results.h5"
    write_stage_record(path, "diagnose", named(), Provenance("k1"))
    write_stage_record(path, "diagnose", nothing_missing(), Provenance("k2"))

    assert_same(read_stage_record(path, "diagnose", Diagnosis), nothing_missing())
    assert read_stage_key(path, "diagnose") == "k2"


def test_a_damaged_diagnosis_is_one_line_with_the_next_step(tmp_path):
    path = tmp_path / "results.h5"
    write_stage_record(path, "diagnose", named(), Provenance("k1"))
    with h5py.File(path, "r+") as file:
        del file["diagnose/gaps"]

    with pytest.raises(CacheError, match=r"results of diagnose; .*'hwid diagnose'"):
        read_stage_record(path, "diagnose", Diagnosis)


@pytest.mark.parametrize(
    ("place", "value"),
    [("latent_force/0/at", np.nan), ("overlays/0/time_s", 1e308)],
    ids=["force", "overlay"],
)
def test_a_planted_number_is_one_line_with_its_place(tmp_path, place, value):
    path = tmp_path / "results.h5"
    write_stage_record(path, "diagnose", named(), Provenance("k1"))
    plant(path, f"diagnose/{place}", [value, 1.0])

    group, name = place.rsplit("/", 1)
    with pytest.raises(
        CacheError,
        match=rf"/diagnose/{group}: {name} must be finite numbers up to 1e\+130, got "
        rf".* run 'hwid diagnose' again",
    ):
        read_stage_record(path, "diagnose", Diagnosis)


@pytest.mark.parametrize(
    ("place", "says"),
    [
        ("latent_force/0/spread", r"at \(\d+,\), mean \(\d+,\), spread \(1,\)"),
        ("overlays/0/after", r"time_s \(\d+,\), .*, after \(1,\)"),
    ],
)
def test_curves_of_different_lengths_are_one_line(tmp_path, place, says):
    path = tmp_path / "results.h5"
    write_stage_record(path, "diagnose", named(), Provenance("k1"))
    plant(path, f"diagnose/{place}", [1.0])

    with pytest.raises(CacheError, match=f"{says}.* must have one shape"):
        read_stage_record(path, "diagnose", Diagnosis)


def test_the_ranking_lists_every_candidate_best_first(tmp_path):
    write_diagnosis_tables(tmp_path, named())
    rows = rows_of(tmp_path / "ranking.csv")

    candidates = named().candidates
    assert [row["rank"] for row in rows] == [str(n + 1) for n in range(len(candidates))]
    assert rows[0]["effects"] == "coulomb_friction"
    assert "coulomb_friction+quadratic_drag" in [row["effects"] for row in rows]
    (base,) = [row for row in rows if row["effects"] == "base"]
    assert base["is_fitted"] in ("0", "1")
    for row, one in zip(rows, candidates, strict=True):
        for name in ("forecast_share", "train_rms", "held_out_rms", "bic_gain"):
            # Text keeps every digit.
            np.testing.assert_equal(float(row[name]), getattr(one, name))


def test_every_place_and_every_recording_has_a_row(tmp_path):
    diagnosis = replace(named(), places=named().places[:3])
    write_diagnosis_tables(tmp_path, diagnosis)
    places, gaps = rows_of(tmp_path / "where.csv"), rows_of(tmp_path / "gaps.csv")

    assert [row["sentence"] for row in places] == [
        one.sentence for one in diagnosis.places
    ]
    assert [row["recording"] for row in gaps] == [one.name for one in diagnosis.gaps]
    held_out = {row["recording"] for row in gaps if row["is_held_out"] == "1"}
    assert held_out == {one.name for one in diagnosis.gaps if one.is_held_out}
    assert float(gaps[0]["rms_after"]) == diagnosis.gaps[0].rms_after


def test_without_places_and_candidates_the_tables_have_heads_only(tmp_path):
    write_diagnosis_tables(tmp_path, nothing_missing())

    assert rows_of(tmp_path / "where.csv") == []
    assert (tmp_path / "ranking.csv").read_text().startswith("rank,effects,")


def test_simulated_curves_keep_every_digit(tmp_path):
    curves = [np.random.default_rng(n).normal(size=7) for n in range(4)]
    write_simulated_csv(tmp_path / "deep" / "a.csv", curves)
    rows = rows_of(tmp_path / "deep" / "a.csv")

    assert list(rows[0]) == ["time_s", "input", "measured", "simulated"]
    found = [[float(row[name]) for row in rows] for name in rows[0]]
    np.testing.assert_array_equal(found, curves)
