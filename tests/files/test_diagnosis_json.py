import pytest

from hwid_cli.errors import CacheError
from hwid_cli.files.diagnosis_json import read_diagnosis


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
