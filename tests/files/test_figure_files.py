import io

import pytest

from hwid_cli.files.figure_files import read_figure, write_figure


@pytest.fixture
def png():
    from matplotlib.figure import Figure

    buffer = io.BytesIO()
    Figure((1, 1)).savefig(buffer, format="png")
    return buffer.getvalue()


def test_figure_is_whole_and_stays_a_picture(tmp_path, png):
    from matplotlib.image import imread

    path = tmp_path / "folder" / "a.png"
    write_figure(path, png, "key a")

    assert read_figure(path, "key a") == path.read_bytes()
    assert imread(path).shape == imread(io.BytesIO(png)).shape


@pytest.mark.parametrize("about", ["key b", "other a"])
def test_figure_of_something_else_is_not_taken(tmp_path, png, about):
    write_figure(tmp_path / "a.png", png, "key a")

    assert read_figure(tmp_path / "a.png", about) is None


@pytest.mark.thorough
def test_any_byte_that_changed_or_is_missing_is_noticed(tmp_path, png):
    path = tmp_path / "a.png"
    write_figure(path, png, "key a")
    content = path.read_bytes()
    for at in range(len(content)):
        path.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
        assert read_figure(path, "key a") is None, at
        path.write_bytes(content[:at])
        assert read_figure(path, "key a") is None, at


def test_figure_that_is_there_is_not_written_again(tmp_path, png):
    path = tmp_path / "a.png"
    write_figure(path, png, "key a")
    number = path.stat().st_ino
    write_figure(path, png, "key a")

    assert path.stat().st_ino == number
