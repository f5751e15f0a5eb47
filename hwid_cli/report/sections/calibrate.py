"""Section about calibration."""

from hwid_cli.records.recordings import CalibrationLog
from hwid_cli.records.report import ReportContents
from hwid_cli.report import plots
from hwid_cli.report.calibration import calibration_table
from hwid_cli.report.formats import counted
from hwid_cli.report.page import (
    Collapsible,
    Figures,
    Image,
    PageBlock,
    Picker,
    Section,
    collapsed_beyond,
    image,
)
from hwid_cli.report.table import Text

# Rows of a table that stands open before the first figure.
_MOST_ROWS = 12


def calibration_section(contents: ReportContents) -> Section:
    """Show what calibration did."""
    logs, figures = contents.stored.logs, contents.stored.calibration_figures
    blocks: list[PageBlock] = []
    missing = "" if logs else "not run yet: run 'hwid calibrate CONFIG'."
    if logs:
        summary = f"The table of all {counted(len(logs), 'recording')}"
        blocks.append(collapsed_beyond(_MOST_ROWS, calibration_table(logs), summary))
        shown = [
            Figures((_calibration_image(log, figures[log.name]),), _cut_sentence(log))
            for log in logs
            if log.name in figures
        ]
        if shown:
            names = [log.name for log in logs if log.name in figures]
            items = zip(names, ((one,) for one in shown), strict=True)
            about = "Before and after calibration: what was cut, moved and repaired"
            blocks.append(
                Collapsible(
                    about, (Picker("recording", tuple(items)),), is_printed=False
                )
            )
        if not shown:
            text = "No figures: the configuration leaves the recordings as they are."
            blocks.append(Text(text, is_note=True))
    title = "Calibration: what was kept of each recording"
    return Section("calibration", title, "Calibration", tuple(blocks), missing)


def _calibration_image(log: CalibrationLog, png: bytes) -> Image:
    alt = f"Input and output of {log.name} before and after calibration"
    return image(f"calibrate/{log.name}.png", png, alt, dots_per_inch=plots.DOTS)


def _cut_sentence(log: CalibrationLog) -> str:
    last = log.first_sample + log.n_samples - 1
    repaired = len(log.repaired_input) + len(log.repaired_output)
    kept = f"{log.name}: samples {log.first_sample} to {last} of {log.n_raw_input} are kept"
    if repaired:
        kept += f", {counted(repaired, 'damaged sample')} replaced"
    return f"{kept}."


# Sections of the page, in their order.
SECTIONS = (calibration_section,)
