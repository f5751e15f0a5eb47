"""Excitation plans: the commands of a set of recordings, at 1 kHz."""

import numpy as np

from tests.blind.machine import SAMPLE_TIME_S

LARGEST_A = 5.0
# Rest before the excitation, [s].
LEAD_IN_S = 0.1
STEP_AMPLITUDES_A = (1.0, 2.0, 3.0, 4.0, 5.0)
RAMPS_S = (0.005, 0.05, 0.2)
STEP_SAMPLES = 1200
# Length of the recordings with a sine, [samples]: slow ones need room to settle.
SINE_SAMPLES = {1.0: 3000, 3.0: 1500, 7.0: 1000, 12.0: 1000, 25.0: 1000}
MULTISINE_SAMPLES = 3000
MULTISINE_HZ = (0.5, 60.0)


def plan(name, rng):
    """Commands by the name of the recording: ``full``, ``poor``, ``short`` or ``few``."""
    plans = {
        "full": full_plan,
        "poor": poor_plan,
        "short": short_plan,
        "few": few_plan,
    }
    return plans[name](rng)


def full_plan(rng):
    """27 recordings: steps with return of both signs, sines, multisines."""
    commands = {}
    steps = [(amplitude, ramp) for ramp in RAMPS_S for amplitude in STEP_AMPLITUDES_A]
    for n, (amplitude, ramp) in enumerate(steps):
        signed = amplitude if n % 2 == 0 else -amplitude
        commands[f"step_{n + 1:02}"] = returning_step(signed, ramp)
    sines = [(f, amplitude) for amplitude in (2.0, LARGEST_A) for f in SINE_SAMPLES]
    for n, (frequency, amplitude) in enumerate(sines):
        commands[f"sine_{n + 1:02}"] = sine(amplitude, frequency)
    for n in range(2):
        commands[f"random_{n + 1:02}"] = multisine(rng)
    return commands


def poor_plan(_rng):
    """15 steps in one direction, without return."""
    steps = [(amplitude, ramp) for ramp in RAMPS_S for amplitude in STEP_AMPLITUDES_A]
    return {
        f"step_{n + 1:02}": one_way_step(amplitude, ramp)
        for n, (amplitude, ramp) in enumerate(steps)
    }


def short_plan(rng):
    """10 recordings with the kinds of the full plan, a quarter of its samples."""
    steps = [(5.0, 0.005), (-5.0, 0.05), (3.0, 0.2), (-3.0, 0.005), (1.5, 0.05)]
    sines = [(5.0, 3.0), (2.0, 3.0), (5.0, 12.0), (2.5, 7.0)]
    commands = {
        f"step_{n + 1:02}": returning_step(amplitude, ramp)[:1000]
        for n, (amplitude, ramp) in enumerate(steps)
    }
    for n, (amplitude, frequency) in enumerate(sines):
        commands[f"sine_{n + 1:02}"] = sine(amplitude, frequency)[:1000]
    commands["random_01"] = multisine(rng)[:1000]
    return commands


def few_plan(_rng):
    """6 short steps in one direction: a tenth of the samples of the poor plan."""
    steps = [
        (amplitude, ramp) for ramp in (0.005, 0.1) for amplitude in (1.5, 3.0, 5.0)
    ]
    return {
        f"step_{n + 1:02}": one_way_step(amplitude, ramp)[:500]
        for n, (amplitude, ramp) in enumerate(steps)
    }


def returning_step(amplitude_A, ramp_s):
    """Rest, ramp up, hold, ramp back, rest."""
    down = 0.75
    corners = [0.0, LEAD_IN_S, LEAD_IN_S + ramp_s, down, down + ramp_s]
    return np.interp(_times(STEP_SAMPLES), corners, amplitude_A * np.r_[0, 0, 1, 1, 0])


def one_way_step(amplitude_A, ramp_s):
    """Rest, ramp up, hold."""
    corners = [0.0, LEAD_IN_S, LEAD_IN_S + ramp_s]
    return np.interp(_times(STEP_SAMPLES), corners, amplitude_A * np.r_[0, 0, 1])


def sine(amplitude_A, frequency_Hz):
    """Rest, then a sine that starts at zero."""
    running = np.maximum(_times(SINE_SAMPLES[frequency_Hz]) - LEAD_IN_S, 0.0)
    return amplitude_A * np.sin(2 * np.pi * frequency_Hz * running)


def multisine(rng):
    """Rest, then all frequencies of a band with equal amplitude and random phases."""
    times = _times(MULTISINE_SAMPLES)
    first, last = MULTISINE_HZ
    frequencies = np.arange(first, last + first / 2, first)
    phases = rng.uniform(0, 2 * np.pi, len(frequencies))
    running = np.maximum(times - LEAD_IN_S, 0.0)
    signal = np.sin(2 * np.pi * np.outer(running, frequencies) + phases).sum(axis=1)
    # It fades in, because the recording starts at rest.
    signal *= np.clip(running / 0.1, 0.0, 1.0)
    return LARGEST_A * signal / np.abs(signal).max()


def _times(samples):
    return np.arange(samples) * SAMPLE_TIME_S
