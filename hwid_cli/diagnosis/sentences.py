"""What a diagnosis says in words: the summary, the next experiment, what is hidden."""

from typing import TYPE_CHECKING

import numpy as np

from hwid_cli.diagnosis.candidate import rebuilt
from hwid_cli.diagnosis.next_experiment import Model, best_separation
from hwid_cli.diagnosis.problem import Problem
from hwid_cli.diagnosis.selection import Verdict
from hwid_cli.drive.catalogue import public_id
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import FittedEffect, NextExperiment
from hwid_cli.records.units import behind

if TYPE_CHECKING:
    from hwid_cli.diagnosis.findings import Findings

# Share of the largest displacement that counts as motion to one side.
_ONE_SIDE = 0.05
_MOST_RIVALS = 3
# The gap sits in recordings that hold this share of it ...
_NEARLY_ALL = 0.95
# ... and are of one kind, or no more than this share of all.
_FEW = 1 / 3
_MOST_NAMED = 6


def summarise(
    findings: "Findings", verdict: Verdict, effects: tuple[FittedEffect, ...]
) -> str:
    """Say the verdict in one or two sentences."""
    judge, base = findings.judge, findings.base
    before = judge.ratio(base)
    after = judge.ratio(verdict.chosen)
    names = " and ".join(one.id for one in effects)
    if verdict.word == "none":
        return (
            "Nothing is missing: the simulation agrees with the recordings up to "
            f"their noise ({after:.3g} times the noise)."
        )
    if verdict.word == "parameters":
        return (
            "No effect is missing: the parameters were off, and once they are fitted "
            f"the error is {after:.3g} times the noise."
        )
    if verdict.word == "unknown":
        return (
            f"The simulation differs from the recordings by {before:.3g} times their "
            "noise, and no effect of the catalogue explains most of it."
            f"{_where_it_sits(findings, verdict.chosen)}"
        )
    meaning = "; ".join(one.sentence for one in effects)
    text = (
        f"The simulation lacks {names} ({meaning}): with it the error on held-out "
        f"recordings falls from {before:.3g} to {after:.3g} times the noise."
    )
    if verdict.word == "ambiguous":
        others = ", ".join(_name(one) for one in verdict.rivals)
        text += f" These recordings cannot tell it from {others}."
    if not verdict.is_complete:
        text += " Something smaller remains."
    return text


def _where_it_sits(findings: "Findings", chosen: CandidateFit) -> str:
    """Name the recordings that hold the gap, if they are of one kind or few."""
    problem = findings.problem
    signals = problem.signals
    floor = np.array([one.n_judged for one in signals]) * findings.noise.rms**2
    excess = np.maximum(chosen.sse - floor, 0.0)
    if not 0 < excess.sum() < np.inf:
        return ""
    rows = _rows_of_gap(excess, [one.kind for one in signals])
    if not rows:
        return ""
    shown = ", ".join(signals[row].name for row in rows[:_MOST_NAMED])
    more = len(rows) - _MOST_NAMED
    shown += f" and {more} more" if more > 0 else ""
    text = f" Nearly all of the gap sits in {shown}"
    if problem.compares_command or problem.start == "estimated":
        return f"{text}."
    return f"{text}: check how they start (diagnose.initial_state)."


def _rows_of_gap(excess: np.ndarray, kinds: list[str]) -> list[int]:
    """Rows of the kind, or of the few recordings, that hold nearly all; else none."""
    least = _NEARLY_ALL * excess.sum()
    largest = np.argsort(-excess)
    n_most = int(np.searchsorted(np.cumsum(excess[largest]), least)) + 1
    kind = kinds[largest[0]]
    of_kind = [row for row, one in enumerate(kinds) if one == kind]
    # Where one recording of many is off, its kind is not to blame.
    is_kind = excess[of_kind].sum() >= least and n_most > len(of_kind) / 2
    if is_kind and len(of_kind) < len(kinds):
        return of_kind
    return sorted(largest[:n_most]) if n_most <= _FEW * len(kinds) else []


def _name(found: CandidateFit) -> str:
    return " with ".join(public_id(one) for one in found.effects)


def propose(findings: "Findings", verdict: Verdict) -> NextExperiment:
    """Find the input that would separate what the recordings do not.

    Returns
    -------
    NextExperiment
        With an empty input where none is needed.
    """
    if verdict.word == "ambiguous":
        pair = (verdict.chosen, verdict.rivals[0])
    elif verdict.word == "unknown":
        judge = findings.judge
        usable = [one for one in findings.found.fits if one.is_usable]
        usable.sort(key=lambda one: -judge.gain(one, findings.base))
        if len(usable) < 2:
            return NextExperiment("", "no candidate could be simulated")
        pair = (usable[0], usable[1])
    else:
        return NextExperiment("", "the recordings decide; no further one is needed")
    if findings.problem.compares_command:
        return NextExperiment(
            "a slower and a faster motion along the same path",
            "friction, inertia and delay then weigh differently",
        )
    models = [Model(*rebuilt(findings.problem, one, findings.scales)) for one in pair]
    best = best_separation(findings.problem, models[0], models[1], findings.scales)
    # The dash of a dimensionless output would be a minus behind a number.
    by = f"{best.rms:.2g}{behind(findings.problem.unit)}"
    return NextExperiment(
        best.input,
        f"{_name(pair[0])} and {_name(pair[1])} then differ by {by} "
        f"({best.rms / max(findings.noise.rms, 1e-300):.2g} times the noise) after the "
        "parameters have been fitted again",
    )


def hidden_from_view(problem: Problem) -> tuple[str, ...]:
    """Say what these recordings cannot show, whatever the drive does."""
    drive, texts = problem.drive, []
    if drive.resistance_ohm is None:
        texts.append(
            "what happens before the current (resistance, inductance, brush drop, "
            "supply voltage), because the current is the input"
        )
    texts.append(
        "the mass itself: force constant, damping and stiffness are known only in "
        "proportion to it"
    )
    lowest = min(float(np.min(one.output)) for one in problem.signals)
    highest = max(float(np.max(one.output)) for one in problem.signals)
    reach = max(abs(lowest), abs(highest))
    if lowest > -_ONE_SIDE * reach:
        texts.append("anything on the negative side, where the drive never is")
    if highest < _ONE_SIDE * reach:
        texts.append("anything on the positive side, where the drive never is")
    if drive.stiffness_N_per_m == 0 and not problem.compares_command:
        texts.append(
            "a constant offset of the sensor, because nothing holds a position"
        )
    if len(problem.part(held_out=True).signals) == 0:
        texts.append("how the result does on other recordings: there is only one")
    return tuple(texts)
