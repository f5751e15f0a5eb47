"""``hwid report``: one page that shows whatever stages have run."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hwid_cli.cli.options import Choices, stage_options

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hwid_cli.cli.session import Session
    from hwid_cli.records.report import StageRun, StoredResults

FILE = "report.html"
FIGURES = "figures"
_KEY_MARK, _KEY_END = "<!-- drawn from ", " -->\n"


@click.command("report")
@stage_options
def command(choices: Choices) -> None:
    """Show whatever stages have run on one page.

    Runs no stage. Writes report.html, which needs nothing else to be looked at, and its
    figures as figures/*.png.
    """
    from hwid_cli.cli.session import open_session

    session = open_session(choices, "report", is_alone=False)
    report_stage(session)


def report_stage(session: "Session") -> Path:
    """Write ``report.html`` and its figures from the stored results.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ConfigError
        If no stage has run.
    CacheError
        If results are there but cannot be read; nothing is written then.
    """
    from hwid_cli.cli.session import say, start_timer
    from hwid_cli.errors import ConfigError
    from hwid_cli.files.atomic import replace_file
    from hwid_cli.report.html import report_page
    from hwid_cli.stages.report import report_contents, report_key

    timer = start_timer()
    stored = read_stored(session)
    if not stored.stages and stored.diagnosis is None:
        source = session.experiment.source
        raise ConfigError(
            f"{session.out}: holds no results; expected those of at least one stage; "
            f"run 'hwid run {source}' first, with the same --out"
        )
    figures = _calibration_figures(session, stored)
    key = report_key(stored, figures)
    path = session.out / FILE
    stages = ", ".join(run.stage for run in stored.stages) or "the diagnosis"
    if "report" not in session.forced and _is_complete(session.out, path, key):
        say(session, f"report: {path} shows {stages} already, {timer()}")
        return path
    page = report_page(report_contents(stored), figures)
    for name, png in page.figures.items():
        place = session.out / FIGURES / name
        if not (place.is_file() and place.read_bytes() == png):
            replace_file(place, png)
    replace_file(path, (page.html + _last_line(key, page.figures)).encode())
    say(session, f"report: {path} shows {stages}, {timer()}")
    return path


def _last_line(key: str, figures: "Iterable[str]") -> str:
    """Comment that says what a page was drawn from, and which figures belong to it."""
    import json

    # The sign that ends a comment may be part of a name.
    names = json.dumps(sorted(figures)).replace(">", "\\u003e")
    return f"{_KEY_MARK}{key} {names}{_KEY_END}"


def _is_complete(out: Path, path: Path, key: str) -> bool:
    """Whether a page was drawn from the same, and all of its figures are still there."""
    import json

    if not path.is_file():
        return False
    page = path.read_text(encoding="utf-8", errors="replace")
    said, _, names = page.rpartition(_KEY_MARK)[2].partition(" ")
    if said != key or not names.endswith(_KEY_END):
        return False
    figures = json.loads(names.removesuffix(_KEY_END))
    return all((out / FIGURES / name).is_file() for name in figures)


def read_stored(session: "Session") -> "StoredResults":
    """Read the results of all stages that have run.

    Raises
    ------
    CacheError
        If results are there but cannot be read.
    """
    import json

    from hwid_cli.config.load import describe_experiment
    from hwid_cli.records.report import StoredResults
    from hwid_cli.store.diagnosis_results import read_diagnosis, read_diagnosis_record
    from hwid_cli.store.final_test_results import read_final_test
    from hwid_cli.store.group_results import read_group
    from hwid_cli.store.results import read_calibrated, read_crossval, read_fits

    described = describe_experiment(session.experiment)
    runs = _stage_runs(session, described)
    done = {run.stage for run in runs}
    calibrated = (
        read_calibrated(session.calibrated_path) if "calibrate" in done else None
    )
    path = session.results_path
    crossval = read_crossval(path) if "crossval" in done else None
    orders = session.experiment.orders
    return StoredResults(
        name=session.experiment.name,
        config=json.dumps(described, indent=2, ensure_ascii=False),
        nk_role=orders.nk_role if crossval is None else crossval.nk_role,
        stages=runs,
        recordings=() if calibrated is None else calibrated.recordings,
        logs=() if calibrated is None else calibrated.logs,
        fits=read_fits(path) if "identify" in done else (),
        crossval=crossval,
        search=read_group(path) if "group" in done else None,
        final_test=read_final_test(path) if "test" in done else None,
        diagnosis=read_diagnosis(session.out / "diagnosis.json"),
        diagnosis_record=read_diagnosis_record(path) if "diagnose" in done else None,
        thesis_names=session.experiment.thesis_names,
    )


def _stage_runs(
    session: "Session", described: dict[str, Any]
) -> "tuple[StageRun, ...]":
    """Stages that have left results, and how each was run."""
    from hwid_cli.records.report import StageRun
    from hwid_cli.stages.report import STAGES, changed_sections
    from hwid_cli.store.result_files import has_left_results, read_provenance

    runs = []
    for stage in STAGES:
        is_first = stage == "calibrate"
        path = session.calibrated_path if is_first else session.results_path
        if not has_left_results(path, stage):
            continue
        origin = read_provenance(path, stage)
        changed = changed_sections(stage, described, origin.config)
        runs.append(
            StageRun(stage, origin.key, origin.seconds, origin.versions, changed)
        )
    return tuple(runs)


def _calibration_figures(
    session: "Session", stored: "StoredResults"
) -> dict[str, bytes]:
    """Figures that calibration left, by the names of the recordings."""
    folder = session.out / FIGURES / "calibrate"
    paths = {log.name: folder / f"{log.name}.png" for log in stored.logs}
    return {name: path.read_bytes() for name, path in paths.items() if path.is_file()}
