import zipfile
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from hwid_cli.errors import ConfigError
from hwid_cli.export.formats import write_exported
from hwid_cli.export.predict import predict
from tests.export.fmu_runs import answered, simulated
from tests.export.model_examples import (
    STARTS,
    deviation,
    example_input,
    example_model,
    exported_of,
)

STEP = 1e-3
# As for the C source that it is built from.
PROMISED = 1e-12


@pytest.fixture
def exported():
    return exported_of(example_model(2, nb=2, nf=3, nk=2))


@pytest.fixture
def unit(exported, tmp_path):
    return write_exported(tmp_path, exported, "fmu")[0]


def test_fmpy_finds_no_fault_and_simulates_the_same(unit, exported):
    u = example_input(1, 200)

    assert validate_fmu(str(unit)) == []
    for name, start in STARTS.items():
        expected = predict(exported, u, initial_state=name)
        assert deviation(simulated(unit, u, STEP, start), expected) <= PROMISED


@pytest.mark.thorough
def test_without_a_delay_the_output_answers_to_the_input_of_its_instant(tmp_path):
    exported = exported_of(example_model(2, nb=2, nf=3, nk=0))
    unit = write_exported(tmp_path, exported, "fmu")[0]
    u = example_input(1, 100)

    assert validate_fmu(str(unit)) == []
    assert deviation(answered(unit, u, STEP), predict(exported, u)) <= PROMISED


def test_a_step_of_another_length_is_refused(unit):
    with pytest.raises(FMICallException):
        answered(unit, np.ones(3), 0.4 * STEP)


@pytest.mark.thorough
def test_the_sources_are_inside_and_equal_models_give_equal_files(
    unit, exported, tmp_path
):
    again = write_exported(tmp_path / "again", exported, "fmu")[0]

    assert {"sources/model.c", "sources/fmi2.c", "modelDescription.xml"} < set(
        zipfile.ZipFile(unit).namelist()
    )
    assert unit.read_bytes() == again.read_bytes()


@pytest.mark.thorough
def test_a_name_with_any_characters_gives_a_valid_unit(tmp_path):
    exported = exported_of(example_model(1), name='7b<&"+x/1/2', output_unit="<m>")
    unit = write_exported(tmp_path, exported, "fmu")[0]

    assert validate_fmu(str(unit)) == []


@pytest.mark.parametrize(
    ("compiler", "said"),
    [("no-such-compiler", "no C compiler"), ("false", "false failed")],
)
def test_without_a_compiler_there_is_one_line(
    compiler, said, exported, tmp_path, monkeypatch
):
    monkeypatch.setenv("CC", compiler)
    with pytest.raises(ConfigError, match=f"--format fmu: {said}.*use --format c"):
        write_exported(tmp_path, exported, "fmu")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.thorough
@pytest.mark.parametrize("sign", ["\uffff", "\ufffe", "\U0001f600", "\x0b", "é"])
def test_a_name_that_xml_has_no_place_for_leaves_a_document(tmp_path, sign):
    exported = exported_of(example_model(5), name=f"a{sign}b/1/2", output_unit=sign)
    path = write_exported(tmp_path, exported, "fmu")[0]
    with zipfile.ZipFile(path) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))

    found = root.get("description")
    assert f"a{sign}b" in found or "a\ufffdb" in found
