"""Effects that recordings cannot show, because each recording's own zero takes them up.

A zero that is free takes up what a constant force does: friction of two sizes, one for
each direction of motion, is friction of their mean beside a constant force. What an effect
changes beside the fit, linearised, is compared with the span of the derivatives by the
fit's own parameters, zeros and starts. docs/method_diagnosis.md, eq. (D26c).
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from hwid_cli.diagnosis.candidate import fitted_values, rebuilt
from hwid_cli.diagnosis.effect_sets import is_nested
from hwid_cli.diagnosis.parameters import (
    ParameterLayout,
    ParameterPoint,
    parameter_layout,
    residuals_at,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.search import derivatives
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.effect import Effect, Scales, Values
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit

# Multiple of an effect's size that is simulated: small, so that changes add up.
_SMALL = 1e-2
# Share of an effect's change that may be left where it counts as taken up.
_LEFT = 0.02


def absorbed_effects(
    problem: DiagnosisProblem, chosen: CandidateFit, scales: Scales, noise_rms: float
) -> tuple[str, ...]:
    """Public ids of effects whose change the zeros of the recordings take up.

    Tried are effects of one parameter, and those that split the size of a named one in
    parts; an effect with a shape has marks of its own.

    Parameters
    ----------
    chosen : CandidateFit
        That the verdict rests on.
    noise_rms : float, [output unit]
        An effect that changes less would not show anyhow.
    """
    has_offsets = any(one.offset is not None for one in problem.signals)
    is_free = problem.start == "held" or has_offsets
    if not (is_free and chosen.is_usable) or problem.compares_command:
        return ()
    fit_layout, point = rebuilt(problem, chosen, scales)
    values = fitted_values(chosen, drive_effects(problem.drive))
    parts = residuals_at(problem, fit_layout, point)
    jacobians = derivatives(problem, fit_layout, point, parts)
    if has_offsets:
        jacobians = [np.column_stack([one, np.ones(len(one))]) for one in jacobians]
    n_shared = len(fit_layout.shared)
    found = []
    for effect, trial in _trials(values, scales, problem):
        with_effect = _residuals_with(
            problem, scales, (fit_layout, point), values, (effect.id, trial)
        )
        changed = [one - two for one, two in zip(parts, with_effect, strict=True)]
        size = _rms(changed)
        if not size > _SMALL * noise_rms:
            continue
        without_own = [one[:, :n_shared] for one in jacobians]
        by_shared = _rms(_unabsorbed(changed, without_own, n_shared))
        if by_shared > _LEFT * size >= _rms(_unabsorbed(changed, jacobians, n_shared)):
            found.append(public_id(effect.id))
    return tuple(dict.fromkeys(found))


def _trials(
    values: Mapping[str, Values], scales: Scales, problem: DiagnosisProblem
) -> Iterator[tuple[Effect, dict[str, float]]]:
    """Effects that may stand beside those of a fit, with a small size each."""
    has_spring = problem.drive.stiffness_N_per_m > 0
    for effect in CATALOGUE.values():
        if effect.id in values or effect.needs_circuit or effect.beside:
            continue
        if effect.needs_spring and not has_spring:
            continue
        parts = [(one, of) for of in effect.contains if of in values
                 for one in effect.parameters
                 if set(one.places) < set(CATALOGUE[of].strongest.places)]  # fmt: skip
        if len(parts) == len(effect.parameters):
            one, of = parts[0]
            nothing = dict.fromkeys((two.name for two in effect.parameters), 0.0)
            size = values[of][CATALOGUE[of].strongest.name]
            yield effect, {**nothing, one.name: _SMALL * size}
        elif len(effect.parameters) == 1 and not is_nested(effect.id, tuple(values)):
            (only,) = effect.parameters
            is_size = only.off == 0.0 and not (only.is_own or only.is_factor)
            if is_size and not effect.moves_at_rest:
                largest = max(only.starts(scales), key=abs) - only.center
                yield effect, {only.name: only.center + _SMALL * largest}


def _residuals_with(
    problem: DiagnosisProblem,
    scales: Scales,
    fit: tuple[ParameterLayout, ParameterPoint],
    values: Mapping[str, Values],
    trial: tuple[str, Mapping[str, float]],
) -> list[np.ndarray]:
    """What the fit leaves with an effect beside its own, all else held."""
    (fit_layout, point), (identifier, given) = fit, trial
    ids = (*fit_layout.effects, identifier)
    wider = parameter_layout(problem, ids, {**values, identifier: given}, scales)
    known = {one.ref: one.value(q)
             for one, q in zip(fit_layout.shared, point.shared, strict=True)}  # fmt: skip
    shared = [
        one.coordinate(known[one.ref] if one.ref in known else given[one.name])
        for one in wider.shared
    ]
    # A lag has a start of its own, where starts are fitted.
    had = {one.ref: point.own[:, column] for column, one in enumerate(fit_layout.own)}
    nothing = np.zeros(len(problem.signals))
    own = [had.get(one.ref, nothing) for one in wider.own]
    stacked = np.column_stack(own) if own else point.own
    return residuals_at(problem, wider, ParameterPoint(np.array(shared), stacked))


def _unabsorbed(
    changed: Sequence[np.ndarray], jacobians: Sequence[np.ndarray], n_shared: int
) -> list[np.ndarray]:
    """Changes without what the derivatives span, each recording's own ones first."""
    rows, targets = [], []
    for one, jacobian in zip(changed, jacobians, strict=True):
        both = np.column_stack([jacobian[:, :n_shared], one])
        own = jacobian[:, n_shared:]
        if own.shape[1]:
            both = both - own @ np.linalg.lstsq(own, both, rcond=None)[0]
        rows.append(both[:, :n_shared])
        targets.append(both[:, n_shared])
    taken = np.linalg.lstsq(np.vstack(rows), np.concatenate(targets), rcond=None)[0]
    return [one - row @ taken for one, row in zip(targets, rows, strict=True)]


def _rms(parts: Sequence[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.square(np.concatenate(parts)))))
