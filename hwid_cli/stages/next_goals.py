"""What each goal makes of inputs that could be recorded: how much each of them teaches.

References
----------
docs/trust.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.diagnosis.hidden import LEAST_SHOWN, HiddenEffect
from hwid_cli.diagnosis.next_experiment import (
    UNDECIDED,
    least_separation,
    times_the_noise,
)
from hwid_cli.records.experiment import NextOptions
from hwid_cli.records.model import Fit
from hwid_cli.records.next import (
    NextRecordings,
    PlannedInput,
    ProposedRecording,
    RepeatSpread,
)
from hwid_cli.records.recordings import Recording
from hwid_cli.records.units import as_percent
from hwid_cli.stages.diagnose import ToDiagnose, hidden, undecided
from hwid_cli.stages.known_parameters import (
    known_of_parameters,
    left_of_errors,
    model_of,
)
from hwid_cli.stages.output_range import (
    in_words,
)
from hwid_cli.stages.repeats import Repeats, proposed_repeats
from hwid_cli.stages.stage import Runner
from hwid_cli.stages.trust import trust_of
from hwid_cli.tasks.cache import model_key, recording_key, task_key
from hwid_cli.trust.choice import chosen_by_gain, information_gain, information_of
from hwid_cli.trust.content import content, joined, value_edges, visited_share
from hwid_cli.trust.visited import N_BANDS

NAME = "next"
STAGE_VERSION = 7
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


@dataclass(frozen=True, eq=False)
class Choice:
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


def _for_coverage(given: ToChoose, _: Runner) -> Choice:
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
    return Choice(share, words, sentence, tuple(proposals), spread)


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


def _for_parameters(given: ToChoose, _: Runner) -> Choice:
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
        return Choice(0.0, words, sentence, ())
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
    return Choice(left, words, sentence, tuple(proposals))


def _for_diagnosis(given: ToChoose, runner: Runner) -> Choice:
    words = "candidates that the recordings do not tell apart"
    if given.diagnosed is None:
        raise ValueError("this goal has a diagnosis")
    if given.verdict not in UNDECIDED:
        return _for_hidden_effects(given, given.diagnosed, runner)
    found = undecided(given.diagnosed, runner, [one.values for one in given.offered])
    if len(found.titles) < 2 or not np.isfinite(found.ratios).any():
        sentence = "no two candidates could be simulated; nothing is proposed"
        return Choice(float(len(found.titles)), words, sentence, ())
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
    return Choice(float(len(found.titles)), words, sentence, proposals)


def _for_hidden_effects(
    given: ToChoose, diagnosed: ToDiagnose, runner: Runner
) -> Choice:
    """Inputs that show effects behind what the recordings do not tell."""
    words = "effects that may hide behind the recordings"
    says = f"the diagnosis says {given.verdict!r}"
    if not diagnosed.can_play_inputs:
        sentence = (
            f"{says}, and no candidates are left to tell apart; which effects may hide is "
            "told for a drive without a controller only"
        )
        return Choice(0.0, words, sentence, ())
    if not given.offered:
        sentence = f"{says}, and no input is on offer that could show another effect"
        return Choice(0.0, words, sentence, ())
    found = hidden(diagnosed, runner, [one.values for one in given.offered])
    left = [one for one in found if one.may_hide]
    untold = ", ".join(one.effect for one in found if not one.is_told)
    beside = f"; no input tells {untold}" if untold else ""
    if not left:
        sentence = (
            f"enough is known: {says}, and no input on offer would show another one of "
            f"{len(found)} effects, of a size that the recordings do not exclude{beside}"
        )
        return Choice(0.0, words, sentence, ())
    proposals = _showing(given, left)
    sentence = (
        f"{says}; {len(left)} of {len(found)} further effects may hide behind the "
        f"recordings ({', '.join(one.effect for one in left)}){beside}; "
        f"{_are_proposed(len(proposals), 'recording')}"
    )
    return Choice(float(len(left)), words, sentence, proposals)


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


def known_before(given: ToChoose, before: NextRecordings) -> float:
    """How much the recordings of the last proposal tell, by the measure of the goal."""
    earlier = [one for one in given.recordings if one.name in before.recordings]
    if given.options.goal == "coverage":
        return _visited(given, earlier)
    if given.options.goal == "parameters" and given.fit is not None:
        trust = trust_of(given.fit, given.recordings, given.tested)
        known = known_of_parameters(given.fit, trust, earlier, given.tested)
        return left_of_errors(known) if known.size else 0.0
    return before.known


# What a goal makes of the inputs on offer, by its name.
WAYS: dict[str, Callable[[ToChoose, Runner], Choice]] = {
    "coverage": _for_coverage,
    "parameters": _for_parameters,
    "diagnosis": _for_diagnosis,
}
