"""A prediction with its band as a chart of the page."""

import numpy as np

from hwid_cli.records.trust import ShownBand
from hwid_cli.report.charts import MOST_POINTS, Chart, Curve, Panel

# Shaded stretches of one chart; more are told apart by nobody, and the shortest are left out.
_MOST_SPANS = 60


def band_chart(shown: ShownBand, sentence: str) -> Chart:
    """Draw a prediction with its band beside what was measured.

    Parameters
    ----------
    sentence : str
        How the band did.

    Returns
    -------
    Chart
        Shaded where the prediction rests on data in every respect.
    """
    part = slice(None, None, -(-shown.time_s.size // MOST_POINTS))
    band = Curve(
        "90 % band", shown.lower[part], "noise", "band", upper=shown.upper[part]
    )
    panel = Panel(
        f"output y [{shown.unit}]",
        (
            band,
            Curve("measured", shown.measured[part], "measured"),
            Curve("predicted", shown.output[part], "taken"),
        ),
        height_px=260,
        spans=_stretches(shown.time_s, shown.is_inside),
    )
    where = "Shaded: rests on data in every respect."
    if not shown.is_inside.any():
        where = "No sample rests on data in every respect: nothing is shaded."
    return Chart(
        name=f"{shown.model} on {shown.recording}",
        at=shown.time_s[part],
        label="time t [s]",
        panels=(panel,),
        sentence=f"{shown.model} on {shown.recording}. {sentence} {where}",
        alt="A prediction with its band of 90 % beside the measured output",
    )


def _stretches(
    time_s: np.ndarray, is_inside: np.ndarray
) -> tuple[tuple[float, float], ...]:
    """First and last time of the longest stretches in which samples are inside."""
    edges = np.flatnonzero(np.diff(np.r_[False, is_inside, False]))
    ends = list(zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True))
    longest = sorted(ends, key=lambda one: one[0] - one[1])[:_MOST_SPANS]
    return tuple((float(time_s[a]), float(time_s[b])) for a, b in sorted(longest))
