"""``hwid report``: one page that shows whatever stages have run."""

import json
import logging
from collections.abc import Iterable, Sequence
from contextlib import closing
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from hwid_cli.cli.options import Choices
from hwid_cli.cli.session import Session, Timer, context_of, open_session
from hwid_cli.config.load import describe_experiment
from hwid_cli.errors import ConfigError, HwidError
from hwid_cli.files.atomic import replace_file
from hwid_cli.files.figure_files import read_figure, write_figure
from hwid_cli.records.recordings import Calibrated
from hwid_cli.records.report import StageRun, StoredResults
from hwid_cli.report.progress import StageProgress
from hwid_cli.stages.calibrate import figure_path
from hwid_cli.stages.report import changed_sections, report_contents, report_key
from hwid_cli.stages.table import STAGES, stage_named
from hwid_cli.store.diagnosis_results import read_diagnosis
from hwid_cli.store.order_results import read_chosen_maps
from hwid_cli.store.result_files import has_left_results, read_provenance
from hwid_cli.tasks.task import Task
from hwid_cli.tasks.workers import Workers, compute

if TYPE_CHECKING:
    from hwid_cli.report.page import Drawing

_log = logging.getLogger(__name__)

FILE = "report.html"
FIGURES = "figures"
# Fewer figures than this are drawn before workers have started, [-].
_FEW_FIGURES = 48
# Figures that are read, not drawn: they are part of what a page is drawn from.
_OF_CALIBRATION = "calibrate/"
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
    about = _figures_key(stored)
    if "report" not in session.forced and _is_complete(session.out, path, key, about):
        session.note_end("report", f"{path} shows {stages} already", timer)
        return path
    # What draws is loaded where something is drawn.
    from hwid_cli.report.html import report_page

    page = report_page(report_contents(stored), STAGES)
    for name, png in page.figures.items():
        _write_figure(session.out, name, png, about)
    # The page before the figures beside it: it is what people wait for.
    replace_file(path, _signed(page.html + _last_line(key, page.files)))
    session.note_end("report", f"{path} shows {stages}", timer)
    _draw(session, page.drawings, about)
    return path


def _draw(session: Session, drawings: "Sequence[Drawing]", about: str) -> None:
    """Write the figures beside the page.

    Parameters
    ----------
    about : str
        What they are drawn from.
    """
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
            _write_figure(session.out, file, png, about)
            bar.advance(from_cache=False)


def _write_figure(out: Path, name: str, png: bytes, about: str) -> None:
    """Write a figure that the page draws; those of calibration are its own."""
    if not name.startswith(_OF_CALIBRATION):
        write_figure(out / FIGURES / name, png, f"{about} {name}")


def _png(drawing: "Drawing") -> bytes:
    return drawing.png


def _last_line(key: str, figures: Iterable[str]) -> str:
    """Comment that says what a page was drawn from, and which figures belong to it."""
    # The sign that ends a comment may be part of a name.
    names = json.dumps(sorted(figures)).replace(">", "\\u003e")
    return f"{_KEY_MARK}{key} {names}{_KEY_END}"


def _signed(page: str) -> bytes:
    """A page with its checksum, in a comment behind it."""
    content = page.encode()
    return content + f"<!-- sha256 {sha256(content).hexdigest()} -->\n".encode()


def _figures_key(stored: StoredResults) -> str:
    """What figures are drawn from; unlike the page they say nothing of how long it took."""
    diagnosis = (stored.diagnosis or {}).get("provenance") or {}
    keys = [*(run.key for run in stored.stages), str(diagnosis.get("key"))]
    return sha256(" ".join(keys).encode()).hexdigest()


def _is_complete(out: Path, path: Path, key: str, about: str) -> bool:
    """Whether a page was drawn from the same, and it and all its figures are whole."""
    if not path.is_file():
        return False
    page, mark, _ = path.read_bytes().rpartition(b"<!-- sha256 ")
    text = page.decode(errors="replace")
    if not mark or _signed(text) != path.read_bytes():
        return False
    said, _, names = text.rpartition(_KEY_MARK)[2].partition(" ")
    if said != key or not names.endswith(_KEY_END):
        return False
    figures = json.loads(names.removesuffix(_KEY_END))
    return all(
        read_figure(out / FIGURES / name, f"{about} {name}") is not None
        for name in figures
        if not name.startswith(_OF_CALIBRATION)
    )


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
        else _calibration_figures(session, calibrated),
        order=experiment.order,
        chosen_maps=read_chosen_maps(session.out),
    )


def _calibration_figures(session: Session, calibrated: Calibrated) -> dict[str, bytes]:
    """Figures that calibration left, by the names of the recordings."""
    figures = _whole_figures(session.out, calibrated)
    names = [log.name for log in calibrated.logs if log.name not in figures]
    damaged = [name for name in names if figure_path(session.out, name).exists()]
    if damaged and not _draw_again(session, calibrated):
        _log.warning(
            "%s: damaged, or of other results; left out; 'hwid calibrate' draws it again",
            ", ".join(str(figure_path(session.out, name)) for name in damaged),
        )
    return _whole_figures(session.out, calibrated) if damaged else figures


def _whole_figures(out: Path, calibrated: Calibrated) -> dict[str, bytes]:
    found = {
        log.name: read_figure(
            figure_path(out, log.name), f"{calibrated.key} {log.name}"
        )
        for log in calibrated.logs
    }
    return {name: png for name, png in found.items() if png is not None}


def _draw_again(session: Session, calibrated: Calibrated) -> bool:
    """Draw the figures of a calibration again, where its measurements are unchanged."""
    stage = stage_named("calibrate")
    try:
        given = stage.choose(context_of(session))
    except HwidError:
        # Measurements may be gone; what has been stored of them is shown all the same.
        return False
    if stage.key is None or stage.key(given) != calibrated.key:
        return False
    stage.write_files(session.out, given, calibrated, None, False)
    return True
