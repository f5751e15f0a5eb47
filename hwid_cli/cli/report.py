"""``hwid report``: one page that shows whatever stages have run."""

import json
from collections.abc import Iterable, Sequence
from contextlib import closing
from pathlib import Path

from hwid_cli.cli.options import Choices
from hwid_cli.cli.session import Session, Timer, open_session
from hwid_cli.config.load import describe_experiment
from hwid_cli.errors import ConfigError
from hwid_cli.files.atomic import replace_file
from hwid_cli.records.recordings import Calibrated
from hwid_cli.records.report import StageRun, StoredResults
from hwid_cli.report.html import report_page
from hwid_cli.report.page import Drawing
from hwid_cli.report.progress import StageProgress
from hwid_cli.stages.report import changed_sections, report_contents, report_key
from hwid_cli.stages.table import STAGES, stage_named
from hwid_cli.store.diagnosis_results import read_diagnosis
from hwid_cli.store.order_results import read_chosen_maps
from hwid_cli.store.result_files import has_left_results, read_provenance
from hwid_cli.tasks.task import Task
from hwid_cli.tasks.workers import Workers, compute

FILE = "report.html"
FIGURES = "figures"
# Fewer figures than this are drawn before workers have started, [-].
_FEW_FIGURES = 48
_KEY_MARK, _KEY_END = "<!-- drawn from ", " -->\n"


def report(choices: Choices) -> None:
    """Show whatever stages have run on one page."""
    session = open_session(choices, "report", is_alone=False)
    session.say(str(write_report(session)))


def write_report(session: Session) -> Path:
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
    timer = Timer()
    stored = read_stored(session)
    if not stored.stages and stored.diagnosis is None:
        source = session.experiment.source
        raise ConfigError(
            f"{session.out}: holds no results; expected those of at least one stage; "
            f"run 'hwid run {source}' first, with the same --out"
        )
    key = report_key(stored)
    path = session.out / FILE
    stages = ", ".join(run.stage for run in stored.stages) or "the diagnosis"
    if "report" not in session.forced and _is_complete(session.out, path, key):
        session.note_end("report", f"{path} shows {stages} already", timer)
        return path
    page = report_page(report_contents(stored), STAGES)
    for name, png in page.figures.items():
        _write_figure(session.out / FIGURES / name, png)
    # The page before the figures beside it: it is what people wait for.
    replace_file(path, (page.html + _last_line(key, page.files)).encode())
    session.note_end("report", f"{path} shows {stages}", timer)
    _draw(session, page.drawings)
    return path


def _draw(session: Session, drawings: Sequence[Drawing]) -> None:
    """Write the figures beside the page."""
    if not drawings:
        return
    tasks = [Task(one.file, one.file, _png, (one,), bytes) for one in drawings]
    is_few = len(tasks) < _FEW_FIGURES
    workers = Workers(1 if is_few else session.workers.jobs)
    with (
        StageProgress(
            "figures", len(tasks), "figures", is_silent=session.is_quiet
        ) as bar,
        closing(compute(tasks, workers)) as results,
    ):
        for file, (png, _) in results:
            _write_figure(session.out / FIGURES / file, png)
            bar.advance(from_cache=False)


def _write_figure(place: Path, png: bytes) -> None:
    """Write a figure, unless it is there already."""
    if not (place.is_file() and place.read_bytes() == png):
        replace_file(place, png)


def _png(drawing: Drawing) -> bytes:
    return drawing.png


def _last_line(key: str, figures: Iterable[str]) -> str:
    """Comment that says what a page was drawn from, and which figures belong to it."""
    # The sign that ends a comment may be part of a name.
    names = json.dumps(sorted(figures)).replace(">", "\\u003e")
    return f"{_KEY_MARK}{key} {names}{_KEY_END}"


def _is_complete(out: Path, path: Path, key: str) -> bool:
    """Whether a page was drawn from the same, and all of its figures are still there."""
    if not path.is_file():
        return False
    page = path.read_text(encoding="utf-8", errors="replace")
    said, _, names = page.rpartition(_KEY_MARK)[2].partition(" ")
    if said != key or not names.endswith(_KEY_END):
        return False
    figures = json.loads(names.removesuffix(_KEY_END))
    return all((out / FIGURES / name).is_file() for name in figures)


def read_stored(session: Session) -> StoredResults:
    """Read the results of all stages that have run.

    Raises
    ------
    CacheError
        If results are there but cannot be read.
    """
    experiment = session.experiment
    described = describe_experiment(experiment)
    runs, results = [], {}
    for name in STAGES:
        storage = stage_named(name).storage
        if storage is None or not storage.is_hdf5:
            continue
        path = session.out / storage.file
        if not has_left_results(path, name):
            continue
        origin = read_provenance(path, name)
        changed = changed_sections(name, described, origin.config)
        runs.append(
            StageRun(name, origin.key, origin.seconds, origin.versions, changed)
        )
        results[name] = storage.read(path)
    calibrated, crossval = results.get("calibrate"), results.get("crossval")
    nk_role = experiment.orders.nk_role if crossval is None else crossval.nk_role
    return StoredResults(
        name=experiment.name,
        config=json.dumps(described, indent=2, ensure_ascii=False),
        nk_role=nk_role,
        stages=tuple(runs),
        results=results,
        diagnosis=read_diagnosis(session.out / "diagnosis.json"),
        thesis_names=experiment.thesis_names,
        calibration_figures={}
        if calibrated is None
        else _calibration_figures(session.out, calibrated),
        order=experiment.order,
        chosen_maps=read_chosen_maps(session.out),
    )


def _calibration_figures(out: Path, calibrated: Calibrated) -> dict[str, bytes]:
    """Figures that calibration left, by the names of the recordings."""
    folder = out / FIGURES / "calibrate"
    paths = {log.name: folder / f"{log.name}.png" for log in calibrated.logs}
    return {name: path.read_bytes() for name, path in paths.items() if path.is_file()}
