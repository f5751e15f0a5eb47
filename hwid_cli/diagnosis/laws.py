"""A formula for what no effect of the catalogue explains.

The most likely subsets of named terms become effects like those of the user's own: they
are simulated in a free run and fitted with the base, thresholds and periods with them,
and held-out recordings judge. A law that is nothing but effects of the catalogue is told
by their names. docs/method_diagnosis.md, eq. (D35) to (D37).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from math import log

import numpy as np

from hwid_cli.diagnosis.candidate import (
    SearchStart,
    base_of,
    base_start,
    fit_candidate,
    present_start,
    start_from,
)
from hwid_cli.diagnosis.choice import TIE
from hwid_cli.diagnosis.fit_facts import has_own_values
from hwid_cli.diagnosis.intervals import intervals, unclear_effects
from hwid_cli.diagnosis.latent_force import Smoothed
from hwid_cli.diagnosis.law_names import effects_of
from hwid_cli.diagnosis.law_search import (
    MOST_TERMS,
    Regression,
    Subset,
    best_subsets,
    coefficients,
    inclusion,
    regression,
)
from hwid_cli.diagnosis.law_terms import Term, coefficient_unit, library, readings
from hwid_cli.diagnosis.problem import Compared
from hwid_cli.diagnosis.rounds import RoundsResult
from hwid_cli.diagnosis.selection import LEAST_GAIN, LEAST_IMPROVED
from hwid_cli.diagnosis.set_fits import Rounds, has_many_samples
from hwid_cli.diagnosis.tasks import DiagnosisTask
from hwid_cli.diagnosis.verdict import DiagnosisVerdict, needs_each
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import SMALL_REMAINDER
from hwid_cli.records.drive import BASE_PARAMETERS, BASE_UNDER_FORCE
from hwid_cli.records.own_effects import OwnEffect, OwnParameter, own_id, own_of

# The verdict, and the name of the effect that holds a law.
LAW = "law"
_SENTENCE = "a law that was found in the recordings"
# Subsets of each size that are simulated; of many training samples on so many, and the
# best one on all. A regression on all samples says where each one starts.
_SIMULATED = 2
_FEW_SAMPLES = 10_000
# Thresholds, periods and exponents stay within this factor of where the regression has
# them. A frequency far above the sample rate changes nothing and takes many short steps.
_SHAPE_FACTOR = 4.0
# Share of the held-out excess over the noise that a law must explain.
LEAST_EXPLAINED_LAW = 0.8
# What a law may leave of what effects of the catalogue leave, where it is not complete.
MOST_OF_NAMED = 0.5
# What a law leaves of held-out recordings against what it leaves of its own, in what the
# base leaves there.
_MOST_ELSEWHERE = 2.0
# A further term must take this share off what is left beyond the noise.
_LEAST_OF_TERM = 0.25
_DRAWS = 100
# Exponents that a refined one is taken for, if they are near enough to fit as well.
_PLAIN_STEP = 0.5


@dataclass(frozen=True, eq=False)
class LawTermFound:
    """One term of a law as it was found.

    Parameters
    ----------
    parameter : str
        Name of its coefficient.
    share : float, [N] or [m]
        RMS of its contribution along the motion.
    """

    term: Term
    parameter: str
    unit: str
    share: float
    inclusion: float


@dataclass(frozen=True, eq=False)
class LawFound:
    """A law, and the effect that holds it.

    Parameters
    ----------
    identifier : str
        Of the effect.
    acts_on : str
        ``force``, ``input`` or ``output``.
    terms : tuple of LawTermFound
        The largest first.
    """

    identifier: str
    acts_on: str
    terms: tuple[LawTermFound, ...]


@dataclass(frozen=True, eq=False)
class _Tried:
    """A subset as an effect, and its fit in a free run."""

    of: Regression
    subset: Subset
    terms: tuple[Term, ...]
    acts_on: str
    identifier: str
    start: SearchStart
    fit: CandidateFit | None = None


def find_law(
    rounds: Rounds,
    compared: Sequence[Compared],
    smoothed: Sequence[Smoothed],
    found: RoundsResult,
    verdict: DiagnosisVerdict,
    most_terms: int = MOST_TERMS,
) -> tuple[DiagnosisVerdict, RoundsResult, LawFound | None]:
    """Look for a law where the catalogue leaves something.

    Parameters
    ----------
    compared, smoothed : sequence
        All recordings beside the fitted base, and the motion as measured.
    found : RoundsResult
        What the catalogue's effects have led to.
    most_terms : int
        Of the law.

    Returns
    -------
    verdict : DiagnosisVerdict
        ``law`` or ``named``; the given one where no law holds.
    found : RoundsResult
        With the fits of laws.
    law : LawFound or None
    """
    most = min(_most_terms(rounds, verdict), most_terms)
    if most == 0:
        return verdict, found, None
    rounds.on_round("laws", 0)
    best = _best(rounds, _tried(rounds, _likely(rounds, compared, smoothed, most)))
    if best is None or not _holds(rounds, best, found, verdict):
        return verdict, found, None
    best = _refined(rounds, best)
    named = _named(rounds, best, found)
    if named is not None and not needs_each(
        rounds.criteria, named, found.fits, rounds.base
    ):
        # Effects that a set of the catalogue would not be named with.
        return verdict, found, None
    if named is not None:
        fits = {**found.fits, named.effects: named}
        word = DiagnosisVerdict("named", rounds.criteria.is_complete(named), named, ())
        return word, replace(found, fits=fits), None
    fit = best.fit
    if fit is None:
        raise ValueError("a law that was not fitted")
    fits = {**found.fits, fit.effects: fit}
    word = DiagnosisVerdict(LAW, rounds.criteria.is_complete(fit), fit, ())
    return word, replace(found, fits=fits), _described(best)


def _most_terms(rounds: Rounds, verdict: DiagnosisVerdict) -> int:
    """How many terms a law may have that something is left for; 0 where nothing is.

    What a named effect leaves near the noise is no reason to take its name away, unless
    a law as short as that leaves nothing.
    """
    is_open = rounds.base.is_usable and not rounds.problem.compares_command
    is_settled = verdict.is_complete or rounds.criteria.leaves_noise(verdict.chosen)
    is_settled = is_settled or rounds.criteria.is_close_to_noise(rounds.base)
    if is_settled or not is_open:
        return 0
    return _as_short(rounds, verdict) or MOST_TERMS


def _as_short(rounds: Rounds, verdict: DiagnosisVerdict) -> int:
    """Number of effects that are named and leave little; 0 where none do."""
    is_small = rounds.criteria.ratio(verdict.chosen) <= SMALL_REMAINDER
    return len(verdict.chosen.effects) if verdict.word == "named" and is_small else 0


def _tried(rounds: Rounds, likely: Sequence[_Tried]) -> list[_Tried]:
    """Fit short laws first, longer ones while something is left."""
    tried: list[_Tried] = []
    for size in sorted({len(one.terms) for one in likely}):
        of_size = [one for one in likely if len(one.terms) == size]
        what = f"laws of {size} term{'s' if size > 1 else ''}"
        tried += _simulated(rounds, of_size, what)
        if any(rounds.criteria.is_complete(_fit(one)) for one in tried):
            break
    return tried


def _likely(
    rounds: Rounds,
    compared: Sequence[Compared],
    smoothed: Sequence[Smoothed],
    most_terms: int,
) -> list[_Tried]:
    """Best subsets of each size, of forces and of what the sensor adds."""
    drive, scales = rounds.baseline.drive, rounds.baseline.scales
    pairs = [
        (one, motion)
        for one, motion in zip(compared, smoothed, strict=True)
        if not one.signals.is_held_out
    ]
    of, motions = [one for one, _ in pairs], [motion for _, motion in pairs]
    tried = []
    kinds = [(library(scales), "force")]
    if drive.output == "position":
        kinds.append((readings(scales), "output"))
    for terms, acts_on in kinds:
        columns = regression(of, motions, drive, terms, through=acts_on == "force")
        for of_size in best_subsets(columns, most_terms):
            tried += [
                _as_effect(rounds, columns, one, acts_on)
                for one in _different(columns, of_size)
            ]
    return tried


def _different(columns: Regression, ranked: Sequence[Subset]) -> list[Subset]:
    """The first subsets that are of other kinds of terms."""
    chosen: dict[tuple[str, ...], Subset] = {}
    for one in ranked:
        kinds = tuple(sorted(columns.terms[place].kind for place in one.places))
        chosen.setdefault(kinds, one)
        if len(chosen) == _SIMULATED:
            break
    return list(chosen.values())


def _as_effect(
    rounds: Rounds, columns: Regression, subset: Subset, acts_on: str
) -> _Tried:
    """A subset as an effect with a parameter for each coefficient and shape."""
    weights, of_base = coefficients(columns, subset.places)
    terms = tuple(columns.terms[place] for place in subset.places)
    drive = rounds.baseline.drive
    base = base_of(drive)
    if acts_on == "force":
        changes = (-of_base[2], -of_base[1], of_base[3])
        for name, change in zip(BASE_PARAMETERS, changes, strict=True):
            base[name] = _near(base[name], change)
        if drive.has_known_forces:
            # The regression holds the mass; here the force sets the scale.
            share = drive.force_constant_N_per_A / base["force_constant_N_per_A"]
            scaled = {name: share * base[name] for name in BASE_UNDER_FORCE}
            base = {**base_of(drive), **scaled}
            weights = share * weights
        variables = set().union(*(one.variables for one in terms))
        if "u" in variables and variables <= {"u", "t"}:
            # As a force it would be the same; it is said where it acts.
            acts_on, weights = "input", weights / base["force_constant_N_per_A"]
    effect, values = _effect(terms, weights, acts_on, _units(rounds))
    identifier = own_id(_name(rounds), effect)
    present = present_start(rounds.base, drive_effects(rounds.problem.drive))
    start = SearchStart(base, {**present, identifier: values})
    return _Tried(columns, subset, terms, acts_on, identifier, start)


def _name(rounds: Rounds) -> str:
    """Name of the effect: another one where the simulation has a law already."""
    taken = {public_id(one) for one in drive_effects(rounds.problem.drive)}
    numbers = (f"{LAW}_{number}" for number in count(2))
    return LAW if LAW not in taken else next(one for one in numbers if one not in taken)


def _near(value: float, change: float) -> float:
    """A parameter of the base with a change that leaves its sign and size."""
    moved = value + change
    return moved if 0.3 * value < moved < 3.0 * value else value


def _units(rounds: Rounds) -> tuple[str, str, str]:
    """Units of force, reading and input."""
    units = rounds.problem.drive.units
    return units.force, units.length, units.source


def _effect(
    terms: Sequence[Term],
    weights: np.ndarray,
    acts_on: str,
    units: tuple[str, str, str],
) -> tuple[OwnEffect, dict[str, float]]:
    """Formula, parameters and their values."""
    source = units[2]
    parameters: dict[str, OwnParameter] = {}
    values: dict[str, float] = {}
    parts = []
    shapes: dict[tuple[str, float], str] = {}
    for number, (term, weight) in enumerate(zip(terms, weights, strict=True), start=1):
        name = f"c{number}"
        unit = _unit(term, acts_on, units)
        parameters[name] = OwnParameter(unit, start=float(weight))
        values[name] = float(weight)
        text = term.formula
        for key, (value, shape_unit) in term.shape.items():
            # One period or threshold where two terms have the same.
            shape = shapes.setdefault((key, value), f"{key}{len(shapes) + 1}")
            text = _renamed(text, key, shape)
            stated = shape_unit or source
            bounds = (value / _SHAPE_FACTOR, value * _SHAPE_FACTOR)
            parameters[shape] = OwnParameter(
                stated, positive=True, bounds=bounds, start=value
            )
            values[shape] = value
        parts.append(f"{name}*{text}")
    formula = " + ".join(parts)
    if acts_on == "force":
        return OwnEffect(
            force_N=formula, sentence=_SENTENCE, parameters=parameters
        ), values
    if acts_on == "input":
        return OwnEffect(
            input=f"u + {formula}", sentence=_SENTENCE, parameters=parameters
        ), values
    return OwnEffect(
        output=f"x + {formula}", sentence=_SENTENCE, parameters=parameters
    ), values


def _unit(term: Term, acts_on: str, units: tuple[str, str, str]) -> str:
    """Unit of a coefficient: of a reading a length, of an input one of the input."""
    force, *others = units
    length, source = others
    if acts_on == "force":
        return coefficient_unit(term, force, (length, source))
    way, time, of_source = term.exponents
    taken = (
        (way - 1, time, of_source)
        if acts_on == "output"
        else (way, time, of_source - 1)
    )
    return coefficient_unit(replace(term, exponents=taken), "1", (length, source))


def _renamed(text: str, name: str, new: str) -> str:
    """A name of a formula replaced; it stands between signs."""
    return re.sub(rf"\b{name}\b", new, text)


def _simulated(rounds: Rounds, tried: Sequence[_Tried], what: str) -> list[_Tried]:
    """Fit effects with the base in a free run; of many samples only the best to all."""
    found = _with_few_samples(rounds, tried, what)
    if not has_many_samples(rounds.problem):
        return found
    best = max(found, key=lambda one: rounds.criteria.gain(_fit(one), rounds.base))
    if not _fit(best).is_usable:
        return found
    again = replace(best, start=start_from(rounds.problem.drive, _fit(best)))
    (whole,) = _fitted(rounds, [again], f"{what}, in a free run, all recordings", None)
    return [whole if one is best else one for one in found]


def _with_few_samples(
    rounds: Rounds, tried: Sequence[_Tried], what: str
) -> list[_Tried]:
    """Fit effects with the base in a free run, to some of many samples."""
    most = _FEW_SAMPLES if has_many_samples(rounds.problem) else None
    return _fitted(rounds, tried, f"{what}, in a free run", most)


def _fitted(
    rounds: Rounds, tried: Sequence[_Tried], what: str, most: int | None
) -> list[_Tried]:
    """Fit effects with the base to so many samples, or to all."""
    rounds.on_round(what, len(tried))
    baseline = rounds.baseline
    tasks = [
        DiagnosisTask(
            name=f"law {number}",
            function=fit_candidate,
            arguments=(
                rounds.problem, (one.identifier,), (one.start,), baseline.scales,
                baseline.noise, most,
            ),
            result_type=CandidateFit,
            content={"law": one.identifier, "start": one.start, "most_samples": most},
            arrays=(rounds.base.values,),
        )
        for number, one in enumerate(tried)
    ]  # fmt: skip
    fits = rounds.run_tasks(tasks, keep=True)
    return [replace(one, fit=fit) for one, fit in zip(tried, fits, strict=True)]


def _best(rounds: Rounds, tried: Sequence[_Tried]) -> _Tried | None:
    """The law that leaves least, a shorter one where that leaves hardly more."""
    criteria, base = rounds.criteria, rounds.base
    usable = [one for one in tried if one.fit is not None and one.fit.is_usable]
    best: _Tried | None = None
    for size in sorted({len(one.terms) for one in usable}):
        same = [one for one in usable if len(one.terms) == size]
        winner = max(same, key=lambda one: criteria.gain(_fit(one), base))
        if best is None:
            best = winner
            continue
        against = criteria.evidence(_fit(winner), _fit(best))
        taken = 1 - criteria.excess(_fit(winner)) / max(
            criteria.excess(_fit(best)), 1e-300
        )
        is_clear = criteria.is_beyond_stand_in(_fit(winner), _fit(best))
        is_clear = is_clear and not _unclear_terms(rounds, winner)
        if against.gain > LEAST_GAIN and taken > _LEAST_OF_TERM and is_clear:
            best = winner
    return best


def _fit(one: _Tried) -> CandidateFit:
    if one.fit is None:
        raise ValueError("a law that was not fitted")
    return one.fit


def _unclear_terms(rounds: Rounds, one: _Tried) -> list[str]:
    """Coefficients whose intervals reach zero."""
    fit = _fit(one)
    low, high = intervals(rounds.problem, fit, rounds.baseline.scales)
    return [
        ref.parameter
        for ref, lowest, highest in zip(fit.names, low, high, strict=True)
        if ref.owner == one.identifier
        and ref.parameter.startswith("c")
        # Signs, not a product of the two, which may overflow; NaN has none.
        and not np.sign(lowest) * np.sign(highest) > 0
    ]


def _holds(
    rounds: Rounds, one: _Tried, found: RoundsResult, verdict: DiagnosisVerdict
) -> bool:
    """Whether held-out recordings agree, and effects of the catalogue do not do as well."""
    criteria, fit = rounds.criteria, _fit(one)
    against = criteria.evidence(fit, rounds.base)
    holds = (
        against.gain >= LEAST_GAIN
        and against.explained >= LEAST_EXPLAINED_LAW
        and against.improved >= LEAST_IMPROVED
        and criteria.is_beyond_stand_in(fit, rounds.base)
        and _is_as_good_elsewhere(rounds, fit)
        and not _is_behind(rounds, one, found)
        and not _unclear_terms(rounds, one)
    )
    if not verdict.chosen.effects or not holds:
        return holds
    rest = criteria.excess(fit) / max(criteria.excess(verdict.chosen), 1e-300)
    is_better = criteria.gain(fit, verdict.chosen) >= LEAST_GAIN
    is_better = is_better and criteria.is_beyond_stand_in(fit, verdict.chosen)
    if _as_short(rounds, verdict):
        return is_better and criteria.is_complete(fit)
    return is_better and (rest <= MOST_OF_NAMED or criteria.is_complete(fit))


def _is_behind(rounds: Rounds, one: _Tried, found: RoundsResult) -> bool:
    """Whether effects of the catalogue, named or not, leave clearly less than a law."""
    criteria, law = rounds.criteria, _fit(one)
    return any(
        fit.is_usable
        and not has_own_values(fit)
        and criteria.gain(fit, law) >= LEAST_GAIN
        and criteria.rms(fit, held_out=True) < criteria.rms(law, held_out=True)
        for fit in found.fits.values()
    )


def _is_as_good_elsewhere(rounds: Rounds, fit: CandidateFit) -> bool:
    """Whether it leaves about as much of held-out recordings as of its own.

    A formula of many terms follows anything along the motion that it was made from.
    """

    def share(one: CandidateFit) -> float:
        criteria = rounds.criteria
        least = criteria.noise.rms
        own = max(criteria.rms(one, held_out=False), least)
        return max(criteria.rms(one, held_out=True), least) / own

    return share(fit) <= _MOST_ELSEWHERE * max(share(rounds.base), 1.0)


def _refined(rounds: Rounds, one: _Tried) -> _Tried:
    """Powers with an exponent that is fitted, where that is worth it."""
    for place, term in enumerate(one.terms):
        if not term.family.startswith("power of "):
            continue
        name = term.family[-1]
        time = -1.0 if name == "v" else 0.0
        power = term.exponents[0]
        free = Term(
            f"abs({name}/n0)**p*sign({name})", (0.0, 0.0, 0.0),
            {"p": (power, "-")}, term.family,
        )  # fmt: skip
        size = _size(rounds, name)
        free = replace(free, formula=free.formula.replace("n0", f"{size:.6g}"))
        fitted = _replaced(rounds, one, place, free, size**power)
        # Rounded afterwards, an exponent needs no more than some of many samples.
        (fitted,) = _with_few_samples(rounds, [fitted], "the exponent")
        found = _value_of(fitted, "p")
        if (
            not np.isfinite(found)
            or rounds.criteria.gain(_fit(fitted), _fit(one)) < TIE
        ):
            continue
        plain = round(found / _PLAIN_STEP) * _PLAIN_STEP
        has_sign = any(other.formula == f"sign({name})" for other in one.terms)
        candidates = [
            _replaced(
                rounds, one, place,
                Term(_power_text(name, p), (p, p * time, 0.0), family=term.family),
                size ** (power - p),
            )
            for p in (plain, round(found, 2))
            # The first power is the base's; the power 0 is the sign alone.
            if (p > 0 and p != 1) or (p == 0 and not has_sign)
        ]  # fmt: skip
        done = _simulated(rounds, candidates, "the exponent")
        for other in done:
            if rounds.criteria.gain(_fit(other), _fit(one)) > TIE:
                one = other
                break
    return one


def _power_text(name: str, power: float) -> str:
    if power == 0:
        return f"sign({name})"
    if power == 2:
        return f"{name}*abs({name})"
    if power in (1, 3, 5):
        return f"{name}**{power:g}"
    return f"abs({name})**{power:g}*sign({name})"


def _size(rounds: Rounds, name: str) -> float:
    scales = rounds.baseline.scales
    sizes = {"x": scales.displacement_m, "v": scales.velocity_m_per_s}
    return float(f"{sizes.get(name, scales.current_A):.6g}")


def _replaced(
    rounds: Rounds, one: _Tried, place: int, term: Term, factor: float
) -> _Tried:
    """The same law with another term, whose coefficient is another one by a factor."""
    terms = (*one.terms[:place], term, *one.terms[place + 1 :])
    values = _values(one)
    weights = np.array([values[f"c{n}"] for n in range(1, len(terms) + 1)])
    weights[place] *= factor
    acts_on = one.acts_on
    effect, start = _effect(terms, weights, acts_on, _units(rounds))
    for name, value in values.items():
        if name in start and not name.startswith("c"):
            start[name] = value
    identifier = own_id(_name(rounds), effect)
    base = base_start(rounds.problem.drive, _fit(one))
    present = present_start(rounds.base, drive_effects(rounds.problem.drive))
    search = SearchStart(base, {**present, identifier: start})
    return replace(one, terms=terms, identifier=identifier, start=search, fit=None)


def _values(one: _Tried) -> dict[str, float]:
    fit = _fit(one)
    return {
        ref.parameter: float(value)
        for ref, value in zip(fit.names, fit.values, strict=True)
        if ref.owner == one.identifier
    }


def _value_of(one: _Tried, start: str) -> float:
    """Value of the shape whose name begins so; NaN without a fit."""
    if not _fit(one).is_usable:
        return float("nan")
    values = _values(one)
    return next(v for name, v in values.items() if name.startswith(start))


def _named(rounds: Rounds, one: _Tried, found: RoundsResult) -> CandidateFit | None:
    """Fit of the catalogue's own effects, where the law is nothing else."""
    effects = effects_of({term.formula for term in one.terms}, one.acts_on)
    allowed = set(rounds.allowed) or set(CATALOGUE)
    if not effects or not set(effects) <= allowed:
        return None
    fit = found.fits.get(effects)
    if fit is None:
        fit = _fit_of(rounds, one, effects)
    criteria = rounds.criteria
    is_as_good = criteria.gain(_fit(one), fit) < LEAST_GAIN
    is_clear = not unclear_effects(rounds.problem, fit, rounds.baseline.scales)
    explained = criteria.evidence(fit, rounds.base).explained
    return fit if is_as_good and is_clear and explained >= LEAST_EXPLAINED_LAW else None


def _fit_of(rounds: Rounds, one: _Tried, effects: tuple[str, ...]) -> CandidateFit:
    """Fit effects of the catalogue from their own starts, the base where the law has it."""
    base = base_start(rounds.problem.drive, _fit(one))
    present = present_start(rounds.base, drive_effects(rounds.problem.drive))
    scales, baseline = rounds.baseline.scales, rounds.baseline
    several = [CATALOGUE[effect].starts(scales) for effect in effects]
    most = max(len(starts) for starts in several)
    starts = [
        SearchStart(
            base,
            {
                **present,
                **{
                    effect: of[row % len(of)]
                    for effect, of in zip(effects, several, strict=True)
                },
            },
        )
        for row in range(most)
    ]
    task = DiagnosisTask(
        "+".join(effects), fit_candidate,
        (rounds.problem, effects, tuple(starts), baseline.scales, baseline.noise),
        CandidateFit, {"effects": effects, "of a law": True}, (rounds.base.values,),
    )  # fmt: skip
    fit: CandidateFit = rounds.run_tasks([task], keep=True)[0]
    return fit


def _described(one: _Tried) -> LawFound:
    """Terms with their shares, the largest first."""
    chances = _chances(one)
    values = _values(one)
    _, effect = own_of(one.identifier)
    terms = []
    for number, (term, chance) in enumerate(zip(one.terms, chances, strict=True), 1):
        name = f"c{number}"
        unit = effect.parameters[name].unit
        settled = _settled(term, values)
        share = abs(values[name]) * float(np.std(settled.values(one.of.motion)))
        terms.append(LawTermFound(settled, name, unit, share, chance))
    terms.sort(key=lambda found: -found.share)
    return LawFound(one.identifier, one.acts_on, tuple(terms))


def _chances(one: _Tried) -> list[float]:
    ranked = best_subsets(one.of)
    places = one.subset.places
    found = inclusion(one.of, ranked, places, np.random.default_rng(1), draws=_DRAWS)
    return [float(chance) for chance in found]


def _settled(term: Term, values: Mapping[str, float]) -> Term:
    """The term with the numbers of its shape in its formula."""
    text = term.formula
    for key, (start, _) in term.shape.items():
        near = [
            value for name, value in values.items() if name[0] == key and name != "c"
        ]
        value = min(near, key=lambda one: abs(log(one / start))) if near else start
        text = _renamed(text, key, f"{value:.6g}")
    return replace(term, formula=text, shape={})
