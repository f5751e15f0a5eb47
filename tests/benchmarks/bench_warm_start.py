"""Groups of recordings: fits that begin with the members' models against fits from nothing.

Steps of the virtual gun, 7500 samples each. Both kinds of fits run in this process, one
after the other, so that their ratio holds on a busy machine too.
"""

import time
from dataclasses import replace

import numpy as np

from hwid_cli.campaign.calibrate import calibrate_all
from hwid_cli.campaign.simulate import simulate_machine
from hwid_cli.maths.model.fit import fit
from hwid_cli.records.experiment import CalibrateOptions
from hwid_cli.records.machines import GunMachine, GunPlan
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import RawRecording

GROUPS = (
    ("step_02", "step_12"),
    ("step_04", "step_14"),
    ("step_03", "step_15"),
    ("step_01", "step_14", "step_15"),
    ("step_02", "step_07", "step_13"),
    ("step_04", "step_06", "step_09", "step_12"),
)
ORDERS = tuple(Orders(nb, nf, 1) for nb, nf in ((1, 2), (3, 4), (2, 7), (6, 4), (9, 9)))
ALONE, TOGETHER = FitOptions(), FitOptions(join="experiments")
THRESHOLD = 0.01


def measured_steps():
    """Calibrated recordings of the groups, by name."""
    names = tuple(sorted({name for group in GROUPS for name in group}))
    machine = replace(GunMachine(), plan=replace(GunPlan(), only=names))
    raws = [
        RawRecording(
            one.name, one.input, one.output, machine.plan.sample_time_s, one.kind
        )
        for one in simulate_machine(machine)
    ]
    recipe = CalibrateOptions(step=("cut", "output_offset"), samples=7500)
    recordings, _ = calibrate_all(raws, recipe)
    return {one.name: one for one in recordings}


def timed(*arguments, **starts):
    """RMSD of a fit and the seconds of this process that it took."""
    start = time.process_time()
    result = fit(*arguments, **starts)
    return result.rmsd, time.process_time() - start


def main():
    """Fit every group with every pair of orders in both ways."""
    recordings = measured_steps()
    print("group                                     size  cold s  warm s  cold/warm")
    rows = []
    for group in GROUPS:
        members = [recordings[name] for name in group]
        mine = []
        for orders in ORDERS:
            models = [fit([one], orders, ALONE).model for one in members]
            starts = [model for model in models if model is not None]
            cold = timed(members, orders, TOGETHER)
            warm = timed(members, orders, TOGETHER, starts=starts)
            mine.append((*cold, *warm))
        cold_s, warm_s = np.sum([[row[1], row[3]] for row in mine], axis=0)
        print(
            f"{'+'.join(group):42}{len(group):4}{cold_s / len(ORDERS):8.2f}"
            f"{warm_s / len(ORDERS):8.2f}{cold_s / warm_s:11.1f}"
        )
        rows += mine
    cold, cold_s, warm, warm_s = np.array(rows).T
    ratio = warm / cold
    print(
        f"{len(rows)} fits: {cold_s.sum():.0f} s cold, {warm_s.sum():.0f} s warm "
        f"({cold_s.sum() / warm_s.sum():.1f} times)"
    )
    print(
        f"RMSD warm/cold: median {np.median(ratio):.2f}, quartiles "
        f"{np.quantile(ratio, 0.25):.2f} to {np.quantile(ratio, 0.75):.2f}, "
        f"extremes {ratio.min():.2f} and {ratio.max():.2f}"
    )
    print(
        f"above the threshold of {THRESHOLD} m: {np.sum(cold >= THRESHOLD)} cold, "
        f"{np.sum(warm >= THRESHOLD)} warm"
    )


if __name__ == "__main__":
    main()
