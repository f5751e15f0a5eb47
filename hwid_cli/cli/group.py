"""``hwid group``: recordings joined into models that cover more of them."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from hwid_cli.cli.calibrate import calibrate_stage
from hwid_cli.cli.identify import identify_stage
from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session
    from hwid_cli.records.groups import GroupSearch
    from hwid_cli.stages.group import GroupPlan, RunLevel
    from hwid_cli.stages.identify import Run


@click.command("group")
@stage_options
def command(choices: Choices) -> None:
    """Join recordings, level by level, into models that cover more of them.

    Writes the search to results.h5:/group and groups.csv, and shows the coverage of
    every group that was tried.
    """
    from hwid_cli.cli.session import open_session, say

    session = open_session(choices, "group")
    show_groups(session, group_stage(session))
    say(session, f"\nresults: {session.results_path}, groups.csv")


@once
def group_stage(session: "Session") -> "GroupSearch":
    """Bring ``results.h5:/group`` and ``groups.csv`` up to date."""
    from hwid_cli.cli.session import provenance, read_unchanged, say, start_timer
    from hwid_cli.stages.group import group_key, search_all
    from hwid_cli.store.group_results import read_group, write_group, write_groups_csv

    plan, path = _plan(session), session.results_path
    timer = start_timer()
    key = group_key(plan)
    search = read_unchanged(session, "group", key, read_group)
    if search is not None:
        tried = len(search.groups)
        say(session, f"group: {tried} groups from the cache, 0 computed, {timer()}")
    else:
        search = search_all(plan, _runner(session))
        origin = provenance(session, key, plan.recordings, seconds=timer.seconds)
        write_group(path, search, origin)
    write_groups_csv(session.out / "groups.csv", search)
    return search


def show_groups(session: "Session", search: "GroupSearch") -> None:
    """Show the coverage of every group, what the levels filtered, and the chain."""
    from hwid_cli.cli.session import show
    from hwid_cli.report.groups import chain_table, join_table, levels_table

    for level in search.levels[1:]:
        show(session, join_table(search, level))
    show(session, levels_table(search))
    show(session, chain_table(search))


def _plan(session: "Session") -> "GroupPlan":
    """Everything that the search depends on, from the configuration."""
    from hwid_cli.records.experiment import CrossvalOptions, GroupOptions
    from hwid_cli.stages.group import GroupPlan
    from hwid_cli.stages.selection import select_recordings

    experiment = session.experiment
    identify_stage(session)
    recordings = calibrate_stage(session).recordings
    options = experiment.group or GroupOptions()
    held_out = () if experiment.test is None else experiment.test.recordings

    def chosen(key: str) -> tuple[str, ...]:
        place = f"{experiment.source}: group.{key}"
        names = getattr(options, key)
        found = select_recordings(recordings, names, key=place, held_out=held_out)
        return tuple(one.name for one in found)

    start = None if options.start is None else chosen("start")
    candidates, validate = chosen("candidates"), chosen("validate")
    used = {*(start or ()), *candidates, *validate}
    return GroupPlan(
        recordings=tuple(one for one in recordings if one.name in used),
        start=start,
        candidates=candidates,
        validate=validate,
        orders=experiment.orders,
        fit_options=experiment.fit,
        options=options,
        threshold=(experiment.crossval or CrossvalOptions()).threshold,
    )


def _runner(session: "Session") -> "RunLevel":
    """Do the work of a level under a progress bar."""
    from hwid_cli.cli.session import stage_tasks
    from hwid_cli.tasks.runner import run_tasks

    def run(level: int, unit: str, total: int, work: "Callable[[Run], Any]") -> Any:
        part = f"level {level}"
        with stage_tasks(session, "group", total, unit, part=part) as settings:
            # Fits of single recordings are those of another stage: --force spares them.
            is_forced = settings.force and not (level == 1 and unit == "fits")
            own = replace(settings, force=is_forced)
            return work(lambda tasks: run_tasks(tasks, own))

    return run
