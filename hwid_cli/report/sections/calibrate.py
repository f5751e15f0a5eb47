"""Section about calibration."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hwid_cli.data.as_measured import as_measured
from hwid_cli.records.recordings import CalibrationLog, Recording
from hwid_cli.records.report import ReportContents
from hwid_cli.report.calibration import calibration_table
from hwid_cli.report.charts import (
    Chart,
    Curve,
    Panel,
    Thinning,
    points_of_each,
    thinned,
    thinned_note,
    thinned_places,
    thinning,
)
from hwid_cli.report.formats import counted
from hwid_cli.report.page import (
    Collapsible,
    Drawing,
    PageBlock,
    Picker,
    Section,
    collapsed_beyond,
)
from hwid_cli.report.table import Text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Rows of a table that stands open before the first chart.
_MOST_ROWS = 12
# Of a recording on the page: measured, calibrated and repaired, of input and output.
_CURVES = 6


def calibration_section(contents: ReportContents) -> Section:
    """Show what calibration did."""
    logs = contents.stored.logs
    blocks: list[PageBlock] = []
    missing = "" if logs else "not run yet: run 'hwid calibrate CONFIG'."
    if logs:
        summary = f"The table of all {counted(len(logs), 'recording')}"
        blocks.append(collapsed_beyond(_MOST_ROWS, calibration_table(logs), summary))
        items = _charts(contents.stored.recordings, logs)
        if items:
            about = "Before and after calibration: what was cut, moved and repaired"
            blocks.append(
                Collapsible(about, (Picker("recording", items),), is_printed=False)
            )
        else:
            text = "The configuration leaves the recordings as they are."
            blocks.append(Text(text, is_note=True))
    title = "Calibration: what was kept of each recording"
    return Section("calibration", title, "Calibration", tuple(blocks), missing)


def _changed(
    recordings: tuple[Recording, ...], logs: tuple[CalibrationLog, ...]
) -> list[tuple[Recording, CalibrationLog]]:
    return [
        (recording, log)
        for recording, log in zip(recordings, logs, strict=True)
        if log.steps or log.repaired_input or log.repaired_output
    ]


def _charts(
    recordings: tuple[Recording, ...], logs: tuple[CalibrationLog, ...]
) -> tuple[tuple[str, tuple[PageBlock, ...]], ...]:
    """A chart of each recording that was changed, by its name."""
    changed = _changed(recordings, logs)
    most = points_of_each(_CURVES * len(changed))
    return tuple((log.name, (_chart(one, log, most),)) for one, log in changed)


def _chart(recording: Recording, log: CalibrationLog, most: int) -> Chart:
    """Input above output over the time of the raw record; what was kept is shaded."""
    measured = as_measured(recording, log)
    n_samples = max(log.n_raw_input, log.n_raw_output)
    chosen, step = thinning(n_samples, most, (0, 0)), recording.sample_time_s
    kept = (step * log.first_sample, step * (log.first_sample + log.n_samples - 1))
    panels = []
    for place, (name, values, unit, repaired) in enumerate(
        (
            ("input u", recording.input, recording.input_unit, log.repaired_input),
            ("output y", recording.output, recording.output_unit, log.repaired_output),
        )
    ):
        curves = [_curve("calibrated", values, log.first_sample, chosen, "map")]
        if measured is not None:
            raw = _curve("measured", measured[place], 0, chosen, "measured")
            bad = np.full(measured[place].size, np.nan)
            bad[list(repaired)] = measured[place][list(repaired)]
            marks = _curve("repaired", bad, 0, chosen, "beyond", "points")
            curves = [raw, *curves, *([marks] if repaired else [])]
        label = f"{name} [{unit}]"
        panels.append(Panel(label, tuple(curves), height_px=190, spans=(kept,)))
    sentence = _cut_sentence(log)
    if measured is None:
        sentence += " Run 'hwid calibrate CONFIG' to see what was cut and repaired."
    return Chart(
        name=log.name,
        at=step * thinned_places(chosen),
        label="time t in the raw record [s]",
        panels=tuple(panels),
        sentence=sentence + thinned_note(chosen),
        alt=f"Input and output of {log.name} before and after calibration",
    )


def _curve(
    label: str,
    values: np.ndarray,
    first: int,
    chosen: Thinning,
    role: str,
    style: str = "line",
) -> Curve:
    """A signal in its place in the raw record, of which it may be a part."""
    n_samples = max(end for _, end, _ in chosen.stretches)
    placed = np.full(n_samples, np.nan)
    placed[first : first + values.size] = values
    return Curve(label, thinned(placed, chosen), role, style)


def _cut_sentence(log: CalibrationLog) -> str:
    last = log.first_sample + log.n_samples - 1
    repaired = len(log.repaired_input) + len(log.repaired_output)
    kept = (
        f"{log.name}: samples {log.first_sample} to {last} of {log.n_raw_input} are kept "
        "(shaded)"
    )
    if repaired:
        kept += f", {counted(repaired, 'damaged sample')} replaced"
    return f"{kept}."


def calibration_drawings(contents: ReportContents) -> list[Drawing]:
    """Figures of recordings before and after, as ``hwid calibrate`` has drawn them."""
    given = contents.stored.recordings, contents.stored.logs
    return drawings_of(*given) if _changed(*given) else []


def drawings_of(
    recordings: tuple[Recording, ...], logs: tuple[CalibrationLog, ...]
) -> list[Drawing]:
    """Draw each recording whose measurement is known."""
    return [
        Drawing(f"calibrate/{log.name}.png", partial(_figure, one, log))
        for one, log in zip(recordings, logs, strict=True)
        if as_measured(one, log) is not None
    ]


def _figure(recording: Recording, log: CalibrationLog) -> "Figure":
    # Loading what draws takes longer than to see that nothing has to be drawn.
    from hwid_cli.report.plots import calibration_figure

    return calibration_figure(recording, log)


# Sections of the page, in their order, and figures beside it.
SECTIONS = (calibration_section,)
DRAWINGS = (calibration_drawings,)
