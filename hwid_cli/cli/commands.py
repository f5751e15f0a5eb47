"""What the command line accepts: every command with its options and its help.

Light, so that ``hwid --help`` and ``hwid COMMAND --help`` stay fast: what a command does
is a function of another module of this room, loaded when the command runs.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from hwid_cli.cli.options import stage_options
from hwid_cli.stages.table import STAGES

# New objects among which Python looks for garbage, [-]. With its own number, 700, reading
# thousands of stored records, all of which stay, spends a tenth of its time looking.
_NEW_OBJECTS = 50_000


def _run(place: str, *values: Any, **options: Any) -> None:
    """Call the function ``module.name`` of this room."""
    module, name = place.rsplit(".", 1)
    with _seldom_collected():
        getattr(import_module(f"hwid_cli.cli.{module}"), name)(*values, **options)


@contextmanager
def _seldom_collected() -> Iterator[None]:
    """Have Python look for garbage less often."""
    before = gc.get_threshold()
    gc.set_threshold(_NEW_OBJECTS, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


@click.command("init")
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("experiment.yaml"),
    show_default=True,
    metavar="FILE",
    help="Configuration to write.",
)
@click.option(
    "--units",
    type=click.Choice(("si", "file")),
    default="si",
    show_default=True,
    help="Whether thresholds, limits and results are in SI, or in the units of the files, "
    "such as mA and mm.",
)
@click.option("--force", is_flag=True, help="Replace a configuration that is there.")
@click.option("-q", "--quiet", is_flag=True, help="Say errors only.")
def init(*values: Any, **options: Any) -> None:
    """Write a commented starter configuration for measurements.

    Guesses columns, units, sample time, kinds, recipes and orders from names and content,
    says why, and asks nothing: the file runs at once, and every line of it is yours to
    correct.
    """
    _run("init.write_starter_configuration", *values, **options)


@click.command("check")
@click.argument("config", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder of the results.  [default: results/<name>]",
)
@click.option(
    "--cache",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder of what was computed before.  [default: cache in that folder]",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes to estimate for.  [default: one for each core]",
)
@click.option(
    "--timing/--no-timing",
    default=True,
    help="Time one fit on these data for the estimate (about two seconds).",
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Write recordings, stages and seconds as JSON; tables go to stderr.",
)
def check(*values: Any, **options: Any) -> None:
    """Check a configuration and its data, and say what would run.

    Lists the recordings with what looks odd in them, the tasks of every stage, what is in
    the cache already, and an estimate of time and disk. Computes no result and writes
    nothing. Every problem is one line; the exit code is 1 if there is any.
    """
    _run("check.check", *values, **options)


@click.command("run")
@stage_options
def run(*values: Any, **options: Any) -> None:
    """Run all stages that the configuration names, in order.

    With --force, all of them ignore their cached results.
    """
    _run("run.run", *values, **options)


@click.command("report")
@stage_options
def report(*values: Any, **options: Any) -> None:
    """Show whatever stages have run on one page.

    Runs no stage. Writes report.html, which needs nothing else to be looked at, and its
    figures as figures/*.png.
    """
    _run("report.report", *values, **options)


# The mark keeps click from joining the lines; a docstring could not hold it.
_COMPARED = """Compare models on the same recordings: fit percent and RMSD.

\b
A MODEL is
  step_06/3/7           one of CONFIG's own models (identified first if need be)
  results/old:step_06/3/7   one of another folder of results
  linear:step_06/3/7    a linear model of that recording, fitted for the comparison
  models/step_06.json   an exported model

Writes compare.csv and figures/compare.png.
"""


@click.command("compare", help=_COMPARED)
@click.argument("models", nargs=-1, required=True, metavar="MODEL [MODEL]...")
@click.option(
    "--on",
    "config",
    type=click.Path(path_type=Path),
    required=True,
    metavar="CONFIG",
    help="Configuration whose recordings judge the models.",
)
@click.option(
    "--recording",
    "recordings",
    multiple=True,
    metavar="NAME",
    help="Judge on this recording only; may be given several times.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder of the results.  [default: results/<name>]",
)
@click.option(
    "--cache",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder of what was computed before.  [default: cache in that folder]",
)
@click.option(
    "--jobs", type=click.IntRange(min=1), metavar="N", help="Processes that compute."
)
@click.option("-q", "--quiet", is_flag=True, help="Say errors only.")
@click.option(
    "--run-own-functions",
    is_flag=True,
    help="Run Python that models of other folders or files carry; only where you trust "
    "them.",
)
def compare(*values: Any, **options: Any) -> None:
    """Compare models on the same recordings."""
    _run("compare.compare", *values, **options)


FORMATS = ("json", "mat", "c", "fmu", "python", "simulink", "modelica")


@click.command("export")
@click.option(
    "--model",
    metavar="NAME",
    help="The model: step_06/3/7, a group step_06+step_09/3/7, a published name "
    "NLHW-Step-6-3-7-1, 'best' for the one that 'hwid run' says to take, or 'simulation' "
    "for the physics simulation that 'hwid diagnose' extended.",
)
@click.option(
    "--diagnosis",
    is_flag=True,
    help="The simulation that 'hwid diagnose' extended; the same as --model simulation.",
)
@click.option(
    "--format",
    "file_format",
    type=click.Choice(FORMATS),
    default="json",
    show_default=True,
    help="json for 'hwid predict', mat with a script for MATLAB, C source or an FMU. Of a "
    "simulation of your own with what a diagnosis added: python (a module), fmu (around "
    "yours), or the effects alone as c, simulink (a C S-function) or modelica.",
)
@stage_options
def export(*values: Any, **options: Any) -> None:
    """Write a model as a file that runs elsewhere.

    Writes models/NAME.json, .mat (and .m), .c, .fmu or .py below the folder of the
    results, and prints the path; docs/export.md describes the formats.
    """
    _run("export.export", *values, **options)


_STARTS = ("fitted", "steady", "empty")


@click.command("predict")
@click.argument("model", type=click.Path(path_type=Path), metavar="MODEL.json")
@click.argument("input_file", type=click.Path(path_type=Path), metavar="INPUT.csv")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("prediction.csv"),
    show_default=True,
    metavar="FILE",
    help="File of the prediction.",
)
@click.option(
    "--initial-state",
    type=click.Choice(_STARTS),
    default="fitted",
    show_default=True,
    help="How it starts: by the model's own rule (a model with an estimated state like "
    "the first recording of its fit), in equilibrium with the first input, or empty.",
)
@click.option(
    "--force", is_flag=True, help="Replace a file that is no prediction, too."
)
@click.option(
    "--run-own-functions",
    is_flag=True,
    help="Run Python that the model's file carries; only for files that you trust.",
)
@click.option(
    "--band",
    is_flag=True,
    help="Add the columns lower and upper: a band that holds 90 % of what would be "
    "measured, and say how much of the prediction rests on data.",
)
@click.option(
    "--input",
    "input_column",
    metavar="NAME",
    help="Column of the input, where the file names it otherwise than the model's own "
    "files; a number counts as in a configuration.",
)
@click.option(
    "--time", "time_column", metavar="NAME", help="The same for the column of the time."
)
@click.option(
    "--table",
    metavar="NAME",
    help="Sheet, group, struct or array of the file that holds the input, where there are "
    "several.",
)
def predict(*values: Any, **options: Any) -> None:
    """Predict the output for an input, with an exported model.

    Reads the columns that the model's file names, and writes time, the input and the
    predicted output.
    """
    _run("predict.predict_file", *values, **options)


def _of_stage(name: str) -> click.Command:
    """Command that brings a stage up to date and shows it."""
    # One stage can do more: simulate what was measured.
    place = "simulate.simulate" if name == "simulate" else "driver.run_command"
    run = stage_options(partial(_run, place, name))
    return click.command(name, help=STAGES[name])(run)


# How `hwid --help` lists them: every command once.
GROUPS = {
    "Start here": ("init", "check", "run"),
    "Stages, each after those that it needs": tuple(STAGES),
    "Models": ("compare", "export", "predict"),
    "More": ("report",),
}

# In the order in which they work.
COMMANDS = {
    one.name: one
    for one in (
        init,
        check,
        run,
        *map(_of_stage, STAGES),
        report,
        compare,
        export,
        predict,
    )
}
