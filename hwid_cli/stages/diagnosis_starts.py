"""Whether `cut` leaves recordings a start that a diagnosis can take: at rest.

Models need no rest before an excitation, and `cut` takes it away. A simulation starts from
it: the last of it is given back where the log has it. Where the cut went on into the motion,
as it may in a random signal, the drive is not at rest. What first samples themselves tell is
found out with the base (``hwid_cli/diagnosis/found_start.py``).
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
    DiagnoseOptions,
    SimulationOptions,
)
from hwid_cli.records.recordings import CalibrationLog, Recording

# A first sample is away from the equilibrium beyond this many times the noise, [-].
_AWAY = 5.0
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


def _shown(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMED
    shown = ", ".join(names[:_MOST_NAMED])
    return f"{shown} and {more} more" if more > 0 else shown
