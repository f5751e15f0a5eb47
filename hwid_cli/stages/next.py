"""Stage ``next``: which recordings to take next, or that enough is known.

Offered are the inputs of a plan, or inputs that are designed within limits. Of these the
ones that teach most are chosen one after the other (`trust.choice`), each for what it adds
to the recordings that are there and to those chosen before it. When a new recording lies
in the folder, the same command takes it up, says what it changed, and proposes again.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hwid_cli.errors import ConfigError
from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import Experiment, NextOptions
from hwid_cli.records.model import Fit
from hwid_cli.records.next import (
    InputMap,
    NextRecordings,
    ProposedRecording,
)
from hwid_cli.records.recordings import Recording
from hwid_cli.records.units import as_percent
from hwid_cli.report.next import next_blocks
from hwid_cli.report.table import Block
from hwid_cli.stages.diagnose import answers
from hwid_cli.stages.diagnose import choose as choose_diagnosis
from hwid_cli.stages.fit_seconds import counted
from hwid_cli.stages.next_goals import NAME, WAYS, Choice, ToChoose, known_before
from hwid_cli.stages.next_seconds import choice_seconds
from hwid_cli.stages.offered_inputs import next_options, odd_inputs, offered_inputs
from hwid_cli.stages.order_grid import grid_place
from hwid_cli.stages.output_range import (
    Foresee,
    Reach,
    foreseen_by,
    in_words,
    reaches,
    within,
)
from hwid_cli.stages.ranking import best_fits
from hwid_cli.stages.stage import Context, Planning, Runner, Stage, as_record
from hwid_cli.stages.trust import kept_for_test
from hwid_cli.store.next_results import (
    read_previous,
    write_next_files,
)
from hwid_cli.store.result_files import Provenance
from hwid_cli.tasks.task import one_thread
from hwid_cli.trust.content import content, joined, value_edges
from hwid_cli.trust.visited import N_BANDS


def propose_next(given: ToChoose, runner: Runner) -> NextRecordings:
    """Choose the recordings that teach most."""
    with one_thread():
        reached = _reached(given, runner)
        given, left_out = _within_range(given, reached)
        choice = WAYS[given.options.goal](given, runner)
    unit = given.recordings[0].output_unit
    proposals = tuple(_with_reach(one, reached, unit) for one in choice.proposals)
    table = _input_map(given, [one.values for one in proposals])
    return NextRecordings(
        goal=given.options.goal,
        recordings=tuple(one.name for one in given.recordings),
        known=choice.known,
        known_words=choice.known_words,
        is_enough=not proposals,
        sentence=choice.sentence + left_out,
        proposals=proposals,
        map=table,
        n_offered=len(given.offered),
        sample_time_s=given.recordings[0].sample_time_s,
        input_unit=given.recordings[0].input_unit,
        changed=_changed(given, choice),
        repeats=choice.repeats,
    )


def _reached(given: ToChoose, runner: Runner) -> dict[str, Reach]:
    """Outputs that the offered inputs are foreseen to reach, where a range is given."""
    if given.options.output_range is None:
        return {}
    return reaches(given.offered, _foresee(given, runner))


def _foresee(given: ToChoose, runner: Runner) -> Foresee:
    """What tells the output of an input that nobody has played."""
    diagnosed = given.diagnosed
    if diagnosed is not None:
        return lambda inputs: answers(diagnosed, runner, inputs)
    if given.fit is None or given.fit.model is None:
        raise ValueError("a range of the output has a model")
    return foreseen_by(given.fit.model)


def _within_range(given: ToChoose, reached: dict[str, Reach]) -> tuple[ToChoose, str]:
    """The same without inputs that leave the range, and how many these are in words."""
    limits = given.options.output_range
    if limits is None:
        return given, ""
    unit = given.recordings[0].output_unit
    left = within(given.plan, reached, limits, unit, given.source)
    count = len(given.plan) - len(left)
    said = (
        f"; {counted(count, 'input')} of {len(reached)} left out: the output is foreseen "
        f"to leave {in_words(limits, unit)}"
    )
    return replace(given, plan=left), said * (count > 0)


def _with_reach(
    one: ProposedRecording, reached: dict[str, Reach], unit: str
) -> ProposedRecording:
    """The same with what it is foreseen to reach; repeats were played already."""
    if one.name not in reached:
        return one
    said = f"the output is foreseen to go from {in_words(reached[one.name], unit)}"
    return replace(one, reason=f"{one.reason}; {said}")


def _changed(given: ToChoose, choice: Choice) -> str:
    """What the recordings since the last proposal changed, by what is on offer now."""
    before = given.previous
    if before is None or before.goal != given.options.goal:
        return ""
    names = [one.name for one in given.recordings if one.name not in before.recordings]
    if not names:
        is_same = len(given.recordings) == len(before.recordings)
        return before.changed if is_same and before.known == choice.known else ""
    asked = {one.name for one in before.proposals}
    words = ", ".join(f"{name}{' (proposed)' * (name in asked)}" for name in names)
    form = "{:g}".format if given.options.goal == "diagnosis" else as_percent
    earlier = f"{form(known_before(given, before))} before"
    if before.known_words != choice.known_words:
        # Of another model, or what had been decided then is open now.
        earlier = f"{form(before.known)} {before.known_words} before"
    return (
        f"new since the last proposal: {words}; {earlier}, {form(choice.known)} now "
        f"{choice.known_words}"
    )


def _input_map(given: ToChoose, proposed: Sequence[np.ndarray]) -> InputMap:
    inputs = [one.input for one in given.recordings]
    offered = [one.values for one in given.offered]
    edges = value_edges([*inputs, *offered])
    visited = joined([content(one, edges) for one in inputs])
    after = joined([visited, *(content(one, edges) for one in proposed)])
    reachable = joined([visited, *(content(one, edges) for one in offered)])
    nyquist = 0.5 / given.recordings[0].sample_time_s
    return InputMap(
        nyquist / 2.0 ** np.arange(N_BANDS), edges, visited, after, reachable
    )


def _choose(context: Context) -> ToChoose:
    experiment, results = context.experiment, context.results
    options = next_options(experiment)
    recordings = results["calibrate"].recordings
    is_diagnosis = options.goal == "diagnosis"
    fit, name = None, ""
    if _asks_model(options):
        fit = _model(experiment, results["identify"], recordings)
        nb, nk = grid_place(fit, experiment.orders.nk_role)
        name = f"{fit.name}/{nb}/{nk}"
    return ToChoose(
        options,
        recordings,
        offered_inputs(experiment, recordings),
        kept_for_test(experiment),
        fit,
        name,
        choose_diagnosis(context) if is_diagnosis else None,
        results["diagnose"].verdict if is_diagnosis else "",
        read_previous(context.out),
        experiment.source,
    )


def _model(
    experiment: Experiment, fits: Sequence[Fit], recordings: Sequence[Recording]
) -> Fit:
    """The fit that comes closest to the recordings of others."""
    best = [group[0] for group in best_fits(fits, 1) if group]
    if not best:
        raise ConfigError(
            f"{experiment.source}: next: no recording has a usable model; expected one, "
            "which tells what inputs do; widen the orders or change fit"
        )
    tested = kept_for_test(experiment)
    judges = [one for one in recordings if one.name not in tested]

    def error(fit: Fit) -> float:
        values = [
            rmsd(one.output, validation_output(fit.model, one))
            for one in judges
            if fit.model is not None and one.name not in fit.identified_on
        ]
        total = float(np.sum(np.log(np.maximum(values, 1e-300))))
        return total if np.isfinite(total) else float("inf")

    return min(best, key=error)


def _needs(experiment: Experiment) -> tuple[str, ...]:
    options = experiment.next
    if options is None:
        return ()
    if options.goal == "diagnosis":
        return ("diagnose",)
    return ("identify",) if _asks_model(options) else ()


def _asks_model(options: NextOptions) -> bool:
    """Whether a fitted model tells what inputs do."""
    is_foreseen = options.output_range is not None and options.goal == "coverage"
    return options.goal == "parameters" or is_foreseen


def _write_files(
    out: Path,
    _: ToChoose,
    result: NextRecordings,
    __: Provenance | None,
    ___: bool,
) -> None:
    write_next_files(out, result)


def _tables(_: Context, result: NextRecordings) -> list[Block]:
    return next_blocks(result)


def _plan(planning: Planning) -> tuple[StagePlan, ...]:
    offered = offered_inputs(planning.experiment, planning.recordings)
    what = (
        f"{counted(len(offered), 'input')} on offer, for {_goal(planning.experiment)}"
    )
    size = sum(8.0 * one.values.size for one in offered)
    least, most = choice_seconds(planning, offered, _goal(planning.experiment))
    why = "the verdict is settled, and effects are looked for that may hide"
    return (StagePlan(NAME, what, len(offered), None, least, size, most, why),)


def _goal(experiment: Experiment) -> str:
    return next_options(experiment).goal


STAGE = Stage(
    name=NAME,
    needs=("calibrate",),
    needs_for=_needs,
    sections=("next",),
    require=next_options,
    choose=_choose,
    key=lambda given: given.key,
    compute=propose_next,
    storage=as_record(NAME, NextRecordings),
    summary=lambda given, result, is_stored: (
        f"{result.n_offered} inputs compared"
        + (" (unchanged since the last run)" if is_stored else "")
    ),
    write_files=_write_files,
    tables=_tables,
    warnings=lambda context, given: odd_inputs(
        given.options, given.recordings, given.plan, context.experiment.source
    ),
    plan=_plan,
    files=("next.csv", "next.json", "next"),
)
