"""The files of a case: recordings and configuration in one folder, the truth elsewhere."""

import json
from pathlib import Path

import numpy as np

from tests.blind.campaign import measured_case
from tests.blind.machine import Machine

HEADER = "time_s,current_A,displacement_m"


def write_case(case, folder, truth_file, max_effects=3):
    """Write recordings and configuration; return the configuration's path and the truth.

    The truth goes to a file of its own, which the program never sees.
    """
    folder, truth_file = Path(folder), Path(truth_file)
    if folder.resolve() in truth_file.resolve().parents:
        raise ValueError(f"{truth_file}: the truth must stay outside {folder}")
    recordings, truth = measured_case(case)
    raw = folder / "raw"
    raw.mkdir(parents=True, exist_ok=True)
    for one in recordings:
        columns = np.column_stack([one.time_s, one.current_A, one.displacement_m])
        np.savetxt(
            raw / f"{one.name}.csv",
            columns,
            fmt="%.9e",
            delimiter=",",
            header=HEADER,
            comments="",
        )
    config = folder / "config.yaml"
    config.write_text(config_text(truth["simulation"], max_effects), encoding="utf-8")
    truth_file.parent.mkdir(parents=True, exist_ok=True)
    truth_file.write_text(json.dumps(truth, indent=1), encoding="utf-8")
    return config, truth


def config_text(simulation, max_effects):
    """A configuration that names no case, so that nothing can be read from it."""
    parameters = "".join(f"  {name}: {value!r}\n" for name, value in simulation.items())
    return (
        "name: drive\n\n"
        "recordings:\n"
        "  files: raw/*.csv\n"
        "  columns: {time: time_s, input: current_A, output: displacement_m}\n"
        '  kind: {step: "step_*", sine: "sine_*", random: "random_*"}\n\n'
        "simulation:\n"
        "  kind: drive\n"
        f"  mass_kg: {Machine().mass_kg!r}\n"
        f"{parameters}"
        "  effects: {}\n\n"
        f"diagnose: {{recordings: all, hold_out: auto, max_effects: {max_effects}}}\n"
    )
