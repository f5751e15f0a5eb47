"""One search for what a simulation lacks, beside a drive that stands for it.

Single effects come first, then a second one beside a first that runs bear out, then sets
that the stand-in chooses: each is put into the simulation itself, whose runs decide.
docs/method_diagnosis.md, eq. (D32), (D33).
"""

from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import belongs_to
from hwid_cli.diagnosis.confirmation import confirm, unconfirmed
from hwid_cli.diagnosis.diagnose import find
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.further_effects import with_further_effect
from hwid_cli.diagnosis.laws_in_simulation import short_law
from hwid_cli.diagnosis.leads_in_simulation import leads_in_simulation
from hwid_cli.diagnosis.own_base import with_own_base
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.single_effects import single_in_simulation, to_its_end
from hwid_cli.diagnosis.stand_in import acts_at_port
from hwid_cli.diagnosis.tasks import OnRound
from hwid_cli.diagnosis.told_by_runs import ToldByRuns
from hwid_cli.diagnosis.turns import have_moved, where_it_starts
from hwid_cli.records.drive import StandIn
from hwid_cli.records.experiment import DiagnoseOptions

# Parameters that have moved by more than this have imitated what is missing. Beside an
# effect that runs bear out, those that have moved by less than the second had hardly done
# so: what else is missing is looked for at once.
MOVED, _MOVED_BESIDE_NAMED = 0.01, 0.05
# Of all runs, those after which no further single effect is tried: sets need some, too. Where
# the configuration leaves their number open, what is missing beside an effect, and sets, have
# some beyond them.
_FOR_SINGLES, _FOR_SETS = 0.75, 1.5


@dataclass(frozen=True, eq=False)
class Beside:
    """A drive that stands for a simulation, and what is asked of both.

    Parameters
    ----------
    standing : DiagnosisProblem
        With that drive.
    runs : Runs
        Of the simulation.
    values : dict of str to float
        Its parameters, which the drive stands for.
    given_sse : ndarray, shape (n_recordings,), [output unit squared]
        What the simulation as given leaves; None where the drive says that.
    """

    standing: DiagnosisProblem
    options: DiagnoseOptions
    runs: Runs
    values: dict[str, float]
    given_sse: np.ndarray | None
    on_round: OnRound

    def found(self, options: DiagnoseOptions, *, may_cut: bool) -> Findings:
        """What the stand-in lacks.

        Parameters
        ----------
        may_cut : bool
            Whether pieces of the recordings are asked where nothing is settled.
        """
        tasks, simulator = self.runs.run_tasks, self.runs.simulator
        found = find(
            self.standing,
            options,
            tasks,
            self.on_round,
            self.given_sse,
            may_cut=may_cut,
        )
        return with_own_base(found, self.standing, simulator)


@dataclass(frozen=True, eq=False)
class FoundBeside:
    """What one search beside a stand-in has led to.

    Parameters
    ----------
    values : dict of str to float
        Parameters of the simulation, with what was found where that is confirmed.
    is_confirmed : bool
        Whether the simulation's own run bears it out.
    """

    findings: Findings
    values: dict[str, float]
    is_confirmed: bool

    @property
    def names_effects(self) -> bool:
        """Whether there are effects that the simulation's own run confirms."""
        return self.is_confirmed and bool(self.findings.verdict.chosen.effects)

    def leaves_less_than(self, one: Findings) -> bool:
        """Whether effects that its run confirms leave less than what is chosen elsewhere."""
        return self.names_effects and _leaves_less_than(self.findings, one)

    def stays_beside(self, further: "FoundBeside") -> bool:
        """Whether a further search is no reason to give this one up."""
        if not self.is_confirmed:
            return False
        return not (
            further.is_confirmed and _leaves_less_than(further.findings, self.findings)
        )


def searched_beside(beside: Beside, *, is_first: bool) -> FoundBeside:
    """What the stand-in lacks, single effects first, put into the simulation.

    Parameters
    ----------
    is_first : bool
        Whether another search may follow, from where this one has moved the parameters.
    """
    if beside.options.laws == "only" or beside.runs.simulator.run is None:
        return _of_sets(_with_nearer_spring(beside), None)
    found = beside.found(_of_one(beside.options), may_cut=False)
    law = short_law(
        beside.standing,
        beside.options,
        (beside.runs, beside.values),
        found,
        beside.on_round,
    )
    if law is not None:
        return FoundBeside(*law)
    alone = single_in_simulation(
        found,
        beside.runs.up_to(_FOR_SINGLES),
        beside.values,
        beside.on_round,
        may_pair=beside.options.max_effects > 1,
    )
    if alone.findings is not None and alone.is_all:
        return FoundBeside(alone.findings, alone.values, is_confirmed=True)
    return _beyond_singles(beside, found, alone, is_first=is_first)


def _of_one(options: DiagnoseOptions) -> DiagnoseOptions:
    """Options that ask for single effects alone."""
    return replace(options, max_effects=1, laws="never")


def _beyond_singles(
    beside: Beside, found: Findings, alone: ToldByRuns, *, is_first: bool
) -> FoundBeside:
    """What is missing where no single effect is all of it.

    Where one that explains most has moved the parameters, these had imitated it: no set is
    looked for beside a stand-in of the old ones. One that the simulation's own run bears
    out stays where no set, which a stand-in has chosen, leaves less; a second one is looked
    for beside it first.
    """
    told, runs, values = alone.findings, beside.runs, beside.values
    least = MOVED if told is None else _MOVED_BESIDE_NAMED
    begins_anew = is_first and have_moved(values, alone.values, least)
    if begins_anew and not _is_exact(told):
        # What runs bear out stays unless a search from there leaves less.
        return FoundBeside(told or found, alone.values, told is not None)
    # Nothing more to look for: no gap, or parameters.
    if found.verdict.word in ("none", "parameters"):
        return FoundBeside(*confirm(found, runs, values))
    if beside.options.max_runs is None:
        runs = runs.up_to(_FOR_SETS)
    both = with_further_effect(alone, runs, beside.options, beside.on_round)
    alone = to_its_end(alone, runs) if both is alone else both
    is_told = alone.findings is not None
    if begins_anew and not _is_enough(alone):
        return FoundBeside(alone.findings or found, alone.values, is_told)
    if runs.run_tasks.are_spent or _is_enough(alone):
        lead = _with_runs(unconfirmed(found), alone)
        return FoundBeside(alone.findings or lead, alone.values, is_told)
    return _of_sets(replace(beside, runs=runs), alone)


def has_few_runs(runs: Runs) -> bool:
    """Whether no further single effect would be tried."""
    return runs.up_to(_FOR_SINGLES).run_tasks.are_spent


def _is_exact(told: Findings | None) -> bool:
    """Whether what is told was fitted through runs alone, whatever the stand-in says.

    Effects at the ports are, from the parameters as stated, too: a search from where these
    have moved to would tell no more of them.
    """
    return told is not None and acts_at_port(told.verdict.chosen.effects)


def _is_enough(alone: ToldByRuns) -> bool:
    """Whether sets that a stand-in chooses could tell no more than runs have.

    A second effect was looked for in the simulation before.
    """
    one = alone.findings
    return one is not None and (alone.is_all or is_all_but_nothing(one))


def is_all_but_nothing(found: Findings) -> bool:
    """Whether what is chosen leaves next to nothing, whatever shape that has."""
    return found.criteria.leaves_next_to_nothing(found.verdict.chosen, found.base)


def _of_sets(beside: Beside, alone: ToldByRuns | None) -> FoundBeside:
    """What the stand-in lacks, several effects at once, put into the simulation.

    Parameters
    ----------
    alone : ToldByRuns or None
        What single effects in the simulation have told, where they were tried.
    """
    runs, values, on_round = beside.runs, beside.values, beside.on_round
    one = None if alone is None else alone.findings
    # What a stand-in leaves of an effect that runs bear out is its own error: pieces,
    # which are asked where nothing is settled, would only repeat it.
    found = beside.found(beside.options, may_cut=one is None)
    on_round("the effect in the simulation", 0)
    several = FoundBeside(*confirm(found, runs, values))
    if alone is None:
        return several
    if not several.names_effects:
        leads = leads_in_simulation(found, runs, values, on_round)
        if leads.findings is not None:
            several = FoundBeside(leads.findings, leads.values, is_confirmed=True)
    if one is None or several.leaves_less_than(one):
        return replace(several, findings=_with_runs(several.findings, alone))
    return FoundBeside(one, alone.values, is_confirmed=True)


def _with_runs(found: Findings, alone: ToldByRuns) -> Findings:
    """Findings in which nothing is named, with what the simulation's runs say of effects.

    Leads are taken from there rather than from a stand-in that errs.
    """
    if found.verdict.word != "unknown":
        return found
    problem = found.problem
    of_runs = {ids: where_it_starts(problem, one) for ids, one in alone.fits.items()}
    leads = {
        ids: one
        for ids, one in of_runs.items()
        if belongs_to(problem, one, found.scales)
    }
    fits = {**found.found.fits, **leads}
    return replace(found, found=replace(found.found, fits=fits))


def _leaves_less_than(one: Findings, other: Findings) -> bool:
    """Whether what is chosen leaves less of all recordings than in other findings."""
    return bool(one.verdict.chosen.sse.sum() < other.verdict.chosen.sse.sum())


def _with_nearer_spring(beside: Beside) -> Beside:
    """The stand-in whose curved spring changes as the recordings say; of outputs alone.

    Outputs do not tell whether a parameter that is off belongs to the straight part of a
    spring alone, as beside a hardening one, or to all of it, as the weight of a pendulum.
    """
    standing, runs = beside.standing, beside.runs
    drive = standing.drive
    if runs.simulator.run is not None:
        return beside
    if not isinstance(drive, StandIn) or drive.bends == (0.0, 0.0):
        return beside
    whole = replace(drive, one_curve_N_per_m=drive.stiffness_N_per_m)
    problems = (standing, replace(standing, drive=whole))
    singles = _of_one(beside.options)
    found = [find(one, singles, runs.run_tasks, beside.on_round) for one in problems]
    criteria, base = found[0].criteria, found[0].base

    def worth(row: int) -> tuple[bool, float]:
        # Where one of them lacks nothing, the other one's effects make up for its curve.
        one = found[row]
        fits = (one.base, *one.found.fits.values())
        best = max(criteria.gain(fit, base) for fit in fits)
        return criteria.needs_nothing(one.base), best

    nearer = problems[max(range(len(problems)), key=worth)]
    return replace(beside, standing=nearer)
