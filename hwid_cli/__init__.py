"""Identify nonlinear servo drives and find what a simulation of them is missing.

The rooms, and the only direction in which they import each other::

    cli | python -> stages -> export | report | tasks -> config | store -> data | simulations
        -> files -> diagnosis -> trust -> drive | model -> records -> compiled | errors
        -> sources

``records`` holds the data handed between rooms; ``model``, ``drive``, ``trust`` and
``diagnosis`` are pure functions on it; ``files`` to ``export`` turn bytes into records
and back; ``tasks`` runs and memoises work; ``stages`` say what is needed, computed,
stored and shown; ``report`` makes tables, figures and the page; ``cli`` joins them
behind ``hwid``, ``python`` behind ``from hwid_cli import ...``.

From Python, the names below do on records in memory what the commands do on files.

Examples
--------
>>> import numpy as np
>>> from hwid_cli import FitOptions, Orders, Recording, fit, fit_percent, simulate
>>> u = np.repeat(np.random.default_rng(1).uniform(-1, 1, 40), 25)
>>> y = np.zeros(u.size)
>>> for k in range(1, u.size):
...     y[k] = 0.9 * y[k - 1] + 0.1 * np.tanh(2 * u[k - 1])
>>> recording = Recording("r1", input=u, output=y, sample_time_s=1e-3)
>>> result = fit([recording], Orders(nb=1, nf=1, nk=1), FitOptions())
>>> result.status, result.fit_percent > 99
('converged', True)
>>> y_hat = simulate(result.model, u)
>>> fit_percent(y, y_hat) > 99
True
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Loaded on first use: `hwid --help` must not wait for the compiled loops. Type checkers
# read __init__.pyi, which names the same.
_PUBLIC = {
    "Columns": "hwid_cli.records.experiment",
    "DiagnoseOptions": "hwid_cli.records.experiment",
    "Diagnosis": "hwid_cli.records.diagnosis",
    "Fit": "hwid_cli.records.model",
    "FitOptions": "hwid_cli.records.model",
    "FitGrid": "hwid_cli.records.fit_grid",
    "GroupOptions": "hwid_cli.records.experiment",
    "HammersteinWiener": "hwid_cli.records.model",
    "HammersteinWienerRegressor": "hwid_cli.python.estimator",
    "HwidError": "hwid_cli.errors",
    "MapFunction": "hwid_cli.records.maps",
    "Orders": "hwid_cli.records.model",
    "OrdersOptions": "hwid_cli.records.experiment",
    "OwnFunction": "hwid_cli.records.maps",
    "Recording": "hwid_cli.records.recordings",
    "SimulationOptions": "hwid_cli.records.experiment",
    "crossval": "hwid_cli.python.functions",
    "diagnose": "hwid_cli.python.functions",
    "fit": "hwid_cli.model.fit",
    "fit_grid": "hwid_cli.python.functions",
    "fit_percent": "hwid_cli.model.scores",
    "group": "hwid_cli.python.functions",
    "identify": "hwid_cli.python.functions",
    "load_recording": "hwid_cli.stages.single_recording",
    "load_model": "hwid_cli.export.loading",
    "parameter_covariance": "hwid_cli.model.uncertainty",
    "rmsd": "hwid_cli.model.scores",
    "simulate": "hwid_cli.model.simulate",
}

__all__ = [
    "Columns",
    "DiagnoseOptions",
    "Diagnosis",
    "Fit",
    "FitGrid",
    "FitOptions",
    "GroupOptions",
    "HammersteinWiener",
    "HammersteinWienerRegressor",
    "HwidError",
    "MapFunction",
    "Orders",
    "OrdersOptions",
    "OwnFunction",
    "Recording",
    "SimulationOptions",
    "crossval",
    "diagnose",
    "fit",
    "fit_grid",
    "fit_percent",
    "group",
    "identify",
    "load_model",
    "load_recording",
    "parameter_covariance",
    "rmsd",
    "simulate",
]


def __getattr__(name: str) -> Any:
    """Load a public name from the room where it lives."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'hwid_cli' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    """Show the public names, loaded or not."""
    return [*globals(), *_PUBLIC]
