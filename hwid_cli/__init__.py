"""Identify nonlinear servo drives and find what a simulation of them is missing.

The rooms, and the only direction in which they import each other::

    cli -> campaign | files | report -> maths -> records -> errors

``records`` holds the data handed between rooms, ``maths`` is pure functions on it,
``files`` reads and writes, ``campaign`` runs whole experiments, ``report`` makes
tables and figures, ``cli`` joins them behind the ``hwid`` command.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Loaded on first use: `hwid --help` must not wait for the compiled loops.
_PUBLIC = {
    "Fit": "hwid_cli.records.model",
    "FitOptions": "hwid_cli.records.model",
    "HammersteinWiener": "hwid_cli.records.model",
    "MapFunction": "hwid_cli.records.maps",
    "Orders": "hwid_cli.records.model",
    "OwnFunction": "hwid_cli.records.maps",
    "Recording": "hwid_cli.records.recordings",
    "fit": "hwid_cli.maths.model.fit",
    "load_model": "hwid_cli.files.exported.loading",
    "parameter_covariance": "hwid_cli.maths.model.uncertainty",
    "simulate": "hwid_cli.maths.model.simulate",
}

__all__ = [
    "Fit",
    "FitOptions",
    "HammersteinWiener",
    "MapFunction",
    "Orders",
    "OwnFunction",
    "Recording",
    "fit",
    "load_model",
    "parameter_covariance",
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
