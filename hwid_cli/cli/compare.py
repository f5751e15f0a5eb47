"""``hwid compare``: several models side by side on the same recordings."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hwid_cli.cli.calibrate import calibrate_stage
from hwid_cli.cli.options import Choices

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session
    from hwid_cli.records.comparison import Comparison, NamedModel
    from hwid_cli.records.model import Fit, Orders

_LINEAR = "linear:"
# Exported models that say less than their JSON.
_OTHER_FORMATS = (".c", ".m", ".mat", ".fmu")


@click.command("compare")
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
def command(
    models: tuple[str, ...], recordings: tuple[str, ...], **values: Any
) -> None:
    r"""Compare models on the same recordings: fit percent and RMSD side by side.

    \b
    A MODEL is
      step_06/3/7           one of CONFIG's own models (identified first if need be)
      results/old:step_06/3/7   one of another folder of results
      linear:step_06/3/7    a linear model of that recording, fitted for the comparison
      models/step_06.json   an exported model

    Writes compare.csv and figures/compare.png.
    """
    from hwid_cli.cli.session import open_session, say, show
    from hwid_cli.report.comparison import comparison_tables

    session = open_session(Choices(**values), "compare")
    comparison = _compared(session, models, recordings)
    had_results = (session.out / "compare.csv").exists()
    _write(session, comparison)
    show(session, *comparison_tables(comparison))
    say(
        session,
        f"\nresults: {session.out / 'compare.csv'}, "
        f"{session.out / 'figures' / 'compare.png'}"
        f"{' (those of the last comparison are replaced)' * had_results}",
    )


def _compared(
    session: "Session", models: tuple[str, ...], names: tuple[str, ...]
) -> "Comparison":
    from hwid_cli.stages.compare import compare_models
    from hwid_cli.stages.selection import select_recordings

    calibrated = calibrate_stage(session).recordings
    judges = select_recordings(calibrated, names or None, key="--recording")
    found = [_model(session, text) for text in models]
    return compare_models(found, judges)


def _model(session: "Session", text: str) -> "NamedModel":
    """Model that a word of the command line names."""
    from hwid_cli.errors import ConfigError
    from hwid_cli.export.stored_models import (
        chosen_model,
        read_exported_model,
        read_stored_model,
    )

    if text.startswith(_LINEAR):
        return _linear(session, text)
    if text.lower().endswith(".json"):
        return read_exported_model(Path(text))
    if text.lower().endswith(_OTHER_FORMATS):
        raise ConfigError(
            f"{text}: expected the name of a model or a .json file, the only exported "
            "models that can be compared; export it with --format json"
        )
    # The last colon: a folder of Windows has one of its own.
    folder, colon, name = text.rpartition(":")
    if colon:
        return read_stored_model(Path(folder), name)
    return chosen_model(_own_fits(session, name), name, name)


def _own_fits(session: "Session", name: str) -> "dict[str, Fit]":
    """Fits of the configuration's own stages by name, as far as they are needed."""
    from hwid_cli.cli.group import group_stage
    from hwid_cli.cli.identify import identify_stage
    from hwid_cli.export.stored_models import fit_name

    nk_role = session.experiment.orders.nk_role
    if "+" in name and session.experiment.group is not None:
        fits = group_stage(session).fits
    else:
        fits = identify_stage(session).fits
    return {fit_name(one, nk_role): one for one in fits if one is not None}


def _linear(session: "Session", text: str) -> "NamedModel":
    """Linear model of one or several recordings of the configuration, fitted now."""
    from hwid_cli.cli.session import stage_tasks
    from hwid_cli.export.stored_models import chosen_model
    from hwid_cli.stages.compare import fit_linear
    from hwid_cli.stages.selection import select_recordings

    name, orders = _split(session, text)
    chosen = select_recordings(
        calibrate_stage(session).recordings, name.split("+"), key=text
    )
    with stage_tasks(session, "compare", 1, "fits", part="linear") as settings:
        found = fit_linear(chosen, orders, session.experiment.fit, settings)
    return chosen_model({text: found}, text, text)


def _split(session: "Session", text: str) -> "tuple[str, Orders]":
    from hwid_cli.errors import ConfigError
    from hwid_cli.records.model import Orders

    parts = text.removeprefix(_LINEAR).rsplit("/", 2)
    if len(parts) != 3 or not all(part.isdecimal() for part in parts[1:]):
        raise ConfigError(
            f"{text}: expected linear:RECORDING/NB/NK, such as linear:step_06/2/3"
        )
    nb, nk = int(parts[1]), int(parts[2])
    grid = session.experiment.orders
    if grid.nk_role == "delay":
        return parts[0], Orders(nb, grid.nf or 0, nk)
    return parts[0], Orders(nb, nk, 1)


def _write(session: "Session", comparison: "Comparison") -> None:
    from hwid_cli.files.atomic import replace_file
    from hwid_cli.files.csv_tables import write_compare_csv
    from hwid_cli.report.figures.comparison import comparison_figure
    from hwid_cli.report.figures.style import as_png

    write_compare_csv(session.out / "compare.csv", comparison)
    png = as_png(comparison_figure(comparison))
    replace_file(session.out / "figures" / "compare.png", png)
