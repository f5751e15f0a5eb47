"""A simulation of the user's own, from its section to what the diagnosis works with."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.units import factor_between, quantity_of
from hwid_cli.diagnosis.run_starts import Begun
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.diagnosis.stand_in import with_change
from hwid_cli.diagnosis.standing import as_given, outputs_of_stand_in, stand_in_for
from hwid_cli.diagnosis.tasks import DiagnosisTask
from hwid_cli.errors import ConfigError, ModelFileError, SimulationError
from hwid_cli.export.json_reader import read_exported
from hwid_cli.export.loading import check_trust
from hwid_cli.export.stored_models import read_stored_model
from hwid_cli.model.normalise import rescaled
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.drive import DriveResponse, told_apart
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.exported import ExportedModel
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.programs import (
    ForeignSimulation,
    ModelSimulation,
    RunRequest,
    SimulatorRun,
    StandInChange,
)
from hwid_cli.records.recordings import CalibrationLog, Recording
from hwid_cli.simulations.extended import run_extended
from hwid_cli.simulations.kinds import kind_named
from hwid_cli.store.final_test_results import read_final_test
from hwid_cli.store.result_files import has_left_results


def placed(options: ForeignSimulation, source: str) -> ForeignSimulation:
    """The section with absolute paths, and with the model that it names.

    Parameters
    ----------
    source : str
        The configuration.

    Raises
    ------
    ConfigError
        If a file is missing or holds no model.
    """
    kind = kind_named(options.kind)
    there = kind.placed(options, Path(source).parent)
    if kind.with_model is not None:
        if there.results:
            there, model = _of_results(there, source)
        else:
            model = _of_file(there.file, source)
        try:
            there = kind.with_model(there, model)
        except SimulationError as error:
            raise ConfigError(f"{source}: {error}") from error
    placed_one: ForeignSimulation = there
    return placed_one


def _of_results(options: Any, source: str) -> tuple[Any, HammersteinWiener]:
    """The model of a folder of results: the named one, or the widest; named then."""
    folder = Path(options.results)
    name = options.name or _widest(folder, source)
    try:
        found = read_stored_model(folder, name)
    except ConfigError as error:
        raise ConfigError(f"{source}: simulation.results: {error}") from error
    return replace(options, name=name), found.model


def in_units_of(
    simulation: ForeignSimulation, recording: Recording
) -> ForeignSimulation:
    """A fitted model for recordings in other units than those of its fit.

    Other simulations count in what the configuration says.
    """
    if not isinstance(simulation, ModelSimulation) or simulation.model is None:
        return simulation
    model = simulation.model
    own = (model.input_unit, model.output_unit)
    wanted = (recording.input_unit, recording.output_unit)
    # A side of another quantity, such as counts, stays as it is.
    factors = [factor_between(*pair) or 1.0 for pair in zip(own, wanted, strict=True)]
    if factors == [1.0, 1.0]:
        return simulation
    of_input, of_output = factors
    converted = replace(
        rescaled(model, of_input, of_output),
        input_unit=own[0] if of_input == 1.0 else wanted[0],
        output_unit=own[1] if of_output == 1.0 else wanted[1],
    )
    return replace(simulation, model=converted)


def _widest(folder: Path, source: str) -> str:
    """The model that covers most recordings in the final test, the nearest of several."""
    path = folder / "results.h5"
    if not path.is_file() or not has_left_results(path, "test"):
        raise ConfigError(
            f"{source}: simulation.results: found no results of hwid test in {folder}; "
            "run 'hwid test' first, or name the model with simulation.name"
        )
    final = read_final_test(path)
    rmsd = np.where(np.isfinite(final.rmsd), final.rmsd, np.inf)
    order = np.lexsort((np.median(rmsd, axis=1), -final.covers))
    return final.models[int(order[0])]


def _of_file(file: str, source: str) -> HammersteinWiener:
    """The model of an exported file."""
    try:
        found = read_exported(Path(file))
        step = "name its file under fit.input_map or fit.output_map"
        check_trust(found, Path(file), is_trusted=False, step=step)
    except ModelFileError as error:
        raise ConfigError(f"{source}: simulation.file: {error}") from error
    if not isinstance(found, ExportedModel):
        raise ConfigError(
            f"{source}: simulation.file: {file} is a physics simulation; "
            "expected a Hammerstein-Wiener model; write its section with kind: drive"
        )
    return replace(found.model, sample_time_s=found.sample_time_s)


_VELOCITIES = {"velocity", "angular velocity"}
# Fewer recordings than these say too little alone.
_FEWEST_UNCOVERED = 3


def uncovered_by(
    options: SimulationOptions | ForeignSimulation, known: Sequence[str]
) -> tuple[str, ...] | None:
    """Recordings that the model of a folder of results does not cover.

    Parameters
    ----------
    options : SimulationOptions or ForeignSimulation
        Placed.
    known : sequence of str
        Recordings at hand.

    Returns
    -------
    tuple of str or None
        None where all are to be used: another kind of simulation, or hardly any that it
        does not cover.
    """
    is_model = kind_named(options.kind).with_model is not None
    results = getattr(options, "results", "") if is_model else ""
    if not results:
        return None
    path = Path(results) / "results.h5"
    if not has_left_results(path, "test"):
        return None
    final = read_final_test(path)
    name = getattr(options, "name", "")
    if name not in final.models:
        return None
    row = final.models.index(name)
    rmsd = np.where(np.isfinite(final.rmsd[row]), final.rmsd[row], np.inf)
    open_ones = {
        name
        for name, one in zip(final.recordings, rmsd, strict=True)
        if one > final.threshold
    }
    found = tuple(name for name in known if name in open_ones)
    return found if len(found) >= _FEWEST_UNCOVERED else None


def content_of(options: ForeignSimulation, source: str) -> dict[str, Any]:
    """Everything that a simulation's answers depend on, as plain data.

    Raises
    ------
    ConfigError
        If it cannot be found.
    """
    about = asdict(options)
    for name in ("file", "results", "model", "time_limit_s"):
        about.pop(name, None)
    kind = kind_named(options.kind)
    if kind.content is not None:
        try:
            about["sha256"] = kind.content(options)
        except SimulationError as error:
            raise ConfigError(f"{source}: {error}") from error
    return about


def simulator_of(
    options: ForeignSimulation,
    recordings: Sequence[Recording],
    logs: Sequence[CalibrationLog],
) -> Simulator:
    """What the diagnosis works with."""
    kind = kind_named(options.kind)
    return Simulator(
        capabilities=kind.capabilities(options),
        run=None if kind.run is None else partial(kind.run, options),
        given=_given_outputs(recordings, logs) if kind.run is None else {},
        free=getattr(options, "free", {}),
        values=getattr(options, "values", {}),
        effects=options.effects,
        change=getattr(options, "stand_in", StandInChange()),
        output=_compared(recordings),
    )


def _compared(recordings: Sequence[Recording]) -> str:
    """What the recordings are of; one of ``records.drive.OUTPUTS``."""
    quantities = {quantity_of(one.output_unit) for one in recordings[:1]}
    return "velocity" if quantities & _VELOCITIES else "position"


def _given_outputs(
    recordings: Sequence[Recording], logs: Sequence[CalibrationLog]
) -> dict[str, np.ndarray]:
    """What the simulation gave; the offset of the sensor is none of its own."""
    offsets = {one.name: one.output_offset for one in logs}
    return {
        one.name: np.array(one.reference) + offsets.get(one.name, 0.0)
        for one in recordings
        if one.reference is not None
    }


def simulated(
    options: ForeignSimulation,
    recordings: Sequence[Recording],
    logs: Sequence[CalibrationLog],
    diagnosed: DiagnoseOptions,
) -> tuple[DriveResponse, ...]:
    """What a simulation makes of the recordings' inputs, beside what was measured.

    What was added to it before is put into it.

    Parameters
    ----------
    diagnosed : DiagnoseOptions
        How a diagnosis divides the recordings.
    """
    simulator = simulator_of(options, recordings, logs)
    begun = as_given(recordings, simulator, diagnosed, in_turn)
    outputs = _outputs(begun)
    found = []
    for one in recordings:
        output, start = outputs[one.name], begun.starts.above.get(one.name, 0.0)
        rms = float(np.sqrt(np.mean(np.square(one.output - output))))
        time_s = one.sample_time_s * np.arange(one.n_samples)
        found.append(
            DriveResponse(one.name, time_s, one.input, one.output, output, rms, start)
        )
    return tuple(found)


def _outputs(begun: Begun) -> dict[str, np.ndarray]:
    """What the simulation makes of the recordings' inputs, with what was added to it."""
    simulator = begun.runs.simulator
    run = simulator.run
    if not simulator.is_extended:
        return begun.beside_recordings([one.output for one in begun.given])
    if run is None:
        return outputs_of_stand_in(begun)
    plain = stand_in_for(begun)
    effects = {name: dict(values) for name, values in simulator.effects.items()}
    changed = with_change(plain, simulator.change)
    drives = (plain, replace(changed, effects=effects))
    places, has_force = begun.starts.of_places, simulator.capabilities.force

    def moved(asked: RunRequest) -> SimulatorRun:
        found = run(asked)
        return replace(found, output=found.output + places.get(asked.name, 0.0))

    outputs = []
    for one in begun.problem.signals:
        request = RunRequest(
            one.name, one.sample_time_s, one.driven_by, np.zeros(0), simulator.values
        )
        found = run_extended(moved, request, drives, has_force=has_force)
        outputs.append(found.output)
    return begun.beside_recordings(outputs)


def in_turn(tasks: Sequence[DiagnosisTask], *, keep: bool) -> list[Any]:  # noqa: ARG001
    """Results of tasks, computed here and kept nowhere."""
    return [one.function(*one.arguments) for one in tasks]


def extended_foreign(
    diagnosis: Diagnosis, options: ForeignSimulation
) -> ForeignSimulation:
    """The section with the effects that were found and the fitted parameters."""
    effects = [
        (
            effect.own or effect.id,
            {one.name: one.text or one.value for one in effect.parameters},
        )
        for effect in (*diagnosis.present, *diagnosis.effects)
    ]
    fitted = {one.name: one.after for one in diagnosis.base}
    with_them = kind_named(options.kind).with_fitted(options, fitted)
    found: dict[str, Any] = {"effects": told_apart(effects)}
    if hasattr(options, "stand_in"):
        found["stand_in"] = diagnosis.stand_in
    extended: ForeignSimulation = replace(with_them, **found)
    return extended
