"""How far a simulation may be trusted on other inputs, with the effects that it got.

The same band as that of a fitted model (`trust.band`): the covariance of the parameters
of base and effects, what is left of the training recordings, and what held-out ones show
beyond that. A held-out recording is simulated as another input would be: where it starts
is known, its own phase or factor is not.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.candidate import rebuilt
from hwid_cli.diagnosis.intervals import shared_covariance
from hwid_cli.diagnosis.parameters import (
    START,
    ParameterLayout,
    ParameterPoint,
    Unknown,
    compare_at,
    is_factor,
)
from hwid_cli.diagnosis.problem import Compared, DiagnosisProblem
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import STILL_LARGE
from hwid_cli.records.trust import Band, Inside, ModelTrust, ShownBand, TrustOnTests
from hwid_cli.trust.band import ErrorTerms
from hwid_cli.trust.judged import Judgement, calibrated, left_out_bands, trust_row
from hwid_cli.trust.visited import inside, visited_by

NAME = "simulation"
# Longest step of a coordinate, as of a model's parameters: half the size of the value.
_LONGEST = 0.5
# Share of the largest output below which an error is none: that of a noise-free fit.
_ROUNDING = 1e-12
# Share of the best determined direction below which a direction is none.
_DIRECTION = 1e-14


def simulation_trust(
    problem: DiagnosisProblem,
    found: CandidateFit,
    scales: Scales,
    noise_rms: float,
) -> tuple[ModelTrust | None, TrustOnTests]:
    """What is known of a simulation's errors, and its bands on held-out recordings.

    Parameters
    ----------
    problem : DiagnosisProblem
        Training and held-out recordings.
    found : CandidateFit
        On all of them.
    noise_rms : float, [output unit]
        Of the recordings.

    Returns
    -------
    ModelTrust or None
        None where a recording cannot be simulated.
    TrustOnTests
        A row for each held-out recording; its band is told by the other ones.
    """
    if not found.is_usable:
        return None, TrustOnTests()
    fit_layout, point = rebuilt(problem, found, scales)
    steps = _steps(*shared_covariance(problem, found, fit_layout, point))
    point = _as_unseen(problem, fit_layout, point)
    compared = compare_at(problem, fit_layout, point)
    train = [one for one in compared if not one.signals.is_held_out]
    trust = ModelTrust(
        visited_by(
            [one.signals.driven_by for one in train], [one.position for one in train]
        ),
        _in_values(fit_layout.shared, point.shared, steps),
        _rms_of(train),
        1.0,
        (),
        parameters=tuple(f"{one.owner}.{one.name}" for one in fit_layout.shared),
    )
    rows = [row for row, one in enumerate(compared) if one.signals.is_held_out]
    held = replace(problem, signals=tuple(problem.signals[row] for row in rows))
    at = ParameterPoint(point.shared, point.own[rows])
    variances = _variances(held, fit_layout, at, [compared[row] for row in rows], steps)
    judged = [
        _judgement(compared[row], trust, variance)
        for row, variance in zip(rows, variances, strict=True)
    ]
    is_off = _is_far_off(judged, noise_rms)
    bands = left_out_bands(trust, judged, is_off=is_off)
    return calibrated(trust, judged, is_off=is_off), _on_held_out(problem, bands)


def _is_far_off(judged: Sequence[Judgement], noise_rms: float) -> bool:
    """Whether held-out recordings show far more than noise."""
    if not judged:
        return False
    errors = np.concatenate([one.errors for one in judged])
    return float(np.sqrt(np.mean(errors**2))) > STILL_LARGE * noise_rms


def _rms_of(train: Sequence[Compared]) -> float:
    left = np.concatenate([one.residual for one in train])
    largest = max(float(np.abs(one.signals.compared).max()) for one in train)
    rms = float(np.sqrt(np.mean(left**2)))
    return max(rms, _ROUNDING * largest, _ROUNDING)


def _as_unseen(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> ParameterPoint:
    """The same with own values of held-out recordings that nobody can know: usual ones.

    A place at rest is read at the start: fitted, it would take a part of what comes later
    off, the drift of an axis.
    """
    is_held = np.array([one.is_held_out for one in problem.signals])
    own = point.own.copy()
    for column, one in enumerate(fit_layout.own):
        if one.owner == START and one.name == "position" and problem.start == "rest":
            rests = [one.coordinate(each.rest_position_m) for each in problem.signals]
            own[is_held, column] = np.array(rests)[is_held]
        if one.owner == START or not is_held.any():
            continue
        # An exported simulation has the mean of the factors, and no phase.
        usual = (
            own[~is_held, column].mean() if is_factor(one.ref) else one.coordinate(0.0)
        )
        own[is_held, column] = usual
    return ParameterPoint(point.shared, own)


def _steps(covariance: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Steps of one standard deviation in coordinates, shape (n_steps, n_shared)."""
    sizes, turned = np.linalg.eigh(covariance)
    kept = sizes > _DIRECTION * max(float(sizes.max(initial=0.0)), 0.0)
    steps = (turned[:, kept] * np.sqrt(sizes[kept])).T / scale
    longest = np.abs(steps).max(axis=1, initial=0.0)
    return steps * np.minimum(1.0, _LONGEST / np.maximum(longest, 1e-300))[:, None]


def _in_values(
    unknowns: Sequence[Unknown], shared: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Steps of coordinates as changes of the parameters' values, within their bounds."""
    return np.array(
        [
            [
                min(max(one.value(q + by), one.low), one.high) - one.value(q)
                for one, q, by in zip(unknowns, shared, step, strict=True)
            ]
            for step in steps
        ]
    ).reshape(len(steps), len(unknowns))


def _variances(
    held: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    compared: Sequence[Compared],
    steps: np.ndarray,
) -> list[np.ndarray]:
    """What the covariance of the parameters makes of each held-out output."""
    variances = [np.zeros(one.simulated.size) for one in compared]
    for step in steps:
        moved = [
            one.coordinate(one.value(q + by))
            for one, q, by in zip(fit_layout.shared, point.shared, step, strict=True)
        ]
        others = compare_at(
            held, fit_layout, ParameterPoint(np.array(moved), point.own)
        )
        for variance, one, other in zip(variances, compared, others, strict=True):
            # A step to what cannot be simulated says nothing.
            variance += np.nan_to_num(other.simulated - one.simulated) ** 2
    return variances


def _judgement(one: Compared, trust: ModelTrust, variance: np.ndarray) -> Judgement:
    """What a held-out recording tells, where it is evaluated."""
    at, signals = one.signals.evaluated, one.signals
    where = inside(trust.visited, signals.driven_by, one.position)
    terms = ErrorTerms(
        one.simulated[at], one.position[at], variance[at], np.zeros(variance[at].size)
    )
    part = Inside(where.amplitude[at], where.rate[at], where.frequency[at])
    return Judgement(signals.name, one.residual, terms, part, trust.noise_rms)


def _on_held_out(
    problem: DiagnosisProblem, bands: Sequence[tuple[Judgement, Band]]
) -> TrustOnTests:
    found = [
        (trust_row((NAME, one.name, problem.unit), one.measured, band), one, band)
        for one, band in bands
    ]
    if not found:
        return TrustOnTests()
    row, worst, band = min(found, key=lambda item: item[0].coverage)
    signals = next(one for one in problem.signals if one.name == row.recording)
    time_s = signals.sample_time_s * np.arange(signals.compared.size)
    shown = ShownBand(
        NAME,
        row.recording,
        time_s[signals.evaluated],
        worst.measured,
        band.output,
        band.lower,
        band.upper,
        band.inside.all,
        problem.unit,
    )
    return TrustOnTests(tuple(one for one, *_ in found), shown)
