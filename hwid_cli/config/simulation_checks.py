"""What the sections ``simulation`` and ``diagnose`` must agree on.

Names of the effects that a drive's simulation may hold, and of their parameters.
"""

from collections.abc import Iterator, Mapping

from hwid_cli.config.faults import (
    Fault,
    Place,
    missing,
    unknown_key,
    wrong,
    wrong_word,
)
from hwid_cli.records.drive import CHANGING
from hwid_cli.records.experiment import DiagnoseOptions, Experiment

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

# What the electrical circuit has besides its resistance.
_OF_CIRCUIT = ("inductance_H", "back_emf_V_s_per_m")


def circuit_faults(experiment: Experiment) -> Iterator[Fault]:
    """Parts of an electrical circuit that has no resistance."""
    options = experiment.simulation
    if options is None or options.resistance_ohm is not None:
        return
    for name in _OF_CIRCUIT:
        value = getattr(options, name)
        if value:
            yield wrong(
                ("simulation", name),
                value,
                "simulation.resistance_ohm too, because without it the input is the "
                "current",
                "add that key or remove this one",
            )


def controller_faults(experiment: Experiment) -> Iterator[Fault]:
    """A controller without the column that it follows."""
    simulation, recordings = experiment.simulation, experiment.recordings
    if simulation is None or simulation.controller is None or recordings is None:
        return
    if recordings.columns.reference is None:
        yield missing(
            ("recordings", "columns", "reference"),
            "the column that the controller follows",
            "name it, or remove simulation.controller",
            without=("simulation", "controller"),
        )


def effect_faults(experiment: Experiment) -> Iterator[Fault]:
    """Effects of the simulation that there are not, or that lack a parameter."""
    if experiment.simulation is not None:
        for name, parameters in experiment.simulation.effects.items():
            yield from _effect(name, parameters, ("simulation", "effects"))


def _effect(
    name: str, found: Mapping[str, float | str], place: Place
) -> Iterator[Fault]:
    if name not in EFFECT_PARAMETERS:
        yield wrong_word(place, name, EFFECT_PARAMETERS)
        return
    place = (*place, name)
    needed = EFFECT_PARAMETERS[name]
    known = (*needed, *OPTIONAL_PARAMETERS.get(name, ()))
    for key in found:
        if key not in known:
            yield unknown_key((*place, key), known)
    for key in needed:
        is_word = key in WORD_PARAMETERS.get(name, ())
        expected = f"one of {', '.join(CHANGING)}" if is_word else "a finite number"
        if key not in found:
            yield missing((*place, key), expected)
    for key, value in found.items():
        if key in known:
            yield from _parameter(name, key, value, (*place, key))


def _parameter(
    effect: str, key: str, value: float | str, place: Place
) -> Iterator[Fault]:
    if key in WORD_PARAMETERS.get(effect, ()):
        if value not in CHANGING:
            yield wrong_word(place, value, CHANGING)
    elif isinstance(value, str):
        yield wrong(place, value, "a finite number")
    elif key in POSITIVE_PARAMETERS.get(effect, ()) and value <= 0:
        yield wrong(place, value, "a number > 0")
    elif key in NOT_NEGATIVE_PARAMETERS.get(effect, ()) and value < 0:
        yield wrong(place, value, "a number >= 0")
    elif key == "motor_share" and value >= 1:
        yield wrong(place, value, "a share of the mass below 1")


def simulation_faults(experiment: Experiment) -> Iterator[Fault]:
    """A diagnosis without a simulation."""
    if experiment.diagnose is not None and experiment.simulation is None:
        yield missing(
            ("simulation",),
            "the physics model that diagnose judges",
            "add the section (configs/README.md explains it), or remove diagnose",
            without=("diagnose",),
        )


def named_effect_faults(experiment: Experiment) -> Iterator[Fault]:
    """Effects that a diagnosis may name, but that there are not."""
    options = experiment.diagnose
    for effect in (options and options.effects) or ():
        if effect not in EFFECT_PARAMETERS:
            yield wrong_word(("diagnose", "effects"), effect, EFFECT_PARAMETERS)


def held_out_faults(experiment: Experiment) -> Iterator[Fault]:
    """Recordings that are held out of a diagnosis that does not use them, or of all."""
    options = experiment.diagnose or DiagnoseOptions()
    names, held_out = options.recordings, options.hold_out
    if names is None or isinstance(held_out, str):
        return
    place = ("diagnose", "hold_out")
    unknown = [name for name in held_out if name not in names]
    if unknown:
        yield wrong_word(place, unknown[0], names)
    elif len(held_out) >= len(names):
        yield wrong(
            place, held_out, "at least one of diagnose.recordings left to train on"
        )
