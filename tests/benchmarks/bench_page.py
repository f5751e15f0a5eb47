"""The page of 43 recordings: seconds to work it out and to write it, bytes, first paint.

Results are made up, of the shape that `thesis.yaml` has: 43 recordings of 7500 samples. The
last rows need playwright and Chromium, and are left out where there is none.
"""

import shutil
import statistics
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from hwid_cli.records.recordings import Calibrated
from hwid_cli.report.html import report_page
from hwid_cli.report.page import Drawing
from hwid_cli.stages.report import report_contents
from hwid_cli.stages.table import STAGES
from hwid_cli.tasks.task import Task
from hwid_cli.tasks.workers import Workers, compute
from tests.report.report_examples import everything, log, names, recording, with_results
from tests.report.test_browser import WAIT_FOR_PAINT

COUNT, SAMPLES, REPEATS = 43, 7500, 5
BROWSER = "chromium"


def results():
    """Results of all stages on long recordings."""
    who = names(COUNT)
    recordings = tuple(recording(name, n, SAMPLES) for n, name in enumerate(who))
    logs = tuple(log(name, SAMPLES) for name in who)
    stored = everything(COUNT, levels=2)
    calibrated = Calibrated(recordings, logs, "")
    return replace(with_results(stored, calibrate=calibrated))


def show(name: str, seconds: list[float]) -> None:
    """Print one row."""
    middle = statistics.median(seconds)
    print(f"{name:52}{middle:9.2f}{min(seconds):9.2f}{max(seconds):9.2f}")


def timed(function, *arguments) -> tuple[list[float], object]:
    """Wall seconds of some calls, and the last result."""
    seconds, found = [], None
    for _ in range(REPEATS):
        begun = time.perf_counter()
        found = function(*arguments)
        seconds.append(time.perf_counter() - begun)
    return seconds, found


def png(drawing: Drawing) -> bytes:
    """Draw one figure."""
    return drawing.png


def first_paints(path: Path) -> tuple[list[float], list[float]]:
    """Seconds until Chromium shows something, and those that it worked; empty without it."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return [], []
    found = shutil.which(BROWSER)
    if found is None:
        return [], []
    seconds, worked = [], []
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=found, args=["--no-sandbox"])
        for _ in range(REPEATS):
            tab = browser.new_page(viewport={"width": 1280, "height": 800})
            tools = tab.context.new_cdp_session(tab)
            tools.send("Performance.enable", {"timeDomain": "threadTicks"})
            tab.goto(path.as_uri())
            seconds.append(tab.evaluate(WAIT_FOR_PAINT))
            told = tools.send("Performance.getMetrics")["metrics"]
            worked += [one["value"] for one in told if one["name"] == "TaskDuration"]
            tab.close()
        browser.close()
    return seconds, worked


def main() -> None:
    """Work out, write and open the page several times; draw the figures once."""
    stored = results()
    print(
        f"\n{f'{COUNT} recordings of {SAMPLES} samples':52}{'median s':>9}{'least':>9}{'most':>9}"
    )
    seconds, contents = timed(report_contents, stored)
    show("what it shows: models simulated, residuals tested", seconds)
    seconds, page = timed(report_page, contents, STAGES)
    show("the page", seconds)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "report.html"
        path.write_text(page.html, encoding="utf-8")
        seconds, worked = first_paints(path)
        if seconds:
            show("first paint in Chromium", seconds)
            show("processor time of its thread until then", worked)
    tasks = [Task(one.file, one.file, png, (one,), bytes) for one in page.drawings]
    begun = time.perf_counter()
    written = sum(len(found.result) for _, found in compute(tasks, Workers()))
    show(f"{len(tasks)} figures beside it, all cores", [time.perf_counter() - begun])
    print(f"page {len(page.html) / 1e6:.1f} MB, figures {written / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
