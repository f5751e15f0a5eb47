"""Groups of recordings: grids that begin with the members' models against grids that do not.

Steps of the virtual gun, 7500 samples each, every recording with its own initial state, 10
x 10 orders. Both kinds of fits run in this process, one after the other, so that their
ratio holds on a busy machine too. The widest model of each grid is judged as in
``configs/model1.yaml``: on the twelve steps that may join, covered below 0.01 m.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.experiment import CalibrateOptions, GroupOptions, OrdersOptions
from hwid_cli.records.machines import GunMachine, GunPlan
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import RawRecording
from hwid_cli.stages.calibrate import calibrate_all
from hwid_cli.stages.group_levels import GroupPlan, fit_level
from hwid_cli.stages.identify import identify_all
from hwid_cli.stages.simulate import simulate_machine
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers, run_tasks

GROUPS = (
    ("step_03", "step_13"),
    ("step_12", "step_13"),
    ("step_04", "step_06"),
    ("step_01", "step_14", "step_15"),
    ("step_02", "step_07", "step_13"),
)
TWELVE = tuple(f"step_{n:02d}" for n in (1, 2, 3, 4, 6, 7, 8, 9, 12, 13, 14, 15))
THRESHOLD = 0.01


def measured_steps():
    """Calibrated recordings of the twelve steps, by name."""
    machine = replace(GunMachine(), plan=replace(GunPlan(), only=TWELVE))
    raws = [
        RawRecording(
            one.name, one.input, one.output, machine.plan.sample_time_s, one.kind
        )
        for one in simulate_machine(machine)
    ]
    recipe = CalibrateOptions(step=("cut", "output_offset"), samples=7500)
    recordings, _ = calibrate_all(raws, recipe)
    return {one.name: one for one in recordings}


def grid_of(recordings, group, orders, singles):
    """Fits of a group for all orders, and the seconds that they took.

    Without models of single recordings they begin from nothing.
    """
    plan = GroupPlan(
        recordings=tuple(recordings.values()),
        start=group[:1],
        candidates=group,
        validate=TWELVE,
        orders=orders,
        fit_options=FitOptions(join="experiments"),
        options=GroupOptions(warm_start=bool(singles)),
        threshold=THRESHOLD,
    )
    settings = RunSettings(store=MemoryStore(), workers=Workers(jobs=1))
    begun = time.process_time()
    (fits,) = fit_level(
        plan,
        [group],
        singles,
        lambda _level, _unit, _total, work: work(
            lambda tasks: run_tasks(tasks, settings)
        ),
    )
    return fits, time.process_time() - begun


def widest(fits, recordings):
    """Steps that the widest model of a grid covers."""
    return max(
        sum(
            rmsd(one.output, validation_output(fit.model, one)) < THRESHOLD
            for one in recordings.values()
        )
        for fit in fits
        if fit.model is not None
    )


def main():
    """Fit the grid of every group in both ways."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--orders", type=int, default=10)
    counts = tuple(range(1, parser.parse_args().orders + 1))
    orders = OrdersOptions(nb=counts, nk=counts)
    recordings = measured_steps()
    settings = RunSettings(store=MemoryStore(), workers=Workers(jobs=1))
    singles = {
        name: list(identify_all([recordings[name]], orders, FitOptions(), settings))
        for name in sorted({name for group in GROUPS for name in group})
    }
    print(
        f"{len(counts)} x {len(counts)} orders; RMSD is that of the warm fit against the "
        "cold one of the same orders"
    )
    print(
        f"{'group':26}{'cold s':>8}{'warm s':>8}{'cold/warm':>11}"
        f"{'RMSD 25 %':>11}{'50 %':>7}{'75 %':>7}{'covers cold':>13}{'warm':>6}"
    )
    times = []
    for group in GROUPS:
        cold, cold_s = grid_of(recordings, group, orders, {})
        warm, warm_s = grid_of(recordings, group, orders, singles)
        ratio = np.array([one.rmsd for one in warm]) / [one.rmsd for one in cold]
        low, middle, high = np.quantile(ratio, [0.25, 0.5, 0.75])
        print(
            f"{'+'.join(group):26}{cold_s:8.1f}{warm_s:8.1f}{cold_s / warm_s:11.1f}"
            f"{low:11.2f}{middle:7.2f}{high:7.2f}{widest(cold, recordings):13d}"
            f"{widest(warm, recordings):6d}",
            flush=True,
        )
        times.append((cold_s, warm_s))
    cold_s, warm_s = np.sum(times, axis=0)
    print(
        f"{len(GROUPS) * len(counts) ** 2} fits: {cold_s:.0f} s cold, {warm_s:.0f} s "
        f"warm ({cold_s / warm_s:.1f} times)"
    )


if __name__ == "__main__":
    main()
