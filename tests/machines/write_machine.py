"""Writes a machine's folder: recordings as CSV, experiment.yaml, truth.json.

The configuration knows the mass and, within their errors, the base's other parameters. The
truth holds the hidden effects, the answers that do them justice, the true numbers and how
far the machine is from what a simulation without its effects can reach.
"""

import json
import shutil
from pathlib import Path

import numpy as np
import yaml

from tests.machines.gap import projected_gap, refitted_gap
from tests.machines.machine import Machine, Recordings, record
from tests.machines.plants import Base

NAMES = {
    "mass": "mass_kg",
    "damping": "damping_N_s_per_m",
    "stiffness": "stiffness_N_per_m",
    "force_constant": "force_constant_N_per_A",
}


def configuration(machine: Machine) -> dict:
    """What stands in experiment.yaml."""
    base = machine.base
    if machine.folded:
        kt, ohms = base.force_constant, base.resistance
        base = Base(base.mass, base.damping + kt * kt / ohms, base.stiffness, kt / ohms)
    simulation = {"kind": "drive"}
    for name, key in NAMES.items():
        value = float(np.mean(getattr(base, name))) * machine.off.get(name, 1.0)
        simulation[key] = float(f"{value:.6g}")
    if base.resistance is not None:
        simulation["resistance_ohm"] = base.resistance
    kinds = {}
    for one in machine.signals:
        kinds.setdefault(one.kind, []).append(one.name)
    (input_name, input_factor), (output_name, output_factor) = (
        machine.input_unit,
        machine.output_unit,
    )
    recordings = {
        "files": "recordings/*.csv",
        "columns": {"time": "time_s", "input": input_name, "output": output_name},
        "kind": kinds,
    }
    for key, factor in (("input_scale", input_factor), ("output_scale", output_factor)):
        if factor != 1.0:
            recordings[key] = 1.0 / factor
    if "angle" in output_name:
        recordings["output_unit"] = "rad"
    if machine.jitter:
        recordings["resample"] = True
    return {
        "name": machine.name,
        "recordings": recordings,
        "simulation": simulation | machine.simulation,
        "diagnose": machine.settings,
    }


def accepted(machine: Machine) -> dict:
    """The part of a truth that says which answers do it justice."""
    answers = machine.answers
    return {
        "full": [list(one) for one in answers.full],
        "near": [list(one) for one in answers.near],
        "partial": [list(one) for one in answers.partial],
        "honest_refusal": answers.honest_refusal,
        "may_be_complete": bool(answers.full),
    }


def truth(machine: Machine, recordings: Recordings) -> dict:
    """What stands in truth.json."""
    hold = machine.simulation.get("hold", "linear")
    names = [one.effect for one in machine.hidden]
    alone = {}
    if len(set(names)) > 1:
        for name in names:
            alone[name] = projected_gap(
                machine, recordings, lambda other, name=name: other != name
            )
    return {
        "name": machine.name,
        "family": machine.family,
        "story": machine.story,
        "hidden": names,
        **accepted(machine),
        "parameters": [
            {"effect": one.effect, "values": one.parameters}
            for one in machine.hidden
            if one.parameters
        ],
        "noise_rms": recordings.noise_rms,
        "gap_over_noise": refitted_gap(machine, recordings, hold),
        "gap_without": alone,
    }


def write(machine: Machine, folder: Path) -> dict:
    """Write a machine's folder anew, and give its truth."""
    recordings = record(machine)
    if folder.exists():
        shutil.rmtree(folder)
    (folder / "recordings").mkdir(parents=True)
    header = f"time_s,{machine.input_unit[0]},{machine.output_unit[0]}"
    for n, (signal, length) in enumerate(
        zip(machine.signals, recordings.lengths, strict=True)
    ):
        table = np.stack(
            [
                recordings.times[:, n],
                recordings.logged[:, n] * machine.input_unit[1],
                recordings.readings[:, n] * machine.output_unit[1],
            ],
            axis=1,
        )
        path = folder / "recordings" / f"{signal.name}.csv"
        np.savetxt(path, table[:length], "%.9g", ",", header=header, comments="")
    text = yaml.safe_dump(configuration(machine), sort_keys=False)
    (folder / "experiment.yaml").write_text(text)
    told = truth(machine, recordings)
    (folder / "truth.json").write_text(json.dumps(told, indent=1))
    return told
