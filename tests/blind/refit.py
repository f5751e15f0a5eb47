"""The drive without any effect, fitted to recordings: how large a hidden effect is.

``m x'' + c x' + k x = kt i`` with a current that is linear between samples, solved
exactly; the mass is known, the three others are fitted by least squares.
"""

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import cont2discrete, lfilter

from tests.blind.machine import SAMPLE_TIME_S


def linear_response(mass_kg, damping, stiffness, force_constant, commands_A):
    """Displacements from rest, exact for commands that start at zero, [m]."""
    system = ([force_constant / mass_kg], [1.0, damping / mass_kg, stiffness / mass_kg])
    top, bottom, _ = cont2discrete(system, SAMPLE_TIME_S, method="foh")
    return [lfilter(top.ravel(), bottom, command) for command in commands_A]


def gap_of(commands, outputs, mass_kg, start):
    """RMS that stays after the re-fit and RMS of the motion, [m]; the parameters.

    ``start`` holds damping, stiffness and force constant.
    """

    motion = np.concatenate(outputs)

    def gap(logs):
        damping, stiffness, constant = np.exp(logs)
        fitted = linear_response(mass_kg, damping, stiffness, constant, commands)
        return motion - np.concatenate(fitted)

    found = least_squares(gap, np.log(start), x_scale=0.1, xtol=1e-10, ftol=1e-12)
    return rms(found.fun), rms(motion), np.exp(found.x)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))
