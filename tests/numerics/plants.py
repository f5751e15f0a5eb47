"""A small plant, fits of it, and the same measurement in other units."""

import numpy as np
from scipy.signal import lfilter

from hwid_cli.records.experiment import CrossvalOptions, OrdersOptions
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.crossval import cross_validate
from hwid_cli.stages.identify import identify_all
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers

GRID = OrdersOptions(nb=(1,), nk=(1, 2))
FEW = FitOptions(units=4, starts=1, max_iterations=8, initial_state="zero")


def measured(name="a", seed=1, n=300, *, input_unit=1.0, output_unit=1.0):
    """A displacement in metres of a saturating plant, divided by the units."""
    rng = np.random.default_rng(seed)
    current = np.repeat(rng.uniform(-2.0, 2.0, n // 20), 20)
    moved = lfilter([0.0, 0.2], [1.0, -0.8], np.tanh(current))
    # Rounded to a micrometre, as a sensor that counts gives it.
    counts = np.round(1e3 * (moved + 0.1 * moved**2) + rng.standard_normal(n))
    return Recording(name, current / input_unit, 1e-6 * counts / output_unit, 1e-3)


def settings(store=None, jobs=1):
    return RunSettings(MemoryStore() if store is None else store, Workers(jobs))


def identified(recordings, options=FEW, **run):
    return identify_all(recordings, GRID, options, settings(**run))


def validated(fits, recordings, **run):
    return cross_validate(fits, recordings, GRID, CrossvalOptions(), settings(**run))
