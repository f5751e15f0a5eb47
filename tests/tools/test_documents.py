"""The documents hang together: every link leads somewhere, every page is in the index."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
DOCS = PROJECT / "docs"
PAGES = sorted(DOCS.glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda one: one.name)
def test_every_link_leads_to_a_file(page):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    targets = re.findall(r"\]\(([^)\s#]+)(?:#[^)]*)?\)", text)
    local = [one for one in targets if not one.startswith(("http://", "https://"))]
    assert [one for one in local if not (DOCS / one).exists()] == []


def test_the_index_and_the_site_name_every_page():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    site = (PROJECT / "tools" / "mkdocs.yml").read_text(encoding="utf-8")
    for page in PAGES:
        assert page.name in site, page.name
        assert page.name == "index.md" or f"({page.name})" in index, page.name


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_of_a_missing_page(tmp_path):
    done = subprocess.run(
        [
            *(sys.executable, "-m", "mkdocs", "build", "--site-dir", str(tmp_path)),
            *("--config-file", str(PROJECT / "tools" / "mkdocs.yml")),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING -  Doc file" not in done.stderr
    assert '"../../configs/README.md"' in (tmp_path / "tutorial.html").read_text()
    assert (tmp_path / "tutorial.html").is_file()
    assert (tmp_path / "search" / "search_index.json").is_file()
