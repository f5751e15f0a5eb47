"""A model as a co-simulation unit of the Functional Mock-up Interface 2.0.

A zip archive with a description, the C source, and that source compiled for this
platform by its own compiler.
"""

import io
import os
import platform
import re
import shutil
import subprocess
import tempfile
import uuid
import zipfile
from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

from hwid_cli import __version__
from hwid_cli.errors import ConfigError
from hwid_cli.export.c_source import filled
from hwid_cli.export.names import identifier
from hwid_cli.files.atomic import replace_file
from hwid_cli.records.exported import Exported, ExportedModel

_COMPILERS = ("cc", "gcc", "clang")
# Strict arithmetic, so that the unit computes what the C source alone does.
_FLAGS = (
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-fPIC",
    "-fvisibility=hidden",
    "-shared",
)
SYSTEMS = {
    "Linux": ("linux", ".so"),
    "Darwin": ("darwin", ".dylib"),
    "Windows": ("win", ".dll"),
}
# Archives of equal content are equal: their files have no times of their own.
_DATE = (1980, 1, 1, 0, 0, 0)
# Signs that no XML document may hold, not even as references.
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
# What a simulation lasts that asks for nothing else, [samples].
_USUAL_SAMPLES = 1000


def write_fmu(path: Path, exported: Exported, source: str) -> None:
    """Write a model as an FMU for this platform.

    Parameters
    ----------
    source : str
        Its C source.

    Raises
    ------
    ConfigError
        If there is no C compiler, or it fails.
    CacheError
        If the file cannot be written.
    """
    name = identifier(exported.card.name)
    guid = f"{{{uuid.uuid5(uuid.NAMESPACE_URL, source)}}}"
    words = {
        "sample_time": repr(exported.sample_time_s),
        "guid": guid,
        "has_starts": int(isinstance(exported, ExportedModel)),
    }
    sources = {"model.c": source, **unit_sources("fmi2.c", words)}
    system, ending = SYSTEMS.get(platform.system(), ("linux", ".so"))
    bits = platform.architecture()[0][:2]
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        add_file(archive, "modelDescription.xml", _description(exported, name, guid))
        for file_name, text in sources.items():
            add_file(archive, f"sources/{file_name}", text)
        add_file(
            archive,
            f"binaries/{system}{bits}/{name}{ending}",
            compiled(sources, f"{name}{ending}"),
        )
    replace_file(path, content.getvalue())


def unit_sources(main: str, words: Mapping[str, object]) -> dict[str, str]:
    """The source of a unit and what every unit includes, by the names of their files."""
    shared = {name: filled(name, {}) for name in ("fmi2_types.h", "fmi2_refused.h")}
    return {main: filled(main, words), **shared}


def add_file(archive: zipfile.ZipFile, name: str, content: str | bytes) -> None:
    """Add a file to an archive whose bytes depend on its content alone."""
    info = zipfile.ZipInfo(name, _DATE)
    info.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(info, content)


def compiled(sources: dict[str, str], name: str, *, main: str = "fmi2.c") -> bytes:
    """Binary that the system's compiler makes.

    Parameters
    ----------
    sources : dict of str to str
        By the names of their files.
    name : str
        Of the binary.
    main : str
        The source that includes the others.

    Raises
    ------
    ConfigError
        If there is no C compiler, or it fails.
    """
    asked = os.environ.get("CC", "").split()
    candidates = asked[:1] or _COMPILERS
    compiler = next((one for one in candidates if shutil.which(one)), None)
    if compiler is None:
        raise ConfigError(
            f"--format fmu: no C compiler ({', '.join(candidates)}); expected one to "
            "build the unit with; install one, name it in CC, or use --format c"
        )
    with tempfile.TemporaryDirectory() as folder:
        for file_name, text in sources.items():
            (Path(folder) / file_name).write_text(text)
        libraries = ["-lm", "-ldl"] if platform.system() == "Linux" else ["-lm"]
        command = [compiler, *asked[1:], *_FLAGS, "-o", name, main, *libraries]
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            said = " ".join(done.stderr.split())[:200]
            raise ConfigError(
                f"--format fmu: {compiler} failed ({said}); expected a C99 compiler; "
                "name another one in CC, or use --format c"
            )
        return (Path(folder) / name).read_bytes()


def _attribute(text: str) -> str:
    """Text in quotes; what XML has no place for, however it is written, is replaced."""
    return quoteattr(_NO_XML.sub("\ufffd", text))


def _description(exported: Exported, name: str, guid: str) -> str:
    """Content of ``modelDescription.xml``."""
    card, step = exported.card, exported.sample_time_s
    is_model = isinstance(exported, ExportedModel)
    # Without a delay the output answers to the input of the same instant.
    depends = (
        "" if isinstance(exported, ExportedModel) and exported.model.delay else "1"
    )
    units = "".join(
        f"    <Unit name={_attribute(unit)}/>\n"
        for unit in dict.fromkeys((card.input_unit, card.output_unit))
    )
    title = _attribute(f"{card.title} ({card.name})")
    stop = repr(_USUAL_SAMPLES * step)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName={_attribute(name)} guid="{guid}"
  description={title} generationTool="hwid {__version__}" variableNamingConvention="flat"
  numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="false"
    canBeInstantiatedOnlyOncePerProcess="false" canNotUseMemoryManagementFunctions="false"
    canGetAndSetFMUstate="true" canInterpolateInputs="false">
    <SourceFiles><File name="fmi2.c"/></SourceFiles>
  </CoSimulation>
  <UnitDefinitions>
{units}  </UnitDefinitions>
  <DefaultExperiment startTime="0" stopTime="{stop}" stepSize="{step!r}"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input" variability="continuous"
      description="input">
      <Real unit={_attribute(card.input_unit)} start="0"/>
    </ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"
      variability="continuous" initial="calculated" description="output">
      <Real unit={_attribute(card.output_unit)}/>
    </ScalarVariable>
{_START_VARIABLE if is_model else ""}  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies="{depends}"/></Outputs>
    <InitialUnknowns>
      <Unknown index="2" dependencies="{"1 3" if is_model else "1"}"/>
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


_START_VARIABLE = """    <ScalarVariable name="initial_state" valueReference="2" causality="parameter"
      variability="fixed" initial="exact"
      description="0: by the model's own rule, 1: empty, 2: in equilibrium with the first input">
      <Integer min="0" max="2" start="0"/>
    </ScalarVariable>
"""
