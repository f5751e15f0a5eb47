"""Which effects may still hide behind recordings, and which inputs would show them.

A verdict says what the recordings show. An effect that they hardly move may be there all
the same. Each effect that is not in the fit is simulated at the start values of its search,
which are shares of what the recordings and the inputs on offer reach. Regressed on what
the fit leaves, beside what its parameters absorb, that gives the largest multiple of it
that the recordings do not exclude. The same effect in a further recording changes the
output by so much; a smaller one by less, in proportion. It is shown where the change is
enough to be named.
docs/method_diagnosis.md, eq. (D26b).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import fitted_drive, fitted_values, rebuilt
from hwid_cli.diagnosis.effect_sets import is_nested
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.forecast import Linearisation, changed_by, linearise
from hwid_cli.diagnosis.next_experiment import FittedCandidate, played
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.scales import scales_of_recordings
from hwid_cli.diagnosis.selection import LEAST_GAIN
from hwid_cli.diagnosis.tasks import DiagnosisTask, RunTasks
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.simulation import drive_effects

# Normal quantile of the largest multiple that is not excluded: 95 % to one side.
_QUANTILE = 1.645
# Share of the sizes that are not excluded, of all start values alike, that an input must
# show for an effect to hide.
LEAST_SHOWN = 0.1


@dataclass(frozen=True, eq=False)
class HiddenEffect:
    """An effect that may hide, and which inputs would show it.

    Parameters
    ----------
    effect : str
        Public id.
    ratios : ndarray, shape (n_starts, n_inputs), [-]
        What the largest that is not excluded changes in a recording, over the noise, for
        each start value of its search.
    shares : ndarray, shape (n_starts, n_inputs), [-]
        Of the sizes up to that one, that a recording would show.
    """

    effect: str
    ratios: np.ndarray
    shares: np.ndarray

    @property
    def is_told(self) -> bool:
        """Whether an input can show it: not what differs between recordings alone."""
        return bool(self.ratios.any())

    @property
    def may_hide(self) -> bool:
        """Whether an input on offer would show enough of what is not excluded."""
        return self.is_told and bool(self.shares.mean(axis=0).max() >= LEAST_SHOWN)


def hidden_effects(
    findings: Findings,
    allowed: Sequence[str],
    inputs: Sequence[np.ndarray],
    run_tasks: RunTasks,
) -> list[HiddenEffect]:
    """Look for every effect behind recordings, and in further ones.

    Parameters
    ----------
    allowed : sequence of str
        Ids that may be named.
    inputs : sequence of ndarray, shape (n_samples,), [input unit]
        That could be played, at the sample time of the recordings.
    """
    problem, chosen = findings.problem, findings.verdict.chosen
    fitted = FittedCandidate(*rebuilt(problem, chosen, findings.scales))
    further = [played(problem, fitted, one) for one in inputs]
    signals = [one.signals[0] for one, _ in further]
    scales = scales_of_recordings(
        replace(problem, signals=(*problem.signals, *signals)),
        [
            *(one.velocity for one in findings.before),
            *(one.velocity for _, one in further),
        ],
    )
    present = drive_effects(problem.drive)
    values, drive = fitted_values(chosen, present), fitted_drive(problem.drive, chosen)

    def at(one: DiagnosisProblem) -> Linearisation:
        return linearise(one, drive, values, scales)

    known, offered = at(problem), tuple(at(one) for one, _ in further)
    ids = [one for one in allowed if not is_nested(one, chosen.effects, present)]
    noise = findings.criteria.noise.rms
    tasks = [
        DiagnosisTask(
            one, look_for, (one, known, offered, noise), HiddenEffect, {"effect": one}
        )
        for one in ids
    ]
    found: list[HiddenEffect] = run_tasks(tasks, keep=False)
    return [
        HiddenEffect(
            name,
            np.concatenate([one.ratios for one in found if one.effect == name]),
            np.concatenate([one.shares for one in found if one.effect == name]),
        )
        for name in dict.fromkeys(one.effect for one in found)
    ]


def look_for(
    identifier: str,
    known: Linearisation,
    offered: Sequence[Linearisation],
    noise_rms: float,
) -> HiddenEffect:
    """Look for one effect behind the recordings, and in further ones.

    Parameters
    ----------
    identifier : str
        Id in the catalogue.
    known : Linearisation
        The fit on the recordings.
    offered : sequence of Linearisation
        On each further one.
    noise_rms : float, [output unit]
    """
    effect = CATALOGUE[identifier]
    starts = effect.starts(known.scales)
    n_known = known.error.size
    deviation = max(float(np.sqrt(np.mean(known.error**2))), noise_rms)
    deviation = max(deviation, np.finfo(float).tiny)
    ratios = np.zeros((len(starts), len(offered)))
    for row, start in enumerate(starts):
        largest = _not_excluded(known, identifier, start, deviation)
        ratios[row] = [largest * _size_in(one, identifier, start) for one in offered]
    ratios /= deviation
    n = np.array([one.error.size for one in offered])
    penalty = len(effect.parameters) * np.log(n_known + n)
    least = np.sqrt((LEAST_GAIN + penalty) / n)
    shares = np.maximum(0.0, 1.0 - least / np.maximum(ratios, least))
    return HiddenEffect(public_id(identifier), ratios, shares)


def _not_excluded(
    known: Linearisation, identifier: str, start: dict[str, float], deviation: float
) -> float:
    """Largest multiple of an effect, up to 1, that the recordings do not exclude."""
    changed = changed_by(known, identifier, start)
    if changed is None:
        return 0.0
    column = known.unabsorbed(changed)
    square = float(column @ column)
    if square == 0.0:
        return 1.0
    best = float(column @ known.error) / square
    return min(1.0, max(best, 0.0) + _QUANTILE * deviation / np.sqrt(square))


def _size_in(at: Linearisation, identifier: str, start: dict[str, float]) -> float:
    """RMS of what an effect changes; 0 where it runs away, which tells nothing."""
    changed = changed_by(at, identifier, start)
    if changed is None:
        return 0.0
    return float(np.sqrt(np.mean(at.unabsorbed(changed) ** 2)))
