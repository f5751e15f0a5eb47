"""What a diagnosis says in words: the summary, and what recordings cannot show."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from hwid_cli.diagnosis.candidate_words import title_of
from hwid_cli.diagnosis.law_names import known_terms
from hwid_cli.diagnosis.odd_recordings import (
    NEARLY_ALL,
    rows_of_few,
    went_another_way,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.diagnosis.verdict import DiagnosisVerdict, lead
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.records.axis import name_on
from hwid_cli.records.candidates import CAUSES, CandidateFit
from hwid_cli.records.diagnosis import (
    SMALL_REMAINDER,
    STILL_LARGE,
    BaseParameter,
    FittedEffect,
    Law,
)
from hwid_cli.records.drive import HELD, LINE, Drive, StandIn
from hwid_cli.records.units import as_percent

# What moves and what drives it, by axis.
_WORDS = {
    "linear": ("mass", "force constant"),
    "rotary": ("inertia", "torque constant"),
}
# What makes the input, where that is measured.
_BEFORE = {
    "current": "resistance, inductance, brush drop, supply voltage",
    "voltage": "controller, supply",
    "force": "controller, amplifier, motor",
    "torque": "controller, amplifier, motor",
}
# Share of the largest displacement that counts as motion to one side.
_ONE_SIDE = 0.05
_MOST_NAMED = 6
# A value off by more than this factor is a wrong one, not an inaccurate one, [-].
_DOUBTFUL = 3.0
# Effects that make a signal late; below this share of a sample they may be no part of a
# machine, [-].
_MAKE_LATE = ("input_delay", "actuator_lag", "sensor_lag")
_HARDLY_LATE = 0.2
# Share of the farthest displacement below which a stop begins in the middle of the way.
_MIDDLE = 0.05
# Values that a wrong mass moves, in a drive with a spring; and how far apart they may
# have moved, [-].
_PROPORTIONAL = 3
_SAME_FACTOR = 1.5
# A ratio to the noise that is taken for 1, [-].
_NO_MORE_THAN_NOISE = 1.02
# Held-out error of the re-fitted base over that of the given one from which that is said.
_CLEARLY_MORE = 1.5
# A term that comes back in fewer of the resampled recordings is one of several, [-].
_SURE_INCLUSION = 0.5
# What is late by this near to half a sample may be a command that is held, [samples].
_NEAR_HALF = 0.1
_LATE = {"input_delay": ("delay_s",), "actuator_lag": ("time_constant_s",)}


def summarise(
    problem: DiagnosisProblem,
    criteria: SelectionCriteria,
    base: CandidateFit,
    verdict: DiagnosisVerdict,
    effects: tuple[FittedEffect, ...],
    fits: Iterable[CandidateFit],
) -> str:
    """Say the verdict in one or two sentences, and the best lead where some remains.

    Parameters
    ----------
    base : CandidateFit
        Re-fitted, without further effects.
    effects : tuple of FittedEffect
        Those that are named.
    fits : iterable of CandidateFit
        Of all sets of effects.
    """
    best = lead(criteria, fits, verdict)
    text = _verdict_in_words(problem, criteria, base, verdict, effects)
    return text if best is None else f"{text} {_lead_in_words(criteria, best, verdict)}"


def held_in_words(problem: DiagnosisProblem) -> str:
    """Say that the command is held, where the recordings told it; else nothing."""
    if not (problem.may_be_held and problem.drive.hold == HELD):
        return ""
    return (
        " The command is held between samples, as controllers do it: so simulated "
        "(simulation.hold: zero) it fits better than as a line."
    )


def imitated_in_words(given: float, refitted: float) -> str:
    """Say that the re-fitted base leaves more than the given one, where it does.

    Parameters
    ----------
    given, refitted : float, [-]
        RMS that they leave of held-out recordings over that of the noise.
    """
    if not refitted > _CLEARLY_MORE * given:
        return ""
    return (
        f" As given it is {given:.3g} times the noise: fitted again without an effect, the "
        "parameters imitate what is missing in the other recordings, and fail in these."
    )


def _lead_in_words(
    criteria: SelectionCriteria, best: CandidateFit, verdict: DiagnosisVerdict
) -> str:
    """Say which set would go on from here, and why it is not named."""
    # Of little, noise alone makes it more than all.
    share = min(criteria.evidence(best, verdict.chosen).explained, 1.0)
    added = [one for one in best.effects if one not in verdict.chosen.effects]
    names = " and ".join(public_id(one) for one in added)
    what = "of what remains" if verdict.chosen.effects else "of it"
    return (
        f"Best lead: {names} would explain {100 * share:.3g} % {what}, down to "
        f"{criteria.ratio(best):.3g} times the noise; it is not named, because another "
        "law may do as well."
    )


def _verdict_in_words(
    problem: DiagnosisProblem,
    criteria: SelectionCriteria,
    base: CandidateFit,
    verdict: DiagnosisVerdict,
    effects: tuple[FittedEffect, ...],
) -> str:
    before = criteria.ratio(base)
    after = criteria.ratio(verdict.chosen)
    if verdict.word == "none":
        return (
            "Nothing is missing: the simulation agrees with the recordings up to "
            f"their noise ({after:.3g} times the noise).{_cause(criteria, verdict)}"
        )
    if verdict.word == "parameters":
        return (
            "No effect is missing: the parameters were off, and once they are fitted "
            f"the error is {after:.3g} times the noise.{_cause(criteria, verdict)}"
        )
    if verdict.word == "unknown":
        return (
            f"The simulation differs from the recordings by {before:.3g} times their "
            "noise, and no effect of the catalogue explains it well enough to be named."
            f"{_where_it_sits(problem, criteria, verdict.chosen)}"
        )
    names = _names(effects)
    text = _named(problem, criteria, base, verdict, effects)
    text += _held_command(problem, effects)
    if verdict.word == "ambiguous":
        others = " or from ".join(title_of(one) for one in verdict.rivals)
        text += f" These recordings cannot tell {names} from {others}."
    if not problem.part(held_out=True).signals:
        text += " Named on training data only: no recording was held out to test it."
    return text


def law_in_words(
    criteria: SelectionCriteria,
    base: CandidateFit,
    verdict: DiagnosisVerdict,
    law: Law,
    effect: FittedEffect,
) -> str:
    """Say which formula holds, and which of its terms have a name.

    Parameters
    ----------
    base : CandidateFit
        Re-fitted, without the law.
    effect : FittedEffect
        That holds the law.
    """
    share = 100 * criteria.evidence(verdict.chosen, base).explained
    known = known_terms(law)
    terms = " and ".join(f"{name} ({term})" for term, name in known.items())
    ratio = criteria.ratio(verdict.chosen)
    if ratio > STILL_LARGE:
        # No statement of a fact while so much is left.
        text = (
            "No effect of the catalogue explains what the simulation leaves. As a lead"
        )
        text += f", with {terms}" if known else ""
        text += ", a formula takes most of it"
    elif known:
        text = f"The simulation lacks {terms} and something that is no effect of the "
        text += "catalogue; a formula holds for both"
    else:
        text = "No effect of the catalogue is what the simulation lacks, but a formula holds"
    return (
        f"{text}: {_in_numbers(law, effect)}. With it the error on held-out recordings falls from "
        f"{criteria.ratio(base):.3g} to {ratio:.3g} times the "
        f"noise ({share:.3g} % of what was left is explained)."
        f"{_how_sure(law)}{_rest(criteria, verdict)}"
    )


def _in_numbers(law: Law, effect: FittedEffect) -> str:
    """The formula with its values, to four digits; in the table stand all of them."""
    symbol = effect.equation.partition(" = ")[0]
    short = re.sub(
        r"\d+\.\d+(?:e[-+]\d+)?", lambda found: f"{float(found[0]):.4g}", law.formula
    )
    return f"{symbol} = {short}"


def _how_sure(law: Law) -> str:
    """Say that terms are a curve and no mechanism, where others would do as well."""
    least = min(one.inclusion for one in law.terms)
    if least >= _SURE_INCLUSION:
        return ""
    return (
        f" Take it as a curve, not as a mechanism: other terms do nearly as well (chosen "
        f"again in {100 * least:.0f} % of resampled recordings)."
    )


def _cause(criteria: SelectionCriteria, verdict: DiagnosisVerdict) -> str:
    """Say what is left beside the noise of the output."""
    if verdict.chosen.cause:
        return f" What is left is {CAUSES[verdict.chosen.cause]}."
    if not verdict.is_complete and criteria.needs_nothing(verdict.chosen):
        return (
            " What is left is no more than the drive that stands for the simulation may "
            "be wrong by: outputs alone do not tell it from a small effect."
        )
    if not verdict.is_complete:
        if criteria.is_close_to_noise(verdict.chosen):
            return " Too little is left beyond the noise for an effect to be named."
        is_little = criteria.ratio(verdict.chosen) <= SMALL_REMAINDER
        what = "The little that" if is_little else "What"
        return f" {what} is left beyond the noise goes with no effect."
    return ""


def _named(
    problem: DiagnosisProblem,
    criteria: SelectionCriteria,
    base: CandidateFit,
    verdict: DiagnosisVerdict,
    effects: tuple[FittedEffect, ...],
) -> str:
    """Say what was found as a fact, or as a part where much remains."""
    before, after = criteria.ratio(base), criteria.ratio(verdict.chosen)
    names = _names(effects)
    meaning = "; ".join(dict.fromkeys(one.sentence for one in effects))
    them = "it" if len(effects) == 1 else "them"
    on = "held-out" if problem.part(held_out=True).signals else "these"
    # What leaves that much is no fact, but a part of what is missing.
    if after > STILL_LARGE:
        share = criteria.evidence(verdict.chosen, base).explained
        return (
            f"{names} ({meaning}) explains {100 * share:.3g} % of what the simulation "
            f"leaves of {on} recordings: the error falls from {before:.3g} to "
            f"{after:.3g} times the noise.{_rest(criteria, verdict)}"
        )
    others = "".join(f", or instead {title_of(one)}" for one in verdict.rivals)
    which = "the first" if others else them
    text = (
        f"The simulation lacks {names} ({meaning}){others}: with {which} the error on {on} "
        f"recordings falls from {before:.3g} to {after:.3g} times the noise."
    )
    return f"{text}{_rest(criteria, verdict)}"


def _names(effects: Sequence[FittedEffect]) -> str:
    """Ids of effects, each once."""
    counts = Counter(one.id for one in effects)
    return " and ".join(one if n == 1 else f"{one} twice" for one, n in counts.items())


def _held_command(problem: DiagnosisProblem, effects: tuple[FittedEffect, ...]) -> str:
    """Say that what is late by half a sample may be how the command is held."""
    sample_time_s = min(one.sample_time_s for one in problem.signals)
    late = [
        parameter.value / sample_time_s
        for one in effects
        if one.id in _LATE
        for parameter in one.parameters
        if parameter.name in _LATE[one.id]
    ]
    if (
        problem.may_be_held
        or problem.drive.hold != LINE
        or not any(abs(one - 0.5) <= _NEAR_HALF for one in late)
    ):
        return ""
    return (
        f" Late by half a sample ({1e3 * sample_time_s / 2:.3g} ms) is also a "
        "command that is held between samples, as controllers do it: set "
        "simulation.hold: zero and run again."
    )


def untold_command(problem: DiagnosisProblem, is_untold: bool) -> tuple[str, ...]:
    """Say that values hang on how the command goes on between samples."""
    if not is_untold:
        return ()
    ways = ["goes on in a line", "is held"]
    taken, other = ways[:: -1 if problem.drive.hold == HELD else 1]
    return (
        f"Between samples the command {taken} here; that it {other} does as well, with "
        "other values. The intervals hold both: set simulation.hold to zero (held, as "
        "controllers and D/A converters do it) or linear, and run again",
    )


def _rest(criteria: SelectionCriteria, verdict: DiagnosisVerdict) -> str:
    """Say what remains beside what was found; nothing where that is noise of the output."""
    is_more = criteria.ratio(verdict.chosen) > SMALL_REMAINDER
    if verdict.chosen.cause and (is_more or not verdict.is_complete):
        return f" What remains is {CAUSES[verdict.chosen.cause]}."
    if verdict.is_complete:
        return ""
    if criteria.ratio(verdict.chosen) > STILL_LARGE:
        return " What remains is not explained."
    if criteria.ratio(verdict.chosen) > SMALL_REMAINDER:
        return " Something smaller remains."
    if criteria.ratio(verdict.chosen) > _NO_MORE_THAN_NOISE:
        return " Little more than the noise remains."
    return " What remains is no larger than the noise, but not as random."


def _where_it_sits(
    problem: DiagnosisProblem, criteria: SelectionCriteria, chosen: CandidateFit
) -> str:
    """Name the recordings that hold the gap, if they are of one kind or few."""
    signals = problem.signals
    excess = np.maximum(chosen.sse - criteria.floors, 0.0)
    if not 0 < excess.sum() < np.inf:
        return ""
    rows = _rows_of_gap(excess, [one.kind for one in signals])
    if not rows:
        return ""
    shown = _few([signals[row].name for row in rows])
    text = f" Nearly all of the gap sits in {shown}"
    if all(went_another_way(signals[row], excess[row]) for row in rows):
        # A pendulum over the top: one run more or less tells nothing of the machine.
        return (
            f"{text}, where the machine went another way altogether: leave that out "
            "(diagnose.recordings), and diagnose again."
        )
    if problem.compares_command or problem.start == "estimated":
        return f"{text}."
    return f"{text}: check how they start (diagnose.initial_state)."


def _rows_of_gap(excess: np.ndarray, kinds: list[str]) -> list[int]:
    """Rows of the kind, or of the few recordings, that hold nearly all; else none."""
    least = NEARLY_ALL * excess.sum()
    largest = np.argsort(-excess)
    n_most = int(np.searchsorted(np.cumsum(excess[largest]), least)) + 1
    kind = kinds[largest[0]]
    of_kind = [row for row, one in enumerate(kinds) if one == kind]
    # Where one recording of many is off, its kind is not to blame.
    is_kind = excess[of_kind].sum() >= least and n_most > len(of_kind) / 2
    if is_kind and len(of_kind) < len(kinds):
        return of_kind
    return rows_of_few(excess)


def doubtful_values(base: Sequence[BaseParameter], drive: Drive) -> tuple[str, ...]:
    """Question the parameters that the last fit moved far away from what was given."""
    moved = {
        one: one.after / one.before
        for one in base
        if one.before * one.after > 0 and np.isfinite(one.after)
    }
    doubtful = {
        one: ratio for one, ratio in moved.items() if max(ratio, 1 / ratio) > _DOUBTFUL
    }
    contradicted = _contradicted_mass(base, drive)
    if not doubtful:
        return contradicted
    if _is_the_mass(moved, drive):
        return (_questioned_mass(moved, drive),)
    rests = ""
    if not drive.has_known_forces:
        held, known = _held_and_known(drive)
        names = " and ".join(name_on(drive.axis, one) for one in held)
        rests = f"; it rests on the given {names}: {known}"
    return contradicted + tuple(
        f"{one.name} was {one.before:.3g} and is fitted as {one.after:.3g}: "
        "check its value, or the units of the recordings; simulation.known: "
        f"[{one.name}] holds it{rests}"
        for one in doubtful
    )


def hardly_late(
    effects: Sequence[FittedEffect], sample_time_s: float
) -> tuple[str, ...]:
    """Question effects that only shift a signal by a small part of a sample.

    Parameters
    ----------
    sample_time_s : float, [s]
        The shortest one.
    """
    shares = {
        effect.id: one.value / sample_time_s
        for effect in effects
        if effect.id in _MAKE_LATE
        for one in effect.parameters
        if not one.text and one.value < _HARDLY_LATE * sample_time_s
    }
    return tuple(
        f"{name} is {share:.2g} of a sample: how the simulation goes on between samples, "
        "or when the logger reads, may be all of it"
        for name, share in shares.items()
    )


def stops_in_the_middle(
    effects: Sequence[FittedEffect], farthest_m: float
) -> tuple[str, ...]:
    """Say that a curved contact on both sides which begins at once is a spring's law.

    Parameters
    ----------
    farthest_m : float, [m]
        Largest displacement of all recordings.
    """
    said = []
    for effect in effects:
        values = {one.name: one.value for one in effect.parameters}
        place, exponent = values.get("position_m", np.inf), values.get("exponent", 1.0)
        is_spring = effect.id == "end_stop" and exponent > 1.0
        if is_spring and place <= _MIDDLE * farthest_m:
            share = as_percent(place / farthest_m)
            said.append(
                f"end_stop begins at {share} of the way: it is no stop but a spring that "
                f"hardens from the middle on, with the power {exponent:.3g} "
                "(cubic_stiffness has 3)"
            )
    return tuple(said)


def _is_the_mass(moved: Mapping[BaseParameter, float], drive: Drive) -> bool:
    """Whether all that is known in proportion to the mass has moved by one factor.

    Two values alone may go together by chance, and with a spring there are three.
    """
    is_held = drive.resistance_ohm is None and not drive.has_known_forces
    if not is_held or len(moved) < _PROPORTIONAL:
        return False
    return max(moved.values()) <= _SAME_FACTOR * min(moved.values())


def _contradicted_mass(base: Sequence[BaseParameter], drive: Drive) -> tuple[str, ...]:
    """Say which mass goes with a force constant that the configuration holds."""
    name = name_on(drive.axis, "mass_kg")
    _, constant = _WORDS[drive.axis]
    return tuple(
        f"{name} {one.before:.4g} does not go with the {constant} that simulation.known "
        f"holds: {one.after:.4g} is fitted instead, and forces count beside the {constant}"
        for one in base
        if one.name == name and drive.is_mass_free
    )


def _questioned_mass(moved: Mapping[BaseParameter, float], drive: Drive) -> str:
    factor = float(np.median(list(moved.values())))
    mass, constant = _WORDS[drive.axis]
    size, word = (factor, "large") if factor > 1 else (1 / factor, "small")
    name = name_on(drive.axis, "mass_kg")
    return (
        f"{name} is {drive.mass_kg:.3g}, probably {size:.2g} times too {word}: "
        f"{constant}, damping and stiffness are known only in proportion to the {mass}, "
        f"and all are fitted as about {factor:.2g} times what was given; with {name} "
        f"{drive.mass_kg / factor:.3g} they would be near it"
    )


def _held_and_known(drive: Drive) -> tuple[tuple[str, ...], str]:
    """Given parameters that no fit moves, and what recordings show beside them.

    From ``m x'' = kt i - d v - k x`` with ``i = (u - kt v) / R`` under a voltage: whatever
    leaves these quotients as they are leaves the motion as it is.
    """
    mass, constant = _WORDS[drive.axis]
    if drive.is_resistance_free:
        return ("mass_kg", "damping_N_s_per_m"), (
            f"known is only {constant} / (resistance x {mass}), (damping + {constant}^2 / "
            f"resistance) / {mass} and stiffness / {mass}; the resistance was fitted, "
            "because a damping below 0 would have been needed beside the given one"
        )
    if drive.resistance_ohm is None:
        return ("mass_kg",), (
            f"{constant}, damping and stiffness are known only in proportion to it"
        )
    return ("mass_kg", "resistance_ohm"), (
        f"known is only {constant} / (resistance x {mass}), (damping + {constant}^2 / "
        f"resistance) / {mass} and stiffness / {mass}"
    )


def hidden_from_view(problem: DiagnosisProblem) -> tuple[str, ...]:
    """Say what these recordings cannot show, whatever the drive does."""
    drive, texts = problem.drive, []
    # What a simulation of one's own holds, a circuit say, nobody knows here.
    is_known = not isinstance(drive, StandIn)
    if is_known and drive.resistance_ohm is None:
        texts.append(
            f"what happens before the {drive.source} ({_BEFORE[drive.source]}), because "
            "the input comes after it"
        )
    if is_known and not drive.has_known_forces:
        held, known = _held_and_known(drive)
        mass, _ = _WORDS[drive.axis]
        which = (
            f"{mass} itself"
            if len(held) == 1
            else f"{mass} and the resistance themselves"
        )
        texts.append(f"the {which}: {known}")
    if drive.output == "velocity":
        texts.append("where the drive is, because its velocity is measured")
    else:
        texts += _unseen_sides(problem)
    if problem.moves_one_way:
        texts.append(
            "dry friction apart from a constant load: all recordings move in one "
            "direction only, where the two are the same force"
        )
    holds_nothing = drive.stiffness_N_per_m == 0 and drive.output == "position"
    if holds_nothing and not problem.compares_command:
        texts.append(
            "a constant offset of the sensor, because nothing holds a position"
        )
    if len(problem.part(held_out=True).signals) == 0:
        texts.append("how the result does on other recordings: there is only one")
    return tuple(texts)


def unseen_beside(named: Sequence[str], problem: DiagnosisProblem) -> tuple[str, ...]:
    """Say what gives the same output as an effect that is named.

    Parameters
    ----------
    named : sequence of str
        Ids in the catalogue.
    """
    # Under a controller what is late acts on the command, which is compared.
    if problem.compares_command:
        return ()
    found = (CATALOGUE[one].unseen for one in named)
    return tuple(dict.fromkeys(text for text in found if text))


def taken_up(effects: Sequence[str], named: Sequence[str]) -> tuple[str, ...]:
    """Say which effects the free zeros of the recordings hide, and what would show them.

    Parameters
    ----------
    effects, named : sequence of str
        Public ids.
    """
    if not effects:
        return ()
    wider = [f"{of} may be {one}, with the named size as the mean of its parts"
             for one in effects for of in named if of in CATALOGUE[one].contains]  # fmt: skip
    means = f" ({'; '.join(wider)})" if wider else ""
    return (
        f"{' and '.join(effects)}: each recording's zero is free and takes up the constant "
        f"shift that is all they would change{means}; recordings in both directions that "
        "keep one known zero, where the spring is relaxed, show it with "
        "diagnose.initial_state: estimated",
    )


def _unseen_sides(problem: DiagnosisProblem) -> list[str]:
    lowest = min(float(np.min(one.output)) for one in problem.signals)
    highest = max(float(np.max(one.output)) for one in problem.signals)
    reach = max(abs(lowest), abs(highest))
    # A sensor's zero may lie elsewhere than where the drive starts.
    ways = [one.output - one.output[0] for one in problem.signals]
    lowest = min(lowest, *(float(np.min(one)) for one in ways))
    highest = max(highest, *(float(np.max(one)) for one in ways))
    texts = []
    if lowest > -_ONE_SIDE * reach:
        texts.append("anything on the negative side, where the drive never is")
    if highest < _ONE_SIDE * reach:
        texts.append("anything on the positive side, where the drive never is")
    return texts


def found_start(problem: DiagnosisProblem) -> tuple[str, ...]:
    """Say how recordings start, where their first samples have told it."""
    names = problem.start_told_by
    if not names:
        return ()
    how = {
        "estimated": "in motion: place and speed at the start of each recording are fitted",
        "held": "at rest away from their balance: how far, and the sensor's zero, are "
        "fitted for each recording",
    }[problem.start]
    starts = "starts" if len(names) == 1 else "start"
    return (f"{_few(names)} {starts} {how} (diagnose.initial_state: {problem.start})",)


def left_out(problem: DiagnosisProblem) -> tuple[str, ...]:
    """Say how many samples do not count, because they stand out alone."""
    count = problem.n_damaged
    if not count:
        return ()
    of = _few(problem.damaged)
    if count == 1:
        return (
            f"1 sample of {of} stands out alone, as damage does, and does not count",
        )
    return (
        f"{count} samples of {of} stand out alone, as damage does, and do not count",
    )


def _few(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMED
    return ", ".join(names[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
