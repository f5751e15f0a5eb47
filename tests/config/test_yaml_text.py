import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.config.yaml_text import read_yaml, yaml_text
from hwid_cli.errors import ConfigError


def test_numbers_with_an_exponent_and_no_point_are_numbers(write_config):
    content = read_yaml(write_config("a: 1e-3\nb: -2E5\nc: 10\nd: 1e-3x\n"))
    assert content == {"a": 1e-3, "b": -2e5, "c": 10, "d": "1e-3x"}


def test_repeated_key_is_refused_with_both_lines(write_config):
    path = write_config("name: a\nfit:\n  units: 3\n  degree: 2\n  units: 4\n")
    with pytest.raises(ConfigError, match=r"tiny.yaml, line 5: key 'units' is given"):
        read_yaml(path)
    with pytest.raises(ConfigError, match=r"first in line 3; keep one of them$"):
        read_yaml(path)


def test_key_of_a_merged_mapping_may_be_given_again(write_config):
    content = read_yaml(write_config("a: &a {x: 1, y: 2}\nb:\n  <<: *a\n  x: 3\n"))
    assert content["b"] == {"x": 3, "y": 2}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name: [1, 2\nfit: 3\n", r"line 2: .*expected valid YAML"),
        ("name: a\n\tfit: 3\n", r"line 2: begins with a tab; expected blanks"),
        ("name: !!python/name:os.system\n", r"line 1: could not determine"),
        ("name: a: b\n", r"line 1: mapping values are not allowed here"),
        ("a: \x00\n", r"expected valid YAML"),
    ],
)
def test_faulty_yaml_is_one_line_with_its_place(write_config, text, message):
    with pytest.raises(ConfigError, match=message) as caught:
        read_yaml(write_config(text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "found"), [("", "nothing"), ("- a\n", "a list"), ("hello\n", "text")]
)
def test_file_without_sections_is_refused(write_config, text, found):
    with pytest.raises(ConfigError, match=f"holds {found}; expected sections"):
        read_yaml(write_config(text))


def test_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"nowhere.yaml: no such file; .*check the"):
        read_yaml(tmp_path / "nowhere.yaml")


def test_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "binary.yaml"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ConfigError, match=r"binary.yaml: cannot be read .* in UTF-8"):
        read_yaml(path)


def test_byte_order_mark_is_no_part_of_the_first_key(tmp_path):
    path = tmp_path / "bom.yaml"
    path.write_bytes(b"\xef\xbb\xbfname: a\n")
    assert read_yaml(path) == {"name": "a"}


@given(
    st.recursive(
        st.floats(allow_nan=False, allow_infinity=False)
        | st.integers()
        | st.booleans()
        # Control characters have no place in YAML without escapes; names hold none.
        | st.text(st.characters(exclude_categories=["C"])),
        lambda inner: (
            st.lists(inner) | st.dictionaries(st.text("abc1e-.", min_size=1), inner)
        ),
        max_leaves=8,
    )
)
def test_what_is_written_is_read_back_to_the_same_values(tmp_path_factory, value):
    path = tmp_path_factory.mktemp("yaml") / "any.yaml"
    path.write_text(yaml_text({"value": value}), encoding="utf-8")
    found = read_yaml(path)["value"]

    assert found == value
    # 1 equals 1.0 and True, which no configuration may mix up.
    assert repr(found) == repr(value)


def test_text_that_reads_like_a_number_is_quoted(write_config):
    text = yaml_text({"a": "1e3", "b": "-2E-5", "c": "12", "d": 1e-5})
    assert read_yaml(write_config(text)) == {
        "a": "1e3",
        "b": "-2E-5",
        "c": "12",
        "d": 1e-5,
    }
