"""Effects at the ports of a simulation that its own runs call likely.

What a stand-in leaves of a simulation that is far from linear says little of a dead zone,
a delay or play before the sensor. Each of them is exact in one run, and derivatives by the
simulation's own parameters tell what these can take of the rest.
docs/method_diagnosis.md, eq. (D32d).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hwid_cli.diagnosis.candidate import with_values
from hwid_cli.diagnosis.effect_sets import is_nested
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.own_parameters import HOLD, cost_of, errors_of, linearised
from hwid_cli.diagnosis.port_effects import PortSearch, moving_most, port_effects
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import acts_at_port
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.programs import SimulatorRun

# Of what the simulation leaves of these, a likely effect leaves at most this share, [-].
_CLEARLY_LESS = 0.7
# Of so many that leave less than this share, sizes between the start values are tried, which
# are about a factor of three apart.
_MOST_REFINED, _LESS, _BETWEEN = 3, 0.95, (1.73, 1.32)
# What leaves so many times as much as another one is none beside it that leaves nothing.
_FAR_BEHIND = 4.0


@dataclass(frozen=True, eq=False)
class LikelyAtPort:
    """An effect at a port that runs call likely.

    Parameters
    ----------
    share : float, [-]
        Squares that it leaves, over those without it.
    fit : CandidateFit
        With the size that leaves least, and effects that were known before.
    values : dict of str to float
        Parameters of the simulation, and of effects known before, that have followed.
    """

    share: float
    fit: CandidateFit
    values: dict[str, float]


@dataclass(frozen=True, eq=False)
class AtPorts:
    """What runs say of effects at the ports before any of them is fitted.

    Parameters
    ----------
    shares : mapping of str to float, [-]
        Squares that each effect leaves at its best start value, over those without it.
    likely : tuple of LikelyAtPort
        Those that clearly leave less, the best first, as starts of a fit.
    """

    shares: Mapping[str, float] = field(default_factory=dict)
    likely: tuple[LikelyAtPort, ...] = ()

    def is_behind(self, effect: str, other: str) -> bool:
        """Whether an effect leaves far more than another one."""
        shares = self.shares
        return effect in shares and shares[effect] > _FAR_BEHIND * shares.get(
            other, 1.0
        )


def screened_at_ports(
    findings: Findings,
    runs: Runs,
    values: dict[str, float],
    known: Mapping[str, Mapping[str, float]] | None = None,
) -> AtPorts:
    """Try effects at the ports in a few sizes, by one run of each.

    Parameters
    ----------
    values : dict of str to float
        Parameters of the simulation as they were fitted without an effect, or with those
        that are known.
    known : mapping of str to mapping of str to float, or None
        Parameters of effects at the ports that are there already, which move as well.

    References
    ----------
    docs/method_diagnosis.md, eq. (D32d).
    """
    known = known or {}
    screening = _Screening.of(findings, runs, values, known)
    if screening is None:
        return AtPorts()
    best: dict[str, LikelyAtPort] = {}
    for effect, start in _starts(findings, known):
        one = screening.of_start({**known, effect: start})
        if effect not in best or one.share < best[effect].share:
            best[effect] = one
    first = sorted(best, key=lambda effect: best[effect].share)[:_MOST_REFINED]
    for effect in first:
        if best[effect].share < _LESS:
            best[effect] = screening.followed(_refined(best[effect], effect, screening))
    clear = [one for one in best.values() if one.share <= _CLEARLY_LESS]
    return AtPorts(
        {effect: one.share for effect, one in best.items()},
        tuple(sorted(clear, key=_share)),
    )


def _share(found: LikelyAtPort) -> float:
    return found.share


def _refined(found: LikelyAtPort, effect: str, screening: "_Screening") -> LikelyAtPort:
    """The same effect in sizes between the start values, and what it leaves there."""
    strongest = ParameterRef(effect, CATALOGUE[effect].strongest.name)
    bounds = CATALOGUE[effect].strongest.bounds(screening.scales)
    for factor in _BETWEEN:
        one = found.fit
        size = float(one.values[one.names.index(strongest)])
        sizes = np.clip([size / factor, size * factor], *bounds).tolist()
        near = [with_values(one, {strongest: another}) for another in sizes]
        found = min([found, *map(screening.of_fit, near)], key=_share)
    return found


def _starts(
    findings: Findings, known: Mapping[str, Mapping[str, float]]
) -> list[tuple[str, Mapping[str, float]]]:
    """Every effect at a port that was looked for, with each of its sizes."""
    looked_for = [one for (one,) in findings.found.shares if acts_at_port((one,))]
    return [
        (effect, start)
        for effect in looked_for
        if public_id(effect) == effect and not is_nested(effect, tuple(known))
        for start in CATALOGUE[effect].starts(findings.scales)
    ]


class _Screening:
    """What runs leave of a few recordings once the simulation's parameters have followed.

    Parameters
    ----------
    signals : sequence of Signals
        Of these recordings.
    search : PortSearch
        Of the effects that are known, beside which another one is tried.
    values : mapping of str to float
        Of its free parameters, as they are.
    gap : tuple of ndarray, shapes (n_evaluated,) and (n_evaluated, n_free), [output unit]
        Errors of all recordings in a row, and their derivatives by each parameter over
        its size.
    plain : sequence of SimulatorRun
        Runs without another effect, before their reading.
    """

    def __init__(
        self,
        signals: Sequence[Signals],
        search: PortSearch,
        values: dict[str, float],
        gap: tuple[np.ndarray, np.ndarray],
        plain: Sequence[SimulatorRun],
    ) -> None:
        self._signals, self._search, self._values = signals, search, values
        errors, slopes = gap
        hold = HOLD * float(np.linalg.norm(errors)) * np.eye(slopes.shape[1])
        self._slopes, self._plain = np.vstack([slopes, hold]), plain
        self._whole = self._unexplained(errors)[0]

    @classmethod
    def of(
        cls,
        findings: Findings,
        runs: Runs,
        values: dict[str, float],
        known: Mapping[str, Mapping[str, float]],
    ) -> "_Screening | None":
        """Beside effects that are known; None where no run is possible."""
        signals = moving_most(findings.problem.signals)
        search = PortSearch(findings, port_effects(findings, known), runs)
        values = {**search.of_effects, **values}
        plain = search.run(signals, values)
        gap = linearised(search.ask, signals, search.free, values)
        if plain is None or gap is None:
            return None
        return cls(signals, search, values, gap, plain)

    @property
    def scales(self) -> Scales:
        """Of the recordings, which bounds go with."""
        return self._search.findings.scales

    def of_start(self, values: Mapping[str, Mapping[str, float]]) -> LikelyAtPort:
        """What effects with these values leave."""
        return self.of_fit(port_effects(self._search.findings, values))

    def of_fit(self, fit: CandidateFit) -> LikelyAtPort:
        """What effects leave, of which one is not known yet."""
        search = self._search.of(fit)
        found = self._run(search, {**search.of_effects, **self._values})
        share = float("inf")
        if found is not None:
            errors = errors_of(self._signals, found)
            share = self._unexplained(errors)[0] / self._whole
        return LikelyAtPort(share, fit, self._values)

    def followed(self, likely: LikelyAtPort) -> LikelyAtPort:
        """The same where derivatives say that its parameters follow to, if it leaves less."""
        search = self._search.of(likely.fit)
        found = self._run(search, {**search.of_effects, **self._values})
        if found is None:
            return likely
        change = self._unexplained(errors_of(self._signals, found))[1]
        values = dict(self._values)
        for (name, one), by in zip(self._search.free.items(), change, strict=True):
            size = abs(one.value) or 1.0
            values[name] = float(np.clip(values[name] - size * by, *one.limits))
        left = cost_of(search.ask, self._signals, {**search.of_effects, **values})
        share = left / self._whole
        return (
            LikelyAtPort(share, likely.fit, values) if share < likely.share else likely
        )

    def _run(
        self, search: PortSearch, values: Mapping[str, float]
    ) -> list[SimulatorRun] | None:
        """Runs with a further effect; one that changes only the reading needs none."""
        if search.changes_input_as(self._search):
            return search.read(self._signals, self._plain, values)
        return search.ask(self._signals, values)

    def _unexplained(self, errors: np.ndarray) -> tuple[float, np.ndarray]:
        """Squares left of errors, and by what the parameters follow over their sizes."""
        target = np.r_[errors, np.zeros(self._slopes.shape[1])]
        change = np.linalg.lstsq(self._slopes, target, rcond=None)[0]
        rest = target - self._slopes @ change
        return float(rest @ rest), change
