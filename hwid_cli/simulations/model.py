"""Simulations that are a fitted Hammerstein-Wiener model.

A force acts behind the input map, where the linear block B/F begins. What may have
changed in the machine are factors: of the gains before and behind that map, and of
stiffness and damping, which are the block turned round at low frequencies,

    F/B = k + c s + ...,   F' = F + q^-n B ((stiffness - 1) k + (damping - 1) c s),

with n = 1 at most (what the block has beyond is a delay of the command) and
s = (1 - q^-1) / T. docs/any_simulation.md.
"""

import hashlib
import json
from dataclasses import asdict, replace
from itertools import product
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
from hwid_cli.simulations.simulation import (
    SimulationKind,
    hash_of_file,
    with_file_placed,
)

# A model was fitted at its own sample time, and is wrong at another one.
_SAME = 1e-3
# Delay of the block that a force has as well: a force that is held shows a sample later.
_DELAY_OF_FORCE = 1
# Factors within which a parameter may change, the widest first that keeps the block
# stable, and how far out a pole may be that is at the edge.
_FACTORS = (5.0, 3.0, 2.0, 1.5, 1.2)
_AT_EDGE = 1e-9
# Before the map less: beside the gain behind it that imitates other maps.
_MOST_BEFORE_MAP = 1.5
# Inputs beyond any recording, where a map that cuts off is flat.
_FAR = np.array([-2e9, -1e9, 1e9, 2e9])
# A stiffness below this share of what its coefficients add up to is rounding.
_ROUNDING = 1e-9


def free_parameters(model: HammersteinWiener) -> dict[str, FreeParameter]:
    """What may have changed in a machine since its model was fitted, each a factor.

    Returns
    -------
    dict of str to FreeParameter
        ``gain``; ``input_gain`` before a map that cuts nothing off; ``stiffness`` and
        ``damping`` where the block has such and stays stable.
    """
    found = {"gain": FreeParameter(1.0, (1 / _FACTORS[0], _FACTORS[0]))}
    if model.input_map.kind != "none" and _goes_on(model):
        found["input_gain"] = FreeParameter(
            1.0, (1 / _MOST_BEFORE_MAP, _MOST_BEFORE_MAP)
        )
    own = [name for name, size in zip(_FEEDBACK, _answers_back(model), strict=True)
           if size > 0]  # fmt: skip
    outermost = max(1.0, _radius(model.denominator)) + _AT_EDGE
    for factor in _FACTORS if own else ():
        corners = product((1 / factor, factor), repeat=len(own))
        changed = (
            _fed_back(model, dict(zip(own, one, strict=True))) for one in corners
        )
        if all(_radius(one) <= outermost for one in changed):
            ends = (1 / factor, factor)
            return {**found, **{name: FreeParameter(1.0, ends) for name in own}}
    return found


def _goes_on(model: HammersteinWiener) -> bool:
    """Whether the input map cuts nothing off, which a gain before it would move."""
    with np.errstate(over="ignore", invalid="ignore"):
        ends = evaluate_repeatably(outlined_model(model).input_map, _FAR)
    return bool(ends[0] != ends[1] and ends[2] != ends[3])


_FEEDBACK = ("stiffness", "damping")


def _answers_back(model: HammersteinWiener) -> tuple[float, float]:
    """k, and c times the samples of a second; 0 where the block has none."""
    above, below = model.numerator, model.denominator
    gain, stiff = float(above.sum()), float(below.sum())
    if gain == 0.0:
        return 0.0, 0.0
    late = np.arange(above.size) + min(model.delay, _DELAY_OF_FORCE)
    slope = stiff * float(late @ above) - gain * float(np.arange(below.size) @ below)
    is_rounding = abs(stiff) <= _ROUNDING * float(np.abs(below).sum())
    return 0.0 if is_rounding else stiff / gain, slope / gain**2


def _fed_back(model: HammersteinWiener, values: dict[str, float]) -> np.ndarray:
    """Denominator with other factors of stiffness and damping; its first is not 1."""
    stiff, damped = (
        (values.get(name, 1.0) - 1.0) * size
        for name, size in zip(_FEEDBACK, _answers_back(model), strict=True)
    )
    if stiff == 0.0 == damped:
        return model.denominator
    back = np.convolve(model.numerator, [stiff + damped, -damped])
    back = np.r_[np.zeros(min(model.delay, _DELAY_OF_FORCE)), back]
    size = max(back.size, model.denominator.size)
    return np.pad(back, (0, size - back.size)) + np.pad(
        model.denominator, (0, size - model.denominator.size)
    )


def _radius(denominator: np.ndarray) -> float:
    """Distance of the outermost pole from zero."""
    return float(np.max(np.abs(np.roots(denominator)), initial=0.0))


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
    below = _fed_back(model, values)
    above, below = model.numerator / below[0], below / below[0]
    with np.errstate(over="ignore", invalid="ignore"):
        command = values.get("input_gain", 1.0) * request.input
        given = evaluate_repeatably(model.input_map, np.ascontiguousarray(command))
        given = values.get("gain", 1.0) * given
        moved = filtered(given, above, below, model.delay, steady=True)
        if request.force.size:
            late = min(model.delay, _DELAY_OF_FORCE)
            moved = moved + filtered(request.force, above, below, late, steady=True)
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
