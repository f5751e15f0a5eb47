"""What a diagnosis found, put together for files and reports.

Gaps, parameters with their intervals, and the curves that show them.
docs/method_diagnosis.md, eq. (D20).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hwid_cli.diagnosis.behind_loop import unseen_in_command
from hwid_cli.diagnosis.candidate import compared_with_fit, fitted_drive
from hwid_cli.diagnosis.held_command import OtherCommand
from hwid_cli.diagnosis.intervals import intervals
from hwid_cli.diagnosis.latent_force import Smoothed
from hwid_cli.diagnosis.laws import LawFound
from hwid_cli.diagnosis.next_experiment import propose
from hwid_cli.diagnosis.observability import absorbed_effects
from hwid_cli.diagnosis.parameters import BASE, is_factor
from hwid_cli.diagnosis.pieces import JudgedPieces
from hwid_cli.diagnosis.problem import Compared, DiagnosisProblem
from hwid_cli.diagnosis.ranking import ranked
from hwid_cli.diagnosis.rounds import RoundsResult
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.diagnosis.sentences import (
    doubtful_values,
    found_start,
    hardly_late,
    held_in_words,
    hidden_from_view,
    imitated_in_words,
    law_in_words,
    left_out,
    stops_in_the_middle,
    summarise,
    taken_up,
    unseen_beside,
    untold_command,
)
from hwid_cli.diagnosis.simulation_trust import simulation_trust
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.diagnosis.where import latent_force_curves
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.formula import as_text, parsed, with_values
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.axis import name_on
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.diagnosis import (
    BaseParameter,
    Diagnosis,
    FittedEffect,
    FittedParameter,
    Gap,
    LatentForce,
    Law,
    LawTerm,
    NoiseFloor,
    Overlay,
    Place,
    RecordingGap,
)
from hwid_cli.records.drive import BASE_PARAMETERS, Drive
from hwid_cli.records.own_effects import is_own, own_of
from hwid_cli.records.trust import ModelTrust, TrustOnTests
from hwid_cli.records.units import behind

MOST_OVERLAYS = 4


@dataclass(frozen=True, eq=False)
class Findings:
    """All that the verdict and its presentation rest on.

    Parameters
    ----------
    given_sse : ndarray, shape (n_recordings,), [output unit squared]
        Of the simulation with the parameters that the configuration gives.
    base : CandidateFit
        Re-fitted, without further effects.
    before : list of Compared
        Simulations with the re-fitted base.
    force : list of Smoothed
        That the re-fitted base lacks.
    pieces : JudgedPieces or None
        Fits that all of this was joined from, where whole recordings cannot judge.
    own_base : CandidateFit or None
        What a simulation of the user's leaves itself with its parameters fitted, where a
        stand-in's base, of which more is free, leaves less.
    own_before : list of Compared
        Its runs beside the recordings.
    other : OtherCommand or None
        The chosen effects beside the command that was not taken, where the recordings do
        not tell whether it is held between samples.
    warnings : tuple of str
        What a reader has to know of how it was judged.
    """

    problem: DiagnosisProblem
    criteria: SelectionCriteria
    scales: Scales
    given_sse: np.ndarray
    base: CandidateFit
    before: list[Compared]
    force: list[Smoothed]
    where: tuple[Place, ...]
    found: RoundsResult
    verdict: DiagnosisVerdict
    law: LawFound | None = None
    pieces: JudgedPieces | None = None
    own_base: CandidateFit | None = None
    own_before: list[Compared] = field(default_factory=list)
    other: OtherCommand | None = None
    warnings: tuple[str, ...] = ()

    def intervals_of(self, ids: Sequence[str]) -> tuple[FittedEffect, ...]:
        """The chosen effects with intervals, as the fit that judges gives them.

        Where another command does as well, the intervals hold what is found beside it.
        """
        if not ids:
            return ()
        problem, chosen = self._judging
        ends = intervals(problem, chosen, self.scales)
        if self.other is not None:
            beside = intervals(self.other.problem, self.other.fit, self.scales)
            ends = np.fmin(ends[0], beside[0]), np.fmax(ends[1], beside[1])
        return _fitted_effects_of(chosen, ends, ids)

    @property
    def _judging(self) -> tuple[DiagnosisProblem, CandidateFit]:
        """The fit that judges, and what it was fitted to."""
        if self.pieces is None:
            return self.problem, self.verdict.chosen
        return self.pieces.problem, self.pieces.chosen

    def intervals_of_base(self) -> dict[str, tuple[float, float]]:
        """95 % intervals of the base's parameters in the fit that judges."""
        problem, chosen = self._judging
        ends = zip(*intervals(problem, chosen, self.scales), strict=True)
        return {
            one.parameter: (float(low), float(high))
            for one, (low, high) in zip(chosen.names, ends, strict=True)
            if one.owner == BASE
        }

    @property
    def is_untold(self) -> bool:
        """Whether effects have other values beside another command that does as well."""
        if self.other is None:
            return False
        low, high = intervals(self.problem, self.verdict.chosen, self.scales)
        beside = self.other.fit.values
        of_effects = [one.owner != BASE for one in self.verdict.chosen.names]
        return bool(((beside < low) | (beside > high))[of_effects].any())

    def described_effects(self) -> tuple[tuple[FittedEffect, ...], ...]:
        """Effects that the simulation has, and those that it lacks."""
        drive, base = self.problem.drive, self.base
        present = tuple(drive_effects(drive))
        told = self.intervals_of((*present, *self.verdict.chosen.effects))
        n = len(present)
        return _beside_given(drive, base, told[:n]), told[n:]

    def after(self) -> list[Compared]:
        """Simulations with the chosen effects, beside the measurements."""
        chosen = self.verdict.chosen
        if chosen is self.base:
            return self.before
        if self.pieces is not None:
            return self.pieces.compared(self.pieces.chosen, self.scales)
        return compared_with_fit(self.problem, chosen, self.scales)

    def unseen(self) -> tuple[str, ...]:
        """What these recordings cannot show, in words."""
        return (
            *unseen_beside(self.verdict.chosen.effects, self.problem),
            *hidden_from_view(self.problem),
            *self._absorbed(),
        )

    def _absorbed(self) -> tuple[str, ...]:
        """What the recordings' own zeros take up, in words."""
        if self.pieces is not None:
            return ()
        chosen, noise = self.verdict.chosen, self.criteria.noise
        found = absorbed_effects(self.problem, chosen, self.scales, noise.rms)
        return taken_up(found, [public_id(one) for one in chosen.effects])

    def all_warnings(
        self, parameters: Sequence[BaseParameter], effects: Sequence[FittedEffect]
    ) -> tuple[str, ...]:
        """What a reader has to know, of how it was judged and of the values."""
        signals = self.problem.signals
        sample_time_s = min(one.sample_time_s for one in signals)
        farthest_m = max(float(np.max(np.abs(one.position))) for one in signals)
        return (
            *self.warnings,
            *found_start(self.problem),
            *left_out(self.problem),
            *unseen_in_command(self.problem, self.verdict.chosen, self.scales),
            *untold_command(self.problem, self.is_untold),
            *doubtful_values(parameters, self.problem.drive),
            *hardly_late(effects, sample_time_s),
            *stops_in_the_middle(effects, farthest_m),
        )

    def trust(self) -> tuple[ModelTrust | None, TrustOnTests]:
        """What is known of the errors on whole recordings, if these can be predicted."""
        if self.pieces is not None:
            return None, TrustOnTests()
        return simulation_trust(
            self.problem, self.verdict.chosen, self.scales, self.criteria.noise.rms
        )


def describe(findings: Findings) -> Diagnosis:
    """Put together what shows the verdict."""
    problem, criteria, base = findings.problem, findings.criteria, findings.base
    verdict, noise, scales = findings.verdict, criteria.noise, findings.scales
    chosen, before, after = verdict.chosen, findings.before, findings.after()
    fits, given_sse = list(findings.found.fits.values()), findings.given_sse
    from_sse = given_sse if verdict.word in ("parameters", "none") else base.sse
    parameters = _base(problem.drive, base, chosen, findings.intervals_of_base())
    present, effects = findings.described_effects()
    trust, bands = findings.trust()
    law = _law(findings.law, effects)
    return Diagnosis(
        verdict=verdict.word,
        complete=verdict.is_complete,
        summary=_summary(findings, effects, law),
        effects=effects,
        ambiguous_with=_ids_of(verdict.rivals),
        noise=_told(criteria, problem.unit),
        given=_gap(criteria, given_sse),
        before=_gap(criteria, from_sse),
        after=_gap(criteria, chosen.sse),
        explained_share=_explained(criteria, chosen.sse, from_sse),
        base=parameters,
        places=findings.where,
        not_observable=findings.unseen(),
        next_experiment=propose(problem, criteria, scales, verdict, fits),
        train=tuple(one.name for one in problem.signals if not one.is_held_out),
        held_out=tuple(one.name for one in problem.signals if one.is_held_out),
        candidates=ranked(criteria, fits, base, findings.found.shares, verdict),
        gaps=_recording_gaps(problem, given_sse, base, chosen),
        overlays=_overlays(before, after, noise),
        latent_force=_force_curves(findings, None if chosen is base else after),
        present=present,
        reference_current_A=problem.drive.reference_current_A,
        reference_displacement_m=problem.drive.reference_displacement_m,
        output_unit=problem.unit,
        compared="command u" if problem.compares_command else "output y",
        warnings=findings.all_warnings(parameters, effects),
        axis=problem.drive.axis,
        units=problem.drive.straight_units,
        output=problem.drive.output,
        hold=problem.drive.hold,
        remains=chosen.cause,
        law=law,
        trust=trust,
        bands=bands,
    )  # fmt: skip


def _summary(
    findings: Findings, effects: tuple[FittedEffect, ...], law: Law | None
) -> str:
    """Say the verdict in words."""
    problem, base, verdict = findings.problem, findings.base, findings.verdict
    if law is None:
        fits = findings.found.fits.values()
        text = summarise(problem, findings.criteria, base, verdict, effects, fits)
    else:
        text = law_in_words(findings.criteria, base, verdict, law, effects[0])
    held_out = problem.part(held_out=True).signals
    if effects and held_out:
        given = _gap(findings.criteria, findings.given_sse).ratio_to_noise
        text += imitated_in_words(given, findings.criteria.ratio(base))
    return text + held_in_words(problem)


def _ids_of(rivals: Sequence[CandidateFit]) -> tuple[str, ...]:
    return tuple("+".join(public_id(name) for name in one.effects) for one in rivals)


def _law(law: LawFound | None, effects: Sequence[FittedEffect]) -> Law | None:
    """The formula with the coefficients of its effect."""
    held = [one for one in effects if law is not None and one.own == law.identifier]
    if law is None or not held:
        return None
    of = {one.name: one for one in held[0].parameters}
    values = {name: float(f"{one.value:.6g}") for name, one in of.items()}
    _, stated = own_of(law.identifier)
    node = with_values(parsed(stated.formula), values)
    terms = tuple(
        LawTerm(
            one.term.formula,
            of[one.parameter].value,
            of[one.parameter].low,
            of[one.parameter].high,
            one.unit,
            one.inclusion,
        )
        for one in law.terms
    )
    if law.acts_on == "force":
        # Term by term, the largest first.
        text = " + ".join(_weighted(one.value, one.term) for one in terms)
        return Law(text.replace("+ -", "- "), law.acts_on, terms)
    return Law(as_text(node).replace("+ -", "- "), law.acts_on, terms)


def _weighted(value: float, term: str) -> str:
    """A term with its coefficient."""
    over_one = term.startswith("1/")
    return f"{value:.6g}{term[1:]}" if over_one else f"{value:.6g}*{term}"


def _force_curves(
    findings: Findings, after: Sequence[Compared] | None
) -> tuple[LatentForce, ...]:
    drive = fitted_drive(findings.problem.drive, findings.base)
    if findings.pieces is not None:
        # Joined pieces jump where the next one starts: that is no force.
        after = None
    return latent_force_curves(
        findings.before, after, findings.force, drive, findings.criteria.noise
    )


def _gap(criteria: SelectionCriteria, sse: np.ndarray) -> Gap:
    held = criteria.is_held_out
    # Without held-out recordings the training ones stand in for them.
    has_held_out = bool((~held).any())
    train = ~held if has_held_out else held
    train_rms, judged_rms = (
        float(np.sqrt(sse[rows].sum() / criteria.n_samples[rows].sum()))
        for rows in (train, held)
    )
    noise_rms = criteria.held_out_noise
    ratio = judged_rms / noise_rms if noise_rms > 0 else float("inf")
    return Gap(train_rms, judged_rms if has_held_out else float("nan"), ratio)


def _told(criteria: SelectionCriteria, unit: str) -> NoiseFloor:
    """The noise, and by how much it differs between recordings."""
    noise, levels = criteria.noise, criteria.levels
    if not np.ptp(levels):
        return noise
    low, high = noise.rms * levels.min(), noise.rms * levels.max()
    sentence = (
        f"{noise.sentence}; it differs between recordings, from {low:.2g} to {high:.2g}"
        f"{behind(unit)}, and is {criteria.held_out_noise:.2g}{behind(unit)} in those that "
        "judge"
    )
    return replace(noise, sentence=sentence, held_out_rms=criteria.held_out_noise)


def _explained(
    criteria: SelectionCriteria, after: np.ndarray, before: np.ndarray
) -> float:
    """Share of the held-out excess over the noise; 0 where there is none."""
    held = criteria.is_held_out
    floor = criteria.floors[held].sum()
    excess = before[held].sum() - floor
    if not np.isfinite(excess):
        return 1.0
    if excess <= 0:
        return 0.0
    return float(min((before[held].sum() - after[held].sum()) / excess, 1.0))


def _base(
    drive: Drive,
    base: CandidateFit,
    chosen: CandidateFit,
    ends: Mapping[str, tuple[float, float]],
) -> tuple[BaseParameter, ...]:
    refitted, after = fitted_drive(drive, base), fitted_drive(drive, chosen)
    found = []
    names = drive.fitted_base
    if drive.is_mass_free:
        # Known, so it stays; it is what the mass was fitted beside.
        names = tuple(dict.fromkeys((*names, *BASE_PARAMETERS)))
    for name in names:
        factor = _mean_factor(chosen, name)
        low, high = ends.get(name, (np.nan, np.nan))
        found.append(
            BaseParameter(
                name_on(drive.axis, name),
                getattr(drive, name),
                getattr(refitted, name),
                getattr(after, name) * factor,
                low * factor,
                high * factor,
            )
        )
    return tuple(found)


def _mean_factor(chosen: CandidateFit, name: str) -> float:
    """What the mean over the recordings is of a parameter that they change, over the fit.

    The mass is known from the configuration: beside another mean mass all others, which
    are known in proportion to it, are others. 1 without any change.
    """
    mean = 1.0
    for column, one in enumerate(chosen.own_names):
        if not is_factor(one):
            continue
        which = CATALOGUE[one.owner].words["which"]
        of_recordings = float(np.mean(np.exp(chosen.own[:, column])))
        if which == "mass":
            mean /= of_recordings
        elif name.startswith(f"{which}_"):
            mean *= of_recordings
    return mean


def _recording_gaps(
    problem: DiagnosisProblem,
    given_sse: np.ndarray,
    base: CandidateFit,
    chosen: CandidateFit,
) -> tuple[RecordingGap, ...]:
    def rms(sse: np.ndarray, row: int) -> float:
        return float(np.sqrt(sse[row] / problem.signals[row].n_evaluated))

    factors = _own_factors(chosen)
    return tuple(
        RecordingGap(
            one.name,
            one.kind,
            one.is_held_out,
            rms(given_sse, row),
            rms(base.sse, row),
            rms(chosen.sse, row),
            float(factors[row]),
        )
        for row, one in enumerate(problem.signals)
    )


def _own_factors(found: CandidateFit) -> np.ndarray:
    """Of each recording, the factor of the parameter that differs, over their mean.

    Returns
    -------
    ndarray, shape (n_recordings,), [-]
        NaN where none does; of several parameters the first one's.
    """
    columns = [row for row, one in enumerate(found.own_names) if is_factor(one)]
    if not columns:
        return np.full(found.sse.size, np.nan)
    factors = np.exp(found.own[:, columns[0]])
    return np.asarray(factors / np.mean(factors))


def _overlays(
    before: Sequence[Compared], after: Sequence[Compared], noise: NoiseFloor
) -> tuple[Overlay, ...]:
    held = [row for row, one in enumerate(before) if one.signals.is_held_out]
    rows = held or list(range(len(before)))
    rows.sort(key=lambda row: -before[row].rms)
    return tuple(
        Overlay(
            before[row].signals.name,
            before[row].signals.sample_time_s
            * np.arange(before[row].signals.compared.size),
            before[row].signals.driven_by,
            before[row].signals.compared,
            before[row].simulated,
            after[row].simulated,
            noise.rms,
        )
        for row in rows[:MOST_OVERLAYS]
    )


def _fitted_effects_of(
    found: CandidateFit, ends: tuple[np.ndarray, np.ndarray], ids: Sequence[str]
) -> tuple[FittedEffect, ...]:
    """Describe effects of a fit, by their ids in the catalogue.

    Parameters
    ----------
    ends : tuple of ndarray, each shape (n_names,)
        Lower and upper ends of the intervals of what all recordings share.
    """
    parameters: dict[str, list[FittedParameter]] = {one: [] for one in ids}
    each = zip(found.names, found.values, *ends, strict=True)
    for one, value, low, high in each:
        if one.owner in parameters:
            # A search may have turned an angle several times.
            turned = CATALOGUE[one.owner].parameter(one.parameter).nearest(float(value))
            parameters[one.owner].append(
                FittedParameter(
                    one.parameter, float(value) + turned, float(low) + turned,
                    float(high) + turned, unit=_unit_of(one),
                )
            )  # fmt: skip
    for identifier in ids:
        entry = CATALOGUE[identifier]
        for name, word in entry.words.items():
            told = FittedParameter(name, float("nan"), text=word)
            parameters[identifier].append(told)
        for parameter in entry.parameters:
            if parameter.is_factor:
                own = ParameterRef(identifier, parameter.name)
                column = found.own_names.index(own)
                parameters[identifier].append(_spread(np.exp(found.own[:, column])))
            elif parameter.is_own and entry.is_of_start:
                # Stated, it says that each recording has a start of its own.
                told = FittedParameter(parameter.name, parameter.default or 0.0)
                parameters[identifier].append(told)
    return tuple(_described(one, parameters[one]) for one in ids)


def _beside_given(
    drive: Drive, base: CandidateFit, present: Sequence[FittedEffect]
) -> tuple[FittedEffect, ...]:
    """Effects of the simulation beside what they were given as, and re-fitted."""
    stated = drive_effects(drive)
    refitted = dict(zip(base.names, base.values, strict=True))
    return tuple(
        replace(
            effect,
            parameters=tuple(
                replace(
                    one,
                    before=values.get(one.name, one.before),
                    refitted=float(
                        refitted.get(ParameterRef(identifier, one.name), np.nan)
                    ),
                )
                for one in effect.parameters
            ),
        )
        for effect, (identifier, values) in zip(present, stated.items(), strict=True)
    )


def _unit_of(ref: ParameterRef) -> str:
    return CATALOGUE[ref.owner].parameter(ref.parameter).unit


def _described(identifier: str, parameters: Sequence[FittedParameter]) -> FittedEffect:
    entry = CATALOGUE[identifier]
    return FittedEffect(
        public_id(identifier), entry.sentence, entry.equation, tuple(parameters),
        own=identifier if is_own(identifier) else "",
    )  # fmt: skip


def _spread(factors: np.ndarray) -> FittedParameter:
    """Relative standard deviation between recordings, with its usual interval."""
    spread = float(np.std(factors, ddof=1) / np.mean(factors))
    reach = 1.96 / float(np.sqrt(2 * max(factors.size - 1, 1)))
    return FittedParameter("spread", spread, spread * (1 - reach), spread * (1 + reach))
