"""An exported model out of its JSON file, or one clear line that says why not."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.config.simulation_checks import check_simulation
from hwid_cli.errors import ModelFileError
from hwid_cli.export import json_fields as read
from hwid_cli.export.json_fields import Fields
from hwid_cli.export.json_writer import FORMAT, MODEL, SCHEMA_VERSION, SIMULATION
from hwid_cli.export.map_parts import parts_of, portable
from hwid_cli.model.maps.rule import Part
from hwid_cli.records.drive import HOLDS, Controller, Drive
from hwid_cli.records.experiment import Columns, Experiment, SimulationOptions
from hwid_cli.records.exported import (
    Exported,
    ExportedModel,
    ExportedSimulation,
    ModelCard,
)
from hwid_cli.records.maps import MAP_KINDS, OwnFunction, StaticMap
from hwid_cli.records.model import INITIAL_STATES, HammersteinWiener

# Far beyond what a fit gives; a file that asks for more is damaged.
_MOST_ORDER, _MOST_DELAY, _MOST_NUMBERS = 1000, 100_000, 100_000

_HEAD = ("format", "schema_version", "kind", "created_by", "name", "title")
_CARD = ("columns", "units", "scales", "input_range", "provenance")
_MODEL = ("orders", "input_map", "linear_block", "output_map", "initial_state")


def read_exported(path: Path) -> Exported:
    """Read a model that was exported as JSON.

    Raises
    ------
    ModelFileError
        If the file is missing, of another version, or something in it cannot be.
    """
    fields = read.read_json(path)
    _check_format(fields)
    kind = read.choice(fields, "kind", (MODEL, SIMULATION))
    own = _MODEL if kind == MODEL else ("simulation",)
    read.check_keys(fields, (*_HEAD, "sample_time_s", *own, *_CARD))
    sample_time_s = read.number(fields, "sample_time_s", above=0.0)
    card = _card(fields)
    if kind == SIMULATION:
        return ExportedSimulation(card, _drive(fields), sample_time_s)
    return _model(fields, card, sample_time_s)


def _check_format(fields: Fields) -> None:
    found = (fields.values.get("format"), fields.values.get("schema_version"))
    if found != (FORMAT, SCHEMA_VERSION):
        name, version = (str(one)[:40] for one in found)
        raise ModelFileError(
            f"{fields.path}: format {name}, schema_version {version}; expected {FORMAT} "
            f"{SCHEMA_VERSION}; export the model again with this version of hwid"
        )


def _model(fields: Fields, card: ModelCard, sample_time_s: float) -> ExportedModel:
    block = read.section(fields, "linear_block")
    read.check_keys(block, ("numerator", "denominator", "delay"), ("static_gain",))
    numerator = read.vector(block, "numerator", most=_MOST_ORDER)
    denominator = read.vector(block, "denominator", most=_MOST_ORDER + 1)
    delay = read.integer(block, "delay", 0, _MOST_DELAY)
    if numerator.size == 0:
        read.refuse(block, "numerator", "no numbers", "at least one")
    if denominator.size == 0 or denominator[0] != 1.0:
        read.refuse(
            block, "denominator", denominator.tolist(), "a list that starts with 1"
        )
    _check_orders(fields, numerator.size, denominator.size - 1, delay)
    start = read.section(fields, "initial_state")
    read.check_keys(start, ("rule", "free_response"))
    free = read.vector(start, "free_response", most=_MOST_ORDER + _MOST_DELAY)
    n_state = max(denominator.size - 1, numerator.size + delay - 1)
    if free.size not in (0, n_state):
        read.refuse(
            start, "free_response", f"{free.size} numbers", f"{n_state}, or none"
        )
    model = HammersteinWiener(
        input_map=_map(fields, "input_map"),
        numerator=numerator,
        denominator=denominator,
        delay=delay,
        output_map=_map(fields, "output_map"),
        sample_time_s=sample_time_s,
        initial_state=read.choice(start, "rule", INITIAL_STATES),
        free_response=free,
        input_unit=card.input_unit,
        output_unit=card.output_unit,
    )
    gain = block.values.get("static_gain")
    gain = math.inf if gain is None else read.number(block, "static_gain")
    return ExportedModel(card, model, gain)


def _check_orders(fields: Fields, nb: int, nf: int, nk: int) -> None:
    """Refuse orders that the coefficients contradict."""
    orders = read.section(fields, "orders")
    read.check_keys(orders, ("nb", "nf", "nk"))
    for key, found, most in (
        ("nb", nb, _MOST_ORDER),
        ("nf", nf, _MOST_ORDER),
        ("nk", nk, _MOST_DELAY),
    ):
        stated = read.integer(orders, key, 0, most)
        if stated != found:
            read.refuse(orders, key, stated, f"{found}, as linear_block has it")


def _map(fields: Fields, key: str) -> StaticMap:
    given = read.section(fields, key)
    kind = read.choice(given, "kind", tuple(MAP_KINDS))
    form, is_function = portable(kind), MAP_KINDS[kind].has_function
    parts = form.parts
    names = (part.name for part in (*parts, *form.derived_parts))
    read.check_keys(given, ("kind", *names, "domain", *("function",) * is_function))
    numbers = [_part(given, part) for part in parts]
    domain = read.vector(given, "domain", most=2)
    if domain.size != 2 or not domain[0] < domain[1]:
        read.refuse(
            given, "domain", domain.tolist(), "two numbers, the lower one first"
        )
    one = StaticMap(
        kind,
        np.concatenate(numbers) if numbers else np.zeros(0),
        (float(domain[0]), float(domain[1])),
        _function(given) if is_function else None,
    )
    _check_sizes(given, one, numbers)
    for part in form.derived_parts:
        found, size = _part(given, part).size, part.size(one.parameters.size)
        if found != size:
            read.refuse(given, part.name, f"{found} numbers", f"{size}, one a value")
    return one


def _part(given: Fields, part: Part) -> np.ndarray:
    values = read.vector(given, part.name, most=_MOST_NUMBERS)
    if part.is_rising and not (np.diff(values) > 0.0).all():
        read.refuse(given, part.name, values.tolist(), "numbers that rise")
    if part.is_positive and not (values > 0.0).all():
        read.refuse(given, part.name, values.tolist(), "numbers above 0")
    return values


def _check_sizes(given: Fields, one: StaticMap, numbers: list[np.ndarray]) -> None:
    """Refuse parts whose lengths do not fit together."""
    form = portable(one.kind)
    expected = form.lengths
    sizes = [values.size for values in numbers]
    fitting = [values.size for values in parts_of(one).values()]
    names = [part.name for part in form.parts]
    is_allowed = all(
        part.least <= size and (part.most is None or size <= part.most)
        for part, size in zip(form.parts, sizes, strict=True)
    )
    if sizes != fitting or not is_allowed:
        found = ", ".join(f"{n} {name}" for n, name in zip(sizes, names, strict=True))
        read.refuse(given, names[0], found, expected)
    if form.are_limits and numbers[0][0] > numbers[0][1]:
        read.refuse(given, names[0], numbers[0].tolist(), expected)


def _function(given: Fields) -> OwnFunction:
    function = read.section(given, "function")
    read.check_keys(function, ("name", "source", "unit"))
    return OwnFunction(
        read.text(function, "name"),
        read.text(function, "source"),
        read.number(function, "unit", above=0.0),
    )


def _drive(fields: Fields) -> Drive:
    given = read.section(fields, "simulation")
    names = tuple(Drive.__dataclass_fields__)
    read.check_keys(given, names)
    values: dict[str, Any] = {
        name: read.number(given, name)
        for name in names
        if name not in ("effects", "controller", "hold")
        and given.values[name] is not None
    }
    values["hold"] = read.choice(given, "hold", HOLDS)
    values["effects"] = _effects(given)
    if given.values["controller"] is not None:
        values["controller"] = _controller(given)
    # The same rules as for a configuration, and the same messages.
    check_simulation(
        Experiment("", str(fields.path), simulation=SimulationOptions(**values))
    )
    return Drive(**values)


def _effects(given: Fields) -> dict[str, dict[str, float | str]]:
    effects = read.section(given, "effects")
    found: dict[str, dict[str, float | str]] = {}
    for identifier in effects.values:
        one = read.section(effects, identifier)
        found[identifier] = {
            name: value if isinstance(value, str) else read.number(one, name)
            for name, value in one.values.items()
        }
    return found


def _controller(given: Fields) -> Controller:
    controller = read.section(given, "controller")
    read.check_keys(controller, ("position_gain_per_s", "velocity_gain", "limit"))
    limit = controller.values["limit"]
    return Controller(
        read.number(controller, "position_gain_per_s", above=0.0),
        read.number(controller, "velocity_gain", above=0.0),
        None if limit is None else read.number(controller, "limit", above=0.0),
    )


def _card(fields: Fields) -> ModelCard:
    columns, units = read.section(fields, "columns"), read.section(fields, "units")
    scales, origin = read.section(fields, "scales"), read.section(fields, "provenance")
    read.check_keys(columns, ("time", "input", "output", "variable"))
    read.check_keys(units, ("time", "input", "output"))
    read.check_keys(scales, ("input", "output"))
    limits = read.vector(fields, "input_range", most=2)
    if limits.size != 2 or limits[0] > limits[1]:
        read.refuse(
            fields, "input_range", limits.tolist(), "two numbers, the lower one first"
        )
    for key in ("input", "output"):
        if read.number(scales, key) == 0.0:
            read.refuse(scales, key, 0.0, "a number other than 0")
    return ModelCard(
        name=read.text(fields, "name"),
        title=read.text(fields, "title"),
        columns=_columns(columns),
        input_range=(float(limits[0]), float(limits[1])),
        input_unit=read.text(units, "input"),
        output_unit=read.text(units, "output"),
        input_scale=read.number(scales, "input"),
        output_scale=read.number(scales, "output"),
        origin=dict(origin.values),
    )


def _columns(columns: Fields) -> Columns:
    for key, value in columns.values.items():
        is_number = (
            isinstance(value, int) and not isinstance(value, bool) and value >= 0
        )
        if isinstance(value, str) or (value is None and key in ("time", "variable")):
            continue
        if not is_number or key == "variable":
            read.refuse(columns, key, value, "a column's name, or its number from 0")
    return Columns(**columns.values)
