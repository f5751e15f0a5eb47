"""Compiled loops after their sources changed: what is kept must not serve any more.

The trial is a small package with a copy of the module, whose sources change in place as a
`git pull` changes them.
"""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import hwid_cli
from hwid_cli import compiled
from hwid_cli.sources import sources_behind

PACKAGE = Path(hwid_cli.__file__).parent

CONSTANTS = "GAIN = {gain}\n"
INNER = """from hwid_cli.compiled import INNER, compiled
from hwid_cli import constants


@compiled(**INNER)
def inner(x: float) -> float:
    return {factor} * constants.GAIN * x
"""
OUTER = """from hwid_cli.compiled import compiled
from hwid_cli.inner import (
    inner,
)


@compiled()
def outer(x: float) -> float:
    return inner(x) + {shift}
"""
ASK = """
from hwid_cli.outer import outer
value = outer(1.0)
print(value, sum(outer.stats.cache_hits.values()))
"""


class Trial:
    """A package of three modules, of which the outer one is asked."""

    def __init__(self, folder, **environment):
        self.folder = folder
        self.package = folder / "hwid_cli"
        self.package.mkdir(parents=True)
        (self.package / "__init__.py").touch()
        for name in ("compiled.py", "sources.py"):
            shutil.copy(PACKAGE / name, self.package)
        left_out = {"NUMBA_CACHE_DIR", "PYTHONPATH"}
        given = {name: one for name, one in os.environ.items() if name not in left_out}
        self.environment = {**given, "PYTHONPATH": str(folder), **environment}
        self.write(gain=2, factor=3, shift=0)

    def write(self, gain=2, factor=3, shift=0):
        texts = {
            "constants": CONSTANTS.format(gain=gain),
            "inner": INNER.format(factor=factor),
            "outer": OUTER.format(shift=shift),
        }
        for name, text in texts.items():
            (self.package / f"{name}.py").write_text(text)

    def ask(self, code=ASK):
        """Value of the outer loop, and how many compiled forms it found on the disk."""
        done = subprocess.run(
            [sys.executable, "-B", "-c", code],
            env=self.environment,
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=True,
        )
        value, hits = done.stdout.split()
        return float(value), int(hits)

    def process(self, code):
        """A process that has begun."""
        return subprocess.Popen(
            [sys.executable, "-B", "-c", code],
            env=self.environment,
            cwd=self.folder,
            stdout=subprocess.PIPE,
            text=True,
        )

    def loops(self, place="hwid_cli/__pycache__/loops"):
        return sorted(path.name for path in (self.folder / place).iterdir())


@pytest.fixture
def trial(tmp_path):
    return Trial(tmp_path)


@pytest.mark.thorough
def test_unchanged_sources_compile_once(trial):
    assert trial.ask() == (6.0, 0)
    assert trial.ask() == (6.0, 1)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("change", "value"),
    [({"factor": 5}, 10.0), ({"gain": 7}, 21.0), ({"shift": 1}, 7.0)],
)
def test_what_a_loop_is_made_from_compiles_it_anew(trial, change, value):
    trial.ask()
    before = trial.loops()

    trial.write(**change)

    assert trial.ask() == (value, 0)
    # Those of the sources before went; a module that did not change keeps its own.
    after = trial.loops()
    assert len(after) == len(before)
    kept = set(before) & set(after)
    assert kept == {name for name in before if "shift" in change and "inner" in name}


@pytest.mark.thorough
def test_a_module_that_no_loop_imports_compiles_nothing(trial):
    trial.ask()
    (trial.package / "other.py").write_text("from hwid_cli.outer import outer\n")

    assert trial.ask() == (6.0, 1)


@pytest.mark.thorough
def test_a_given_folder_is_taken_and_is_safe_as_well(tmp_path):
    trial = Trial(tmp_path / "a", NUMBA_CACHE_DIR=str(tmp_path / "given"))
    trial.ask()
    trial.write(factor=5)

    assert trial.ask() == (10.0, 0)
    assert trial.ask() == (10.0, 1)
    assert not (trial.package / "__pycache__").exists()


@pytest.mark.thorough
def test_two_installations_share_a_given_folder(tmp_path):
    given = str(tmp_path / "given")
    first = Trial(tmp_path / "a", NUMBA_CACHE_DIR=given)
    second = Trial(tmp_path / "b", NUMBA_CACHE_DIR=given)
    second.write(factor=5)
    first.ask()
    second.ask()

    assert first.ask() == (6.0, 1)
    assert second.ask() == (10.0, 1)


@pytest.mark.thorough
def test_loops_of_other_people_stay_where_numba_puts_them(trial):
    own = trial.folder / "own.py"
    own.write_text(
        "from hwid_cli.outer import outer\n"
        "from numba import njit\n\n\n"
        "@njit(cache=True)\n"
        "def twice(x):\n"
        "    return 2 * outer(x)\n"
    )

    assert trial.ask("from own import twice\nprint(twice(1.0), 0)") == (12.0, 0)
    assert list((trial.folder / "__pycache__").glob("own.twice-*.nbi"))


@pytest.mark.skipif(not compiled.HAS_LOCKS, reason="no locks on this system")
def test_one_process_at_a_time_adds_to_a_folder(tmp_path):
    import fcntl

    folder = tmp_path / "loops"
    folder.mkdir()
    with (folder / "lock").open("ab") as other:
        with compiled.one_writer(folder), pytest.raises(BlockingIOError):
            fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)


@pytest.mark.skipif(not compiled.HAS_LOCKS, reason="no locks on this system")
@pytest.mark.thorough
def test_a_loop_is_kept_when_the_other_process_is_done(trial):
    hold = (
        "import time\n"
        "from pathlib import Path\n"
        "from hwid_cli.compiled import one_writer\n"
        "from hwid_cli.outer import outer\n"
        "with one_writer(Path(outer.stats.cache_path)):\n"
        "    print('held', flush=True)\n"
        "    time.sleep(600)\n"
    )
    with trial.process(hold) as holder:
        try:
            assert holder.stdout.readline() == "held\n"
            with trial.process(ASK) as asker:
                with pytest.raises(subprocess.TimeoutExpired):
                    asker.wait(3.0)
                assert list(trial.folder.rglob("outer.outer-*")) == []
                holder.kill()
                assert asker.stdout.read() == "6.0 0\n"
        finally:
            holder.kill()
    assert trial.ask() == (6.0, 1)


def modules_imported(path):
    """Modules of the package that a file imports, by its syntax tree."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports by dots"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def file_of(module):
    path = PACKAGE.parent.joinpath(*module.split("."))
    return next(
        (
            one
            for one in (path.with_suffix(".py"), path / "__init__.py")
            if one.exists()
        ),
        None,
    )


def reached(source):
    found, todo = set(), [source]
    while todo:
        path = todo.pop()
        if path not in found:
            found.add(path)
            named = (
                file_of(one) for one in modules_imported(path) if "hwid_cli" in one
            )
            todo += [one for one in named if one]
    return found


SOURCES = [path for path in PACKAGE.rglob("*.py") if "@compiled(" in path.read_text()]


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_every_source_behind_a_loop_is_found(source):
    assert reached(source) <= sources_behind(source)


def test_all_loops_are_compiled_this_way():
    assert len(SOURCES) > 20
    others = [
        path.name
        for path in PACKAGE.rglob("*.py")
        if "njit" in path.read_text() and path.name != "compiled.py"
    ]
    assert others == []
