"""How large the numbers of a configuration may be, so that a slip ends in a message.

A typing error of six zeros would else fill the memory, or compute for years.
"""

from typing import Any

from hwid_cli.config.requirements import require
from hwid_cli.records.experiment import Experiment

# Far beyond any use: grids of the literature end at 20 orders, maps at 100 units.
MOST_ORDER = 1000
_MOST_SAMPLES = 10_000_000
_MOST: dict[str, int] = {
    "orders.nb": MOST_ORDER,
    "orders.nk": MOST_ORDER,
    "orders.nf": MOST_ORDER,
    "fit.units": 1000,
    "fit.input_units": 1000,
    "fit.output_units": 1000,
    "fit.degree": 100,
    "order.units": 1000,
    "fit.starts": 1000,
    "fit.max_iterations": 1_000_000,
    "fit.delays": 100_000,
    "fit.linear_block.delay": 100_000,
    "recordings.average": 1_000_000,
    "group.max_level": 1000,
    "diagnose.max_effects": 1000,
    "simulate.samples": _MOST_SAMPLES,
    "simulate.plan.samples": _MOST_SAMPLES,
    "simulate.plan.sine_fade_in_samples": _MOST_SAMPLES,
    "simulate.plan.random_longest_samples": _MOST_SAMPLES,
    "simulate.plan.longest_lead_in_samples": _MOST_SAMPLES,
    "simulate.plan.longest_tail_samples": _MOST_SAMPLES,
    "simulate.plan.step_ramps_samples": _MOST_SAMPLES,
    "simulate.sensors.damaged_samples": _MOST_SAMPLES,
}


def check_bounds(experiment: Experiment) -> None:
    """Refuse numbers that no computer could follow.

    Raises
    ------
    ConfigError
        For the first one.
    """
    for key, most in _MOST.items():
        value: Any = experiment
        for name in key.split("."):
            value = getattr(value, name, None)
        if value is None:
            continue
        for number in value if isinstance(value, tuple) else (value,):
            place = f"{experiment.source}: {key}"
            require(number <= most, place, number, f"at most {most}; correct the key")
