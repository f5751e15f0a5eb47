"""What a diagnosis added to a simulation, as one C file: a force for each of its steps."""

from hwid_cli.diagnosis.stand_in import lag_before
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import drive_effects, parameter_vector
from hwid_cli.errors import ConfigError
from hwid_cli.export.c_drive import drive_source
from hwid_cli.export.c_source import card_text, comment_lines, filled, number
from hwid_cli.export.names import in_comment
from hwid_cli.records.axis import way_unit
from hwid_cli.records.exported import ExportedSimulation, ModelCard
from hwid_cli.simulations.extended import ExtendedSimulation


def acts_at_force(extended: ExtendedSimulation) -> bool:
    """Whether what the effects make enters at the simulation's force input."""
    enters = {CATALOGUE[one].enters for one in drive_effects(extended.stand_in)}
    is_command = bool(enters) and not enters - {"command", "output"}
    return extended.base.force_input is not None and not is_command


def effect_source(
    extended: ExtendedSimulation, card: ModelCard, sample_time_s: float
) -> str:
    """Text of a C file with the effects alone, to be called beside a simulation.

    Parameters
    ----------
    card : ModelCard
        Of the simulation.
    sample_time_s : float, [s]
        Step of the simulation between two calls.

    Returns
    -------
    str
        ASCII.

    Raises
    ------
    ConfigError
        If an effect cannot be told step by step.
    """
    stand_in, plain = extended.stand_in, extended.plain
    if "elastic_coupling:motor" in drive_effects(stand_in):
        raise ConfigError(
            "--format c: simulation.effects.elastic_coupling.sensor motor: the position "
            "of the simulation is not that of the mass; expected load; use --format python"
        )
    vector = parameter_vector(stand_in, drive_effects(stand_in))
    exported = ExportedSimulation(card, stand_in, sample_time_s, vector)
    effects = ", ".join(stand_in.effects) or "nothing"
    at_force = acts_at_force(extended)
    lag = lag_before(plain, tuple(drive_effects(stand_in)))
    if lag and not at_force:
        raise ConfigError(
            "simulation.force_input: missing, and forces act behind a lag of "
            f"{lag:.3g} s that the simulation's input passes; expected an input for "
            "forces, step by step; give the simulation one, or use --format python"
        )
    acts_as = (
        "the force [N] that acts in that step"
        if at_force
        else f"what is added to that input [{card.input_unit}]"
    )
    return filled(
        "effect.c",
        {
            **card_text(card, sample_time_s),
            "effects": comment_lines(effects),
            "way_unit": in_comment(
                way_unit(card.output_unit)
                if plain.output == "velocity"
                else card.output_unit
            ),
            "acts_as": in_comment(acts_as),
            "in_unit": "" if at_force else " / plain_gain",
            "drive": drive_source(exported),
            "mass": number(plain.mass_kg),
            "damping": number(plain.damping_N_s_per_m),
            "stiffness": number(plain.stiffness_N_per_m),
            "gain": number(plain.force_constant_N_per_A),
        },
    )
