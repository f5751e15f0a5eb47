"""Drives with a coloured sensor, in other equations than the code's, many at once.

Drift, kick, drift in steps of a tenth of a sample; dry friction is an impulse that takes
speed away, at most all of it. What hides in a drive is a function of its motion alone.
"""

import numpy as np
from scipy.signal import lfilter

from hwid_cli.diagnosis.candidate import compared_with_fit
from hwid_cli.diagnosis.noise import noise_floor
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.recordings import Recording
from tests.diagnosis.small_drive import fit, problem, sizes

STEP_S = 1e-3
N = 800
SUBSTEPS = 10
MASS, DAMPING, PUSH = 0.3, 15.0, 5.0
NOISE = 2e-5
# What leaves 1.3 to 3 times the noise, with and without a spring, open and closed loop.
SIZES = {
    (True, False): {"friction": 0.05, "lag": 4e-4, "cogging": 0.08, "hysteresis": 0.05,
                    "stiffness": 7e4, "mount": 15.0, "eddy": 0.2},
    (True, True): {"friction": 0.1, "lag": 1e-3, "cogging": 0.05, "hysteresis": 0.08,
                   "stiffness": 5e6, "mount": 60.0, "eddy": 0.5},
    (False, False): {"friction": 0.006, "lag": 3e-4, "cogging": 0.01,
                     "hysteresis": 0.006, "stiffness": 0.35, "mount": 2.0, "eddy": 0.03},
    (False, True): {"friction": 0.02, "lag": 7e-4, "cogging": 0.003,
                    "hysteresis": 0.006, "stiffness": 5e4, "mount": 25.0, "eddy": 0.1},
}  # fmt: skip
NAMES = ("step_0", "step_1", "step_2", "sine_0", "sine_1", "sine_2", "other_0",
         "other_1", "other_2")  # fmt: skip


def references(size):
    """Steps, sines, a triangle, a chirp and stairs after a rest, one in each row."""
    time = STEP_S * np.arange(N)
    moving = np.maximum(time - 0.04, 0.0)
    rows = [
        level * np.interp(time, [0.04, 0.04 + rise, 0.45, 0.45 + rise], [0, 1, 1, 0])
        for level, rise in ((1.0, 0.01), (-0.6, 0.03), (0.3, 0.05))
    ]
    rows += [
        level * np.sin(2 * np.pi * frequency * moving)
        for level, frequency in ((0.9, 3.0), (0.5, 7.0), (0.4, 14.0))
    ]
    rows += [
        0.8 * np.arcsin(np.sin(2 * np.pi * 4.0 * moving)),
        0.5 * np.sin(2 * np.pi * (1.0 + 12.0 * moving) * moving),
        np.interp(
            time, [0.04, 0.08, 0.3, 0.34, 0.55, 0.6], [0, 0.5, 0.5, -0.7, -0.7, 1]
        ),
    ]
    return size * np.array(rows)


def coloured(rng, coefficient, rms=NOISE):
    """Noise of first order, of the same size whatever its colour."""
    waves = rng.standard_normal((len(NAMES), N + 200)) * np.sqrt(1 - coefficient**2)
    return rms * lfilter([1.0], [1.0, -coefficient], waves, axis=1)[:, 200:]


def recordings(
    hides="", size=0.0, *, spring=True, loop=False, coefficient=0.0, seed=1, grows=1.0
):
    """What the sensor reads of a drive in which something of some size hides.

    ``asymmetry`` is friction that is twice as large backward as forward.
    Under a controller what the sensor reads goes back into the command, noise too.
    ``grows`` is how much larger the noise is at the end than at the beginning.
    """
    rng = np.random.default_rng(seed)
    noise = coloured(rng, coefficient) * np.linspace(1.0, grows, N)
    stiffness = 1184.0 if spring else 0.0
    wanted = references(5e-3 if loop else 3.0)
    x, v, inner, behind = (np.zeros(len(NAMES)) for _ in range(4))
    read, command = np.empty_like(wanted), np.empty_like(wanted)
    h = STEP_S / SUBSTEPS
    last = noise[:, 0]
    slope = np.zeros(len(NAMES))
    for k in range(N):
        read[:, k] = x + noise[:, k]
        command[:, k] = wanted[:, k]
        if loop:
            slope += 0.3 * ((read[:, k] - last) / STEP_S - slope)
            last = read[:, k]
            command[:, k] = 600.0 * (wanted[:, k] - read[:, k]) - 6.0 * slope
        for _ in range(SUBSTEPS):
            behind += h * (command[:, k] - behind) / (size if hides == "lag" else h)
            x = x + 0.5 * h * v
            force, inner = _hidden(hides, size, x, v, inner, h)
            force = force + PUSH * behind - stiffness * x
            middle = v + 0.5 * h * (force - DAMPING * v) / MASS
            v = v + h * (force - DAMPING * middle) / MASS
            if hides in ("friction", "asymmetry"):
                more = np.where((v < 0) & (hides == "asymmetry"), 2.0, 1.0)
                v = np.sign(v) * np.maximum(np.abs(v) - more * size * h / MASS, 0.0)
            x = x + 0.5 * h * v
    return [
        Recording(name, command[row], read[row], STEP_S, kind=name.split("_")[0])
        for row, name in enumerate(NAMES)
    ]


def _hidden(hides, size, x, v, inner, h):
    """Force of what hides in the drive, and its inner state one step on."""
    if hides == "cogging":
        return -size * np.sin(2 * np.pi * x / 4e-3), inner
    if hides == "hysteresis":
        rate = v / 2e-4 - np.abs(v) / 2e-4 * inner
        return -size * inner, inner + h * rate
    if hides == "stiffness":
        return -size * x**3, inner
    if hides == "mount":
        # A spring and a damper in series beside the drive: in no catalogue.
        return -inner, inner + h * (size * v - inner / 0.03)
    if hides == "eddy":
        return -size * (v / 0.1) / (1 + (v / 0.1) ** 2), inner
    return 0.0 * x, inner


def base_of(found, *, spring=True, loop=False):
    """The base fitted to recordings beside them, their noise, and the problem."""
    of = problem(
        found,
        held_out=("step_2", "sine_1", "other_2"),
        stiffness_N_per_m=1184.0 if spring else 0.0,
        hold="zero",
        # Noise in the command of the first sample is no balance of forces.
        options=DiagnoseOptions(
            initial_state="estimated" if spring and loop else "rest"
        ),
    )
    base = fit(of)
    return of, compared_with_fit(of, base, sizes(of)), noise_floor(of)
