"""Laws that no catalogue holds, in the simulation itself.

One of a single term is asked for before any effect is run, and one takes the place of what
is named where it leaves far less. docs/method_diagnosis.md, eq. (D29), (D33).
"""

from dataclasses import replace

from hwid_cli.diagnosis.confirmation import confirm
from hwid_cli.diagnosis.diagnose import find
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.laws import MOST_OF_NAMED
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.selection import LEAST_GAIN
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.standing import standing_beside
from hwid_cli.diagnosis.tasks import OnRound
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.records.experiment import DiagnoseOptions

# Runs that are left in any case for a law in the place of what is named.
_FOR_LAW = 100
# A law of one term that leaves nothing, or at most this share of what single effects leave
# beside the stand-in, in squares over the noise, is put into the simulation before them, [-].
_CLEARLY_LESS = 0.5
# Verdicts that a law may take the place of.
_NAMED = ("named", "ambiguous")


def short_law(
    standing: DiagnosisProblem,
    options: DiagnoseOptions,
    simulation: tuple[Runs, dict[str, float]],
    found: Findings,
    on_round: OnRound,
) -> tuple[Findings, dict[str, float], bool] | None:
    """A law of one term that is all that is missing, where no single effect may be.

    Both are of the same stand-in: an effect of the catalogue that is missing would leave
    as little beside it.

    Parameters
    ----------
    found : Findings
        Of single effects.
    """
    runs, values = simulation
    fits = found.found.fits.values()
    are_open = found.verdict.word not in ("none", "parameters")
    if not (are_open and _may_be_law(options)) or runs.run_tasks.are_spent:
        return None
    if any(found.criteria.is_nearly_all(one, found.base) for one in fits):
        return None
    law = _laws_alone(standing, options, runs, on_round)
    if law.law is None or len(law.law.terms) > 1:
        return None
    least = min(found.criteria.excess(one) for one in (found.base, *fits))
    chosen, criteria = law.verdict.chosen, law.criteria
    is_clearly_less = criteria.excess(chosen) <= _CLEARLY_LESS * least
    if not (is_clearly_less or criteria.is_complete(chosen)):
        return None
    on_round("the law in the simulation", 0)
    told, moved, is_confirmed = confirm(law, runs, values)
    return (told, moved, True) if is_confirmed and told.verdict.is_complete else None


def law_instead(
    runs: Runs,
    problem: DiagnosisProblem,
    verdict: DiagnosisVerdict,
    values: dict[str, float],
    options: DiagnoseOptions,
    on_round: OnRound,
) -> tuple[Findings, dict[str, float]] | None:
    """A law as short as what is named that leaves far less, if there is one.

    A stand-in that is late at a step may take what is left for its own error; only the
    simulation's run with the effect shows it.

    Parameters
    ----------
    verdict : DiagnosisVerdict
        On the simulation's run.
    values : dict of str to float
        Parameters of the simulation that no effect has moved.
    """
    if options.max_runs is None:
        runs = replace(runs, run_tasks=runs.run_tasks.at_least(_FOR_LAW))
    if (
        runs.run_tasks.are_spent
        or not _may_be_law(options)
        or verdict.word not in _NAMED
        or verdict.is_complete
    ):
        return None
    on_round("a law instead", 0)
    standing = standing_beside(runs, problem, runs.of(problem.signals, values), values)
    found = _laws_alone(standing, options, runs, on_round)
    if found.law is None or len(found.law.terms) > len(verdict.chosen.effects):
        return None
    told, moved, is_confirmed = confirm(found, runs, values)
    criteria, law = told.criteria, told.verdict.chosen
    is_better = criteria.gain(law, verdict.chosen) >= LEAST_GAIN
    least = MOST_OF_NAMED * criteria.excess(verdict.chosen)
    is_clear = told.verdict.is_complete or criteria.excess(law) <= least
    return (told, moved) if is_confirmed and is_better and is_clear else None


def _laws_alone(
    standing: DiagnosisProblem, options: DiagnoseOptions, runs: Runs, on_round: OnRound
) -> Findings:
    """What laws alone leave beside the stand-in."""
    return find(standing, replace(options, laws="only"), runs.run_tasks, on_round)


def _may_be_law(options: DiagnoseOptions) -> bool:
    """Whether a law may take the place of what the catalogue holds."""
    return options.laws == "auto" and options.effects is None
