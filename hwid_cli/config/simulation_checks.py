"""What the sections ``simulation`` and ``diagnose`` must agree on.

Which effects a drive's simulation may hold, and with which parameters, says the catalogue.
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
from hwid_cli.config.own_effects import own_id_faults, own_values_faults
from hwid_cli.drive.catalogue import (
    CATALOGUE,
    configured_effects,
    entry_of,
    public_id,
)
from hwid_cli.drive.effect import Stated
from hwid_cli.records.axis import axis_of, name_on
from hwid_cli.records.drive import BASE_AND_MASS, BASE_PARAMETERS, FORCES
from hwid_cli.records.experiment import DiagnoseOptions, Experiment
from hwid_cli.records.own_effects import is_own
from hwid_cli.records.programs import ForeignSimulation
from hwid_cli.simulations.kinds import kind_named

# What the electrical circuit has besides its resistance.
_OF_CIRCUIT = ("inductance_H", "back_emf_V_s_per_m", "back_emf_V_s_per_rad")
# A parameter that may move by all of its value is not known, [-].
_LARGEST_TOLERANCE = 1.0

# What a section may look like, for messages.
SIMULATION_EXAMPLE = (
    "simulation: {mass_kg: 0.3, damping_N_s_per_m: 15, stiffness_N_per_m: 0, "
    "force_constant_N_per_A: 5}"
)


def circuit_faults(experiment: Experiment) -> Iterator[Fault]:
    """Parts of an electrical circuit that has no resistance."""
    options = experiment.drive_simulation
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


def effect_circuit_faults(experiment: Experiment) -> Iterator[Fault]:
    """Effects of an electrical circuit that has no resistance."""
    options = experiment.drive_simulation
    if options is None or options.resistance_ohm is not None:
        return
    needs = {public_id(one.id) for one in CATALOGUE.values() if one.needs_circuit}
    for name in options.effects:
        if name in needs:
            yield Fault(
                ("simulation", "effects", name),
                "found without simulation.resistance_ohm, so that the input is the "
                "current",
                "simulation.resistance_ohm too",
                "add that key or remove this effect",
            )


def controller_faults(experiment: Experiment) -> Iterator[Fault]:
    """A controller without the column that it follows."""
    simulation, recordings = experiment.drive_simulation, experiment.recordings
    if simulation is None or simulation.controller is None or recordings is None:
        return
    if recordings.columns.reference is None:
        yield missing(
            ("recordings", "columns", "reference"),
            "the column that the controller follows",
            "name it, or remove simulation.controller",
            without=("simulation", "controller"),
        )


def known_faults(experiment: Experiment) -> Iterator[Fault]:
    """Known parameters that no re-fit moves, and tolerances that are none."""
    options = experiment.drive_simulation
    if options is None:
        return
    recordings = experiment.recordings
    # Where the input is the force itself the mass is fitted.
    is_force = recordings is not None and recordings.input_unit in FORCES
    inside = BASE_AND_MASS if is_force else BASE_PARAMETERS
    names = [name_on(axis_of(options), one) for one in inside]
    names += ["inductance_H"] if options.inductance_H > 0 else []
    names += ["resistance_ohm"] if options.resistance_ohm is not None else []
    for name, tolerance in options.known.items():
        place = ("simulation", "known")
        if name not in (*names, *inside):
            yield wrong_word(place, name, names)
        elif not 0 <= tolerance <= _LARGEST_TOLERANCE:
            yield wrong((*place, name), tolerance, "a share from 0 to 1, such as 0.05")


def cascade_faults(experiment: Experiment) -> Iterator[Fault]:
    """A cascade around a position that nobody measures."""
    options = experiment.drive_simulation
    if options is None or options.controller is None or options.output == "position":
        return
    gain = options.controller.position_gain_per_s
    if gain is not None:
        yield wrong(
            ("simulation", "controller", "position_gain_per_s"),
            gain,
            "a controller of the velocity (proportional_gain, integral_gain, "
            "derivative_gain), because simulation.output is velocity",
            "correct one of the two",
        )


def effect_faults(experiment: Experiment) -> Iterator[Fault]:
    """Effects of the simulation that there are not, or that lack a parameter."""
    if experiment.simulation is not None:
        place = ("simulation", "effects")
        entries: set[str] = set()
        own = experiment.own_effects
        for name, parameters in experiment.simulation.effects.items():
            if is_own(name):
                # An exported simulation names the formula in the id.
                yield from own_id_faults(name, parameters, place)
                continue
            if name in own:
                yield from own_values_faults(name, own[name], parameters, place)
                continue
            if public_id(name) in own:
                yield Fault(
                    place, f"{public_id(name)} is listed twice", step="remove one"
                )
                continue
            if public_id(name) not in configured_effects() and own:
                yield wrong_word(place, public_id(name), [*own, *configured_effects()])
                continue
            faults = list(_effect(name, parameters, place))
            yield from faults
            entry = None if faults else entry_of(name, parameters)
            if entry is not None and entry.id in entries:
                yield _same_effect(public_id(name), place)
            entries |= set() if entry is None else {entry.id}


def _same_effect(name: str, place: Place) -> Fault:
    """An effect that is there twice, but that the simulation holds once."""
    twice = {public_id(one.id) for one in CATALOGUE.values() if one.beside}
    words = [one.name for one in configured_effects()[name] if one.words]
    expected = f"twice only {', '.join(sorted(twice))}"
    if words:
        expected = f"each {name} with another {words[0]}"
    return Fault(place, f"{name} is listed twice", expected, "remove one")


def _effect(
    name: str, found: Mapping[str, float | str], place: Place
) -> Iterator[Fault]:
    effects = configured_effects()
    if public_id(name) not in effects:
        yield wrong_word(place, public_id(name), effects)
        return
    place = (*place, name)
    known = {one.name: one for one in effects[public_id(name)]}
    for key in found:
        if key not in known:
            yield unknown_key((*place, key), known)
    # Of several shapes of a law, the one that is stated says what it needs.
    entry = entry_of(name, found)
    for one in known.values() if entry is None else entry.stated_keys():
        if one.is_needed and one.name not in found:
            words = f"one of {', '.join(one.words)}"
            expected = words if one.words else "a finite number"
            yield missing((*place, one.name), expected)
    for key, value in found.items():
        if key in known:
            yield from _parameter(known[key], value, (*place, key))


def _parameter(one: Stated, value: float | str, place: Place) -> Iterator[Fault]:
    if one.words:
        if value not in one.words:
            yield wrong_word(place, value, one.words)
    elif isinstance(value, str):
        yield wrong(place, value, "a finite number")
    else:
        for limit in one.limits:
            if not limit.holds(value):
                yield wrong(place, value, limit.expected)
                return


def simulated_faults(experiment: Experiment) -> Iterator[Fault]:
    """Outputs of a simulation that no column holds, and a column that nobody asked for."""
    recordings = experiment.recordings
    if recordings is None:
        return
    foreign = experiment.foreign_simulation
    is_asked = foreign is not None and _is_read(foreign)
    place = ("recordings", "columns", "simulated")
    if is_asked and recordings.columns.simulated is None:
        yield missing(
            place,
            "the column with what the simulation gave",
            "name it, or choose another simulation.kind",
            without=("simulation",),
        )
    elif recordings.columns.simulated is not None and not is_asked:
        yield wrong(
            place,
            recordings.columns.simulated,
            "simulation.kind: outputs too, which compares it with the output",
            "add that section or remove this key",
        )


def _is_read(simulation: ForeignSimulation) -> bool:
    """Whether what it gives stands in the recordings, because it cannot be run."""
    return not kind_named(simulation.kind).capabilities(simulation).run


def simulation_faults(experiment: Experiment) -> Iterator[Fault]:
    """A diagnosis without a simulation."""
    if experiment.diagnose is not None and experiment.simulation is None:
        yield missing(
            ("simulation",),
            "the physics model that diagnose judges",
            f"add it, such as '{SIMULATION_EXAMPLE}', or remove diagnose",
            without=("diagnose",),
        )


def named_effect_faults(experiment: Experiment) -> Iterator[Fault]:
    """Effects that a diagnosis may name, but that there are not."""
    options = experiment.diagnose
    for effect in (options and options.effects) or ():
        known = [*experiment.own_effects, *configured_effects()]
        if effect not in known:
            yield wrong_word(("diagnose", "effects"), effect, known)


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
