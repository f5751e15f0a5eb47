"""The rules of the house that a program can check."""

import ast
import re
import subprocess
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from hwid_cli.cli.main import COMMANDS
from tests.syntax_trees import tree_of

PROJECT = Path(__file__).parents[1]
SOURCES = sorted((PROJECT / "hwid_cli").rglob("*.py"))
TESTS = sorted((PROJECT / "tests").rglob("*.py"))
TOP_LEVEL = {
    ".ci",
    ".gitignore",
    "CHANGELOG.md",
    "LICENSE",
    "Makefile",
    "README.md",
    "configs",
    "data",
    "docs",
    "hwid_cli",
    "pyproject.toml",
    "tests",
    "tools",
}
MOST_LINES_OF_FUNCTION = 45
FORBIDDEN_NAMES = {"utils", "helpers", "common", "core", "misc"}


@pytest.fixture(scope="module", autouse=True)
def _trees_are_forgotten():
    """A million nodes would slow down the search for garbage in later tests."""
    yield
    functions_of.cache_clear()
    tree_of.cache_clear()


def short(path):
    return str(path.relative_to(PROJECT))


@cache
def functions_of(path):
    """Functions and methods of a file; what lies inside one belongs to it."""

    def walk(node, outer):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
                yield (*outer, child.name), child
            elif isinstance(child, ast.ClassDef):
                yield from walk(child, (*outer, child.name))
            else:
                yield from walk(child, outer)

    return list(walk(tree_of(path), ()))


def body_lines(function):
    """Lines of a function without signature and docstring."""
    body = function.body
    if ast.get_docstring(function, clean=False) is not None:
        body = body[1:]
    return function.end_lineno - body[0].lineno + 1 if body else 0


def is_click_command(function):
    # The docstring of a command is its help; its one argument is told there.
    return any("click." in ast.unparse(line) for line in function.decorator_list)


def is_public(names):
    return not any(name.startswith("_") for name in names)


def arguments_of(function):
    found = function.args
    plain = [*found.posonlyargs, *found.args, *found.kwonlyargs]
    extra = [item for item in (found.vararg, found.kwarg) if item is not None]
    return {item.arg for item in (*plain, *extra)} - {"self", "cls"}


def documented_parameters(docstring):
    """Names in the Parameters section of a numpy docstring."""
    section = re.search(
        r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n-+$|\Z)", docstring, re.DOTALL | re.M
    )
    if section is None:
        return set()
    heads = re.findall(r"^(\S[^:\n]*?)(?: :.*)?$", section[1], re.M)
    return {name.strip().lstrip("*") for head in heads for name in head.split(",")}


def test_the_docstring_reader_knows_a_missing_argument():
    docstring = """First line.

Parameters
----------
a, b : int, [-]
    Two.
*others : str

Returns
-------
c : int
"""
    assert documented_parameters(docstring) == {"a", "b", "others"}


def parameter_entries(docstring):
    """Heads and descriptions of the Parameters section: name -> (type, has text)."""
    section = re.search(
        r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n-+$|\Z)", docstring, re.DOTALL | re.M
    )
    entries = {}
    if section is None:
        return entries
    for head, text in re.findall(
        r"^(\S[^\n]*)\n?((?:^[ \t]+[^\n]*\n?|^\n)*)", section[1], re.M
    ):
        names, _, kind = head.partition(" : ")
        for name in names.split(","):
            entries[name.strip().lstrip("*")] = (kind, bool(text.strip()))
    return entries


def test_docstrings_document_arguments_that_exist():
    faults = []
    for path in SOURCES:
        for names, function in functions_of(path):
            if not is_public(names) or is_click_command(function):
                continue
            place = f"{short(path)}:{function.lineno} {'.'.join(names)}"
            docstring = ast.get_docstring(function)
            if not docstring:
                faults.append(f"{place}: no docstring")
                continue
            unknown = documented_parameters(docstring) - arguments_of(function)
            if unknown:
                faults.append(f"{place}: {', '.join(sorted(unknown))}")
    assert faults == []


def test_arrays_say_what_they_hold_where_they_enter():
    # An annotation tells that it is an array, and no more.
    faults = []
    for path in SOURCES:
        for names, function in functions_of(path):
            if not is_public(names):
                continue
            plain = [*function.args.args, *function.args.kwonlyargs]
            arrays = {
                item.arg
                for item in plain
                if item.annotation is not None
                and ast.unparse(item.annotation) == "np.ndarray"
            }
            told = documented_parameters(ast.get_docstring(function) or "")
            if arrays - told:
                faults.append(f"{short(path)}:{function.lineno} {arrays - told}")
    assert faults == []


def test_no_docstring_repeats_an_annotation():
    # A line for a parameter has more to say than its name and type.
    faults = [
        f"{short(path)}:{function.lineno} {'.'.join(names)}: {name}"
        for path in SOURCES
        for names, function in functions_of(path)
        if not is_click_command(function)
        for name, (kind, has_text) in parameter_entries(
            ast.get_docstring(function) or ""
        ).items()
        if not has_text
        and re.fullmatch(r"[A-Za-z_. ]*", kind)
        and not re.search(r"shape|optional|zero|positive|between|non-", kind)
    ]
    assert faults == []


def is_compiled(function):
    """Whether numba compiles a function: its arrays come one by one."""
    return any(
        ast.unparse(line).startswith("compiled(") for line in function.decorator_list
    )


def test_no_function_is_too_long():
    long = [
        f"{short(path)}: {'.'.join(names)} has {body_lines(function)} lines"
        for path in SOURCES
        for names, function in functions_of(path)
        if not is_compiled(function)
        if body_lines(function) > MOST_LINES_OF_FUNCTION
    ]
    assert long == []


def names_bound_at_the_top(tree):
    """Functions, classes and constants of a module, once for each time they are made."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign):
            for part in (inner for one in node.targets for inner in ast.walk(one)):
                if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
                    yield part.id


def test_no_name_is_made_twice_in_a_module():
    # The later one would silently serve the functions above, too.
    twice = [
        f"{short(path)}: {name}"
        for path in SOURCES
        for name, count in Counter(names_bound_at_the_top(tree_of(path))).items()
        if count > 1
    ]
    assert twice == []


def test_no_module_is_named_after_nothing():
    assert not {path.stem for path in SOURCES} & FORBIDDEN_NAMES


def test_nothing_outside_the_tests_is_named_like_a_test():
    named = [
        f"{short(path)}: {'.'.join(names)}"
        for path in SOURCES
        for names, _ in functions_of(path)
        if names[-1].startswith("test")
    ]
    assert named == []


def test_tests_mirror_the_package():
    rooms = PROJECT / "hwid_cli"
    strays = [
        short(path)
        for path in TESTS
        if path.name.startswith("test_") and path.parent != PROJECT / "tests"
        if not (rooms / path.parent.relative_to(PROJECT / "tests")).is_dir()
        if not {
            "bad_input",
            "benchmarks",
            "blind",
            "machines",
            "numerics",
            "reference",
            "reliability",
            "security",
            "tools",
        }
        & set(path.parts)
    ]
    assert strays == []


def test_the_top_level_holds_what_it_should_and_nothing_else():
    listed = subprocess.run(
        ["git", "ls-files"],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode != 0:
        pytest.skip("not a git clone")
    names = [name for name in listed.stdout.splitlines() if (PROJECT / name).exists()]
    assert {name.split("/")[0] for name in names} == TOP_LEVEL


def test_every_command_has_help():
    for name, command in COMMANDS.items():
        for parameter in command.params:
            if parameter.param_type_name == "option":
                assert parameter.help, f"{name} {parameter.name}"


def test_the_readme_has_a_row_for_every_command_and_no_other():
    rows = re.findall(r"^\| `hwid (\w+) ", (PROJECT / "README.md").read_text(), re.M)
    assert rows == list(COMMANDS)


def test_every_make_target_that_ci_calls_exists():
    makefile = (PROJECT / "Makefile").read_text()
    targets = set(re.findall(r"^([a-z0-9-]+):", makefile, re.M))
    called = re.findall(r"^make ([a-z0-9-]+)", (PROJECT / ".ci/run").read_text(), re.M)
    assert called == ["test", "smoke", "check"]
    assert set(called) <= targets


def test_compiled_loops_keep_strict_arithmetic():
    # Reassociated sums have other last bits in a process that compiled a loop than in
    # one that loaded it: results would depend on the number of workers.
    files = [
        path for path in SOURCES if re.search(r"^@compiled\(", path.read_text(), re.M)
    ]
    assert len(files) > 5
    assert [path for path in files if "fastmath" in path.read_text()] == []
