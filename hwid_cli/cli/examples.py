"""Examples at the end of every command's help; a test parses each of them."""

from collections.abc import Mapping

import click

# Commands that are not named take a configuration and nothing else.
EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "init": ("hwid init measured/", "hwid init measured/ --out configs/gun.yaml"),
    "check": ("hwid check gun.yaml", "hwid check gun.yaml --no-timing --jobs 8"),
    "run": ("hwid run gun.yaml", "hwid run gun.yaml --out results/second --jobs 2"),
    "simulate": ("hwid simulate gun.yaml", "hwid simulate gun.yaml --force"),
    "identify": (
        "hwid identify gun.yaml",
        "hwid identify gun.yaml --cache results/cache -v",
    ),
    "crossval": ("hwid crossval gun.yaml", "hwid crossval gun.yaml --quiet"),
    "group": ("hwid group gun.yaml", "hwid group gun.yaml --force"),
    "diagnose": ("hwid diagnose gun.yaml", "hwid diagnose gun.yaml --jobs 1"),
    "export": (
        "hwid export gun.yaml --model step_06/3/7",
        "hwid export gun.yaml --model step_06+step_09/3/7 --format c",
    ),
    "predict": (
        "hwid predict results/gun/models/step_06_3_7.json measured/step_10.csv",
        "hwid predict step_06_3_7.json step_10.csv --initial-state steady",
    ),
    "compare": (
        "hwid compare step_06/3/7 linear:step_06/3/7 --on gun.yaml",
        "hwid compare step_06/3/7 results/old:step_06/3/7 --on gun.yaml "
        "--recording step_10",
    ),
}


def examples_of(name: str) -> tuple[str, ...]:
    """Command lines that show what a command is for."""
    return EXAMPLES.get(name, (f"hwid {name} gun.yaml",))


def add_examples(command: click.Command) -> click.Command:
    """Give a command's help its examples.

    Returns
    -------
    click.Command
        The same one.
    """
    # The mark keeps click from joining the lines.
    shown = [f"  {one}" for one in examples_of(str(command.name))]
    command.epilog = "\n".join(["\b", "Examples:", *shown])
    return command
