"""Effects at the ports of a simulation that its own runs call likely.

What a stand-in leaves of a simulation that is far from linear says little of a dead zone,
a delay or play before the sensor. Each of them is exact in one run, and derivatives by the
simulation's own parameters tell what these can take of the rest.
docs/method_diagnosis.md, eq. (D32d).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hwid_cli.diagnosis.candidate import with_values
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.own_parameters import errors_of, linearised
from hwid_cli.diagnosis.port_effects import (
    moving_most,
    port_effect,
    run_with_port_effect,
)
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import acts_at_port
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.programs import SimulatorRun

# Of what the simulation leaves of these, a likely effect leaves at most this share, [-].
_CLEARLY_LESS = 0.35
# Of so many that leave less than this share, sizes between the start values are tried, which
# are about a factor of three apart.
_MOST_REFINED, _LESS, _BETWEEN = 3, 0.95, (1.73, 1.32)
# What leaves so many times as much as another one is none beside it that leaves nothing.
_FAR_BEHIND = 4.0
# To double a parameter of the simulation costs this share of what it leaves: so far off,
# derivatives say little, [-].
_HOLD = 0.03


@dataclass(frozen=True, eq=False)
class AtPorts:
    """What runs say of effects at the ports before any of them is fitted.

    Parameters
    ----------
    shares : mapping of str to float, [-]
        Squares that each effect leaves at its best start value, over those without it.
    likely : tuple of CandidateFit
        Those that clearly leave less, the best first, as starts of a fit.
    """

    shares: Mapping[str, float] = field(default_factory=dict)
    likely: tuple[CandidateFit, ...] = ()

    def is_behind(self, effect: str, other: str) -> bool:
        """Whether an effect leaves far more than another one."""
        shares = self.shares
        return effect in shares and shares[effect] > _FAR_BEHIND * shares.get(
            other, 1.0
        )


def screened_at_ports(
    findings: Findings, runs: Runs, values: dict[str, float]
) -> AtPorts:
    """Try effects at the ports in a few sizes, by one run of each.

    Parameters
    ----------
    values : dict of str to float
        Parameters of the simulation as they were fitted without an effect.

    References
    ----------
    docs/method_diagnosis.md, eq. (D32d).
    """
    signals = moving_most(findings.problem.signals)
    found = runs.tried(signals, values)
    gap = linearised(runs.tried, signals, runs.simulator.free, values)
    if found is None or gap is None:
        return AtPorts()
    left = _Left(signals, *gap)

    def share_of(one: CandidateFit) -> float:
        plain = signals, found
        return left.of(run_with_port_effect(findings, one, runs, plain, values))

    best: dict[str, tuple[float, CandidateFit]] = {}
    for one in _starts(findings):
        share = share_of(one)
        (effect,) = one.effects
        if share < best.get(effect, (np.inf, one))[0]:
            best[effect] = share, one
    first = sorted(best, key=lambda effect: best[effect][0])[:_MOST_REFINED]
    for effect in first:
        if best[effect][0] < _LESS:
            best[effect] = _refined(best[effect], share_of)
    clear = [one for one in best.values() if one[0] <= _CLEARLY_LESS]
    return AtPorts(
        {effect: share for effect, (share, _) in best.items()},
        tuple(one for _, one in sorted(clear, key=_share)),
    )


def _share(found: tuple[float, CandidateFit]) -> float:
    return found[0]


def _refined(
    found: tuple[float, CandidateFit], share_of: Callable[[CandidateFit], float]
) -> tuple[float, CandidateFit]:
    """The same effect in sizes between the start values, and what it leaves there."""
    (effect,) = found[1].effects
    strongest = ParameterRef(effect, CATALOGUE[effect].strongest.name)
    for factor in _BETWEEN:
        _, one = found
        size = float(one.values[one.names.index(strongest)])
        near = [with_values(one, {strongest: size * f}) for f in (1 / factor, factor)]
        found = min([found, *((share_of(other), other) for other in near)], key=_share)
    return found


def _starts(findings: Findings) -> list[CandidateFit]:
    """Every effect at a port that was looked for, with each of its sizes."""
    looked_for = [one for (one,) in findings.found.shares if acts_at_port((one,))]
    return [
        port_effect(findings, effect, start)
        for effect in looked_for
        if public_id(effect) == effect
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
