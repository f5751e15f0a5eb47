"""Whether recordings can start as a diagnosis takes them to: at rest, in equilibrium.

Models need no rest before an excitation, and `cut` takes it away. A simulation starts from
it: the last of it is given back where the log has it.

A recording that was cut at the onset of its excitation begins with an input to which the
drive has not answered yet; a simulation that starts in equilibrium with that input is off
from its first sample, and no missing effect explains that. Where the cut went on into the
motion, as it may in a random signal, the drive is not even at rest.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.data.as_measured import as_measured
from hwid_cli.data.signal_features import LEAST_QUIET, find_onset
from hwid_cli.diagnosis.noise import noise_floor
from hwid_cli.diagnosis.problem import prepare
from hwid_cli.records.axis import base_of
from hwid_cli.records.experiment import (
    CalibrateOptions,
    DiagnoseOptions,
    SimulationOptions,
)
from hwid_cli.records.recordings import CalibrationLog, Recording

# A first sample is away from the equilibrium beyond this many times the noise, [-] ...
_AWAY = 5.0
# ... and this share of what the first input asks for: parameters from data sheets are
# not off by so much, [-].
_AWAY_SHARE = 0.5
_MOST_NAMED = 4
# So much of a rest is given back, enough to be one, [samples].
_KEPT_REST = 2 * LEAST_QUIET


def with_rests(
    recordings: Sequence[Recording], logs: Sequence[CalibrationLog]
) -> list[Recording]:
    """Recordings with the last of the rest that was cut before their excitation.

    An onset is found where the input is clearly away from its rest, and its first samples
    are cut as well: a drive that starts there starts too late.

    Parameters
    ----------
    logs : sequence of CalibrationLog
        Of these and maybe of others. What one does not hold is not given back.
    """
    by_name = {log.name: log for log in logs}
    return [
        _with_rest(one, by_name[one.name]) if one.name in by_name else one
        for one in recordings
    ]


def _with_rest(recording: Recording, log: CalibrationLog) -> Recording:
    first = log.first_sample
    measured = as_measured(recording, log) if first else None
    if measured is None or recording.reference is not None:
        return recording
    # Other cuts begin in mid-motion, or keep a rest.
    is_rest = find_onset(measured[0], quiet_is_rest=True) == first
    if not is_rest or _moves_before(recording, log):
        return recording
    kept = slice(max(first - _KEPT_REST, 0), first)
    rest_input = measured[0][kept] - log.input_offset
    rest_output = measured[1][kept] - log.output_offset
    if not (np.isfinite(rest_input).all() and np.isfinite(rest_output).all()):
        return recording
    return replace(
        recording,
        input=np.r_[rest_input, recording.input],
        output=np.r_[rest_output, recording.output],
    )


def unsettled_starts(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
) -> tuple[str, ...]:
    """Find recordings that do not begin in equilibrium, where they are taken to.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one, as the diagnosis gets them.

    Returns
    -------
    tuple of str
        Names of those without a rest before the excitation whose first output is far
        from the equilibrium of the linear drive with the first input. None where a
        diagnosis fits how recordings start, under a controller, without a spring and
        where a velocity is measured.
    """
    if options.initial_state != "rest" or simulation.controller is not None:
        return ()
    base = base_of(simulation)
    stiffness = base.get("stiffness_N_per_m", 0.0)
    if not stiffness > 0 or simulation.output == "velocity":
        return ()
    noise = noise_floor(prepare(recordings, simulation, options, ())).rms
    constant = base.get("force_constant_N_per_A", 1.0)
    gain = constant / (stiffness * (simulation.resistance_ohm or 1.0))
    rests = [_rest(one) for one in recordings]
    zeros = [
        float(np.mean(one.output[:rest] - gain * one.input[:rest]))
        for one, rest in zip(recordings, rests, strict=True)
        if rest
    ]
    # A load, or the zero of the sensor.
    zero = float(np.median(zeros)) if zeros else 0.0
    found = []
    for one, rest in zip(recordings, rests, strict=True):
        asked = abs(gain * float(one.input[0]))
        away = abs(float(one.output[0]) - zero - gain * float(one.input[0]))
        is_known = bool(zeros) or asked > _AWAY * noise
        if not rest and is_known and away > max(_AWAY * noise, _AWAY_SHARE * asked):
            found.append(one.name)
    return tuple(found)


def moving_starts(
    recordings: Sequence[Recording],
    logs: Sequence[CalibrationLog],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
) -> tuple[str, ...]:
    """Find recordings that a cut begins in mid-motion, where they are taken to rest.

    Parameters
    ----------
    recordings : sequence of Recording
        As the diagnosis gets them.
    logs : sequence of CalibrationLog
        Of these and maybe of others.

    Returns
    -------
    tuple of str
        Names of those whose output leaves its rest before the first sample that was
        kept, and moves too fast there for a spring to be about in equilibrium. None
        where a diagnosis fits how recordings start.
    """
    if options.initial_state == "estimated":
        return ()
    by_name = {log.name: log for log in logs}
    moving = [
        one
        for one in recordings
        if one.name in by_name and _moves_before(one, by_name[one.name])
    ]
    base = base_of(simulation)
    stiffness = base.get("stiffness_N_per_m", 0.0)
    if not moving or not stiffness > 0 or simulation.output == "velocity":
        return tuple(one.name for one in moving)
    noise = noise_floor(prepare(recordings, simulation, options, ())).rms
    # By so much motion at an even speed is away from equilibrium and swings afterwards.
    time_s = base["damping_N_s_per_m"] / stiffness + np.sqrt(
        base["mass_kg"] / stiffness
    )
    return tuple(
        one.name for one in moving if _first_speed(one) * time_s > _AWAY * noise
    )


def _first_speed(recording: Recording) -> float:
    """Speed of the output over the first samples, [output unit/s]."""
    first = recording.output[:_KEPT_REST]
    slope = np.polyfit(np.arange(first.size), first, 1)[0]
    return float(abs(slope)) / recording.sample_time_s


def _moves_before(recording: Recording, log: CalibrationLog) -> bool:
    is_cut = log.first_sample > 0 and recording.n_samples == log.n_samples
    measured = as_measured(recording, log) if is_cut else None
    if measured is None:
        # Of others the rest was not cut, or was given back.
        return False
    onset = find_onset(measured[1], quiet_is_rest=True)
    return onset is not None and LEAST_QUIET <= onset < log.first_sample


def moving_sentence(names: Sequence[str], recordings: Sequence[Recording]) -> str:
    """Say which recordings begin in mid-motion, and what to do.

    Parameters
    ----------
    names : sequence of str
        From ``moving_starts``.

    Returns
    -------
    str
        One line; empty without names.
    """
    if not names:
        return ""
    kinds = dict.fromkeys(one.kind for one in recordings if one.name in names)
    where = " and ".join(f"calibrate.{kind}" for kind in kinds)
    is_one = len(names) == 1
    return (
        f"{where}: 'cut' begins {_shown(names)} in mid-motion, but "
        "diagnose.initial_state 'rest' and 'held' start "
        f"{'it' if is_one else 'them'} at rest; leave 'cut' out of {where}, or "
        "write diagnose.initial_state: estimated, which fits the start"
    )


def starts_sentence(
    names: Sequence[str],
    recordings: Sequence[Recording],
    calibrate: CalibrateOptions | None,
) -> str:
    """Say which recordings do not begin in equilibrium, and what to do.

    Parameters
    ----------
    names : sequence of str
        From ``unsettled_starts``.

    Returns
    -------
    str
        One line; empty without names.
    """
    if not names:
        return ""
    kinds = dict.fromkeys(one.kind for one in recordings if one.name in names)
    cut = [kind for kind in kinds if calibrate and "cut" in getattr(calibrate, kind)]
    advice = "'held' keeps the level before the excitation, 'estimated' fits the start"
    if cut:
        where = " and ".join(f"calibrate.{kind}" for kind in cut)
        advice += f"; or leave 'cut' out of {where}, which takes the rest away"
    return (
        "diagnose.initial_state: 'rest' starts each recording in equilibrium with its "
        f"first input, but {_shown(names)} begin{'s' * (len(names) == 1)} within the "
        f"excitation, away from it; {advice}"
    )


def _rest(recording: Recording) -> int:
    """Samples before the excitation; 0 where there are too few to be a rest."""
    onset = find_onset(recording.input, quiet_is_rest=True)
    onset = recording.n_samples if onset is None else onset
    return onset if onset >= LEAST_QUIET else 0


def _shown(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMED
    shown = ", ".join(names[:_MOST_NAMED])
    return f"{shown} and {more} more" if more > 0 else shown
