import re
import subprocess
import sys
import time

import click
import pytest
from click.testing import CliRunner

from hwid_cli import __version__
from hwid_cli.cli import main as main_module
from hwid_cli.cli.commands import COMMANDS, GROUPS
from hwid_cli.cli.main import main
from hwid_cli.errors import MeasurementError


@pytest.fixture
def broken():
    """A command whose fault the test chooses."""
    faults = []

    @click.command("broken")
    def command():
        raise faults[0]

    main.add_command(command)
    yield faults
    del main.commands["broken"]


def test_what_a_user_can_mend_is_one_line_on_stderr_and_exit_code_1(broken):
    broken.append(MeasurementError("run07.csv, row 3:\n time goes back"))
    result = CliRunner().invoke(main, ["broken"])

    assert result.exit_code == 1
    assert result.stderr == "hwid: run07.csv, row 3: time goes back\n"
    assert result.stdout == ""


def test_a_full_disk_is_something_to_mend(broken):
    broken.append(OSError(28, "No space left on device", "results/x.h5"))
    result = CliRunner().invoke(main, ["broken"])

    assert result.exit_code == 1
    assert "results/x.h5: No space left on device" in result.stderr


def test_a_bug_keeps_its_traceback(broken):
    broken.append(ZeroDivisionError("a bug"))
    result = CliRunner().invoke(main, ["broken"])

    assert isinstance(result.exception, ZeroDivisionError)


def test_an_interrupt_is_one_line_and_exit_code_130(broken):
    broken.append(KeyboardInterrupt())
    result = CliRunner().invoke(main, ["broken"])

    assert result.exit_code == 130
    assert result.stderr.count("\n") == 1
    assert "interrupted" in result.stderr


def test_the_version_is_the_packages():
    result = CliRunner().invoke(main, ["--version"])

    assert result.output == f"hwid, version {__version__}\n"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("identfy c.yaml", r"no such command 'identfy'.*"),
        ("--nonsense", r"no such option:? '?--nonsense'?.*"),
        (
            "run",
            r"run: missing argument 'CONFIG'; 'hwid run --help' says what may stand",
        ),
        ("run c.yaml --jobs 0", r"run: invalid value for '--jobs': 0 is not in .*"),
        ("run c.yaml --scheduler tcp://x:1", r"run: --scheduler tcp://x:1: needs .*"),
        ("run c.yaml -v -q", r"run: --verbose and --quiet: choose one of them.*"),
        ("run c.yaml --backend threads", r"run: invalid value for '--backend'.*"),
        ("check a.yaml b.yaml", r"check: got unexpected extra argument \(b.yaml\).*"),
    ],
)
def test_wrong_usage_is_exit_code_2_and_one_line_with_the_next_step(words, says):
    result = CliRunner().invoke(main, words.split(), prog_name="hwid")

    assert result.exit_code == 2
    assert re.fullmatch(f"hwid: {says}\n", result.stderr), result.stderr
    assert "--help' says what may stand" in result.stderr or "?" in result.stderr


def test_without_a_command_the_help_is_shown():
    result = CliRunner().invoke(main, [], prog_name="hwid")

    assert result.exit_code == 2
    assert result.stderr.startswith("Usage: hwid")


def test_help_needs_no_numerical_library():
    code = (
        "import sys; from hwid_cli.cli.main import main; "
        "main(['run', '--help'], standalone_mode=False); "
        "heavy = {'numpy', 'scipy', 'numba', 'joblib', 'h5py', 'yaml', 'matplotlib', "
        "'pydantic', 'jsonschema'}; "
        "print(sorted(heavy & set(sys.modules)))"
    )
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )

    assert done.stdout.splitlines()[-1] == "[]"
    # Measured 0.1 s; the promise is half a second, the rest is for a busy machine.
    assert time.perf_counter() - start < 2.0


def test_python_m_hwid_cli_is_the_same_command():
    done = subprocess.run(
        [sys.executable, "-m", "hwid_cli", "--version"],
        capture_output=True,
        text=True,
        check=True,
    )

    assert done.stdout.endswith(f"version {__version__}\n")


@pytest.mark.parametrize(
    ("options", "level"),
    [({}, 30), ({"verbose": True}, 10), ({"quiet": True}, 40)],
    ids=str,
)
def test_verbose_and_quiet_choose_the_log_level(options, level):
    import logging

    main_module.set_log_levels(**{"verbose": False, "quiet": False, **options})

    assert logging.getLogger("hwid_cli").level == level


def test_help_lists_every_command_in_one_group():
    text = CliRunner().invoke(main, ["--help"]).output

    listed = [name for names in GROUPS.values() for name in names]
    assert sorted(listed) == sorted(COMMANDS)
    assert [text.index(f"\n{title}:") for title in GROUPS] == sorted(
        text.index(f"\n{title}:") for title in GROUPS
    )
    for name in listed:
        assert text.count(f"\n  {name} ") == 1


@pytest.mark.parametrize("name", COMMANDS)
def test_no_help_shows_a_mark_of_its_layout(name):
    text = CliRunner().invoke(main, [name, "--help"]).output

    assert text.startswith("Usage:")
    assert "\\b" not in text
    assert "\b" not in text
