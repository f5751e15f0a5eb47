"""What runs of the simulation with effects in it leave, and the verdict of these.

docs/method_diagnosis.md, eq. (D33).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hwid_cli.diagnosis.choice import select_best
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.intervals import unclear_effects
from hwid_cli.diagnosis.own_base import is_beyond_factors, judged_by_own_base
from hwid_cli.diagnosis.port_effects import PortStart, moving_most
from hwid_cli.diagnosis.port_screening import AtPorts, LikelyAtPort
from hwid_cli.diagnosis.stand_in import acts_at_port
from hwid_cli.diagnosis.turns import Turn, fit_of_run
from hwid_cli.diagnosis.verdict import decide
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import STILL_LARGE

# Squares over those that another effect's run leaves of the same recordings, from which on an
# effect at a port is not fitted to the others.
_FAR_BEHIND = 4.0


@dataclass(frozen=True, eq=False)
class ToldByRuns:
    """What runs of the simulation with effects in it tell.

    Parameters
    ----------
    findings : Findings or None
        Of the run that decides; None where none may be named.
    values : dict of str to float
        Parameters of the simulation at that run; without one, at the best run of an effect
        that explains most, which the parameters may have imitated.
    is_all : bool
        Whether that run leaves so little that a further effect could not be named.
    fits : mapping of tuple of str to CandidateFit
        What runs with single effects left.
    tried : TriedEffects or None
        These runs; None where none was made.
    """

    findings: Findings | None
    values: dict[str, float]
    is_all: bool
    fits: Mapping[tuple[str, ...], CandidateFit] = field(default_factory=dict)
    tried: "TriedEffects | None" = None


class TriedEffects:
    """Best runs of the simulation with each effect, and what they left."""

    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        self.turns: dict[tuple[str, ...], Turn] = {}
        self.fits: dict[tuple[str, ...], CandidateFit] = {}
        # Effects at the ports that were fitted through runs, those begun that are hopeless,
        # what was asked before, and which of them wait, begun or not.
        self.through_runs: set[tuple[str, ...]] = set()
        self.given_up: set[tuple[str, ...]] = set()
        self.at_ports = AtPorts()
        self.later: list[PortStart] = []
        self.unbegun: list[LikelyAtPort] = []
        # Mean square over the noise's that the best of those begun leaves.
        self.least_begun = np.inf
        # Whose runs were followed to their end.
        self.followed: set[tuple[str, ...]] = set()

    @property
    def ports_are_exact(self) -> bool:
        """Whether a run shows an effect at a port as it is.

        The forces of an effect that is there already would have to go with its motion.
        """
        present = drive_effects(self.findings.problem.drive)
        return not present or acts_at_port(tuple(present))

    def is_known(self, one: CandidateFit) -> bool:
        """Whether runs have said what an effect leaves, whatever a stand-in says.

        It was fitted through runs or given up; or they leave nothing with another effect at
        a port, and much with this one.
        """
        is_exact = one.effects in self.through_runs and one.effects in self.fits
        if is_exact or one.effects in self.given_up:
            return True
        criteria, (effect,) = self.findings.criteria, one.effects
        return any(
            criteria.is_complete(fit) and self.at_ports.is_behind(effect, *fit.effects)
            for fit in self.fits.values()
            if len(fit.effects) == 1
        )

    def are_nearly_all(self, turns: Sequence[Turn] | None = None) -> bool:
        """Whether one of some runs, or of all, leaves nothing that could be named."""
        criteria, base = self.findings.criteria, self.findings.base
        fits = list(self.fits.values())
        if turns is not None:
            fits = [fit_of_run(self.findings, turn) for turn in turns]
        return any(criteria.is_nearly_all(fit, base) for fit in fits)

    def is_hopeless(self, start: PortStart) -> bool:
        """Whether a start leaves much, and another effect nothing or far less."""
        if start.left <= STILL_LARGE**2:
            return False
        if self.are_nearly_all():
            return True
        of_runs = map(self.left_of_few, self.fits.values())
        return start.left > _FAR_BEHIND * min([self.least_begun, *of_runs])

    def left_of_few(self, fit: CandidateFit) -> float:
        """Mean square over the noise's of the recordings that starts are fitted to."""
        problem, floors = self.findings.problem, self.findings.criteria.floors
        few = {one.name for one in moving_most(problem.signals)}
        rows = [n for n, one in enumerate(problem.signals) if one.name in few]
        floor = float(floors[rows].sum())
        return float(fit.sse[rows].sum()) / floor if floor > 0 else np.inf

    def keep(self, turns: Sequence[Turn]) -> None:
        """Keep runs that leave less than those before with the same effect."""
        for turn in turns:
            fit = fit_of_run(self.findings, turn)
            before = self.fits.get(fit.effects)
            if before is None or fit.sse.sum() < before.sse.sum():
                self.turns[fit.effects], self.fits[fit.effects] = turn, fit


def decided_by_runs(
    findings: Findings,
    tried: Mapping[tuple[str, ...], Turn],
    fits: Mapping[tuple[str, ...], CandidateFit],
) -> tuple[Findings, dict[str, float]] | None:
    """The verdict by runs of the simulation, if effects of one of them may be named.

    Parameters
    ----------
    tried : mapping of tuple of str to Turn
        Best run with each effect, or set of effects.
    fits : mapping of tuple of str to CandidateFit
        What these runs left, and what the stand-in leaves with parts of the sets.

    Returns
    -------
    Findings
        With that verdict.
    dict of str to float
        Parameters of the simulation at that run.
    """
    criteria, rival = findings.criteria, findings
    findings = judged_by_own_base(findings)
    base, best = findings.base, list[CandidateFit]()
    for size in sorted({len(one) for one in tried}):
        same = [fits[one] for one in tried if len(one) == size]
        one = select_best(criteria, same, base)
        best += [] if one is None else [one]
    if not best:
        return None

    def unclear(one: CandidateFit) -> tuple[str, ...]:
        # What the stand-in alone has fitted was not run.
        turn = tried.get(one.effects)
        problem = findings.problem if turn is None else turn.problem
        return unclear_effects(replace(problem, known={}), one, findings.scales)

    verdict = decide(criteria, findings.given_sse, base, fits, best, unclear)
    chosen = verdict.chosen
    if chosen.effects not in tried or not is_beyond_factors(rival, chosen):
        return None
    turn = tried[verdict.chosen.effects]
    found = replace(findings.found, fits={**findings.found.fits, **fits})
    problem = replace(turn.problem, known={})
    told = replace(findings, problem=problem, verdict=verdict, found=found)
    return told, turn.values_of_run
