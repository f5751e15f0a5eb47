"""The figure of the README: a gap that shrinks, from the results of a diagnosis.

``python tools/gap_figure.py results/measured docs/figures/gap.png`` after the tutorial; a
third word names another of the recordings that the diagnosis keeps curves of.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.store.stage_records import read_stage_record

_DPI = 110
_MILLI = 1e3


def gap_figure(found: Diagnosis, name: str = "") -> Figure:
    """Draw a held-out recording, that which the simulation misses most unless named."""
    one = next(one for one in found.overlays if not name or one.name == name)
    figure = Figure(figsize=(9.0, 3.9), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    above.plot(one.time_s, _MILLI * one.measured, color="0.6", lw=4, label="measured")
    above.plot(one.time_s, _MILLI * one.before, "C1--", label="simulation, re-fitted")
    above.plot(one.time_s, _MILLI * one.after, "C0", lw=1, label="with what it lacked")
    above.set(ylabel="displacement mm")
    above.set_title(f"{one.name}, a recording that no fit has used", loc="left")
    above.legend(loc="upper center", ncols=3, frameon=False)
    for curve, style, gap in (
        (one.before, "C1", found.before),
        (one.after, "C0", found.after),
    ):
        label = f"{gap.ratio_to_noise:.3g} times the noise"
        below.plot(
            one.time_s, _MILLI * (one.measured - curve), style, lw=1, label=label
        )
    below.set(ylabel="gap mm", xlabel="time s")
    below.legend(loc="upper center", ncols=2, frameon=False)
    return figure


def main() -> None:
    """Read the results and write the figure."""
    results, target, *names = sys.argv[1:]
    found = read_stage_record(Path(results) / "results.h5", "diagnose", Diagnosis)
    gap_figure(found, *names).savefig(target, dpi=_DPI, metadata={"Software": None})


if __name__ == "__main__":
    main()
