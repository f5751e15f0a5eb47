"""The report in a real browser, at the widths of a desk and of a phone."""

import html
import json
import re
import shutil
import subprocess

import pytest

from tests.report.test_html import SECTIONS

pytestmark = pytest.mark.browser

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
# Runs before everything else of the page and reports what it found to the page around
# it: a browser without a screen cannot make its own window as narrow as a phone.
PROBE = """
<script>
const errors = [];
addEventListener("error", event => errors.push(String(event.message)));
console.error = (...words) => errors.push(words.join(" "));
addEventListener("load", () => {
  const root = document.documentElement;
  const closed = root.scrollWidth - root.clientWidth;
  document.querySelectorAll("details").forEach(one => { one.open = true; });
  const images = [...document.images];
  const boxes = [...document.querySelectorAll(".scroll, .image, pre")];
  parent.postMessage({
    errors,
    width: root.clientWidth,
    overflow: Math.max(closed, root.scrollWidth - root.clientWidth),
    sections: [...document.querySelectorAll("section")]
      .filter(one => one.getBoundingClientRect().height > 40).map(one => one.id),
    images: images.length,
    broken: images.filter(one => one.naturalWidth === 0).map(one => one.alt),
    tiny: images.filter(one => one.getBoundingClientRect().width < 200)
      .map(one => one.alt),
    small: images.filter(one => one.closest(".n1")).map(one => [
      one.alt,
      one.getBoundingClientRect().width / one.style.getPropertyValue("--inches"),
    ]),
    outside: boxes.filter(one => one.getBoundingClientRect().right > innerWidth + 1)
      .map(one => one.className),
  }, "*");
});
</script>
"""
FRAME = """<!DOCTYPE html>
<body style="margin: 0">
<script>
addEventListener("message", event => {
  const found = document.createElement("pre");
  found.id = "found";
  found.textContent = JSON.stringify(event.data);
  document.body.append(found);
});
</script>
<iframe src="probed.html" width="%d" height="900" style="border: 0"></iframe>
"""


@pytest.fixture(scope="module")
def browser():
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        pytest.skip(f"none of {', '.join(BROWSERS)} is installed")
    return found


@pytest.fixture(scope="module", params=[390, 1280])
def visit(request, browser, page, tmp_path_factory):
    """What the browser finds in the page at a width, and what it writes to its log."""
    folder = tmp_path_factory.mktemp("browser")
    probed = page.html.replace("<head>", f"<head>{PROBE}", 1)
    (folder / "probed.html").write_text(probed, encoding="utf-8")
    (folder / "frame.html").write_text(FRAME % request.param, encoding="utf-8")
    command = [
        browser,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--hide-scrollbars",
        "--enable-logging=stderr",
        f"--user-data-dir={folder / 'profile'}",
        "--window-size=1400,1000",
        "--virtual-time-budget=30000",
        "--dump-dom",
        (folder / "frame.html").as_uri(),
    ]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=180, check=True
    )
    found = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
    assert found, f"the page did not answer:\n{done.stderr[-2000:]}"
    answer = json.loads(html.unescape(found[1]))
    assert answer["width"] == request.param
    return answer, done.stderr


def test_the_page_opens_without_an_error(visit):
    answer, log = visit

    assert answer["errors"] == []
    assert [line for line in log.splitlines() if "CONSOLE" in line] == []


def test_every_section_is_shown(visit):
    assert visit[0]["sections"] == SECTIONS


def test_nothing_is_wider_than_the_window(visit):
    answer, _ = visit

    assert answer["overflow"] <= 0
    assert answer["outside"] == []


def test_every_image_is_decoded_and_large_enough_to_be_read(visit, page):
    answer, _ = visit

    assert answer["images"] == page.html.count("<img")
    assert answer["broken"] == []
    assert answer["tiny"] == []


def test_labels_of_single_figures_keep_their_size_on_a_phone(visit):
    answer, _ = visit

    # Labels have 7.5 points and more: 9 pixels at 85 pixels in an inch. Rounded sizes
    # of figures and the room of a desk take some off.
    assert len(answer["small"]) > 5
    assert {name: size for name, size in answer["small"] if size < 84} == {}
