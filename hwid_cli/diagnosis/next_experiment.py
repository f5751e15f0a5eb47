"""Which input would separate two candidates, by simulation of both.

The rival may adapt its parameters: what its derivatives can absorb of the difference
does not count. The input of the menu that leaves most is proposed, if a recording of it
shows that through the noise.
docs/method_diagnosis.md, eq. (D26).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import belongs_to, rebuilt
from hwid_cli.diagnosis.candidate_words import title_of
from hwid_cli.diagnosis.choice import TIE
from hwid_cli.diagnosis.parameters import (
    START,
    ParameterLayout,
    ParameterPoint,
    residuals_at,
    simulate_at,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.search import derivatives
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import Motion
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NextExperiment
from hwid_cli.records.drive import SOURCES
from hwid_cli.records.units import behind

# Verdicts after which another recording is of use.
UNDECIDED = ("ambiguous", "unknown")
# Reasons why no input is named.
_DECIDED = "the recordings decide; no further one is needed"
_LEFT = (
    "the recordings decide between what was tried, and none of that is all that is missing: "
    "motion of other kinds may show the rest"
)
# Samples of a proposed recording.
_MOST_SAMPLES = 6000
_PERIODS = 12
# So much farther from its start than in the recordings may a proposed motion go, [-].
_BEYOND_TRAVEL = 1.25
# An input that stays within this share of its largest value has no sign there, [-].
_ONE_SIGN = 0.05
# Share of the sample rate up to which the recordings show a frequency well, [-].
HIGHEST_SHARE = 0.1


def propose(
    problem: DiagnosisProblem,
    criteria: SelectionCriteria,
    scales: Scales,
    verdict: DiagnosisVerdict,
    fits: Sequence[CandidateFit],
) -> NextExperiment:
    """Find the input that would separate what the recordings do not.

    Parameters
    ----------
    fits : sequence of CandidateFit
        Of all sets of effects, the best of which are separated where none is named.

    Returns
    -------
    NextExperiment
        With an empty input where none is needed, or none would tell.
    """
    if verdict.word not in UNDECIDED:
        return NextExperiment("", _DECIDED if verdict.is_complete else _LEFT)
    # A run of the simulation may have known how recordings start where a fit had found it.
    pair = [
        one
        for one in undecided_candidates(criteria, verdict, fits)
        if belongs_to(problem, one, scales)
    ][:2]
    if len(pair) < 2:
        return NextExperiment("", "no candidate could be simulated")
    if problem.compares_command:
        return NextExperiment(
            "a slower and a faster motion along the same path",
            "friction, inertia and delay then weigh differently",
        )
    names = " and ".join(map(title_of, pair))
    models = [FittedCandidate(*rebuilt(problem, one, scales)) for one in pair]
    best = best_separation(problem, models[0], models[1], scales)
    if not best.input:
        return NextExperiment(
            "",
            "every input of the menu goes farther than these recordings; one that "
            "moves the drive forth and back may tell "
            f"{names} apart",
        )
    # The dash of a dimensionless output would be a minus behind a number.
    by = f"{best.rms:.2g}{behind(problem.unit)}"
    ratio = best.rms / max(criteria.noise.rms, 1e-300)
    least = least_separation(best.n_samples)
    if ratio < least:
        return NextExperiment(
            "",
            f"no input of the size of these recordings tells {names} apart through the "
            f"noise (the best, {best.input}, makes them differ by {ratio:.2g} times the "
            f"noise; {least:.2g} is needed); larger inputs or a quieter sensor may",
        )
    return NextExperiment(
        best.input,
        f"{names} then differ by {by} ({times_the_noise(ratio, least, best.n_samples)}) "
        "after the parameters have been fitted again",
    )


def least_separation(n_samples: int) -> float:
    """Least difference of candidates that a further recording shows through its noise.

    Parameters
    ----------
    n_samples : int, [samples]
        Of that recording.

    Returns
    -------
    float, [-]
        Over the noise of a sample: many samples show what a single one hides.

    References
    ----------
    docs/method_diagnosis.md, eq. (D26a).

    Examples
    --------
    >>> round(least_separation(600), 2)
    0.1
    """
    return float(np.sqrt(TIE / n_samples))


def times_the_noise(ratio: float, least: float, n_samples: int) -> str:
    """Words for a difference; one below the noise of a sample says why it is seen.

    Examples
    --------
    >>> times_the_noise(5.0, 0.11, 500)
    '5 times the noise'
    >>> times_the_noise(0.4, 0.11, 500)
    '0.4 times the noise of one sample; 500 samples show 0.11 times and more'
    """
    if ratio >= 1.0:
        return f"{ratio:.2g} times the noise"
    return (
        f"{ratio:.2g} times the noise of one sample; {n_samples} samples show {least:.2g} "
        "times and more"
    )


def undecided_candidates(
    criteria: SelectionCriteria,
    verdict: DiagnosisVerdict,
    fits: Sequence[CandidateFit],
) -> list[CandidateFit]:
    """Candidates that the recordings do not tell apart, the best one first.

    Parameters
    ----------
    fits : sequence of CandidateFit
        Of all sets of effects.

    Returns
    -------
    list of CandidateFit
        The chosen one and its rivals; where nothing is named, the best two.
    """
    if verdict.word == "ambiguous":
        return [verdict.chosen, *verdict.rivals]
    # The chosen one is the base then.
    usable = [one for one in fits if one.is_usable]
    return sorted(usable, key=lambda one: -criteria.gain(one, verdict.chosen))[:2]


def with_best_lead(
    criteria: SelectionCriteria,
    candidates: Sequence[CandidateFit],
    fits: Sequence[CandidateFit],
) -> list[CandidateFit]:
    """The same behind the set that fits best, where that is another one.

    It may be best and not named, because the recordings leave its parameters open: a loss
    and its time constant in recordings that are shorter. Then the next one is to tell it
    from the named ones, which may be alike to each other whatever is played.

    Parameters
    ----------
    fits : sequence of CandidateFit
        Of all sets of effects.
    """
    usable = [one for one in fits if one.is_usable]
    if not candidates or not usable:
        return list(candidates)
    best = max(usable, key=lambda one: criteria.gain(one, candidates[0]))
    is_known = best.effects in {one.effects for one in candidates}
    return list(candidates) if is_known else [best, *candidates]


@dataclass(frozen=True, eq=False)
class FittedCandidate:
    """A fitted candidate, ready to be simulated on other inputs.

    Parameters
    ----------
    point : ParameterPoint
        Own values of one recording.
    """

    layout: ParameterLayout
    point: ParameterPoint


@dataclass(frozen=True)
class Separation:
    """How well an input separates two candidates.

    Parameters
    ----------
    input : str
        In words.
    rms : float, [output unit]
        Difference that the rival cannot absorb.
    n_samples : int, [samples]
        Of the recording.
    """

    input: str
    rms: float
    n_samples: int


def best_separation(
    problem: DiagnosisProblem,
    favourite: FittedCandidate,
    rival: FittedCandidate,
    scales: Scales,
) -> Separation:
    """Input of the menu that separates two candidates best.

    Parameters
    ----------
    problem : DiagnosisProblem
        Its recordings say how far the drive may move.

    Returns
    -------
    Separation
        With an empty input where all of them leave that travel.
    """
    found = [Separation("", 0.0, 1)]
    unit = problem.input_unit or problem.drive.source_unit
    for name, command in menu(scales, unit).items():
        if not _has_known_sign(command, problem):
            continue
        asked, motion = played(problem, favourite, command)
        if _stays(motion.position, problem):
            found.append(Separation(name, _left_over(asked, rival), command.size))
    return max(found, key=lambda item: (item.rms, bool(item.input)))


def _has_known_sign(command: np.ndarray, problem: DiagnosisProblem) -> bool:
    """Whether an input keeps to the signs that were recorded, where it may have only one.

    A motor turns both ways; a heater does not cool.
    """
    if problem.input_unit in SOURCES:
        return True
    recorded = np.concatenate([one.input for one in problem.signals])
    least = _ONE_SIGN * float(np.max(np.abs(recorded)))
    is_upward, is_downward = np.min(recorded) > -least, np.max(recorded) < least
    return not (
        (is_upward and np.min(command) < -least)
        or (is_downward and np.max(command) > least)
    )


def _stays(position: np.ndarray, problem: DiagnosisProblem) -> bool:
    """Whether a motion goes hardly farther from its start than those recorded.

    On a free axis a step that is held, or a sine around a level, runs away.
    """
    ways = [one.position - one.position[0] for one in problem.signals]
    farthest = max(float(np.nanmax(np.abs(one))) for one in ways)
    # A motion without numbers is told by what it leaves.
    return not bool(np.any(np.abs(position - position[0]) > _BEYOND_TRAVEL * farthest))


def separation(
    problem: DiagnosisProblem,
    favourite: FittedCandidate,
    rival: FittedCandidate,
    command: np.ndarray,
) -> float:
    """How far apart an input brings two candidates.

    Parameters
    ----------
    problem : DiagnosisProblem
        For the drive.
    command : ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    float, [output unit]
        Root mean square of the difference that the rival cannot absorb.
    """
    return _left_over(played(problem, favourite, command)[0], rival)


def played(
    problem: DiagnosisProblem, candidate: FittedCandidate, command: np.ndarray
) -> tuple[DiagnosisProblem, Motion]:
    """One further recording, as a candidate would answer it.

    Parameters
    ----------
    problem : DiagnosisProblem
        For the drive.
    command : ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    DiagnosisProblem
        Of that recording alone.
    Motion
        The simulation that it is.
    """
    step = min(one.sample_time_s for one in problem.signals)
    is_velocity = problem.drive.output == "velocity"
    nothing = np.zeros(command.size)
    like = min(problem.signals, key=lambda one: one.sample_time_s)
    signals = Signals(
        "next", "other", command, nothing, command, nothing, step,
        is_velocity=is_velocity,
        noise_filter=None if like.noise_filter is None else like.noise_filter.elsewhere,
    )  # fmt: skip
    one = replace(problem, signals=(signals,))
    point = _at_rest(candidate)
    (truth,) = simulate_at(one, candidate.layout, point)
    seen = replace(signals, compared=truth.output, output=truth.output)
    return replace(problem, signals=(seen,)), truth


def _at_rest(candidate: FittedCandidate) -> ParameterPoint:
    """The values of one recording, which starts at rest where the first one does."""
    own = candidate.point.own[:1].copy()
    for column, one in enumerate(candidate.layout.own):
        if one.owner == START and one.name in ("velocity", "current"):
            own[:, column] = one.coordinate(0.0)
    return ParameterPoint(candidate.point.shared, own)


def _left_over(asked: DiagnosisProblem, rival: FittedCandidate) -> float:
    """RMS of what the rival's parameters cannot absorb."""
    point = _at_rest(rival)
    parts = residuals_at(asked, rival.layout, point)
    if not np.isfinite(parts[0]).all():
        return 0.0
    (slopes,) = derivatives(asked, rival.layout, point, parts)
    lengths = np.sqrt(np.sum(slopes**2, axis=0))
    usable = slopes[:, np.isfinite(lengths) & (lengths > 0)]
    left = parts[0]
    if usable.shape[1]:
        left = left - usable @ np.linalg.lstsq(usable, left, rcond=1e-10)[0]
    return float(np.sqrt(np.mean(left**2)))


def menu(scales: Scales, unit: str) -> dict[str, np.ndarray]:
    """Inputs that could be measured next.

    Parameters
    ----------
    unit : str
        Of the input, for the descriptions.

    Returns
    -------
    dict of str to ndarray, shape (n_samples,), [unit]
        By their description.
    """
    step, size, natural = scales.sample_time_s, scales.current_A, scales.natural_Hz
    n = int(min(_MOST_SAMPLES, max(_PERIODS / natural / step, 200)))
    time = step * np.arange(n)
    rest = int(0.05 * n)
    inputs: dict[str, np.ndarray] = {}
    for sign, word in ((1, "positive"), (-1, "negative")):
        for share in (1.0, 0.15):
            value = sign * share * size
            inputs[f"a {word} step of {abs(value):.3g} {unit}, held and taken back"] = (
                _step(n, rest, value)
            )
    inputs[f"a slow triangle of {0.3 * size:.3g} {unit}, once to each side"] = (
        0.3 * size * _triangle(n, rest)
    )
    highest = HIGHEST_SHARE / step
    for factor in (0.15, 0.7, 1.0, 2.5, 6.0):
        frequency = factor * natural
        if frequency <= highest:
            inputs[f"a sine of {size:.3g} {unit} at {frequency:.3g} Hz"] = (
                size * np.sin(2 * np.pi * frequency * time)
            )
    if natural <= highest:
        inputs[f"a small sine of {0.1 * size:.3g} {unit} at {natural:.3g} Hz"] = (
            0.1 * size * np.sin(2 * np.pi * natural * time)
        )
    if 0.7 * natural > highest:
        return inputs
    biased = 0.6 * size + 0.3 * size * np.sin(2 * np.pi * 0.7 * natural * time)
    inputs[
        f"a sine of {0.3 * size:.3g} {unit} at {0.7 * natural:.3g} Hz around {0.6 * size:.3g} {unit}"
    ] = biased * np.minimum(1.0, np.arange(n) / max(rest, 1))
    return inputs


def _step(n: int, rest: int, value: float) -> np.ndarray:
    command = np.zeros(n)
    ramp = max(2, n // 300)
    command[rest:] = value * np.minimum(1.0, np.arange(n - rest) / ramp)
    back = int(0.6 * n)
    command[back:] = value * np.maximum(0.0, 1 - np.arange(n - back) / ramp)
    return command


def _triangle(n: int, rest: int) -> np.ndarray:
    corners = np.array([0, rest, rest + (n - rest) / 4, rest + 3 * (n - rest) / 4, n])
    return np.interp(np.arange(n), corners, [0.0, 0.0, 1.0, -1.0, 0.0])
