"""docs/tutorial.md is true: its files are written and its commands run, in their order."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
TEXT = (DOCS / "tutorial.md").read_text()
# Fenced blocks: what stands above, the words behind the fence, the content.
BLOCK = re.compile(r"^(<!-- not run -->\n)?```([^\n]*)\n(.*?)^```$", re.DOTALL | re.M)


def blocks():
    return [
        (info.split(), body, bool(skipped))
        for skipped, info, body in BLOCK.findall(TEXT)
    ]


def test_every_block_is_of_a_kind_that_is_run_or_compared():
    kinds = [words[0] for words, _, _ in blocks()]
    assert set(kinds) == {"python", "sh", "text", "yaml"}
    assert kinds.count("sh") > 7


def test_only_commands_that_exist_are_shown():
    from hwid_cli.cli.main import main

    for words, body, skipped in blocks():
        for line in body.splitlines() if words == ["sh"] and not skipped else ():
            program, name, *arguments = shlex.split(line)
            if program == "hwid":
                assert main.get_command(None, name).make_context(name, arguments)


@pytest.mark.parametrize(
    "page",
    ["tutorial.md", "coming_from_matlab.md", "glossary.md", "architecture.md"],
)
def test_every_link_leads_somewhere(page):
    text = (DOCS / page).read_text()
    for target, anchor in re.findall(r"\]\(([^)#]*)#?([^)]*)\)", text):
        path = DOCS / target if target else DOCS / page
        assert path.exists(), target
        if anchor and path.suffix == ".md":
            heads = re.findall(r"^#+ (.*)$", path.read_text(), re.M)
            slugs = [re.sub(r"[^\w -]", "", h).lower().replace(" ", "-") for h in heads]
            assert anchor in slugs


@pytest.mark.slow
def test_the_commands_run_on_a_clean_folder(tmp_path):
    said = warned = ""
    for words, body, skipped in blocks():
        if skipped:
            continue
        if words[0] == "sh":
            for line in body.splitlines():
                done = run(line, tmp_path)
                said, warned = said + done.stdout, warned + done.stderr
        elif words[0] == "text":
            for line in body.splitlines():
                assert line in said, line
        else:
            mode = "a" if words[1] == "append" else "w"
            with (tmp_path / words[-1]).open(mode) as file:
                file.write(body)
    results = tmp_path / "results" / "measured"
    assert (results / "report.html").is_file()
    assert (results / "figures" / "compare.png").is_file()
    found = json.loads((results / "diagnosis.json").read_text())
    assert found["verdict"] == "named"
    # The data are made with nothing but friction: noise remains, and no warning is due.
    assert found["complete"]
    assert found["gap"]["after"]["ratio_to_noise"] < 1.3
    assert "initial_state" not in warned
    force = found["effects"][0]["parameters"]["force_N"]
    # Made with 0.8 N; an Euler integration and an offset leave some per cent.
    assert force["value"] == pytest.approx(0.8, rel=0.1)


def run(line, folder):
    """What a line of the page says when it is run."""
    program, *arguments = shlex.split(line)
    program = {
        "hwid": [sys.executable, "-m", "hwid_cli"],
        "python": [sys.executable],
    }[program]
    done = subprocess.run(
        [*program, *arguments],
        cwd=folder,
        # The page's folder is no project: the package comes from here.
        env={**os.environ, "PYTHONPATH": str(DOCS.parent), "COLUMNS": "100"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
    return done
