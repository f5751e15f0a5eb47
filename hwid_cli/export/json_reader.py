"""An exported model out of its JSON file, or one clear line that says why not.

The schema says what each key holds; what several must agree on is checked here.
"""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.config.agreement import disagreements
from hwid_cli.config.sections import read_section
from hwid_cli.errors import ModelFileError
from hwid_cli.export.json_writer import SIMULATION
from hwid_cli.export.map_parts import parts_of, portable
from hwid_cli.export.model_file import read_model_file, refuse
from hwid_cli.files.messages import is_plain
from hwid_cli.model.maps.rule import Part
from hwid_cli.model.parameter_steps import parameter_vector
from hwid_cli.records.axis import ROTARY_NAMES, base_of, name_on
from hwid_cli.records.drive import NOT_IN_FILES, Drive
from hwid_cli.records.experiment import Columns, Experiment, FileUnits
from hwid_cli.records.exported import (
    Exported,
    ExportedModel,
    ExportedSimulation,
    ModelCard,
)
from hwid_cli.records.maps import Extrapolation, OwnFunction, StaticMap
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.trust import ModelTrust, Visited, VisitedPlane
from hwid_cli.trust.simulation import moved

# As of signals (docs/security.md), in any unit.
_LARGEST = 1e60


def read_exported(path: Path) -> Exported:
    """Read a model that was exported as JSON.

    Raises
    ------
    ModelFileError
        If the file is missing, of another version, or something in it cannot be.
    """
    content = read_model_file(path)
    card = _card(path, content)
    if content["kind"] == SIMULATION:
        return _read_simulation(path, content, card)
    return _model(path, content, card)


def _read_simulation(
    path: Path, content: Mapping[str, Any], card: ModelCard
) -> ExportedSimulation:
    drive, trust = _drive(path, content["simulation"]), content.get("trust")
    known = None
    if trust is not None:
        names = tuple(trust.get("parameters", ()))
        known = _trust(path, trust, len(names))
        try:
            moved(drive, names, np.zeros(len(names)))
        except ValueError as error:
            expected = "parameters of the simulation in this file"
            refuse(path, ("trust", "parameters"), str(error), expected)
    step = float(content["sample_time_s"])
    return ExportedSimulation(card, drive, step, trust=known)


def _model(path: Path, content: Mapping[str, Any], card: ModelCard) -> ExportedModel:
    block, start = content["linear_block"], content["initial_state"]
    numerator, denominator = _vector(block["numerator"]), _vector(block["denominator"])
    delay, free = int(block["delay"]), _vector(start["free_response"])
    _check_orders(path, content["orders"], numerator.size, denominator.size - 1, delay)
    n_state = max(denominator.size - 1, numerator.size + delay - 1)
    if free.size not in (0, n_state):
        place = ("initial_state", "free_response")
        refuse(path, place, f"{free.size} numbers", f"{n_state}, or none")
    model = HammersteinWiener(
        input_map=_map(path, content, "input_map"),
        numerator=numerator,
        denominator=denominator,
        delay=delay,
        output_map=_map(path, content, "output_map"),
        sample_time_s=float(content["sample_time_s"]),
        initial_state=start["rule"],
        free_response=free,
        input_unit=card.input_unit,
        output_unit=card.output_unit,
    )
    gain = block.get("static_gain")
    gain = math.inf if gain is None else float(gain)
    trust = content.get("trust")
    known = None if trust is None else _trust(path, trust, parameter_vector(model).size)
    return ExportedModel(card, model, gain, known)


def _trust(path: Path, given: Mapping[str, Any], n_parameters: int) -> ModelTrust:
    if n_parameters and not given["steps"] and not given["reason"]:
        expected = "the steps of the covariance, or a reason why there are none"
        refuse(path, ("trust", "steps"), "none", expected)
    for row, step in enumerate(given["steps"]):
        if len(step) != n_parameters:
            expected = f"{n_parameters}, one a parameter"
            refuse(path, ("trust", "steps", row), f"{len(step)} numbers", expected)
    _refuse_huge(path, given, ("trust",))
    visited = given["visited"]
    before, after = (_plane(path, visited[side], side) for side in ("input", "inner"))
    return ModelTrust(
        Visited(before, after, _vector(visited["bands"])),
        np.array(given["steps"], dtype=float).reshape(-1, max(n_parameters, 1)),
        float(given["noise_rms"]),
        float(given["scale"]),
        tuple(given["judged_on"]),
        float(given["scatter"]),
        given["reason"],
        float(given.get("gain", 0.0)),
        tuple(given.get("parameters", ())),
    )


def _refuse_huge(path: Path, given: Any, place: tuple[str | int, ...]) -> None:
    """Refuse numbers whose squares and sums a float cannot hold: no signal is so large."""
    inner: Iterable[tuple[str | int, Any]] = ()
    if isinstance(given, dict):
        inner = given.items()
    elif isinstance(given, list):
        inner = enumerate(given)
    elif isinstance(given, float | int) and abs(given) > _LARGEST:
        refuse(path, place, given, f"numbers up to {_LARGEST:g}")
    for key, value in inner:
        _refuse_huge(path, value, (*place, key))


def _plane(path: Path, given: Mapping[str, Any], side: str) -> VisitedPlane:
    edges, low, high = (
        _vector(given[name]) for name in ("edges", "lowest_rate", "highest_rate")
    )
    place = ("trust", "visited", side)
    if not (np.diff(edges) > 0.0).all():
        refuse(path, (*place, "edges"), given["edges"], "numbers that rise")
    for name, rates in (("lowest_rate", low), ("highest_rate", high)):
        if rates.size != edges.size - 1:
            expected = f"{edges.size - 1}, one a cell"
            refuse(path, (*place, name), f"{rates.size} numbers", expected)
    return VisitedPlane(edges, low, high)


def _vector(values: list[float]) -> np.ndarray:
    return np.array(values, dtype=np.float64)


def _check_orders(
    path: Path, orders: Mapping[str, int], nb: int, nf: int, nk: int
) -> None:
    """Refuse orders that the coefficients contradict."""
    for key, found in (("nb", nb), ("nf", nf), ("nk", nk)):
        if orders[key] != found:
            expected = f"{found}, as linear_block has it"
            refuse(path, ("orders", key), orders[key], expected)


def _map(path: Path, content: Mapping[str, Any], key: str) -> StaticMap:
    given = content[key]
    kind, domain = given["kind"], given["domain"]
    form = portable(kind)
    numbers = [_part(path, given, key, part) for part in form.parts]
    if not domain[0] < domain[1]:
        refuse(path, (key, "domain"), domain, "two numbers, the lower one first")
    function = given.get("function")
    one = StaticMap(
        kind,
        np.concatenate(numbers) if numbers else np.zeros(0),
        (float(domain[0]), float(domain[1])),
        function and OwnFunction(**{**function, "unit": float(function["unit"])}),
        _extrapolation(path, given.get("extrapolation"), key),
    )
    _check_sizes(path, key, one, numbers)
    for part in form.derived_parts:
        found, size = len(given[part.name]), part.size(one.parameters.size)
        if found != size:
            expected = f"{size}, one a value"
            refuse(path, (key, part.name), f"{found} numbers", expected)
    return one


def _extrapolation(
    path: Path, given: Mapping[str, Any] | None, key: str
) -> Extrapolation | None:
    """What a map does where its fit had no samples; None where the law holds."""
    if given is None:
        return None
    visited, arguments = _vector(given["visited"]), _vector(given["arguments"])
    values, place = _vector(given["values"]), (key, "extrapolation")
    if visited.size % 2 or (np.diff(visited) < 0.0).any():
        refuse(path, (*place, "visited"), visited.tolist(), "pairs of rising numbers")
    if not (np.diff(arguments) > 0.0).all():
        refuse(path, (*place, "arguments"), arguments.tolist(), "numbers that rise")
    if values.size != arguments.size:
        expected = f"{arguments.size}, one an argument"
        refuse(path, (*place, "values"), f"{values.size} numbers", expected)
    return Extrapolation(visited, arguments, values)


def _part(path: Path, given: Mapping[str, Any], key: str, part: Part) -> np.ndarray:
    values = _vector(given[part.name])
    if part.is_rising and not (np.diff(values) > 0.0).all():
        refuse(path, (key, part.name), values.tolist(), "numbers that rise")
    if part.is_positive and not (values > 0.0).all():
        refuse(path, (key, part.name), values.tolist(), "numbers above 0")
    return values


def _check_sizes(
    path: Path, key: str, one: StaticMap, numbers: list[np.ndarray]
) -> None:
    """Refuse parts whose lengths do not fit together."""
    form = portable(one.kind)
    sizes = [values.size for values in numbers]
    names = [part.name for part in form.parts]
    if sizes != [values.size for values in parts_of(one).values()]:
        found = ", ".join(f"{n} {name}" for n, name in zip(sizes, names, strict=True))
        refuse(path, (key, names[0]), found, form.lengths)
    if form.are_limits and numbers[0][0] > numbers[0][1]:
        refuse(path, (key, names[0]), numbers[0].tolist(), form.lengths)


def _drive(path: Path, given: Mapping[str, Any]) -> Drive:
    """A drive, by the same rules as for a configuration."""
    # What a configuration would leave out is null in the file.
    stated = {key: value for key, value in given.items() if value is not None}
    content = {"name": "model", "simulation": stated}
    experiment, faults = read_section(Experiment, content, str(path))
    faults = faults or list(disagreements(experiment))
    if faults:
        raise ModelFileError(faults[0].message(path))
    read = experiment.drive_simulation
    base = base_of(read)
    for name in ROTARY_NAMES:
        if name_on(base["axis"], name) not in given:
            place = ("simulation", name_on(base["axis"], name))
            refuse(path, place, None, "a finite number")
    others = {*Drive.__dataclass_fields__} - {*ROTARY_NAMES} - {*NOT_IN_FILES}
    return Drive(**base, **{name: getattr(read, name) for name in others})


def _check_plain(path: Path, content: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    """Refuse texts that a screen would obey: they go into messages and tables."""
    for key in keys:
        value = content.get(key)
        texts = value if isinstance(value, dict) else {"": value}
        for name, text in texts.items():
            if isinstance(text, str) and not is_plain(text):
                place = (key, name) if name else (key,)
                refuse(path, place, text, "text without control characters")


def _card(path: Path, content: Mapping[str, Any]) -> ModelCard:
    units, scales, limits = content["units"], content["scales"], content["input_range"]
    _check_plain(path, content, ("name", "title", "units", "columns", "file_units"))
    if limits[0] > limits[1]:
        refuse(path, ("input_range",), limits, "two numbers, the lower one first")
    return ModelCard(
        name=content["name"],
        title=content["title"],
        columns=Columns(**content["columns"]),
        input_range=(float(limits[0]), float(limits[1])),
        input_unit=units["input"],
        output_unit=units["output"],
        input_scale=float(scales["input"]),
        output_scale=float(scales["output"]),
        file_units=FileUnits(**content["file_units"])
        if "file_units" in content
        else None,
        origin=dict(content["provenance"]),
    )
