"""What the sections ``simulation`` and ``diagnose`` must agree on.

Which effects a drive's simulation may hold, and with which parameters, says the catalogue.
"""

from collections.abc import Mapping

from hwid_cli.config.requirements import require, require_distinct, require_known
from hwid_cli.drive.catalogue import configured_effects
from hwid_cli.drive.effect import Stated
from hwid_cli.errors import ConfigError
from hwid_cli.files.messages import did_you_mean
from hwid_cli.records.drive import HOLDS, STARTS
from hwid_cli.records.experiment import DiagnoseOptions, Experiment, SimulationOptions

_KIND = "drive"
_POSITIVE = (
    "mass_kg",
    "force_constant_N_per_A",
    "reference_current_A",
    "reference_displacement_m",
    "resistance_ohm",
)
_NOT_NEGATIVE = (
    "damping_N_s_per_m",
    "stiffness_N_per_m",
    "inductance_H",
    "back_emf_V_s_per_m",
)
# What the electrical circuit has besides its resistance.
_OF_CIRCUIT = ("inductance_H", "back_emf_V_s_per_m")


def check_simulation(experiment: Experiment) -> None:
    """Refuse a physics model, or a diagnosis of it, that cannot be computed.

    Parameters
    ----------
    experiment : Experiment
        ``source`` names the file in messages.

    Raises
    ------
    ConfigError
        For the first value that cannot be used.
    """
    file, simulation = experiment.source, experiment.simulation
    if simulation is not None:
        _check_drive(simulation, f"{file}: simulation")
        _check_controller(experiment)
        for name, parameters in simulation.effects.items():
            _check_effect(name, parameters, f"{file}: simulation.effects")
    if experiment.diagnose is not None:
        if simulation is None:
            raise ConfigError(
                f"{file}: simulation: missing; expected the physics model that "
                "diagnose judges; add the section (configs/README.md explains it), or "
                "remove diagnose"
            )
        _check_diagnose(experiment.diagnose, f"{file}: diagnose")


def _check_drive(options: SimulationOptions, at: str) -> None:
    require_known((options.kind,), (_KIND,), f"{at}.kind")
    require_known((options.hold,), HOLDS, f"{at}.hold")
    for name in _POSITIVE:
        value = getattr(options, name)
        require(value is None or value > 0, f"{at}.{name}", value, "a number > 0")
    for name in _NOT_NEGATIVE:
        value = getattr(options, name)
        require(value is None or value >= 0, f"{at}.{name}", value, "a number >= 0")
    if options.resistance_ohm is None:
        for name in _OF_CIRCUIT:
            value = getattr(options, name)
            require(
                not value,
                f"{at}.{name}",
                value,
                "simulation.resistance_ohm too, because without it the input is the "
                "current; add that key or remove this one",
            )


def _check_controller(experiment: Experiment) -> None:
    simulation, recordings = experiment.simulation, experiment.recordings
    if simulation is None or simulation.controller is None or recordings is None:
        return
    if recordings.columns.reference is None:
        raise ConfigError(
            f"{experiment.source}: recordings.columns.reference: missing; expected the "
            "column that the controller follows; name it, or remove "
            "simulation.controller"
        )


def _check_effect(name: str, found: Mapping[str, float | str], at: str) -> None:
    effects = configured_effects()
    require_known((name,), effects, at)
    at = f"{at}.{name}"
    known = {one.name: one for one in effects[name]}
    for key in found:
        if key not in known:
            raise ConfigError(f"{at}.{key}: unknown key; {did_you_mean(key, known)}")
    for one in known.values():
        if one.is_needed and one.name not in found:
            expected = (
                f"one of {', '.join(one.words)}" if one.words else "a finite number"
            )
            raise ConfigError(
                f"{at}.{one.name}: missing; expected {expected}; add the key"
            )
    for key, value in found.items():
        _check_stated(known[key], value, f"{at}.{key}")


def _check_stated(one: Stated, value: float | str, at: str) -> None:
    if one.words:
        if value not in one.words:
            raise ConfigError(
                f"{at}: found {value!r}; {did_you_mean(value, one.words)}"
            )
    elif isinstance(value, str):
        require(False, at, value, "a finite number")
    else:
        for limit in one.limits:
            require(limit.holds(value), at, value, limit.expected)


def _check_diagnose(options: DiagnoseOptions, at: str) -> None:
    for name in ("max_effects", "skip_samples"):
        value = getattr(options, name)
        require(value >= 0, f"{at}.{name}", value, "an integer >= 0")
    require_known((options.initial_state,), STARTS, f"{at}.initial_state")
    if options.effects is not None:
        require_known(options.effects, configured_effects(), f"{at}.effects")
        require_distinct(options.effects, f"{at}.effects")
    names = options.recordings
    if names is not None:
        require(len(names) > 0, f"{at}.recordings", [], "at least one recording")
        require_distinct(names, f"{at}.recordings")
    held_out = options.hold_out
    if isinstance(held_out, str):
        return
    require(len(held_out) > 0, f"{at}.hold_out", [], "auto, or at least one recording")
    require_distinct(held_out, f"{at}.hold_out")
    if names is not None:
        require_known(held_out, names, f"{at}.hold_out")
        require(
            len(held_out) < len(names),
            f"{at}.hold_out",
            list(held_out),
            "at least one of diagnose.recordings left to train on",
        )
