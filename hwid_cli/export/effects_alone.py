"""Effects alone, as text for other tools: C, an S-function of Simulink, Modelica."""

from pathlib import Path

from hwid_cli.export.c_source import filled
from hwid_cli.export.effect_source import effect_source
from hwid_cli.export.modelica import modelica_text
from hwid_cli.files.atomic import replace_file
from hwid_cli.records.exported import ModelCard
from hwid_cli.simulations.extended import ExtendedSimulation

# Steps of the effects in one sample of the recordings: a force is held in each of them.
STEPS_A_SAMPLE = 10


def write_effects(
    folder: Path,
    file_format: str,
    extended: ExtendedSimulation,
    card: ModelCard,
    sample_time_s: float,
) -> list[Path]:
    """Write the effects of an extended simulation without the simulation.

    Parameters
    ----------
    file_format : str
        ``c``, ``simulink`` (a C S-function) or ``modelica``.
    sample_time_s : float, [s]
        Of the recordings.

    Returns
    -------
    list of Path
        What was written, the file to begin with last.

    Raises
    ------
    ConfigError
        If the format cannot hold an effect.
    CacheError
        If a file cannot be written.
    """
    if file_format == "modelica":
        texts = {"effects.mo": modelica_text(extended, card)}
    else:
        source = effect_source(extended, card, sample_time_s / STEPS_A_SAMPLE)
        texts = {"effect.c": source}
        if file_format == "simulink":
            texts["effect_sfun.c"] = filled("effect_sfun.c", {})
    for name, text in texts.items():
        replace_file(folder / name, text.encode("ascii"))
    return [folder / name for name in texts]
