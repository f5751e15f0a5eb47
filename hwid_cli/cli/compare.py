"""``hwid compare``: several models side by side on the same recordings."""

from pathlib import Path
from typing import Any

from hwid_cli.cli.driver import result_of, show_blocks
from hwid_cli.cli.linear_models import linear_model
from hwid_cli.cli.options import Choices
from hwid_cli.cli.session import Session, open_session
from hwid_cli.errors import ConfigError, UntrustedFunctionError
from hwid_cli.export.stored_models import (
    chosen_model,
    fit_name,
    read_exported_model,
    read_stored_model,
)
from hwid_cli.files.atomic import replace_file
from hwid_cli.files.csv_tables import write_compare_csv
from hwid_cli.records.best_model import LINEAR
from hwid_cli.records.comparison import Comparison, NamedModel
from hwid_cli.records.model import Fit
from hwid_cli.report.comparison import comparison_tables
from hwid_cli.report.figures.comparison import comparison_figure
from hwid_cli.report.figures.style import as_png
from hwid_cli.stages.compare import compare_models
from hwid_cli.stages.own_functions import (
    allow_all_functions,
    described,
    functions_of,
)
from hwid_cli.stages.selection import select_recordings

# Exported models that say less than their JSON.
_OTHER_FORMATS = (".c", ".m", ".mat", ".fmu")


def compare(
    models: tuple[str, ...],
    recordings: tuple[str, ...],
    run_own_functions: bool,
    **values: Any,
) -> None:
    """Compare models on the same recordings: fit percent and RMSD."""
    session = open_session(Choices(**values), "compare")
    if run_own_functions:
        allow_all_functions(session.experiment)
    comparison = _compared(session, models, recordings)
    had_results = (session.out / "compare.csv").exists()
    _write(session, comparison)
    show_blocks(session, comparison_tables(comparison))
    session.say(
        f"\nresults: {session.out / 'compare.csv'}, "
        f"{session.out / 'figures' / 'compare.png'}"
        f"{' (those of the last comparison are replaced)' * had_results}",
    )


def _compared(
    session: Session, models: tuple[str, ...], names: tuple[str, ...]
) -> Comparison:

    calibrated = result_of(session, "calibrate").recordings
    chosen = select_recordings(calibrated, names or None, key="--recording")
    found = [_model(session, text) for text in models]
    for one in found:
        for function in functions_of(one.model):
            session.say(f"{one.name}: runs {described(function)}")
    return compare_models(found, chosen)


def _model(session: Session, text: str) -> NamedModel:
    """Model that a word of the command line names."""
    if text.startswith(LINEAR):
        found = linear_model(session, text, "compare")
        return chosen_model({text: found}, text, text)
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
        return _stored_model(Path(folder), name)
    return chosen_model(_own_fits(session, name), name, name)


def _stored_model(folder: Path, name: str) -> NamedModel:
    """Model of another folder of results."""
    try:
        return read_stored_model(folder, name)
    except UntrustedFunctionError as error:
        step = "or leave to run what you have read: add --run-own-functions"
        raise UntrustedFunctionError(f"{error}, {step}") from error


def _own_fits(session: Session, name: str) -> dict[str, Fit]:
    """Fits of the configuration's own stages by name, as far as they are needed."""
    nk_role = session.experiment.orders.nk_role
    if "+" in name and session.experiment.group is not None:
        fits = result_of(session, "group").fits
    else:
        fits = result_of(session, "identify")
    return {fit_name(one, nk_role): one for one in fits if one is not None}


def _write(session: Session, comparison: Comparison) -> None:

    write_compare_csv(session.out / "compare.csv", comparison)
    png = as_png(comparison_figure(comparison))
    replace_file(session.out / "figures" / "compare.png", png)
