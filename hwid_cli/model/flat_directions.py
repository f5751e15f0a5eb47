"""Directions that the data do not tell, or hardly, in words and with the reason.

A flat direction changes nothing that was measured. A weak one is known, but with a
standard error of at least half of the size of what moves (of B, of F, of a map's range):
then its 95 % interval is as wide as the thing itself.

References
----------
docs/method.md, eq. (28).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model import sensitivities
from hwid_cli.model.candidates import Candidate, FitData, JacobianColumns
from hwid_cli.model.identifiability import Directions, listed, parameter_names
from hwid_cli.model.normalise import integrates
from hwid_cli.model.static_map import RULES
from hwid_cli.records.model import HammersteinWiener, StaticMap

# Standard error along a direction, as a share of the size of what moves.
_WEAK = 0.5
# Parameters with less than this share of a direction's largest part are not named.
_NAMED_PART = 0.2
_MOST_NAMES, _MOST_SENTENCES = 4, 3
# Distance of a pole and a zero that counts as a cancellation.
_CANCELS = 0.05
# Levels of a signal nearer than this share of its range are one.
_SAME_LEVEL = 1e-9
_NO_MAP = StaticMap("none", np.zeros(0))
_SAME_OUTPUT = "that hardly changes the simulated output"
_DRIFTS = (
    "the block integrates: where it starts and how it drifts looks like a constant of the "
    "maps"
)


def flat_sentences(
    candidate: Candidate,
    experiments: Sequence[FitData],
    found: Directions,
    variance: float,
) -> tuple[str, ...]:
    """Name the directions that the data do not tell, or hardly.

    Parameters
    ----------
    variance : float, [output unit squared]
        Of the residuals.

    Returns
    -------
    tuple of str
        Flat ones first; the least firm of the others follow. Three at most.
    """
    names = parameter_names(candidate, found.place)
    told = [(parts, "") for parts in found.flat_parts.T]
    # Those that move nothing but initial states matter least.
    told.sort(key=lambda one: not _moves_listed(one[0], found.place))
    told += [
        (parts, f"{100 * spread:.0f} %")
        for parts, spread in _weak_parts(found, variance)
    ]
    if not told:
        return ()
    signals = _map_arguments(candidate, experiments)
    return tuple(
        _sentence(parts, spread, names, _why(parts, candidate, found.place, signals))
        for parts, spread in told[:_MOST_SENTENCES]
    )


def _moves_listed(parts: np.ndarray, place: JacobianColumns) -> bool:
    """Whether a direction moves more than initial states."""
    return bool(np.abs(parts[listed(place)]).max() >= _NAMED_PART * np.abs(parts).max())


def _weak_parts(found: Directions, variance: float) -> list[tuple[np.ndarray, float]]:
    """Weak directions, the weakest first, and their standard errors as shares."""
    place = found.place
    chosen = listed(place)
    if chosen.size == 0 or variance == 0.0:
        return []
    covariance = found.covariance(variance)[np.ix_(chosen, chosen)]
    covariance = covariance / found.size[chosen] / found.size[chosen][:, None]
    if not np.isfinite(covariance).all():
        return []
    # No direction spreads wider than all parameters together.
    if np.trace(covariance) <= _WEAK**2:
        return []
    spread, parts = np.linalg.eigh(covariance)
    weak = []
    for number in np.flatnonzero(spread > _WEAK**2)[::-1]:
        every = np.zeros(place.total)
        every[chosen] = parts[:, number]
        weak.append((every, float(np.sqrt(spread[number]))))
    return weak


def _map_arguments(
    candidate: Candidate, experiments: Sequence[FitData]
) -> dict[str, np.ndarray]:
    """What goes into the two maps, all experiments together."""
    before = replace(candidate, model=replace(candidate.model, output_map=_NO_MAP))
    return {
        "input_map": np.concatenate([one.input for one in experiments]),
        "output_map": np.concatenate(
            sensitivities.simulated_outputs(before, experiments)
        ),
    }


def _sentence(parts: np.ndarray, spread: str, names: Sequence[str], why: str) -> str:
    order = np.argsort(-np.abs(parts), kind="stable")
    shown = order[np.abs(parts[order]) >= _NAMED_PART * np.abs(parts[order[0]])]
    who = [names[place] for place in shown[:_MOST_NAMES]]
    more = f" and {shown.size - len(who)} more" if shown.size > len(who) else ""
    what = ", ".join(who) + more
    if shown.size > 1:
        what += " can move together"
    start = "not identifiable"
    if spread:
        start = f"hardly identifiable (standard error {spread} of the size)"
    return f"{start}: {what}, because {why}"


def _why(
    parts: np.ndarray,
    candidate: Candidate,
    place: JacobianColumns,
    signals: dict[str, np.ndarray],
) -> str:
    """Say why a direction is flat, where the reason can be told."""
    model = candidate.model
    largest = _NAMED_PART * np.abs(parts).max()
    for label, part, what in (
        ("input_map", place.input_map, "the input"),
        ("output_map", place.output_map, "the signal before the output map"),
    ):
        moved = np.flatnonzero(np.abs(parts[part]) >= largest)
        if moved.size:
            reason = _why_of_map(getattr(model, label), moved, signals[label], part)
            if reason:
                return reason.format(what=what)
    starts_anywhere = model.initial_state == "estimated" and integrates(model)
    with_start = np.abs(np.r_[parts[place.free_responses], parts[place.output_map]])
    if starts_anywhere and with_start.max(initial=0.0) >= largest:
        return _DRIFTS
    if not _moves_listed(parts, place):
        return _SAME_OUTPUT
    in_block = [
        np.abs(parts[part]).max(initial=0.0) >= largest
        for part in (place.numerator, place.denominator)
    ]
    if any(in_block):
        at = _cancellation(model)
        if at:
            return f"a pole and a zero nearly cancel at {at}"
    if all(in_block):
        return f"{_SAME_OUTPUT}: orders may be too high, or the input too simple"
    return _SAME_OUTPUT


def _why_of_map(
    one: StaticMap, moved: np.ndarray, signal: np.ndarray, part: slice
) -> str:
    """Reason that lies in what a map gets to see; ``{what}`` stands for its name."""
    n_levels = _count_levels(signal)
    rule = RULES[one.kind]
    count = one.parameters.size - rule.n_positions(one)
    if n_levels < max(count, 2):
        return f"{{what}} visits only {n_levels} level{'s' * (n_levels > 1)}"
    first = one.parameters.size - (part.stop - part.start)
    return rule.why_flat(one, moved + first, signal)


def _count_levels(signal: np.ndarray) -> int:
    """Distinct values of a signal."""
    gaps = np.diff(np.sort(signal))
    return 1 + int(np.sum(gaps > _SAME_LEVEL * max(np.ptp(signal), 1e-300)))


def _cancellation(model: HammersteinWiener) -> str:
    """Where the nearest pole and zero cancel; empty where none do."""
    poles, zeros = np.roots(model.denominator), np.roots(model.numerator)
    if poles.size == 0 or zeros.size == 0:
        return ""
    distance = np.abs(poles[:, None] - zeros)
    if distance.min() > _CANCELS:
        return ""
    pole = poles[np.unravel_index(distance.argmin(), distance.shape)[0]]
    if abs(pole.imag) < 1e-9:
        return f"{pole.real:.3g}"
    return f"{pole.real:.3g} {'+' if pole.imag > 0 else '-'} {abs(pole.imag):.3g}i"
