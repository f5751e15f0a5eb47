"""What a command says last, from what has run."""

import shlex
from collections.abc import Sequence

from hwid_cli.cli.session import Session, Timer, screen_width
from hwid_cli.cli.stage_runner import LinearRunner
from hwid_cli.records.best_model import LINEAR, BestModel
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.experiment import CrossvalOptions
from hwid_cli.records.report import StoredResults
from hwid_cli.report.closing import (
    LINEAR_KEYS,
    LONG_NAME,
    UNDECIDED_MAPS,
    above_threshold_hint,
    best_model_sentences,
    closing_text,
    diagnosis_sentence,
    keys_hint,
    nothing_hint,
    orders_sentence,
    recordings_sentence,
)
from hwid_cli.report.map_words import fit_keys
from hwid_cli.simulations.kinds import kind_named
from hwid_cli.stages.best_model import beside_linear, best_model
from hwid_cli.stages.model_views import named_fits
from hwid_cli.stages.table import is_named, stage_named

PAGE = "report.html"
TABLES = "tables.txt"
_RUN = "run"
# Stages whose results are easier read on the page, where there is none yet.
_WITH_PAGE = ("diagnose", "test")
# They make no model; those of earlier runs may be older than the recordings.
_WITHOUT_MODEL = ("diagnose", "calibrate", "next")
# Of a diagnosis; the page has all.
_MOST_WARNINGS = 2
# The model to take, as export knows it, in place of a name that is longer than a line.
BEST = "best"
BEST_LINEAR = f"{LINEAR}{BEST}"
# What follows a stage, unless its results say more.
_NEXT = {
    "simulate": "run",
    "calibrate": "identify",
    "identify": "crossval",
    "crossval": "order",
    "group": "test",
}


def say_end(session: Session, name: str, files: Sequence[str] = ()) -> None:
    """Show the block that ends the command of a stage, or ``run``.

    Parameters
    ----------
    name : str
        One of ``STAGES``, or ``run``.
    files : sequence of str
        What it may have written; what the stage names, where empty.
    """
    if session.is_quiet:
        return
    diagnosis = session.results.get("diagnose")
    best = None if name in _WITHOUT_MODEL else recommended(session)
    rows = []
    if best is not None:
        rows += [("best model", one) for one in best_model_sentences(best)]
    advice = session.results.get("order")
    if advice is not None and name in (_RUN, "order"):
        asks_for_maps = best is None or (best.is_usable and not best.own_maps)
        maps = advice.maps if asks_for_maps else None
        rows.append(("orders", orders_sentence(advice.orders, maps, best)))
    if diagnosis is not None:
        rows.append(("simulation", diagnosis_sentence(diagnosis)))
        rows += [("warning", one) for one in diagnosis.warnings[:_MOST_WARNINGS]]
    wanted = session.results.get("next")
    if wanted is not None:
        rows.append(("record", recordings_sentence(wanted, session.out / "next")))
    rows += _places(session, name, files)
    if best is not None and name in (_RUN, "test", "order"):
        rows += _hints(session, best, name)
    rows.append(("next", _next(session, name, best)))
    title = f"{session.experiment.name}: {name} done in {session.timer}"
    session.say(closing_text(f"\n{title}", rows, screen_width()))


def recommended(session: Session) -> BestModel | None:
    """The model to take by what has run, beside the linear one."""
    experiment, results = session.experiment, session.results
    options = experiment.crossval or CrossvalOptions()
    best = best_model(
        results, nk_role=experiment.orders.nk_role, threshold=options.threshold
    )
    if best is None:
        return None
    stored = StoredResults(
        experiment.name,
        config="",
        nk_role=experiment.orders.nk_role,
        results={one: results.get(one) for one in ("group",)}
        | {"identify": results["identify"]},
    )
    run, timer = LinearRunner(session, "best model"), Timer()
    found = beside_linear(
        best,
        named_fits(stored),
        results["calibrate"].recordings,
        run,
        nk_role=experiment.orders.nk_role,
    )
    if run.has_computed:
        session.note(f"linear models: {run.counted}, {timer}")
    return found


def _hints(session: Session, best: BestModel, name: str) -> list[tuple[str, str]]:
    """What may help a model that is not good enough."""
    experiment = session.experiment
    if not best.is_usable:
        return [("hint", nothing_hint(str(experiment.source)))]
    if best.is_linear_better:
        return _better_maps(session, name)
    if not best.rmsd >= best.threshold:
        return []
    if experiment.group is not None:
        text = above_threshold_hint(
            str(experiment.source),
            has_order="order" in session.results,
            has_next=experiment.next is not None,
        )
        return [("hint", text)]
    text = (
        "a model of several recordings may cover more: add 'group: {}' to "
        f"{experiment.source} and run it again"
    )
    return [("hint", text)]


def _better_maps(session: Session, name: str) -> list[tuple[str, str]]:
    """What to set where a linear model is better than the maps of the configuration."""
    source = str(session.experiment.source)
    maps = getattr(session.results.get("order"), "maps", None)
    if maps is None:
        return [("hint", keys_hint(LINEAR_KEYS, source))]
    if maps.chosen == maps.given:
        return [("hint", UNDECIDED_MAPS)]
    # The orders' row of a run says it already.
    return [] if name == _RUN else [("hint", keys_hint(fit_keys(maps.chosen), source))]


def _places(session: Session, name: str, files: Sequence[str]) -> list[tuple[str, str]]:
    """Where to look: the page, and files of the stage."""
    out, rows = session.out, []
    if (out / PAGE).is_file():
        rows.append(("page", str(out / PAGE)))
    elif name in _WITH_PAGE:
        rows.append(("page", f"{command_line(session, 'report')} draws it"))
    if name == _RUN and (out / TABLES).is_file():
        rows.append(("tables", str(out / TABLES)))
    known = files or (() if name == _RUN else stage_named(name).files)
    there = [file for file in known if (out / file).exists()]
    first, *others = there or [""]
    return [*rows, ("results", ", ".join([str(out / first), *others]))]


def _next(session: Session, name: str, best: BestModel | None) -> str:
    """The command that a user would give next."""
    diagnosis, wanted = (session.results.get(one) for one in ("diagnose", "next"))
    if name == "next" and wanted is not None and wanted.proposals:
        # The loop: what is new in the folder is taken up from the cache.
        return f"record them, then {command_line(session, 'next')}"
    if diagnosis is not None and (best is None or name == "diagnose"):
        return _after_diagnosis(session, diagnosis)
    follows = _NEXT.get(name)
    if follows == "test" and not is_named("test", session.experiment):
        follows = None
    if follows is not None:
        return command_line(session, follows)
    if best is not None and not best.is_usable:
        return command_line(session, "check")
    if best is not None:
        return _after_model(session, best)
    return command_line(session, "run" if name != _RUN else "identify")


def _after_model(session: Session, best: BestModel) -> str:
    """Take the model elsewhere, unless something may still make it good enough."""
    results = session.results
    if not best.is_linear_better and best.rmsd >= best.threshold:
        if "order" not in results:
            return command_line(session, "order")
        if session.experiment.next is not None and "next" not in results:
            return command_line(session, "next")
    is_long = len(best.taken_name) > LONG_NAME
    name = BEST if is_long else best.taken_name
    return command_line(session, "export", "--model", name)


def _after_diagnosis(session: Session, diagnosis: Diagnosis) -> str:
    foreign = session.experiment.foreign_simulation
    wanted = diagnosis.next_experiment.input
    if diagnosis.verdict in ("ambiguous", "unknown") and wanted:
        return f"measure: {wanted}"
    if diagnosis.verdict == "none":
        return command_line(session, "report")
    if foreign is None:
        return command_line(session, "export", "--diagnosis", "--format", "fmu")
    if "python" in kind_named(foreign.kind).exports:
        return command_line(session, "export", "--diagnosis", "--format", "python")
    return f"look at {session.out / 'extended_simulation.yaml'}"


def command_line(session: Session, command: str, *options: str) -> str:
    """Write a command for the same configuration and folders, as a shell takes it."""
    words = ["hwid", command, *session.arguments]
    return shlex.join([*words, *options])
