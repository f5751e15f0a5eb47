"""docs/scale.md is what its script makes of the measurement that lies beside it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from hwid_cli.tasks.chunks import CHUNK_S

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.slow
def test_the_page_is_what_the_script_writes(tmp_path):
    done = subprocess.run(
        [sys.executable, "tools/scale.py", "docs/scale.json"],
        cwd=DOCS.parent,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == (DOCS / "scale.md").read_text()


def test_the_way_of_a_chunk_of_fits_is_less_than_a_twentieth_of_its_computing():
    measured = json.loads((DOCS / "scale.json").read_text())
    fit_s = 0.09
    count = int(CHUNK_S / fit_s)
    way = measured["wall_chunk_s"] + count * measured["wall_result_s"]
    assert way < 0.05 * count * fit_s
