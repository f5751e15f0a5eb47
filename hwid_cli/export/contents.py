"""Which model leaves the program, and what is said about it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from difflib import get_close_matches
from typing import Any

import numpy as np

from hwid_cli.diagnosis.problem import drive_of, prepare
from hwid_cli.drive.simulation import drive_effects, parameter_vector
from hwid_cli.errors import ConfigError, ModelFileError
from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.model.linear_block import poles, static_gain
from hwid_cli.model.pole_bound import is_within
from hwid_cli.records.experiment import (
    DiagnoseOptions,
    RecordingsOptions,
    SimulationOptions,
)
from hwid_cli.records.exported import ExportedModel, ExportedSimulation, ModelCard
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording

# Name of the physics simulation among the models.
SIMULATION = "simulation"
# Names in the form of the published tables begin so.
TITLE = "NLHW"
# Names that are listed where the asked one is not there.
_LISTED = 3


def find_fit(
    asked: str, named: Mapping[str, Fit], titles: Mapping[str, str]
) -> tuple[str, Fit]:
    """Fit of a name, in either of the forms in which models are named.

    Parameters
    ----------
    asked : str
        ``step_06/3/7`` or ``NLHW-Step-6-3-7-1``.
    titles : mapping of str to str
        Names by the other form.

    Raises
    ------
    ConfigError
        If there is no such model, with those whose names come near; or its fit failed.
    """
    name = titles.get(asked, asked)
    if name not in named:
        known = titles if asked.startswith(TITLE) else named
        raise ConfigError(
            f"--model {asked}: no such model; {_near(asked, tuple(known))}"
        )
    fit = named[name]
    if fit.model is None:
        raise ConfigError(
            f"--model {asked}: its fit failed ({fit.message}); expected a model; "
            "choose another one"
        )
    return name, fit


def _near(asked: str, known: Sequence[str]) -> str:
    # Other orders of the same recordings come nearer than other recordings.
    same = [one for one in known if one.rpartition("/")[0] == asked.rpartition("/")[0]]
    same = same or [one for one in known if one.split("/")[0] == asked.split("/")[0]]
    close = get_close_matches(asked, same or known, n=_LISTED, cutoff=0.5)
    if close:
        return f"did you mean {' or '.join(repr(one) for one in close)}?"
    more = ", ..." if len(known) > _LISTED else ""
    return f"expected one of {', '.join(known[:_LISTED])}{more}"


def export_model(
    fit: Fit,
    recordings: Sequence[Recording],
    options: RecordingsOptions,
    *,
    name: str,
    title: str,
    origin: Mapping[str, Any],
) -> ExportedModel:
    """A fitted model as it leaves the program.

    Parameters
    ----------
    recordings : sequence of Recording
        Calibrated; those of the fit among them.
    options : RecordingsOptions
        Which columns of a file the model reads, in which units, and what takes them to
        those of the recordings.
    origin : mapping
        Configuration, hashes and versions; the fit is added.

    Raises
    ------
    ValueError
        If the fit has no model.
    """
    if fit.model is None:
        raise ValueError(f"{name}: a fit without a model cannot be exported")
    used = [one for one in recordings if one.name in fit.identified_on]
    about = {
        **origin,
        "recordings": _hashes(used),
        "fit": {
            "identified_on": list(fit.identified_on),
            "options": asdict(fit.options),
            "status": fit.status,
            "message": fit.message,
            "iterations": fit.iterations,
            "rmsd": fit.rmsd,
            "fit_percent": fit.fit_percent,
        },
    }
    inputs = [one.input for one in used]
    card = _card(name, title, used, options, inputs, about)
    return completed(card, fit.model)


def completed(card: ModelCard, model: HammersteinWiener) -> ExportedModel:
    """A model with the numbers that a program elsewhere should not have to compute."""
    return ExportedModel(
        card,
        outlined_model(model),
        static_gain(model.numerator, model.denominator),
    )


def export_simulation(
    simulation: SimulationOptions,
    recordings: Sequence[Recording],
    options: RecordingsOptions,
    diagnose: DiagnoseOptions,
    *,
    origin: Mapping[str, Any],
) -> ExportedSimulation:
    """A physics simulation as it leaves the program.

    Parameters
    ----------
    simulation : SimulationOptions
        As a diagnosis extended it.
    recordings : sequence of Recording
        That it was compared with; at least one.
    """
    problem = prepare(recordings, simulation, diagnose, ())
    drive = drive_of(simulation, problem.signals)
    inputs = [one.driven_by for one in problem.signals]
    about = {**origin, "recordings": _hashes(recordings)}
    card = _card(SIMULATION, SIMULATION, recordings, options, inputs, about)
    return ExportedSimulation(
        card if drive.controller is None else _following_reference(card),
        drive,
        recordings[0].sample_time_s,
        parameter_vector(drive, drive_effects(drive)),
    )


def card_of_program(
    recordings: Sequence[Recording],
    options: RecordingsOptions,
    *,
    origin: Mapping[str, Any],
) -> ModelCard:
    """What belongs to an export of a simulation of the user's own.

    Parameters
    ----------
    recordings : sequence of Recording
        That it was compared with; at least one.
    """
    inputs = [one.input for one in recordings]
    about = {**origin, "recordings": _hashes(recordings)}
    return _card(SIMULATION, SIMULATION, recordings, options, inputs, about)


def _following_reference(card: ModelCard) -> ModelCard:
    """Under a controller the input is the reference, in the unit of the output."""
    reference = card.columns.reference
    if reference is None:
        return card
    return replace(
        card,
        columns=replace(card.columns, input=reference),
        input_unit=card.output_unit,
        input_scale=card.output_scale,
        file_units=card.file_units
        and replace(card.file_units, input=card.file_units.output),
    )


def _hashes(recordings: Iterable[Recording]) -> dict[str, str]:
    return {one.name: one.sha256 for one in recordings}


def _card(
    name: str,
    title: str,
    recordings: Sequence[Recording],
    options: RecordingsOptions,
    inputs: Sequence[np.ndarray],
    origin: Mapping[str, Any],
) -> ModelCard:
    return ModelCard(
        name=name,
        title=title,
        columns=options.columns,
        input_range=(
            min(float(one.min()) for one in inputs),
            max(float(one.max()) for one in inputs),
        ),
        input_unit=recordings[0].input_unit,
        output_unit=recordings[0].output_unit,
        input_scale=options.input_scale,
        output_scale=options.output_scale,
        file_units=options.units,
        origin=origin,
    )


def check_stability(model: HammersteinWiener, place: str) -> None:
    """Refuse a model whose output grows without an input.

    Parameters
    ----------
    place : str
        File that holds it, for the message.

    Raises
    ------
    ModelFileError
        With the pole that lies furthest out.
    """
    # As the fit has it: poles that lie together at 1, as of a free axis, are not sharp.
    if not is_within(model.denominator, 1.0):
        found = poles(model.denominator)
        raise ModelFileError(
            f"{place}: linear_block.denominator: has a pole of magnitude "
            f"{abs(found[0]):.6g}; expected all inside the unit circle; choose a stable "
            "model"
        )
