import os
import shlex
import subprocess
import sys

import pytest
from click.testing import CliRunner

from hwid_cli.cli.examples import EXAMPLES, examples_of
from hwid_cli.cli.main import COMMANDS, main

LINES = [line for name in COMMANDS for line in examples_of(name)]


def test_examples_are_of_commands_that_there_are():
    assert set(EXAMPLES) <= set(COMMANDS)


def test_every_example_parses():
    for line in LINES:
        program, name, *arguments = shlex.split(line)
        command = main.get_command(None, name)

        assert program == "hwid"
        # Parses the words and calls nothing; wrong usage raises.
        assert command.make_context(name, arguments).params, line


def test_the_help_shows_each_example_on_a_line_of_its_own():
    for name in COMMANDS:
        lines = CliRunner().invoke(main, [name, "--help"]).output.splitlines()

        shown = [line.strip() for line in lines]
        assert [line for line in examples_of(name) if line not in shown] == []


@pytest.mark.parametrize(
    "shell",
    ["zsh", *(pytest.param(one, marks=pytest.mark.slow) for one in ("bash", "fish"))],
)
def test_shells_get_a_script_and_names_to_complete(shell):
    def hwid(**environment):
        code = "from hwid_cli.cli.main import COMMANDS, main; main(prog_name='hwid')"
        done = subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            check=False,
        )
        return done.stdout

    script = hwid(_HWID_COMPLETE=f"{shell}_source")
    if not script and shell == "bash":
        pytest.skip("no bash here whose version click could ask for")
    assert "_HWID_COMPLETE" in script
    words = {"COMP_WORDS": "hwid di", "COMP_CWORD": "1" if shell != "fish" else "di"}
    assert "diagnose" in hwid(_HWID_COMPLETE=f"{shell}_complete", **words)
