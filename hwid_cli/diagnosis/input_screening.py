"""Effects on the input that runs of the simulation itself call likely.

What a stand-in leaves of a simulation that is far from linear says little of a dead zone
or a delay. Each of them is exact in one run with the changed input, and derivatives by the
simulation's own parameters tell what these can take of the rest.
docs/method_diagnosis.md, eq. (D32d).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.candidate import without_base
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.input_effects import run_with_input
from hwid_cli.diagnosis.own_parameters import errors_of, linearised
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import changes_input
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.programs import SimulatorRun

# Training recordings that they are tried on: those that move most.
_MOST_RECORDINGS = 2
# Of what the simulation leaves of these, an effect leaves at most this share, [-].
_CLEARLY_LESS = 0.5
# To double a parameter of the simulation costs this share of what it leaves: so far off,
# derivatives say little, [-].
_HOLD = 0.03


def likely_on_input(
    findings: Findings, runs: Runs, values: dict[str, float]
) -> list[CandidateFit]:
    """Effects on the input that clearly leave less, the best first, as starts of a fit.

    Parameters
    ----------
    values : dict of str to float
        Parameters of the simulation as they were fitted without an effect.

    References
    ----------
    docs/method_diagnosis.md, eq. (D32d).
    """
    signals = [one for one in findings.problem.signals if not one.is_held_out]
    signals.sort(key=lambda one: -float(np.ptp(one.compared)))
    signals = signals[:_MOST_RECORDINGS]
    gap = linearised(runs.tried, signals, runs.simulator.free, values)
    if gap is None:
        return []
    left = _Left(signals, *gap)
    best: dict[str, tuple[float, CandidateFit]] = {}
    for one in _starts(findings):
        share = left.of(run_with_input(findings, one, runs, signals, values))
        (effect,) = one.effects
        if share < best.get(effect, (_CLEARLY_LESS, one))[0]:
            best[effect] = share, one
    return [one for _, one in sorted(best.values(), key=lambda pair: pair[0])]


def _starts(findings: Findings) -> list[CandidateFit]:
    """Every effect on the input that was looked for, with each of its sizes."""
    base = without_base(findings.base)
    looked_for = [one for (one,) in findings.found.shares if changes_input((one,))]
    return [
        replace(
            base,
            effects=(effect,),
            names=(*base.names, *(ParameterRef(effect, name) for name in start)),
            values=np.r_[base.values, list(start.values())],
            valleys=np.zeros((0, 0)),
        )
        for effect in looked_for
        if not CATALOGUE[effect].contains
        for start in CATALOGUE[effect].starts(findings.scales)
    ]


class _Left:
    """What runs leave of recordings once the simulation's parameters have followed.

    Parameters
    ----------
    errors : ndarray, shape (n_evaluated,), [output unit]
        Of all recordings in a row, with the parameters as they are.
    slopes : ndarray, shape (n_evaluated, n_free), [output unit]
        Derivatives of the errors by each parameter over its size.
    """

    def __init__(
        self, signals: Sequence[Signals], errors: np.ndarray, slopes: np.ndarray
    ) -> None:
        self._signals = signals
        hold = _HOLD * float(np.linalg.norm(errors)) * np.eye(slopes.shape[1])
        self._slopes = np.vstack([slopes, hold])
        self._whole = self._unexplained(errors)

    def of(self, found: Sequence[SimulatorRun] | None) -> float:
        """Share of squares that runs leave; infinite where there are none."""
        if found is None:
            return float("inf")
        return self._unexplained(errors_of(self._signals, found)) / self._whole

    def _unexplained(self, errors: np.ndarray) -> float:
        target = np.r_[errors, np.zeros(self._slopes.shape[1])]
        change = np.linalg.lstsq(self._slopes, target, rcond=None)[0]
        rest = target - self._slopes @ change
        return float(rest @ rest)
