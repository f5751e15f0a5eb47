"""A configuration file as an ``Experiment``, every key checked.

Keys, types and defaults are the fields of the dataclasses in ``records``; only the
few keys that are written in a shorter way than they are held are read here.
"""

from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from hwid_cli.config.bounds import MOST_ORDER
from hwid_cli.config.checks import check_experiment
from hwid_cli.config.fields import Reader, build, convert
from hwid_cli.config.own_functions import read_section
from hwid_cli.config.place import Place
from hwid_cli.config.requirements import require, require_known
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import (
    CrossvalOptions,
    DiagnoseOptions,
    Experiment,
    GroupOptions,
    IdentifyOptions,
    OrderOptions,
    OrdersOptions,
)
from hwid_cli.records.maps import MAP_KINDS
from hwid_cli.records.model import INITIAL_STATES, JOINS, LOSSES, FitOptions

_ALL = "all"


def load_experiment(path: Path) -> Experiment:
    """Experiment that a YAML file describes.

    Returns
    -------
    Experiment
        ``source`` is the path as given; keys that the file leaves out hold their
        defaults.

    Raises
    ------
    ConfigError
        One line with file, key, value found, what was expected and the next step.
    """
    # PyYAML is loaded only by commands that read a configuration.
    from hwid_cli.config.yaml_text import read_yaml  # noqa: PLC0415, RUF100

    return experiment_of(read_yaml(Path(path)), str(path))


def experiment_of(content: dict[Any, Any], source: str) -> Experiment:
    """Experiment that plain data describe, as a YAML file would hold them.

    Parameters
    ----------
    content : dict
        Sections by name.
    source : str
        Names the file in messages; paths are relative to its folder.

    Raises
    ------
    ConfigError
        As for ``load_experiment``.
    """
    experiment = build(
        Experiment,
        content,
        Place(source),
        readers=_READERS,
        given={"source": source},
    )
    check_experiment(experiment)
    return experiment


def describe_experiment(experiment: Experiment) -> dict[str, Any]:
    """Give the resolved configuration as plain data, for storing and hashing.

    Returns
    -------
    dict
        Every key with its value, defaults included; tuples are lists. ``source`` is
        left out: moving the file changes nothing.
    """
    described = _plain_data(experiment)
    del described["source"]
    return described


def _plain_data(value: Any) -> Any:
    if is_dataclass(value):
        return {
            field.name: _plain_data(getattr(value, field.name))
            for field in fields(value)
        }
    if isinstance(value, tuple | list):
        return [_plain_data(item) for item in value]
    if isinstance(value, dict):
        return {key: _plain_data(item) for key, item in value.items()}
    return value


def _read_orders_axis(value: Any, place: Place) -> tuple[int, ...]:
    """``[first, last]``, one order, or a list of three or more."""
    orders = convert(value, tuple[int, ...], place, readers={})
    for number in orders:
        require(number <= MOST_ORDER, str(place), number, f"orders <= {MOST_ORDER}")
    if len(orders) == 2:
        first, last = orders
        if first > last:
            raise ConfigError(
                f"{place}: found [{first}, {last}]; expected [first, last] with "
                f"first <= last; write [{last}, {first}]"
            )
        return tuple(range(first, last + 1))
    return orders


def _read_names(value: Any, place: Place) -> tuple[str, ...] | None:
    """List of names; ``all`` or nothing is None."""
    if value is None or value == _ALL:
        return None
    return convert(value, tuple[str, ...], place, readers={})


def _word_of(known: tuple[str, ...]) -> Reader:
    """Reader of a key that holds one of a few words."""

    def read(value: Any, place: Place) -> str:
        word: str = convert(value, str, place, readers={})
        require_known([word], known, str(place))
        return word

    return read


def _read_maps(value: Any, place: Place) -> tuple[str, ...]:
    """Kinds of maps that need no file beside them."""
    known = tuple(kind for kind, one in MAP_KINDS.items() if not one.has_function)
    words = convert(value, tuple[str, ...], place, readers={})
    require_known(words, known, str(place))
    return words


def _read_hold_out(value: Any, place: Place) -> str | tuple[str, ...]:
    """``auto`` or a list of names."""
    return (
        "auto"
        if value == "auto"
        else convert(value, tuple[str, ...], place, readers={})
    )


def _read_order(value: Any, place: Place) -> OrderOptions:
    """The section ``order``; keys of ``orders`` in it are told from others."""
    grid = {field.name for field in fields(OrdersOptions)}
    for key in value if isinstance(value, dict) else ():
        if key in grid:
            raise ConfigError(
                f"{place.below(key)}: unknown key; did you mean 'orders.{key}'?"
            )
    return build(OrderOptions, value, place, readers=_READERS)


def _read_fit(content: Any, place: Place) -> FitOptions:
    """Options of a fit; a map that is a section names the user's own function."""
    content = dict(content) if isinstance(content, dict) else content
    given: dict[str, Any] = {"input_function": None, "output_function": None}
    for side in ("input", "output"):
        key = f"{side}_map"
        section = content.get(key) if isinstance(content, dict) else None
        if isinstance(section, dict):
            given[f"{side}_function"] = read_section(section, place.below(key))
            content[key] = "own_function"
    return build(FitOptions, content, place, readers=_READERS, given=given)


_READERS: dict[tuple[type, str], Reader] = {
    (Experiment, "order"): _read_order,
    (Experiment, "fit"): _read_fit,
    (OrderOptions, "maps"): _read_maps,
    (OrdersOptions, "nb"): _read_orders_axis,
    (OrdersOptions, "nk"): _read_orders_axis,
    (FitOptions, "input_map"): _word_of(tuple(MAP_KINDS)),
    (FitOptions, "output_map"): _word_of(tuple(MAP_KINDS)),
    (FitOptions, "initial_state"): _word_of(INITIAL_STATES),
    (FitOptions, "join"): _word_of(JOINS),
    (FitOptions, "loss"): _word_of(LOSSES),
    (IdentifyOptions, "recordings"): _read_names,
    (CrossvalOptions, "recordings"): _read_names,
    (GroupOptions, "start"): _read_names,
    (GroupOptions, "candidates"): _read_names,
    (GroupOptions, "validate"): _read_names,
    (DiagnoseOptions, "recordings"): _read_names,
    (DiagnoseOptions, "effects"): _read_names,
    (DiagnoseOptions, "hold_out"): _read_hold_out,
}
