"""A user's own maps: announced, and run and checked once, before anything uses them.

The first run is in a process of its own, which a function may end or keep busy.
"""

import hashlib
from collections.abc import Callable, Iterator
from typing import Any

from hwid_cli.errors import ConfigError
from hwid_cli.files.isolated_process import IsolatedReader, Labelled, serve
from hwid_cli.model.maps.own_function import load
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.maps import MAP_KINDS, OwnFunction
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.store.trusted_functions import allow_only

# Digits of the hash that tell one text from another on the screen.
_SHOWN = 12


def check_own_functions(
    experiment: Experiment, announce: Callable[[str], None]
) -> None:
    """Refuse own functions that do not run, or that contradict their derivatives.

    Stored results may hold these functions from now on, and no other ones.

    Parameters
    ----------
    announce : callable
        Told in one line what is going to run.

    Raises
    ------
    ConfigError
        One line with the key, what was found and what was expected.
    """
    named = _named(experiment)
    allow_only(named.values())
    for key, function in named.items():
        place = f"{experiment.source}: fit.{key}"
        announce(f"{place}: runs {described(function)}, as the configuration says")
        try:
            _try_out(function)
            load(function.name, function.source)
        except ValueError as error:
            raise ConfigError(f"{place}: {function.name}: {error}") from error


def _named(experiment: Experiment) -> dict[str, OwnFunction]:
    """Functions that a configuration names, by their keys."""
    options = experiment.fit
    sides = {"input_map": options.of_input, "output_map": options.of_output}
    return {
        key: one.function
        for key, one in sides.items()
        if MAP_KINDS[one.kind].has_function and one.function is not None
    }


def allow_all_functions(experiment: Experiment) -> None:
    """Take functions of stored models too that the configuration does not name."""
    allow_only(_named(experiment).values(), has_leave=True)


def described(function: OwnFunction) -> str:
    """A function as messages name it.

    Examples
    --------
    >>> described(OwnFunction("curve", "curve = 1"))
    "the Python function 'curve' (text 6ca93a0d21a3)"
    """
    text = hashlib.sha256(function.source.encode()).hexdigest()[:_SHOWN]
    return f"the Python function {function.name!r} (text {text})"


def functions_of(model: HammersteinWiener) -> tuple[OwnFunction, ...]:
    """Functions that run when a model is simulated."""
    maps = (model.input_map, model.output_map)
    return tuple(one.function for one in maps if one.function is not None)


def _try_out(function: OwnFunction) -> None:
    """Run a function for the first time where it can do no harm to a campaign."""
    process = IsolatedReader("hwid_cli.stages.own_functions", "it")
    try:
        process.ask({"name": function.name, "source": function.source})
    finally:
        process.end()


def _answer(request: dict[str, Any]) -> Iterator[Labelled]:
    load(request["name"], request["source"])
    yield from ()


if __name__ == "__main__":
    serve(_answer, most_memory=None)
