"""What the source of the package may not do, read from its syntax trees."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

from tests.syntax_trees import tree_of

PROJECT = Path(__file__).parents[2]
SOURCES = sorted((PROJECT / "hwid_cli").rglob("*.py"))
# Modules that start programs, talk to a network, or build objects from bytes.
FORBIDDEN_MODULES = {
    *("pickle", "cPickle", "dill", "cloudpickle", "marshal", "shelve"),
    *("subprocess", "pty", "commands"),
    *("socket", "urllib", "http", "requests", "httpx", "aiohttp", "ftplib", "ssl"),
    *("smtplib", "xmlrpc", "webbrowser", "socketserver", "telnetlib"),
    *("ctypes", "cffi", "xml", "tarfile"),
}
FORBIDDEN_CALLS = {
    *("eval", "exec", "compile", "__import__", "input", "breakpoint"),
    *("os.system", "os.popen", "os.execv", "os.execvp", "os.spawnl", "os.startfile"),
    *("yaml.load", "yaml.load_all", "yaml.unsafe_load", "yaml.full_load"),
    *("joblib.load", "joblib.dump", "np.loadtxt", "np.genfromtxt", "np.fromfile"),
}
# A function of the user's own runs; nothing else that is read does.
_OWN_FUNCTION = "hwid_cli/model/maps/own_function.py"
# Tasks go through pickle on their way to a worker, here and on a cluster; an FMU is
# compiled by the system's compiler, without a shell, and its text escaped for XML;
# foreign files are read by a Python of its own, which sends text and numbers; an FMU is
# a library of the user's own, called in such a Python; a first fit compiles its loops in
# two such Pythons.
ALLOWED_MODULES = {
    ("hwid_cli/tasks/workers.py", "pickle"),
    ("hwid_cli/tasks/cluster.py", "pickle"),
    ("hwid_cli/files/isolated_process.py", "subprocess"),
    ("hwid_cli/simulations/command.py", "subprocess"),
    ("hwid_cli/export/fmu.py", "subprocess"),
    ("hwid_cli/model/loops_beside.py", "subprocess"),
    ("hwid_cli/simulations/fmu_unit.py", "ctypes"),
    ("hwid_cli/export/fmu.py", "xml.sax.saxutils"),
    # Of an FMU that FMPy has read before; entities are refused.
    ("hwid_cli/export/extended_fmu.py", "xml.etree"),
}
# Of a list of lines np.loadtxt opens no file.
ALLOWED_CALLS = {
    (_OWN_FUNCTION, "exec"),
    (_OWN_FUNCTION, "compile"),
    ("hwid_cli/data/csv_files.py", "np.loadtxt"),
}


def dotted(function):
    """Name of what is called, as ``os.system``; other forms have none."""
    if isinstance(function, ast.Attribute):
        return f"{dotted(function.value)}.{function.attr}"
    return getattr(function, "id", "")


def faults(tree: ast.Module, place: str) -> list[str]:
    """Forbidden imports, calls and arguments of a source."""
    found, calls = [], []
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            calls.append(node)
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        found += [
            name
            for name in names
            if name.split(".")[0] in FORBIDDEN_MODULES
            and (place, name) not in ALLOWED_MODULES
        ]
    for call in calls:
        name = dotted(call.func)
        if name in FORBIDDEN_CALLS and (place, name) not in ALLOWED_CALLS:
            found.append(name)
        arguments = {
            word.arg: getattr(word.value, "value", None) for word in call.keywords
        }
        if arguments.get("shell") is True:
            found.append(f"{name}: shell")
        if (
            name in ("np.load", "numpy.load")
            and arguments.get("allow_pickle") is not False
        ):
            found.append(f"{name}: pickles")
    return [f"{place}: {one}" for one in found]


@pytest.mark.thorough
def test_the_source_starts_no_program_and_trusts_no_file():
    found = [
        fault
        for path in SOURCES
        for fault in faults(tree_of(path), str(path.relative_to(PROJECT)))
    ]

    assert found == []


@pytest.mark.parametrize(
    "text",
    [
        "import pickle",
        "from urllib.request import urlopen",
        "import yaml\nyaml.load(text, Loader=yaml.Loader)",
        "eval(text)",
        "import os\nos.system('ls')",
        "import numpy as np\nnp.load('a.npz')",
        "import numpy as np\nnp.load('a.npz', allow_pickle=True)",
        "run(command, shell=True)",
    ],
)
def test_the_rules_see_what_they_forbid(text):
    assert faults(ast.parse(text), "x.py") != []


def test_the_yaml_loader_is_the_safe_one_and_builds_nothing_more():
    import yaml

    from hwid_cli.config import yaml_text

    loader = yaml_text._StrictLoader

    assert issubclass(loader, yaml.SafeLoader)
    assert loader.yaml_constructors == yaml.SafeLoader.yaml_constructors
    assert loader.yaml_multi_constructors == {}


def test_the_page_escapes_by_itself():
    from hwid_cli.report.html import soft

    page = (PROJECT / "hwid_cli/report/html.py").read_text()
    template = (PROJECT / "hwid_cli/report/templates/report.html").read_text()

    assert "autoescape=True" in page
    assert "safe" not in template
    # The filter that adds places where a line may break escapes what it is given.
    assert soft("<b>+<i> 2e-05") == (
        '&lt;b&gt;+<wbr>&lt;i&gt; <span class="whole">2e-05</span>'
    )
    # In Python: the shipped style and script, their licence, that filter, and JSON without any sign
    # of HTML.
    marked = {
        path.name: path.read_text().count("Markup(")
        for path in (PROJECT / "hwid_cli").rglob("*.py")
        if "Markup(" in path.read_text()
    }
    assert marked == {"html.py": 5, "charts.py": 1}


def test_every_dependency_has_a_lowest_version():
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text())
    needed = [
        *project["project"]["dependencies"],
        *(
            one
            for extra in project["project"]["optional-dependencies"].values()
            for one in extra
        ),
        *project["build-system"]["requires"],
    ]
    tools = [
        one
        for group in project["dependency-groups"].values()
        for one in group
        # Type stubs hold no code.
        if isinstance(one, str) and not one.startswith("types-")
    ]

    assert [one for one in (*needed, *tools) if ">=" not in one] == []


def test_the_audit_of_versions_is_a_target_of_its_own():
    makefile = (PROJECT / "Makefile").read_text()
    ci = (PROJECT / ".ci/run").read_text()

    assert re.search(r"^audit:.*##", makefile, re.M)
    # It needs a network.
    assert "make audit" not in ci
