"""What was found, put into the simulation itself: only that run confirms.

docs/method_diagnosis.md, eq. (D32), (D33).
"""

from collections.abc import Mapping
from dataclasses import replace

from hwid_cli.diagnosis.candidate import rebuilt, without_owner
from hwid_cli.diagnosis.choice import WITHIN_REACH
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.parameters import residuals_at, sum_of_squares
from hwid_cli.diagnosis.selection import LEAST_EXPLAINED, LEAST_LAST_CONTRIBUTION
from hwid_cli.diagnosis.settling import settled
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import acts_at_port
from hwid_cli.diagnosis.through_runs import followed
from hwid_cli.diagnosis.turns import Turn, fit_of_run, is_as_good
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.records.candidates import CandidateFit

# Share of its stated value by which a parameter is far from it, [-].
_LED_AWAY = 0.5


def confirm(
    findings: Findings, runs: Runs, values: dict[str, float]
) -> tuple[Findings, dict[str, float], bool]:
    """Put what was found into the simulation, and fit it again to what that gives.

    Parameters
    ----------
    values : dict of str to float
        Parameters of the simulation that the stand-in was fitted beside.

    Returns
    -------
    Findings
        Of the simulation's own run; without the effects, which stay a lead, where that
        run leaves clearly more than the stand-in said.
    dict of str to float
        Parameters of the simulation at that run.
    bool
        Whether that run bears the effects out.
    """
    chosen, verdict = findings.verdict.chosen, findings.verdict
    if runs.simulator.run is None:
        return findings, values, False
    if not chosen.effects and verdict.word in ("none", "unknown"):
        return findings, values, True
    best = settled(findings, chosen, runs, values)
    if best is None:
        return unconfirmed(findings), values, False
    if not findings.criteria.is_complete(fit_of_run(findings, best)):
        best = followed(findings, best, runs)
    best = _without_idle(findings, best, runs)
    best = _without_imitations(findings, best, runs)
    found, criteria = _with_run(findings, best), findings.criteria
    run = found.verdict.chosen
    is_enough = is_as_good(best) or criteria.is_nearly_all(run, findings.base)
    # Where the simulation's own parameters have moved, another drive stands for it.
    beside = criteria.beside(best.problem.drive)
    may_be_named = not (beside.replaces(run) or criteria.imitates_one_law(run))
    may_be_named = may_be_named and _explains(findings, run)
    if is_enough and may_be_named:
        return _beside_rivals(findings, found, best, runs), best.values_of_run, True
    return unconfirmed(findings), best.values_of_run, False


def _beside_rivals(
    findings: Findings, found: Findings, best: Turn, runs: Runs
) -> Findings:
    """Findings whose rivals are those that leave about as little in the simulation, too.

    A stand-in that errs cannot tell them apart.

    Parameters
    ----------
    findings, found : Findings
        Of the stand-in, and of the simulation's own run.
    """
    verdict, criteria = found.verdict, findings.criteria
    if not verdict.rivals:
        return found
    most = WITHIN_REACH * criteria.excess(verdict.chosen)
    left = float(best.sse.sum())
    rivals = []
    for one in verdict.rivals:
        turn = settled(findings, one, runs, best.values_of_run, left)
        if turn is not None and criteria.excess(fit_of_run(found, turn)) <= most:
            rivals.append(one)
    word = "ambiguous" if rivals else "named"
    return replace(found, verdict=replace(verdict, word=word, rivals=tuple(rivals)))


def _explains(findings: Findings, run: CandidateFit) -> bool:
    """Whether a run with effects leaves clearly less of the recordings held out.

    The stand-in's own fit has; a run may leave as much of all recordings, and more there.
    """
    criteria = findings.criteria
    if not run.effects or criteria.is_complete(run):
        return True
    return criteria.evidence(run, findings.base).explained >= LEAST_EXPLAINED


def _without_idle(findings: Findings, best: Turn, runs: Runs) -> Turn:
    """The run without effects that hardly act in it, if it leaves hardly more.

    They have made up for what the stand-in erred by before runs corrected it.
    """
    slight = _slight(findings)
    for effect in best.fit.effects:
        if _acts_by(findings, best, effect) <= slight:
            best = _without(findings, best, effect, best.values_of_run, runs)
    return best


def _without_imitations(findings: Findings, best: Turn, runs: Runs) -> Turn:
    """The run without effects at the ports that the simulation's own parameters have.

    A parameter that had imitated what is missing is far from its stated value, and an effect
    makes up for it: a lag of the input where a pump's own lag has gone to its bound.
    """
    for effect in best.fit.effects:
        values = _where_stated(runs, best.values_of_run)
        if values != best.values_of_run and acts_at_port((effect,)):
            best = _without(findings, best, effect, values, runs)
    return best


def _where_stated(runs: Runs, values: Mapping[str, float]) -> dict[str, float]:
    """The same with parameters that are far from their stated values back there."""
    stated = {name: one.value for name, one in runs.simulator.free.items()}
    led = {
        name: value
        for name, value in stated.items()
        if abs(values[name] - value) > _LED_AWAY * abs(value)
    }
    return {**values, **led}


def _slight(findings: Findings) -> float:
    """Squares by which an effect has to count, [output unit squared]."""
    return LEAST_LAST_CONTRIBUTION * findings.criteria.excess(findings.base)


def _without(
    findings: Findings, best: Turn, effect: str, values: dict[str, float], runs: Runs
) -> Turn:
    """The run without one of several effects, if it leaves hardly more.

    Parameters
    ----------
    values : dict of str to float
        Parameters of the simulation to begin with.
    """
    criteria, run = findings.criteria, fit_of_run(findings, best)
    if len(run.effects) < 2 or not _may_go(effect, run.effects):
        return best
    if runs.run_tasks.are_spent:
        return best
    beside = replace(findings, problem=replace(best.problem, known={}))
    turn = settled(beside, without_owner(run, effect), runs, values)
    if turn is None:
        return best
    fit = fit_of_run(findings, turn)
    is_as_complete = criteria.is_complete(fit) or not criteria.is_complete(run)
    is_as_little = criteria.excess(fit) <= criteria.excess(run) + _slight(findings)
    return turn if is_as_complete and is_as_little else best


def _may_go(effect: str, effects: tuple[str, ...]) -> bool:
    """Whether no second one of its kind would stay behind."""
    return all(CATALOGUE[one].beside != public_id(effect) for one in effects)


def _acts_by(findings: Findings, turn: Turn, effect: str) -> float:
    """Squares by which an effect of a fit moves the stand-in, as it was corrected last."""
    parts = [
        residuals_at(turn.problem, *rebuilt(turn.problem, fit, findings.scales))
        for fit in (turn.fit, without_owner(turn.fit, effect))
    ]
    return sum_of_squares([one - other for one, other in zip(*parts, strict=True)])


def unconfirmed(findings: Findings) -> Findings:
    """Findings whose effects the simulation itself, with them in it, does not bear out.

    What a stand-in says is no fact where the simulation says otherwise; it stays a lead.
    """
    if not findings.verdict.chosen.effects:
        return findings
    verdict = DiagnosisVerdict("unknown", False, findings.base, ())
    return replace(findings, verdict=verdict, law=None)


def _with_run(findings: Findings, turn: Turn) -> Findings:
    """Findings with what the simulation itself has left with the effect in it."""
    fit, before = fit_of_run(findings, turn), findings.verdict.chosen
    if not before.effects and before.cause and is_as_good(turn):
        # No more is left than was told to be noise.
        fit = replace(fit, whiteness=before.whiteness, cause=before.cause)
    is_complete = findings.criteria.is_complete(fit)
    verdict = replace(findings.verdict, chosen=fit, is_complete=is_complete)
    problem = replace(turn.problem, known={})
    return replace(findings, problem=problem, verdict=verdict)
