"""``hwid report``: one page that shows whatever stages have run."""

import json
import logging
from collections.abc import Mapping, Sequence
from contextlib import closing
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from hwid_cli.cli.options import Choices
from hwid_cli.cli.progress_lines import ProgressLines
from hwid_cli.cli.session import Session, Timer, open_session
from hwid_cli.cli.stage_runner import LinearRunner
from hwid_cli.config.load import describe_experiment
from hwid_cli.errors import ConfigError
from hwid_cli.files.atomic import replace_file
from hwid_cli.files.figure_files import read_figure, write_figure
from hwid_cli.records.report import StageRun, StoredResults
from hwid_cli.report.progress import StageProgress
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
    # What draws is loaded where something is drawn.
    from hwid_cli.report.html import report_page

    linear = LinearRunner(session, "report")
    page = report_page(report_contents(stored, linear), STAGES)
    keys = {one.file: one.key for one in page.drawings}
    # The page before the figures beside it: it is what people wait for.
    replace_file(path, _signed(page.html + _last_line(key, keys)))
    fits = f"{linear.counted}, " if linear.counted else ""
    session.note_end("report", f"{fits}{path} shows {stages}", timer)
    _draw(session, page.drawings, keys)
    return path


def _draw(
    session: Session, drawings: "Sequence[Drawing]", keys: Mapping[str, str]
) -> None:
    """Write the figures beside the page that are not there already.

    Parameters
    ----------
    keys : mapping of str to str
        What each file is drawn from.
    """
    folder = session.out / FIGURES
    is_forced = "report" in session.forced
    tasks = [
        Task(one.file, one.file, _png, (one,), bytes)
        for one in drawings
        if is_forced or read_figure(folder / one.file, keys[one.file]) is None
    ]
    if not tasks:
        return
    is_few = len(tasks) < _FEW_FIGURES
    workers = Workers(1 if is_few else session.workers.jobs)
    with (
        StageProgress(
            "figures", len(tasks), "figures", is_silent=session.is_quiet
        ) as bar,
        ProgressLines(session, lambda: bar.text),
        closing(compute(tasks, workers)) as results,
    ):
        for file, (png, _) in results:
            write_figure(folder / file, png, keys[file])
            bar.advance(from_cache=False)


def _png(drawing: "Drawing") -> bytes:
    return drawing.png


def _last_line(key: str, figures: Mapping[str, str]) -> str:
    """Comment that says what a page and the figures that belong to it were drawn from."""
    # The sign that ends a comment may be part of a name.
    names = json.dumps(dict(sorted(figures.items()))).replace(">", "\\u003e")
    return f"{_KEY_MARK}{key} {names}{_KEY_END}"


def _signed(page: str) -> bytes:
    """A page with its checksum, in a comment behind it."""
    content = page.encode()
    return content + f"<!-- sha256 {sha256(content).hexdigest()} -->\n".encode()


def _is_complete(out: Path, path: Path, key: str) -> bool:
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
        read_figure(out / FIGURES / name, about) is not None
        for name, about in figures.items()
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
    crossval = results.get("crossval")
    nk_role = experiment.orders.nk_role if crossval is None else crossval.nk_role
    return StoredResults(
        name=experiment.name,
        config=json.dumps(described, indent=2, ensure_ascii=False),
        nk_role=nk_role,
        stages=tuple(runs),
        results=results,
        diagnosis=read_diagnosis(session.out / "diagnosis.json"),
        thesis_names=experiment.thesis_names,
        order=experiment.order,
        chosen_maps=read_chosen_maps(session.out),
        source=Path(experiment.source).name,
    )
