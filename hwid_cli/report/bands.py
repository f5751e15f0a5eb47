"""A prediction with its band as a chart of the page."""

import numpy as np

from hwid_cli.records.trust import ShownBand
from hwid_cli.report.charts import (
    MOST_POINTS,
    Chart,
    Curve,
    Panel,
    thinned,
    thinned_note,
    thinned_places,
    thinning,
)

# Shaded stretches of one chart; more are told apart by nobody, and the shortest are left out.
_MOST_SPANS = 60
# Curves of this label are hidden together.
BAND = "90 % band"
# The strip: 1 where all of the samples rest on data.
SHARE = "rests on data"


def band_chart(shown: ShownBand, sentence: str) -> Chart:
    """Draw a prediction with its band beside what was measured.

    Parameters
    ----------
    sentence : str
        How the band did.

    Returns
    -------
    Chart
        The prediction above, what is left of the measurement beneath, where a narrow band
        is seen, and a strip; shaded where the prediction rests on data in every respect.
    """
    chosen = thinning(shown.time_s.size, MOST_POINTS, (0, 0))
    spans = _stretches(shown.time_s, shown.is_inside)
    parts = (shown.measured, shown.output, shown.lower, shown.upper)
    measured, output, lower, upper = (thinned(one, chosen) for one in parts)
    residual, below, above = (
        thinned(one - shown.output, chosen)
        for one in (shown.measured, shown.lower, shown.upper)
    )
    panels = (
        Panel(
            f"output y [{shown.unit}]",
            (
                Curve(BAND, lower, "noise", "band", upper=upper),
                Curve("measured", measured, "measured"),
                Curve("predicted", output, "taken"),
            ),
            height_px=240,
            spans=spans,
        ),
        Panel(
            f"residual e [{shown.unit}]",
            (
                Curve(BAND, below, "noise", "band", upper=above),
                Curve("measured less predicted", residual, "input"),
            ),
            height_px=120,
            lines=(0.0,),
            spans=spans,
        ),
        _strip(thinned(shown.is_inside.astype(float), chosen)),
    )
    where = "Shaded, and in the strip: rests on data in every respect."
    if not shown.is_inside.any():
        where = "No sample rests on data in every respect: nothing is shaded."
    return Chart(
        name=f"{shown.model} on {shown.recording}",
        at=np.interp(
            thinned_places(chosen), np.arange(shown.time_s.size), shown.time_s
        ),
        label="time t [s]",
        panels=panels,
        sentence=f"{shown.model} on {shown.recording}. {sentence} {where}"
        f"{thinned_note(chosen)}",
        alt="A prediction with its band of 90 % beside the measured output",
    )


def _strip(on_data: np.ndarray) -> Panel:
    """Where the prediction rests on data, below it.

    Parameters
    ----------
    on_data : ndarray, shape (n_points,), [-]
        1 there, 0 elsewhere.
    """
    curve = Curve(SHARE, np.zeros(on_data.size), "map", "band", upper=on_data)
    return Panel("on data", (curve,), height_px=48)


def _stretches(
    time_s: np.ndarray, is_inside: np.ndarray
) -> tuple[tuple[float, float], ...]:
    """First and last time of the longest stretches in which samples are inside."""
    edges = np.flatnonzero(np.diff(np.r_[False, is_inside, False]))
    ends = list(zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True))
    longest = sorted(ends, key=lambda one: one[0] - one[1])[:_MOST_SPANS]
    return tuple((float(time_s[a]), float(time_s[b])) for a, b in sorted(longest))
