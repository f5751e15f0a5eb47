"""Simulations that are a fitted Hammerstein-Wiener model."""

import hashlib
import json
from dataclasses import asdict
from typing import Any

import numpy as np

from hwid_cli.errors import SimulationError
from hwid_cli.model.simulate import simulate
from hwid_cli.records.programs import (
    Capabilities,
    ModelSimulation,
    RunRequest,
    SimulatorRun,
)
from hwid_cli.simulations.answers import checked_run
from hwid_cli.simulations.simulation import SimulationKind, hash_of_file

# A model was fitted at its own sample time, and is wrong at another one.
_SAME = 1e-3


def _run(options: ModelSimulation, request: RunRequest) -> SimulatorRun:
    if options.model is None:
        raise ValueError("the model was not read")
    step = options.model_sample_time_s
    if abs(request.sample_time_s - step) > _SAME * step:
        raise SimulationError(
            f"recording {request.name!r}: found a sample every {request.sample_time_s:g} "
            f"s; expected {step:g} s, as the model of simulation.file has; resample it"
        )
    output = simulate(options.model, request.input, initial_state="steady")
    return checked_run({"output": output}, _Names(), request)


class _Names:
    """A model has one output, and no velocity."""

    output, velocity = "output", None


def _content(options: ModelSimulation) -> str:
    if options.file:
        return hash_of_file(options.file)
    if options.model is None:
        raise ValueError("the model was not read")
    text = json.dumps(asdict(options.model), sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else repr(value)


KIND = SimulationKind(lambda options: Capabilities(run=True), _run, _content)
