"""What the sections ``simulation`` and ``diagnose`` must agree on.

Names of the effects that a drive's simulation may hold, and of their parameters.
"""

from collections.abc import Mapping

from hwid_cli.config.requirements import require, require_distinct, require_known
from hwid_cli.errors import ConfigError
from hwid_cli.files.messages import did_you_mean
from hwid_cli.records.drive import CHANGING, HOLDS, STARTS
from hwid_cli.records.experiment import DiagnoseOptions, Experiment, SimulationOptions

# Every parameter that an effect has to state; the law of each is in docs/effects.md.
EFFECT_PARAMETERS: dict[str, tuple[str, ...]] = {
    "coulomb_friction": ("force_N",),
    "asymmetric_friction": ("force_forward_N", "force_backward_N"),
    "stribeck_friction": ("force_N", "static_excess_N", "velocity_m_per_s"),
    "hysteresis": ("force_N", "yield_m"),
    "quadratic_drag": ("drag_N_s2_per_m2",),
    "cubic_stiffness": ("stiffness_N_per_m3",),
    "quadratic_stiffness": ("stiffness_N_per_m2",),
    "end_stop": ("position_m", "stiffness_N_per_m"),
    "one_sided_stop": ("position_m", "stiffness_N_per_m"),
    "spring_gap": ("half_gap_m",),
    "gear_backlash": ("half_gap_m", "stiffness_N_per_m"),
    "output_backlash": ("half_gap_m",),
    "second_mode": ("mass_kg", "frequency_Hz", "damping_ratio"),
    "cogging": ("amplitude_N", "period_m"),
    "constant_load": ("force_N",),
    "input_dead_zone": ("threshold_A",),
    "input_saturation": ("limit_A",),
    "rate_limit": ("rate_A_per_s",),
    "input_delay": ("delay_s",),
    "actuator_lag": ("time_constant_s",),
    "force_constant_saturation": ("loss_at_reference",),
    "supply_sag": ("loss_at_reference",),
    "thermal_gain_loss": ("loss_at_reference", "time_constant_s"),
    "voltage_limit": ("limit_A", "slope_A_s_per_m"),
    "sensor_quadratic": ("coefficient",),
    "sensor_cubic": ("coefficient",),
    "sensor_drift": ("drift_m_per_s",),
    "periodic_force": ("amplitude_N", "frequency_Hz"),
    "parameter_change": ("which", "spread"),
}
# What an effect may state beyond that; 0, or half of the mass, where it does not.
OPTIONAL_PARAMETERS: dict[str, tuple[str, ...]] = {
    "cogging": ("phase_rad",),
    "periodic_force": ("phase_rad",),
    "gear_backlash": ("motor_share",),
}
# Parameters that a law divides by, or that have no meaning at 0 or below.
POSITIVE_PARAMETERS: dict[str, tuple[str, ...]] = {
    "stribeck_friction": ("velocity_m_per_s",),
    "hysteresis": ("yield_m",),
    "end_stop": ("position_m",),
    "spring_gap": ("half_gap_m",),
    "gear_backlash": ("half_gap_m", "stiffness_N_per_m", "motor_share"),
    "output_backlash": ("half_gap_m",),
    "second_mode": ("mass_kg", "frequency_Hz"),
    "cogging": ("period_m",),
    "input_dead_zone": ("threshold_A",),
    "input_saturation": ("limit_A",),
    "rate_limit": ("rate_A_per_s",),
    "input_delay": ("delay_s",),
    "actuator_lag": ("time_constant_s",),
    "thermal_gain_loss": ("time_constant_s",),
    "voltage_limit": ("limit_A",),
    "periodic_force": ("frequency_Hz",),
}
# Parameters that only switch their law off at 0.
NOT_NEGATIVE_PARAMETERS: dict[str, tuple[str, ...]] = {
    "coulomb_friction": ("force_N",),
    "asymmetric_friction": ("force_forward_N", "force_backward_N"),
    "stribeck_friction": ("force_N",),
    "hysteresis": ("force_N",),
    "end_stop": ("stiffness_N_per_m",),
    "one_sided_stop": ("stiffness_N_per_m",),
    "second_mode": ("damping_ratio",),
    "voltage_limit": ("slope_A_s_per_m",),
    "parameter_change": ("spread",),
}
# Parameters that are a word and no number.
WORD_PARAMETERS: dict[str, tuple[str, ...]] = {"parameter_change": ("which",)}


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
    require_known((name,), EFFECT_PARAMETERS, at)
    at = f"{at}.{name}"
    needed = EFFECT_PARAMETERS[name]
    known = (*needed, *OPTIONAL_PARAMETERS.get(name, ()))
    for key in found:
        if key not in known:
            raise ConfigError(f"{at}.{key}: unknown key; {did_you_mean(key, known)}")
    for key in needed:
        is_word = key in WORD_PARAMETERS.get(name, ())
        expected = f"one of {', '.join(CHANGING)}" if is_word else "a finite number"
        if key not in found:
            raise ConfigError(f"{at}.{key}: missing; expected {expected}; add the key")
    for key, value in found.items():
        _check_parameter(name, key, value, f"{at}.{key}")


def _check_parameter(effect: str, key: str, value: float | str, at: str) -> None:
    if key in WORD_PARAMETERS.get(effect, ()):
        if value not in CHANGING:
            raise ConfigError(f"{at}: found {value!r}; {did_you_mean(value, CHANGING)}")
    elif isinstance(value, str):
        require(False, at, value, "a finite number")
    elif key in POSITIVE_PARAMETERS.get(effect, ()):
        require(value > 0, at, value, "a number > 0")
    elif key in NOT_NEGATIVE_PARAMETERS.get(effect, ()):
        require(value >= 0, at, value, "a number >= 0")
    if key == "motor_share" and not isinstance(value, str):
        require(value < 1, at, value, "a share of the mass below 1")


def _check_diagnose(options: DiagnoseOptions, at: str) -> None:
    for name in ("max_effects", "skip_samples"):
        value = getattr(options, name)
        require(value >= 0, f"{at}.{name}", value, "an integer >= 0")
    require_known((options.initial_state,), STARTS, f"{at}.initial_state")
    if options.effects is not None:
        require_known(options.effects, EFFECT_PARAMETERS, f"{at}.effects")
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
