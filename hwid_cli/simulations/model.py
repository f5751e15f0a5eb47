"""Simulations that are a fitted Hammerstein-Wiener model.

What may have changed in the machine are factors: of the gains before and behind the
input map, and of stiffness and damping. Of the linear block B/F the slow poles are a
mass with a damper and a spring (`block_mass`), the others a lag of what pushes
it or reads it. A force acts at the mass: behind the input map, and behind that lag.
docs/any_simulation.md.
"""

import hashlib
import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.errors import SimulationError
from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.model.linear_block import filtered
from hwid_cli.model.static_map import evaluate_repeatably
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.programs import (
    Capabilities,
    FreeParameter,
    ModelSimulation,
    RunRequest,
    SimulatorRun,
)
from hwid_cli.simulations.answers import checked_run
from hwid_cli.simulations.block_mass import mass_of_block
from hwid_cli.simulations.simulation import (
    SimulationKind,
    hash_of_file,
    with_file_placed,
)

# A model was fitted at its own sample time, and is wrong at another one.
_SAME = 1e-3
# Factors within which a parameter may change.
_MOST = 5.0
# Before the map less: beside the gain behind it that imitates other maps.
_MOST_BEFORE_MAP = 1.5
# Inputs beyond any recording, where a map that cuts off is flat.
_FAR = np.array([-2e9, -1e9, 1e9, 2e9])


def free_parameters(model: HammersteinWiener) -> dict[str, FreeParameter]:
    """What may have changed in a machine since its model was fitted, each a factor.

    Returns
    -------
    dict of str to FreeParameter
        ``gain``; ``input_gain`` before a map that cuts nothing off; ``stiffness`` and
        ``damping`` where the block has such.
    """
    found = {"gain": _within(_MOST)}
    if model.input_map.kind != "none" and _goes_on(model):
        found["input_gain"] = _within(_MOST_BEFORE_MAP)
    return {**found, **{name: _within(_MOST) for name in mass_of_block(model).names}}


def _within(factor: float) -> FreeParameter:
    return FreeParameter(1.0, (1.0 / factor, factor))


def _goes_on(model: HammersteinWiener) -> bool:
    """Whether the input map cuts nothing off, which a gain before it would move."""
    with np.errstate(over="ignore", invalid="ignore"):
        ends = evaluate_repeatably(outlined_model(model).input_map, _FAR)
    return bool(ends[0] != ends[1] and ends[2] != ends[3])


def _run(options: ModelSimulation, request: RunRequest) -> SimulatorRun:
    if options.model is None:
        raise ValueError("the model was not read")
    step = options.model_sample_time_s
    if abs(request.sample_time_s - step) > _SAME * step:
        raise SimulationError(
            f"recording {request.name!r}: found a sample every {request.sample_time_s:g} "
            f"s; expected {step:g} s, as the model of simulation.file has; resample it"
        )
    model = outlined_model(options.model)
    values = dict(request.parameters)
    mass = mass_of_block(model).changed(values)
    above, below = mass.scale * model.numerator, mass.denominator
    with np.errstate(over="ignore", invalid="ignore"):
        command = values.get("input_gain", 1.0) * request.input
        given = evaluate_repeatably(model.input_map, np.ascontiguousarray(command))
        given = values.get("gain", 1.0) * given
        moved = filtered(given, above, below, model.delay, steady=True)
        if request.force.size:
            block = mass.force_block(model.numerator, model.delay)
            moved = moved + filtered(request.force, *block, steady=True)
        output = evaluate_repeatably(model.output_map, moved)
    return checked_run({"output": output}, _Names(), request)


class _Names:
    """A model has one output, and no velocity."""

    output, velocity = "output", None


def _content(options: ModelSimulation) -> str:
    model = options.model
    if model is None:
        raise ValueError("the model was not read")
    if options.file:
        # Its numbers may stand in other units than the file's.
        return f"{hash_of_file(options.file)} {model.input_unit} {model.output_unit}"
    text = json.dumps(asdict(model), sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else repr(value)


def _capabilities(options: ModelSimulation) -> Capabilities:
    return Capabilities(run=True, parameters=bool(options.free), force=True)


def _placed(options: ModelSimulation, folder: Path) -> ModelSimulation:
    if options.results:
        return replace(options, results=str((folder / options.results).resolve()))
    placed: ModelSimulation = with_file_placed(options, folder)
    return placed


def _with_model(options: ModelSimulation, model: HammersteinWiener) -> ModelSimulation:
    """With a model, and those of its parameters that the section does not give."""
    free = free_parameters(model)
    unknown = [name for name in options.parameters if name not in free]
    if unknown:
        raise SimulationError(
            f"simulation.parameters.{unknown[0]}: this model has no such parameter; "
            f"expected {', '.join(free)}"
        )
    return replace(
        options,
        model=model,
        model_sample_time_s=model.sample_time_s,
        parameters={**free, **options.parameters},
    )


def _own_code(options: ModelSimulation) -> str:
    return f"the model {options.name}" if options.name else options.file


KIND = SimulationKind(
    _capabilities,
    _run,
    _content,
    placed=_placed,
    own_code=_own_code,
    with_model=_with_model,
)
