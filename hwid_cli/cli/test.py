"""``hwid test``: the final models on all recordings, those never used before included."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from hwid_cli.cli.crossval import crossval_stage
from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session
    from hwid_cli.records.groups import FinalTest
    from hwid_cli.records.recordings import Recording
    from hwid_cli.stages.test import FinalModels


@dataclass(frozen=True, eq=False)
class _ToJudge:
    """What the final test works on: models, recordings, test recordings, threshold."""

    models: "FinalModels"
    recordings: "tuple[Recording, ...]"
    tested_on: tuple[str, ...]
    threshold: float


@click.command("test")
@stage_options
def command(choices: Choices) -> None:
    """Judge the final models on recordings that were never used.

    Judges the widest model of each recording and the chain of groups on all recordings.
    Writes results.h5:/test, test.csv, assignment.csv and coverage_matrix.csv, and shows
    the trend along the chain, what covers what, and which model serves which recording.
    """
    from hwid_cli.cli.session import open_session, say

    session = open_session(choices, "test")
    show_final_test(session, final_test_stage(session))
    say(
        session,
        f"\nresults: {session.results_path}, test.csv, assignment.csv, "
        "coverage_matrix.csv",
    )


@once
def final_test_stage(session: "Session") -> "FinalTest":
    """Bring ``results.h5:/test`` and its CSV files up to date.

    Raises
    ------
    ConfigError
        If the configuration names no test recordings, or no model could be fitted.
    """
    from hwid_cli.cli.session import (
        provenance,
        read_unchanged,
        say,
        stage_tasks,
        start_timer,
    )
    from hwid_cli.stages.test import final_test_key, judge_models
    from hwid_cli.store.final_test_results import read_final_test, write_final_test

    given, path = _to_judge(session), session.results_path
    timer = start_timer()
    key = final_test_key(
        given.models, given.recordings, given.tested_on, given.threshold
    )
    final = read_unchanged(session, "test", key, read_final_test)
    if final is not None:
        done = len(final.recordings)
        say(session, f"test: {done} recordings from the cache, 0 computed, {timer()}")
    else:
        total = len(given.recordings)
        with stage_tasks(session, "test", total, "recordings") as settings:
            final = judge_models(
                given.models,
                given.recordings,
                given.tested_on,
                given.threshold,
                settings,
            )
        origin = provenance(session, key, given.recordings, seconds=timer.seconds)
        write_final_test(path, final, origin)
    write_tables(session, final)
    return final


def _to_judge(session: "Session") -> _ToJudge:
    """Run the stages before this one, and choose the models that it judges."""
    from hwid_cli.cli.session import say
    from hwid_cli.errors import ConfigError
    from hwid_cli.stages.selection import select_recordings
    from hwid_cli.stages.test import final_models

    experiment = session.experiment
    if experiment.test is None:
        raise ConfigError(
            f"{experiment.source}: test: the section is missing; expected the recordings "
            "that nothing else uses; add it, such as 'test: {recordings: [step_05, "
            "step_10]}'"
        )
    identified, crossval = crossval_stage(session)
    search = None
    if experiment.group is None:
        say(
            session,
            f"test: {experiment.source} has no group: section, so there is no chain of "
            "groups to test; models of single recordings only",
        )
    else:
        from hwid_cli.cli.group import group_stage

        search = group_stage(session)
    tested = select_recordings(
        identified.recordings,
        experiment.test.recordings,
        key=f"{experiment.source}: test.recordings",
    )
    models = final_models(identified.fits, crossval, search)
    if not models.names:
        raise ConfigError(
            f"{experiment.source}: orders: no recording has a usable model; expected at "
            "least one to test; widen the orders or change fit"
        )
    names = tuple(recording.name for recording in tested)
    return _ToJudge(models, identified.recordings, names, crossval.threshold)


def write_tables(session: "Session", final: "FinalTest") -> None:
    """Write ``test.csv``, ``assignment.csv`` and ``coverage_matrix.csv``."""
    from hwid_cli.store.final_test_results import (
        write_assignment_csv,
        write_coverage_matrix_csv,
        write_test_csv,
    )

    write_test_csv(session.out / "test.csv", final)
    write_assignment_csv(session.out / "assignment.csv", final)
    write_coverage_matrix_csv(session.out / "coverage_matrix.csv", final)


def show_final_test(session: "Session", final: "FinalTest") -> None:
    """Show the chain, the coverage matrix, the smallest set and the predictions."""
    from hwid_cli.cli.session import show
    from hwid_cli.report import final_test
    from hwid_cli.report.thesis_names import names_of_groups
    from hwid_cli.stages.test import chain_trend
    from hwid_cli.store.group_results import read_group
    from hwid_cli.store.results import read_calibrated

    if final.chain:
        recordings = read_calibrated(session.calibrated_path).recordings
        kinds = {recording.name: recording.kind for recording in recordings}
        trend = chain_trend(final, kinds)
        is_asked = session.experiment.thesis_names
        names = names_of_groups(read_group(session.results_path)) if is_asked else {}
        show(
            session,
            final_test.chain_on_tests_table(final, trend),
            final_test.chain_coverage_table(final, trend, names),
            *final_test.chain_tables(final, trend, kinds),
        )
    show(session, final_test.coverage_matrix_table(final))
    show(session, *final_test.gap_sentences(final))
    show(session, final_test.smallest_set_table(final))
    show(session, final_test.prediction_table(final))
