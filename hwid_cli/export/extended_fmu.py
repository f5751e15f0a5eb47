"""A simulation that is an FMU, with effects inside: an FMU around the one that was given.

The given one lies in the resources and does all the work; the effects are C source,
compiled for this platform. Co-simulation of FMI 2.0.
"""

import io
import platform
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

from hwid_cli import __version__
from hwid_cli.errors import ConfigError
from hwid_cli.export.c_source import number
from hwid_cli.export.effect_source import acts_at_force, effect_source
from hwid_cli.export.fmu import SYSTEMS, add_file, compiled, unit_sources
from hwid_cli.files.atomic import replace_file
from hwid_cli.records.exported import ModelCard
from hwid_cli.records.programs import FmuSimulation
from hwid_cli.simulations.extended import ExtendedSimulation

# Steps of the effects in one sample of the recordings: a force is held in each of them.
_STEPS_A_SAMPLE = 10
# What the unit around cannot do, whatever the given one can.
_CANNOT = (
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "providesDirectionalDerivative",
    "canInterpolateInputs",
    "canRunAsynchronuously",
)
_NONE = "0xffffffff"


@dataclass(frozen=True, eq=False)
class _Given:
    """The FMU that was given."""

    root: ET.Element
    unit: ET.Element
    references: Mapping[str, int]
    files: Mapping[str, bytes]

    @property
    def identifier(self) -> str:
        """Name of its binary."""
        return self.unit.attrib["modelIdentifier"]

    @property
    def is_sampled(self) -> bool:
        """Whether it moves in steps of its own alone."""
        can = self.unit.get("canHandleVariableCommunicationStepSize", "false")
        return can != "true"


def write_extended_fmu(
    path: Path, extended: ExtendedSimulation, card: ModelCard, sample_time_s: float
) -> None:
    """Write an FMU that contains the given one and the effects.

    Parameters
    ----------
    extended : ExtendedSimulation
        Of an FMU.
    sample_time_s : float, [s]
        Of the recordings.

    Raises
    ------
    ConfigError
        If it is none of FMI 2, an effect cannot be told step by step, or there is no C
        compiler.
    CacheError
        If the file cannot be written.
    """
    base = extended.base
    if not isinstance(base, FmuSimulation):
        raise TypeError(f"no FMU: {base!r}")
    given = _read(Path(base.file))
    step = _step(base, given, sample_time_s)
    effect = effect_source(extended, card, step)
    system, ending = SYSTEMS.get(platform.system(), ("linux", ".so"))
    bits = platform.architecture()[0][:2]
    folder = f"binaries/{system}{bits}/"
    name = f"{given.identifier}_extended"
    words = _words(extended, given, f"{folder}{given.identifier}{ending}", step)
    guid = f"{{{uuid.uuid5(uuid.NAMESPACE_URL, effect + repr(sorted(words.items())))}}}"
    sources = {
        "effect.c": effect,
        **unit_sources("extended_fmi2.c", {**words, "guid": guid}),
    }
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        add_file(archive, "modelDescription.xml", _description(extended, given, guid))
        for file_name, text in sources.items():
            add_file(archive, f"sources/{file_name}", text)
        binary = compiled(sources, f"{name}{ending}", main="extended_fmi2.c")
        add_file(archive, f"{folder}{name}{ending}", binary)
        for file_name, data in given.files.items():
            is_other = file_name.startswith("binaries/") and folder not in file_name
            if not is_other:
                add_file(archive, f"resources/base/{file_name}", data)
    replace_file(path, content.getvalue())


def _read(file: Path) -> _Given:
    with zipfile.ZipFile(file) as archive:
        files = {
            one: archive.read(one)
            for one in archive.namelist()
            if not one.endswith("/")
        }
    text = files["modelDescription.xml"]
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        # Entities can grow without an end, and no FMU needs them.
        raise ConfigError(
            f"--format fmu: simulation.file: {file.name}: modelDescription.xml declares "
            "entities; expected plain XML; export the FMU again"
        )
    root = ET.fromstring(text)
    version, unit = root.get("fmiVersion", ""), root.find("CoSimulation")
    if not version.startswith("2") or unit is None:
        raise ConfigError(
            f"--format fmu: simulation.file: {file.name} is of FMI {version}; expected "
            "co-simulation of FMI 2 to build around; use --format python"
        )
    references = {
        one.attrib["name"]: int(one.attrib["valueReference"])
        for one in root.iter("ScalarVariable")
    }
    return _Given(root, unit, references, files)


def _step(base: FmuSimulation, given: _Given, sample_time_s: float) -> float:
    """Step of the effects: the given unit's own where it has one."""
    if given.is_sampled:
        return base.step_s or sample_time_s
    asked = 1 if base.step_s is None else round(sample_time_s / base.step_s)
    return sample_time_s / max(asked, _STEPS_A_SAMPLE)


def _words(
    extended: ExtendedSimulation, given: _Given, binary: str, step: float
) -> dict[str, object]:
    base, references = extended.base, given.references
    fitted = base.values
    return {
        "sample_time": repr(step),
        "base_guid": given.root.attrib["guid"],
        "binary": binary,
        "n_fitted": len(fitted),
        "fitted_at": ", ".join([*(f"{references[one]}u" for one in fitted), "0u"]),
        "fitted": ", ".join([*(number(one) for one in fitted.values()), "0.0"]),
        "input_at": references[base.input],
        "output_at": references[base.output],
        "has_force": int(base.force_input is not None),
        "force_at": references.get(base.force_input or "", _NONE),
        "has_velocity": int(base.velocity is not None),
        "velocity_at": references.get(base.velocity or "", _NONE),
        "at_force": int(acts_at_force(extended)),
    }


def _description(extended: ExtendedSimulation, given: _Given, guid: str) -> bytes:
    """The given description with another name, its parameters as fitted."""
    root = ET.fromstring(given.files["modelDescription.xml"])
    effects = ", ".join(extended.stand_in.effects) or "no effect"
    root.set("guid", guid)
    root.set("modelName", f"{root.get('modelName', '')} extended")
    root.set("description", f"{root.get('description', '')} With {effects}.".strip())
    root.set("generationTool", f"hwid {__version__}")
    for one in root.findall("ModelExchange"):
        root.remove(one)
    unit = root.find("CoSimulation")
    if unit is None:
        raise ValueError("no co-simulation")
    unit.set("modelIdentifier", f"{given.identifier}_extended")
    unit.set("maxOutputDerivativeOrder", "0")
    for name in _CANNOT:
        if name in unit.attrib:
            unit.set(name, "false")
    for one in unit.findall("SourceFiles"):
        unit.remove(one)
    values = extended.base.values
    for variable in root.iter("ScalarVariable"):
        name, kind = variable.attrib["name"], variable.find("Real")
        if name in values and kind is not None:
            kind.set("start", repr(values[name]))
    return ET.tostring(root, encoding="utf-8", xml_declaration=True)
