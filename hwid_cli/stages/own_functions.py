"""A user's own maps are run and checked once, before anything is computed with them."""

from hwid_cli.errors import ConfigError
from hwid_cli.model.maps.own_function import load
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.maps import MAP_KINDS


def check_own_functions(experiment: Experiment) -> None:
    """Refuse own functions that do not run, or that contradict their derivatives.

    Raises
    ------
    ConfigError
        One line with the key, what was found and what was expected.
    """
    options = experiment.fit
    for key, one in (
        ("input_map", options.of_input),
        ("output_map", options.of_output),
    ):
        if not MAP_KINDS[one.kind].has_function or one.function is None:
            continue
        try:
            load(one.function.name, one.function.source)
        except ValueError as error:
            raise ConfigError(
                f"{experiment.source}: fit.{key}: {one.function.name}: {error}"
            ) from error
