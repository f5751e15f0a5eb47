"""Stage ``next``: which recordings to take next, or that enough is known.

Offered are the inputs of a plan, or inputs that are designed within limits. Of these the
ones that teach most are chosen one after the other (`trust.choice`), each for what it adds
to the recordings that are there and to those chosen before it. When a new recording lies
in the folder, the same command takes it up, says what it changed, and proposes again.

References
----------
docs/trust.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path

import numpy as np

from hwid_cli.diagnosis.hidden import LEAST_SHOWN, HiddenEffect
from hwid_cli.diagnosis.next_experiment import (
    UNDECIDED,
    least_separation,
    times_the_noise,
)
from hwid_cli.errors import ConfigError
from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import Experiment, NextOptions
from hwid_cli.records.model import Fit
from hwid_cli.records.next import (
    InputMap,
    NextRecordings,
    PlannedInput,
    ProposedRecording,
    RepeatSpread,
)
from hwid_cli.records.recordings import Recording
from hwid_cli.records.units import as_percent
from hwid_cli.report.next import next_blocks
from hwid_cli.report.table import Block
from hwid_cli.stages.diagnose import ToDiagnose, answers, hidden, undecided
from hwid_cli.stages.diagnose import choose as choose_diagnosis
from hwid_cli.stages.fit_seconds import SECONDS_PER_SIMULATED_SAMPLE, counted
from hwid_cli.stages.known_parameters import (
    known_of_parameters,
    left_of_errors,
    model_of,
)
from hwid_cli.stages.offered_inputs import next_options, odd_inputs, offered_inputs
from hwid_cli.stages.order_grid import candidate_orders, grid_place
from hwid_cli.stages.output_range import (
    Foresee,
    Reach,
    foreseen_by,
    in_words,
    reaches,
    within,
)
from hwid_cli.stages.ranking import best_fits
from hwid_cli.stages.repeats import Repeats, proposed_repeats
from hwid_cli.stages.stage import Context, Planning, Runner, Stage, in_results
from hwid_cli.stages.trust import kept_for_test, trust_of
from hwid_cli.store.next_results import (
    read_next,
    read_previous,
    write_next,
    write_next_files,
)
from hwid_cli.store.result_files import Provenance
from hwid_cli.tasks.cache import model_key, recording_key, task_key
from hwid_cli.tasks.task import one_thread
from hwid_cli.trust.choice import chosen_by_gain, information_gain, information_of
from hwid_cli.trust.content import content, joined, value_edges, visited_share
from hwid_cli.trust.visited import N_BANDS

NAME = "next"
STAGE_VERSION = 7
# Seconds for each sample of a table of what an input visits (measured, 1200 to 50 000
# samples), and how often one is made of each input.
_SECONDS_PER_TABLED_SAMPLE, _TABLES_OF_EACH = 4e-7, 4
# Hidden effects that a reason names.
_NAMED_EFFECTS = 3


@dataclass(frozen=True, eq=False)
class ToChoose:
    """What is known, what could be played or was, and what for."""

    options: NextOptions
    recordings: tuple[Recording, ...]
    plan: tuple[PlannedInput, ...]
    tested: tuple[str, ...] = ()
    fit: Fit | None = None
    model_name: str = ""
    diagnosed: ToDiagnose | None = None
    verdict: str = ""
    previous: NextRecordings | None = None
    source: str = ""

    @property
    def offered(self) -> tuple[PlannedInput, ...]:
        """What is no recording yet."""
        known = {one.name for one in self.recordings}
        return tuple(one for one in self.plan if one.name not in known)

    @property
    def key(self) -> str:
        """Content key of the proposal."""
        model = None if self.fit is None else self.fit.model
        settings = {
            "options": self.options,
            "recordings": [one.name for one in self.recordings],
            "contents": [recording_key(one) for one in self.recordings],
            "plan": [one.name for one in self.plan],
            "model": None if model is None else model_key(model),
            "diagnosis": None if self.diagnosed is None else self.diagnosed.key,
            "tested": self.tested,
        }
        arrays = [one.values for one in self.plan]
        return task_key(NAME, STAGE_VERSION, settings, arrays)


def propose_next(given: ToChoose, runner: Runner) -> NextRecordings:
    """Choose the recordings that teach most."""
    ways: dict[str, Callable[[ToChoose, Runner], _Choice]] = {
        "coverage": _for_coverage,
        "parameters": _for_parameters,
        "diagnosis": _for_diagnosis,
    }
    with one_thread():
        reached = _reached(given, runner)
        given, left_out = _within_range(given, reached)
        choice = ways[given.options.goal](given, runner)
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


@dataclass(frozen=True, eq=False)
class _Choice:
    """What a goal makes of the offered inputs."""

    known: float
    known_words: str
    sentence: str
    proposals: tuple[ProposedRecording, ...]
    repeats: RepeatSpread | None = None


def _visited(given: ToChoose, recordings: Sequence[Recording]) -> float:
    """Share of what all recordings and inputs on offer visit that some recordings visit."""
    everything = [one.input for one in given.recordings]
    everything += [one.values for one in given.offered]
    edges = value_edges(everything)
    by_these = [content(one.input, edges) for one in recordings]
    reachable = joined([content(one, edges) for one in everything])
    return visited_share(joined(by_these), reachable) if by_these else 0.0


def _for_coverage(given: ToChoose, _: Runner) -> _Choice:
    inputs = [one.input for one in given.recordings]
    edges = value_edges([*inputs, *(one.values for one in given.offered)])
    before = joined([content(one, edges) for one in inputs])
    tables = [content(one.values, edges) for one in given.offered]
    reachable = joined([before, *tables])
    share = _visited(given, given.recordings)

    def gain(known: np.ndarray, more: np.ndarray) -> float:
        both = visited_share(joined([known, more]), reachable)
        return both - visited_share(known, reachable)

    found = chosen_by_gain(
        before,
        tables,
        gain,
        lambda known, more: joined([known, more]),
        given.options.number,
    )
    proposals, now = [], share
    for place, by in found:
        if by < given.options.enough:
            break
        one = given.offered[place]
        reason = (
            f"visits {as_percent(by)} more of the amplitudes and frequencies on offer "
            f"({as_percent(now)} to {as_percent(now + by)}), most of it "
            f"{_where(before, tables[place], edges, given)}"
        )
        proposals.append(_proposal(one, by, "share visited", reason))
        now, before = now + by, joined([before, tables[place]])
    words = "of the amplitudes and frequencies on offer are visited"
    best = found[0][1] if found else 0.0
    known, repeats = f"the best input on offer adds {as_percent(best, 1)}", None
    if not proposals:
        repeats = proposed_repeats(
            given.recordings, given.plan, given.options, given.tested
        )
        proposals = list(repeats.proposals)
    sentence = f"{as_percent(share)} {words}; " + (
        _verdict(len(proposals), known, given.options.enough)
        if repeats is None
        else _repeats_verdict(repeats, known, given.options.enough)
    )
    spread = None if repeats is None else repeats.spread
    return _Choice(share, words, sentence, tuple(proposals), spread)


def _repeats_verdict(repeats: Repeats, best: str, enough: float) -> str:
    """What to take once the inputs are enough."""
    inputs = f"{best}, less than {as_percent(enough, 1)}"
    if not repeats.proposals:
        return (
            f"enough is known: {inputs}; {repeats.words}; how good a model of these "
            "recordings is, 'hwid run' says"
        )
    proposed = _are_proposed(len(repeats.proposals), "repeat")
    return f"the inputs are enough ({inputs}), but {repeats.words}; {proposed}"


def _where(
    before: np.ndarray, more: np.ndarray, edges: np.ndarray, given: ToChoose
) -> str:
    """Where an input visits most that is new: how fast, and at which values.

    Parameters
    ----------
    before, more : ndarray, shape (N_BANDS, n), [input unit]
        What recordings visit, and the input.
    edges : ndarray, shape (n + 1,), [input unit]
    """
    largest = np.maximum(before, more).max(axis=1, keepdims=True)
    new = np.maximum(more - before, 0.0) / np.maximum(largest, 1e-300)
    band, cell = (int(at) for at in np.unravel_index(np.argmax(new), new.shape))
    first = given.recordings[0]
    # Octaves from half the sample rate down; the last band holds all that is slower.
    highest_Hz = 0.5 / first.sample_time_s / 2.0**band
    is_slowest = band == N_BANDS - 1
    low = "below" if is_slowest else f"from {highest_Hz / 2.0:.3g} to"
    at = in_words((edges[cell], edges[cell + 1]), first.input_unit)
    return f"{low} {highest_Hz:.3g} Hz at {at}"


def _verdict(count: int, best: str, enough: float) -> str:
    if count:
        return _are_proposed(count, "recording")
    return f"enough is known: {best}, less than {as_percent(enough, 1)}"


def _are_proposed(count: int, thing: str) -> str:
    many = f"one {thing} is" if count == 1 else f"{count} {thing}s are"
    return f"{many} proposed"


def _proposal(
    one: PlannedInput, gain: float, words: str, reason: str
) -> ProposedRecording:
    return ProposedRecording(one.name, one.words, one.values, gain, words, reason)


def _for_parameters(given: ToChoose, _: Runner) -> _Choice:
    fit = given.fit
    model = model_of(fit)
    if fit is None:
        raise ValueError("this goal has a model")
    trust = trust_of(fit, given.recordings, given.tested)
    known = known_of_parameters(fit, trust, given.recordings, given.tested)
    count = len(known)
    own = " + ".join(fit.identified_on)
    words = (
        f"of the standard errors of the {count} parameters of {given.model_name} that {own} alone "
        "leaves are left"
    )
    if not count:
        sentence = f"the parameters of {given.model_name} cannot be told ({trust.reason}); nothing is proposed"
        return _Choice(0.0, words, sentence, ())
    found = chosen_by_gain(
        known,
        [information_of(model, trust, one.values) for one in given.offered],
        information_gain,
        lambda before, one: before + one,
        given.options.number,
    )
    proposals, shrinks = [], []
    for place, by in found:
        # Standard errors shrink by half the gain of each parameter.
        shrink = 1.0 - float(np.exp(-0.5 * by / count))
        shrinks.append(shrink)
        if shrink < given.options.enough:
            break
        reason = (
            f"lets standard errors of the {count} parameters of {given.model_name} shrink by "
            f"{as_percent(shrink)} on (geometric) average"
        )
        one = given.offered[place]
        proposals.append(_proposal(one, by, "log determinant", reason))
    best = f"the best input on offer shrinks standard errors by {as_percent(max(shrinks, default=0.0), 1)}"
    left = left_of_errors(known)
    sentence = f"{as_percent(left)} {words}; " + _verdict(
        len(proposals), best, given.options.enough
    )
    return _Choice(left, words, sentence, tuple(proposals))


def _for_diagnosis(given: ToChoose, runner: Runner) -> _Choice:
    words = "candidates that the recordings do not tell apart"
    if given.diagnosed is None:
        raise ValueError("this goal has a diagnosis")
    if given.verdict not in UNDECIDED:
        return _for_hidden_effects(given, given.diagnosed, runner)
    found = undecided(given.diagnosed, runner, [one.values for one in given.offered])
    if len(found.titles) < 2 or not np.isfinite(found.ratios).any():
        sentence = "no two candidates could be simulated; nothing is proposed"
        return _Choice(float(len(found.titles)), words, sentence, ())
    order = np.argsort(-found.ratios, kind="stable")[: given.options.number]
    names = "; ".join(found.titles)
    sizes = [one.values.size for one in given.offered]
    least = [least_separation(size) for size in sizes]
    proposals = tuple(
        _proposal(
            given.offered[place],
            float(ratio),
            "times the noise",
            f"makes these ({names}) differ by at least "
            f"{times_the_noise(ratio, least[place], sizes[place])} after their parameters "
            "have been fitted again",
        )
        for place in order
        if (ratio := found.ratios[place]) >= least[place]
    )
    top = int(order[0])
    best = float(found.ratios[top])
    sentence = f"{len(found.titles)} {words} ({names}); " + (
        _are_proposed(len(proposals), "recording")
        if proposals
        else f"no input on offer shows their difference through the noise (the best "
        f"{best:.2g} times the noise, and {least[top]:.2g} is needed): only other limits "
        "can tell them apart"
    )
    return _Choice(float(len(found.titles)), words, sentence, proposals)


def _for_hidden_effects(
    given: ToChoose, diagnosed: ToDiagnose, runner: Runner
) -> _Choice:
    """Inputs that show effects behind what the recordings do not tell."""
    words = "effects that may hide behind the recordings"
    says = f"the diagnosis says {given.verdict!r}"
    if not diagnosed.can_play_inputs:
        sentence = (
            f"{says}, and no candidates are left to tell apart; which effects may hide is "
            "told for a drive without a controller only"
        )
        return _Choice(0.0, words, sentence, ())
    if not given.offered:
        sentence = f"{says}, and no input is on offer that could show another effect"
        return _Choice(0.0, words, sentence, ())
    found = hidden(diagnosed, runner, [one.values for one in given.offered])
    left = [one for one in found if one.may_hide]
    untold = ", ".join(one.effect for one in found if not one.is_told)
    beside = f"; no input tells {untold}" if untold else ""
    if not left:
        sentence = (
            f"enough is known: {says}, and no input on offer would show another one of "
            f"{len(found)} effects, of a size that the recordings do not exclude{beside}"
        )
        return _Choice(0.0, words, sentence, ())
    proposals = _showing(given, left)
    sentence = (
        f"{says}; {len(left)} of {len(found)} further effects may hide behind the "
        f"recordings ({', '.join(one.effect for one in left)}){beside}; "
        f"{_are_proposed(len(proposals), 'recording')}"
    )
    return _Choice(float(len(left)), words, sentence, proposals)


def _showing(
    given: ToChoose, left: Sequence[HiddenEffect]
) -> tuple[ProposedRecording, ...]:
    """Inputs that show hidden effects, one after the other."""
    chosen = chosen_by_gain(
        [np.zeros(len(one.shares)) for one in left],
        [[one.shares[:, place] for one in left] for place in range(len(given.offered))],
        _shown_beside,
        lambda known, more: [
            np.maximum(a, b) for a, b in zip(known, more, strict=True)
        ],
        given.options.number,
    )
    return tuple(
        _proposal(
            given.offered[place],
            gain,
            "hidden effects that it is expected to show",
            _shows(left, place),
        )
        for place, gain in chosen
        if gain >= LEAST_SHOWN
    )


def _shown_beside(known: list[np.ndarray], more: list[np.ndarray]) -> float:
    """How many effects an input is expected to show that others do not."""
    pairs = zip(known, more, strict=True)
    return sum(float(np.mean(np.maximum(b - a, 0.0))) for a, b in pairs)


def _shows(left: Sequence[HiddenEffect], place: int) -> str:
    """The effects that an input shows best, and how well."""
    shares = [float(one.shares[:, place].mean()) for one in left]
    order = [k for k in np.argsort(-np.array(shares), kind="stable") if shares[k] > 0.0]
    parts = [
        f"{left[k].effect} ({as_percent(shares[k])} of the sizes that the recordings do "
        f"not exclude, up to {left[k].ratios[:, place].max():.2g} times the noise)"
        for k in order[:_NAMED_EFFECTS]
    ]
    return f"would show {'; '.join(parts)}"


def _changed(given: ToChoose, choice: _Choice) -> str:
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
    earlier = f"{form(_known_before(given, before))} before"
    if before.known_words != choice.known_words:
        # Of another model, or what had been decided then is open now.
        earlier = f"{form(before.known)} {before.known_words} before"
    return (
        f"new since the last proposal: {words}; {earlier}, {form(choice.known)} now "
        f"{choice.known_words}"
    )


def _known_before(given: ToChoose, before: NextRecordings) -> float:
    """How much the recordings of the last proposal tell, by the measure of the goal."""
    earlier = [one for one in given.recordings if one.name in before.recordings]
    if given.options.goal == "coverage":
        return _visited(given, earlier)
    if given.options.goal == "parameters" and given.fit is not None:
        trust = trust_of(given.fit, given.recordings, given.tested)
        known = known_of_parameters(given.fit, trust, earlier, given.tested)
        return left_of_errors(known) if known.size else 0.0
    return before.known


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
    seconds = _seconds(planning, offered)
    return (StagePlan(NAME, what, len(offered), None, seconds, size),)


def _seconds(planning: Planning, offered: Sequence[PlannedInput]) -> float:
    """How long a choice takes, [s]; NaN where candidates of a diagnosis tell it."""
    experiment = planning.experiment
    if _goal(experiment) == "diagnosis":
        return nan
    known = sum(one.n_samples for one in planning.recordings)
    samples = known + sum(one.values.size for one in offered)
    seconds = _TABLES_OF_EACH * _SECONDS_PER_TABLED_SAMPLE * samples
    if _goal(experiment) == "parameters":
        grid = candidate_orders(experiment.orders)
        linear = max(one.nb + one.nf for _, _, one in grid)
        # A place and a value of each corner of both maps.
        n_parameters = linear + 4 * (experiment.fit.units + 1)
        seconds += SECONDS_PER_SIMULATED_SAMPLE * n_parameters * samples
    return seconds


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
    storage=in_results(
        NAME,
        read_next,
        lambda path, given, result, origin: write_next(path, result, origin),
    ),
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
