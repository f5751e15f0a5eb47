"""The base, fitted again, with what measuring alone explains.

Wrong parameters are not a missing effect, and neither are noise of the input, a base that
shakes before it is driven, and zeros of a sensor that differ. docs/method_diagnosis.md.
"""

from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import (
    SearchStart,
    base_of,
    base_start,
    compared_with_fit,
    fit_candidate,
    fitted_drive,
    present_start,
    start_from,
    with_input_noise,
)
from hwid_cli.diagnosis.direction import ReversedInputError, find_reversal
from hwid_cli.diagnosis.growing import fit_grown, grown_starts, is_rugged
from hwid_cli.diagnosis.late_input import with_earlier_input
from hwid_cli.diagnosis.noise import noise_floor
from hwid_cli.diagnosis.parameters import compare_at, first_point, parameter_layout
from hwid_cli.diagnosis.problem import Compared, DiagnosisProblem
from hwid_cli.diagnosis.scales import (
    line_frequencies,
    line_share,
    scales_of_fit,
    scales_of_recordings,
)
from hwid_cli.diagnosis.search import fit_own
from hwid_cli.diagnosis.through_pieces import fit_through_pieces
from hwid_cli.diagnosis.zeros import with_zeros
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import LATE_INPUT, CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import StandIn

# A line that takes this share of what the base leaves is no colour of noise.
LINE_SHARE = 0.3
# What a fit leaves is at least this share of the noise: it has few parameters.
_LEAST_OF_NOISE = 0.5


# A base that leaves at most this share of what another one leaves beyond the noise has
# found a better minimum.
_MUCH_LESS = 0.5
# Damping that has vanished in a fit, as a share of the given one, or of what back-EMF makes.
_VANISHED = 0.01
# Parameters of what repeats along the way or in time: each has many minima.
_REPEATS = {"period_m", "per_turn", "frequency_Hz"}


@dataclass(frozen=True, eq=False)
class FittedBase:
    """The re-fitted base, and the causes beside effects that it has led to.

    Parameters
    ----------
    problem : DiagnosisProblem
        With the zeros of its recordings where these differ.
    given : list of Compared
        With the parameters that the configuration gives.
    """

    problem: DiagnosisProblem
    noise: NoiseFloor
    given: list[Compared]
    scales: Scales
    base: CandidateFit


def fitted_base(problem: DiagnosisProblem) -> FittedBase:
    """Fit the base again, with what measuring alone explains.

    Raises
    ------
    ConfigError
        If the output clearly moves against the input.
    """
    noise = noise_floor(problem)
    given = compared_as_given(problem)
    scales = scales_of_recordings(problem, [one.velocity for one in given])
    base = _refit_base(problem, scales, noise)
    problem, base = _with_resistance(problem, base, scales, noise)
    problem, base = _with_mass(problem, base, scales, noise)
    if _is_too_much(base, noise, problem.n_evaluated) or _shakes_at_rest(
        problem, base, scales, noise
    ):
        noise = noise_floor(problem, rests=False)
        base = _refit_base(problem, scales, noise)
    reversal = find_reversal(problem, base, scales, noise)
    if reversal is not None:
        raise ReversedInputError(reversal)
    return _with_causes(FittedBase(problem, noise, given, scales, base))


def _with_causes(fitted: FittedBase) -> FittedBase:
    """What measuring alone explains of what a base leaves."""
    noise, given, scales = fitted.noise, fitted.given, fitted.scales
    problem = fitted.problem
    base = with_input_noise(problem, fitted.base, scales, noise)
    problem, base = with_zeros(problem, base, scales, noise)
    problem, base = with_earlier_input(problem, base, scales, noise)
    if base.cause in ("zeros", *LATE_INPUT):
        given = compared_as_given(problem)
    if base.is_usable:
        scales = scales_of_fit(problem, base, scales, noise)
    return FittedBase(problem, noise, given, scales, base)


def fitted_from(fitted: FittedBase, found: CandidateFit) -> FittedBase | None:
    """The base fitted from where an effect beside it has led it.

    A base that ended in a minimum of its own looks as if an effect were missing; the
    effect makes up for that, and leads out of it.

    Parameters
    ----------
    found : CandidateFit
        With the effect, which is left out.

    Returns
    -------
    FittedBase or None
        None where that does not leave much less than the base.
    """
    problem, present = fitted.problem, drive_effects(fitted.problem.drive)
    start = SearchStart(base_start(problem.drive, found), present_start(found, present))
    base = fit_candidate(problem, (), [start], fitted.scales, fitted.noise)
    base = fit_through_pieces(problem, base, fitted.scales, fitted.noise)
    floor = problem.n_evaluated * fitted.noise.rms**2
    excess = [float(one.sse.sum()) - floor for one in (base, fitted.base)]
    if not base.is_usable or excess[0] > _MUCH_LESS * excess[1]:
        return None
    return _with_causes(replace(fitted, base=base))


def compared_as_given(problem: DiagnosisProblem) -> list[Compared]:
    """Simulate with the parameters that the configuration gives.

    What belongs to one recording alone (a start, a phase) is found from it.
    """
    present = drive_effects(problem.drive)
    speeds = [signals.velocity for signals in problem.signals]
    rough = scales_of_recordings(problem, speeds)
    fit_layout = parameter_layout(problem, tuple(present), present, rough)
    point = first_point(problem, fit_layout, problem.drive, present)
    own = fit_own(problem, fit_layout, point.shared)
    return compare_at(problem, fit_layout, own)


def _refit_base(
    problem: DiagnosisProblem, scales: Scales, noise: NoiseFloor
) -> CandidateFit:
    """Base, and the effects that the simulation has already, fitted again."""
    present = drive_effects(problem.drive)
    start = SearchStart(base_of(problem.drive), present)
    found = fit_candidate(problem, (), [start], scales, noise)
    if found.whiteness <= 1.0:
        return found
    waves = {name: one for name, one in present.items() if _REPEATS & set(one)}
    if waves and found.is_usable:
        # While the base was far off, a period has gone astray.
        end = start_from(problem.drive, found)
        back = replace(end, effects={**end.effects, **waves})
        again = fit_candidate(problem, (), [back], scales, noise)
        found = min((found, again), key=lambda one: float(one.sse.sum()))
    if isinstance(problem.drive, StandIn):
        # It stands where the simulation's own runs have led it.
        return found
    found = fit_through_pieces(problem, found, scales, noise)
    if not is_rugged(tuple(present)) or found.whiteness <= 1.0:
        return found
    starts = grown_starts(start, tuple(present), scales)
    grown = fit_grown(problem, found, starts, scales, noise)
    return grown if grown.sse.sum() < found.sse.sum() else found


def _with_resistance(
    problem: DiagnosisProblem, base: CandidateFit, scales: Scales, noise: NoiseFloor
) -> tuple[DiagnosisProblem, CandidateFit]:
    """A motor's resistance fitted instead of a damping that should be below 0.

    A winding is a fifth more or less than stated where it is cold or hot, and back-EMF is
    a damping that goes with it.
    """
    if base.whiteness <= 1.0 or not asks_for_resistance(problem, base):
        return problem, base
    free = _resistance_freed(problem)
    found = _refit_base(free, scales, noise)
    return (free, found) if found.sse.sum() < base.sse.sum() else (problem, base)


def _with_mass(
    problem: DiagnosisProblem, base: CandidateFit, scales: Scales, noise: NoiseFloor
) -> tuple[DiagnosisProblem, CandidateFit]:
    """The mass fitted beside a force constant that is known, if they contradict each other.

    Recordings tell their ratio alone. Who knows one of them may have the other wrong: a
    load that was not weighed looks like a part that swings along.
    """
    drive = problem.drive
    is_held = "force_constant_N_per_A" in problem.known and not drive.has_known_forces
    if base.whiteness <= 1.0 or not is_held or drive.is_resistance_free:
        return problem, base
    free = replace(problem, drive=replace(drive, is_mass_free=True))
    found = _refit_base(free, scales, noise)
    floor = problem.n_evaluated * noise.rms**2
    excess, before = (float(one.sse.sum()) - floor for one in (found, base))
    is_much = found.is_usable and excess <= _MUCH_LESS * before
    return (free, found) if is_much else (problem, base)


def with_free_resistance(fitted: FittedBase) -> FittedBase:
    """The base with the resistance fitted instead of the damping."""
    problem = _resistance_freed(fitted.problem)
    base = _refit_base(problem, fitted.scales, fitted.noise)
    return _with_causes(replace(fitted, problem=problem, base=base))


def asks_for_resistance(problem: DiagnosisProblem, found: CandidateFit) -> bool:
    """Whether the damping of a motor under a voltage has vanished in a fit."""
    drive = problem.drive
    if drive.resistance_ohm is None or "resistance_ohm" in problem.known:
        return False
    if drive.is_resistance_free or "damping_N_s_per_m" in problem.known:
        return False
    back_emf = drive.force_constant_N_per_A**2 / drive.resistance_ohm
    given = drive.damping_N_s_per_m or back_emf
    return fitted_drive(drive, found).damping_N_s_per_m <= _VANISHED * given


def _resistance_freed(problem: DiagnosisProblem) -> DiagnosisProblem:
    return replace(problem, drive=replace(problem.drive, is_resistance_free=True))


def _is_too_much(base: CandidateFit, noise: NoiseFloor, n_samples: int) -> bool:
    """Whether a fit leaves far less than what was read at rest: that was motion.

    A drive that settles, such as a load when its brake opens, moves in every recording
    before the input does.
    """
    left = np.sqrt(base.sse.sum() / n_samples)
    return noise.method == "rest" and bool(left < _LEAST_OF_NOISE * noise.rms)


def _shakes_at_rest(
    problem: DiagnosisProblem, base: CandidateFit, scales: Scales, noise: NoiseFloor
) -> bool:
    """Whether the colour at rest is a line that goes on all the time: motion."""
    if not (noise.is_coloured and noise.method == "rest" and base.is_usable):
        return False
    compared = compared_with_fit(problem, base, scales)
    white = replace(noise, whitening=(1.0,))
    line = line_frequencies(compared, white)[0]
    return line_share(compared, line) > LINE_SHARE
