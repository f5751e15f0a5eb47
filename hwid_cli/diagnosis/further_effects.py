"""What a simulation lacks beside an effect that its own run bears out.

A stand-in errs by more than a small effect where the simulation is not linear. Corrected
by the run with the first effect in it, it tells a second one, which is put into the
simulation beside the first. docs/method_diagnosis.md, eq. (D32b).
"""

from dataclasses import replace

from hwid_cli.diagnosis.candidate import fitted_drive, fitted_effects
from hwid_cli.diagnosis.diagnose import find
from hwid_cli.diagnosis.effect_sets import with_effect
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.intervals import unclear_effects
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.single_effects import single_in_simulation, to_its_end
from hwid_cli.diagnosis.tasks import OnRound
from hwid_cli.diagnosis.told_by_runs import ToldByRuns
from hwid_cli.diagnosis.verdict import decide
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.experiment import DiagnoseOptions


def with_further_effect(
    first: ToldByRuns, runs: Runs, options: DiagnoseOptions, on_round: OnRound
) -> ToldByRuns:
    """The first effect with a second one, where the simulation's own run leaves less.

    Parameters
    ----------
    first : ToldByRuns
        Of the simulation's run with the first effect.

    Returns
    -------
    ToldByRuns
        The first one itself where no run with two effects may be named.
    """
    one = first.findings
    if one is None or options.max_effects < 2 or not one.verdict.chosen.effects:
        return first
    if runs.run_tasks.are_spent:
        return first
    chosen = one.verdict.chosen
    if len(chosen.effects) > 1:
        return first
    (known,) = chosen.effects
    if any(each.is_own for each in CATALOGUE[known].parameters):
        # What each recording has for itself is no effect that a simulation may have.
        return first
    drive = fitted_drive(one.problem.drive, chosen)
    present = {**drive.effects, **fitted_effects(chosen)}
    beside = replace(one.problem, drive=replace(drive, effects=present))
    single = replace(options, max_effects=1, laws="never")
    told = find(beside, single, runs.run_tasks, on_round, may_cut=False)
    second = single_in_simulation(told, runs, first.values, on_round)
    if not second.is_all:
        second = to_its_end(second, runs)
    if second.findings is None or not second.findings.verdict.chosen.effects:
        return first
    both = _with_known(one, second.findings, known)
    if both is None:
        return first
    is_all = both.criteria.is_nearly_all(both.verdict.chosen, both.base)
    return ToldByRuns(both, second.values, is_all)


def _with_known(first: Findings, second: Findings, known: str) -> Findings | None:
    """Findings of both effects, from those of the second one beside the first.

    None where no pair may be named, or where the second one was fitted through runs of
    the simulation, whose stand-in has no values of the first.
    """
    if not _holds(second.verdict.chosen, known):
        return None
    pairs = [
        _as_pair(fit, known)
        for fit in second.found.fits.values()
        if len(fit.effects) == 1 and known not in fit.effects and _holds(fit, known)
    ]
    drive = replace(second.problem.drive, effects=first.problem.drive.effects)
    problem = replace(second.problem, drive=drive)
    fits = {**first.found.fits, **{one.effects: one for one in pairs}}
    best = _as_pair(second.verdict.chosen, known)
    fits[best.effects] = best

    def unclear(one: CandidateFit) -> tuple[str, ...]:
        return unclear_effects(problem, one, first.scales)

    verdict = decide(
        first.criteria, first.given_sse, first.base, fits,
        (first.verdict.chosen, best), unclear,
    )  # fmt: skip
    if len(verdict.chosen.effects) < 2:
        return None
    found = replace(first.found, fits=fits)
    return replace(first, problem=problem, verdict=verdict, found=found)


def _holds(fit: CandidateFit, effect: str) -> bool:
    """Whether a fit has values of an effect, present or added."""
    return any(one.owner == effect for one in fit.names)


def _as_pair(fit: CandidateFit, known: str) -> CandidateFit:
    """A fit beside a known effect as one of both, with its values in the order of such."""
    effects = with_effect(fit.effects, known)
    owners = {one: place for place, one in enumerate(effects)}
    # The base comes first.
    order = sorted(
        range(len(fit.names)), key=lambda n: owners.get(fit.names[n].owner, -1)
    )
    return replace(
        fit,
        effects=effects,
        names=tuple(fit.names[n] for n in order),
        values=fit.values[order],
        valleys=fit.valleys[:, order] if fit.valleys.size else fit.valleys,
    )
