"""``hwid predict``: what an exported model makes of an input."""

from pathlib import Path

import click

from hwid_cli.export.json_reader import read_exported
from hwid_cli.export.loading import check_trust
from hwid_cli.export.predict import predict, predict_band
from hwid_cli.export.prediction import (
    InputSource,
    check_target,
    read_input,
    write_prediction,
)
from hwid_cli.files.messages import escaped
from hwid_cli.model.input_range import SAME_LEVEL, outside_share
from hwid_cli.records.exported import Exported, ExportedModel
from hwid_cli.records.maps import OwnFunction
from hwid_cli.records.units import as_percent, behind
from hwid_cli.report.simulation_note import prediction_note
from hwid_cli.report.trust import band_note
from hwid_cli.stages.own_functions import described, functions_of


def _functions(exported: Exported) -> tuple[OwnFunction, ...]:
    """Python that a prediction with a model runs."""
    if not isinstance(exported, ExportedModel):
        return ()
    return functions_of(exported.model)


def predict_file(  # noqa: PLR0913 - one for each option of the command
    model: Path,
    input_file: Path,
    out: Path,
    initial_state: str,
    force: bool,
    run_own_functions: bool,
    band: bool,
    table: str | None,
    input_column: str | None,
    time_column: str | None,
) -> None:
    """Predict the output for an input, with an exported model."""
    exported = read_exported(model)
    check_trust(exported, model, is_trusted=run_own_functions)
    for function in _functions(exported):
        click.echo(f"{escaped(str(model))}: runs {described(function)}")
    source = InputSource(table, input_column, time_column)
    time, values = read_input(input_file, exported, source)
    check_target(out, (model, input_file), is_forced=force)
    card = exported.card
    signal = values * card.input_scale
    predicted = predict(exported, signal, initial_state=initial_state, place=str(model))
    share, lowest, highest = outside_share(signal, card.input_range, same=SAME_LEVEL)
    if share > 0.0:
        low, high = card.input_range
        click.echo(
            f"hwid: {input_file}: the input goes from {lowest:.4g} to {highest:.4g}"
            f"{behind(card.input_unit)}; the model knows {low:.4g} to {high:.4g}, so "
            f"{as_percent(share, 1)} of the samples are extrapolated",
            err=True,
        )
    found = None
    if band:
        place = str(model)
        found = predict_band(exported, signal, initial_state=initial_state, place=place)
    write_prediction(out, exported, time, values, predicted, found)
    click.echo(
        f"{out}: {predicted.size} samples of {card.name}; time in s, predicted in "
        f"{card.output_unit}\n{prediction_note(initial_state, exported.initial_state)}"
    )
    trust = exported.trust
    if found is not None and trust is not None:
        click.echo(band_note(found, card.output_unit, trust.judged_on))
