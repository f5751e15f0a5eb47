"""Names of files of models that were fitted to many recordings."""

from hwid_cli.export.names import file_stem
from hwid_cli.files.stems import shortened_stem
from hwid_cli.report.page import file_names

LONG = "+".join(f"2026-11-30_axis_left_stage_run{n:02}_step_1_warm" for n in range(8))


def test_a_long_name_is_a_file_that_a_disk_takes(tmp_path):
    for stem in (file_stem(f"{LONG}/1/2"), file_names([f"{LONG}/1/2"])[f"{LONG}/1/2"]):
        (tmp_path / f"{stem}_step_response.json").write_text("")
        assert stem.startswith("2026-11-30_axis_left_stage_run00")
        assert stem.endswith("_warm_1_2")


def test_long_names_that_differ_in_their_middle_are_two_files():
    other = LONG.replace("run04", "run14")
    assert file_stem(f"{LONG}/1/2") != file_stem(f"{other}/1/2")
    assert len(set(file_names([LONG, other]).values())) == 2


def test_letters_of_several_bytes_are_cut_whole(tmp_path):
    stem = shortened_stem("\u00e4" * 150)
    (tmp_path / f"{stem}.json").write_text("")
    assert len(stem.encode()) <= 200
