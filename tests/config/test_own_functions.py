import pytest

from hwid_cli.config.load import load_experiment
from hwid_cli.config.own_functions import read_own_function
from hwid_cli.errors import ConfigError
from hwid_cli.records.maps import OwnFunction

SOURCE = "curve = 1\n"
SECTION = "name: tiny\nfit: {input_map: {file: maps/my_map.py, name: curve}}\n"


@pytest.fixture
def write_map(tmp_path):
    def write(text=SOURCE, encoding="utf-8"):
        path = tmp_path / "maps" / "my_map.py"
        path.parent.mkdir()
        path.write_bytes(text.encode(encoding))
        return path

    return write


def test_section_names_a_file_beside_the_configuration(write_config, write_map):
    write_map()
    options = load_experiment(write_config(SECTION)).fit
    assert options.input_map == "own_function"
    assert options.of_input.function == OwnFunction("curve", SOURCE)
    assert options.of_output.function is None


def test_python_may_read_a_file_itself(write_map):
    assert read_own_function(write_map(), "curve").source == SOURCE


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            "{file: a.py}",
            r"fit.input_map.name: missing; expected text; add the key",
        ),
        ("{file: 3, name: a}", r"fit.input_map.file: found 3; expected text"),
        (
            "{fil: a.py, name: a}",
            r"fit.input_map.fil: unknown key; did you mean 'file'",
        ),
        (
            "{file: a.py, name: a}",
            r"fit.input_map.file: found .*a.py', No such file .*;",
        ),
        (
            "own_function",
            r"fit.input_map: 'own_function' needs a function; name its file",
        ),
        ("sigmoid", r"fit.input_map: found 'sigmoid'; did you mean 'sigmoid_net"),
    ],
)
def test_section_that_cannot_be_used_is_one_line(write_config, section, message):
    with pytest.raises(ConfigError, match=message) as caught:
        load_experiment(write_config(f"name: tiny\nfit: {{input_map: {section}}}\n"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "encoding", "message"),
    [
        (
            "curve = (\n",
            "utf-8",
            r"fit.input_map.file: .* no Python text in line 1: '\('",
        ),
        ("curve = '\u00fc'\n", "latin-1", "is no Python text: .*invalid start byte"),
        ("curv = 1\n", "utf-8", r"fit.input_map: .* defines no 'curve'; did you mean"),
        ("import maps\n", "utf-8", r"defines no .curve.; expected curve = MapFunction"),
    ],
)
def test_file_that_cannot_be_used_is_one_line(
    write_config, write_map, text, encoding, message
):
    write_map(text, encoding)
    with pytest.raises(ConfigError, match=message) as caught:
        load_experiment(write_config(SECTION))
    assert "\n" not in str(caught.value)


def test_function_is_no_key_of_its_own(write_config):
    with pytest.raises(ConfigError, match=r"fit.input_function: unknown key"):
        load_experiment(write_config("name: tiny\nfit: {input_function: 1}\n"))


@pytest.mark.parametrize(
    ("fit", "message"),
    [
        (
            "{input_units: 1}",
            r"fit.input_units: found 1; expected an integer >= 2 for piece",
        ),
        ("{output_units: 2.5}", r"fit.output_units: found 2.5; expected an integer"),
    ],
)
def test_units_of_one_side_are_checked(write_config, fit, message):
    with pytest.raises(ConfigError, match=message):
        load_experiment(write_config(f"name: tiny\nfit: {fit}\n"))


def test_sides_have_their_own_kind_and_units(write_config):
    text = (
        "name: tiny\nfit: {input_map: sigmoid_network, input_units: 1, "
        "output_map: cubic_spline, units: 6}\n"
    )
    options = load_experiment(write_config(text)).fit
    assert (options.of_input.kind, options.of_input.units) == ("sigmoid_network", 1)
    assert (options.of_output.kind, options.of_output.units) == ("cubic_spline", 6)
