"""The lists of packages with checksums: complete, and within what pyproject.toml allows."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

PROJECT = Path(__file__).parents[2]
LINE = re.compile(r"([a-z0-9._-]+)==(\S+) --hash=sha256:[0-9a-f]{64}")


def locked(kind):
    (path,) = (PROJECT / "tools" / "locks").glob(f"{kind}-*.txt")
    lines = [one for one in path.read_text().splitlines() if not one.startswith("#")]
    found = [LINE.fullmatch(line) for line in lines]
    assert None not in found
    return {re.sub(r"[-_.]+", "-", one[1]): one[2] for one in found}


def required(kind):
    content = tomllib.loads((PROJECT / "pyproject.toml").read_text())
    named = [*content["project"]["dependencies"], *content["build-system"]["requires"]]
    if kind == "test":
        groups = content["dependency-groups"]
        named += [one for one in groups["test"] + groups["dev"] if isinstance(one, str)]
    return [Requirement(one) for one in named]


@pytest.mark.parametrize("kind", ["run", "test"])
def test_every_requirement_is_locked_to_an_allowed_version(kind):
    versions = locked(kind)

    for one in required(kind):
        name = re.sub(r"[-_.]+", "-", one.name).lower()
        assert name in versions, name
        assert one.specifier.contains(versions[name], prereleases=True), one


def test_both_lists_hold_the_same_versions():
    assert locked("run").items() <= locked("test").items()


def test_a_list_is_made_of_what_pip_reports(tmp_path):
    about = {"name": "Numpy", "version": "2.0"}
    archive = {"archive_info": {"hashes": {"sha256": "ab" * 32}}}
    report = {"install": [{"metadata": about, "download_info": archive}]}
    (tmp_path / "report.json").write_text(json.dumps(report))
    done = subprocess.run(
        [sys.executable, PROJECT / "tools" / "lock.py", tmp_path / "report.json"],
        capture_output=True,
        text=True,
        check=True,
    )

    assert LINE.fullmatch(done.stdout.splitlines()[-1])[1] == "numpy"
