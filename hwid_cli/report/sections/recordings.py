"""Sections about single recordings: calibration, best models, orders, cross-validation."""

from collections.abc import Mapping

import numpy as np

from hwid_cli.records.recordings import CalibrationLog
from hwid_cli.records.report import (
    OrderGrid,
    ReportContents,
    RmsdMatrix,
    SimulatedRecording,
)
from hwid_cli.report import plots
from hwid_cli.report.figures.matrices import order_grid_figure, rmsd_matrix_figure
from hwid_cli.report.figures.recordings import simulation_figure
from hwid_cli.report.page import (
    Block,
    Figures,
    Folded,
    Image,
    Pairs,
    Section,
    Table,
    Text,
)
from hwid_cli.report.sections.words import (
    counted,
    drawn,
    file_names,
    image,
    listed,
    percent,
    simulation_note,
    with_unit,
)
from hwid_cli.report.tables import calibration_cells

# Figures that are shown open; all others are folded.
_MOST_OPEN = 4
# Rows of a table that stands open before the first figure.
_MOST_ROWS = 12
_DETAIL = "_detail"
_WHY = {
    "own": "the best of its own models",
    "assigned": "the model that the final test assigns to it",
    "crossval": "the model of another recording that does best on it",
}


def calibration_section(
    contents: ReportContents, figures: Mapping[str, bytes]
) -> Section:
    """Show what calibration did.

    Parameters
    ----------
    figures : mapping of str to bytes
        PNG files by the names of the recordings.
    """
    logs = contents.stored.logs
    blocks: list[Block] = []
    if not logs:
        blocks.append(Text("Not run yet: run 'hwid calibrate CONFIG'.", is_note=True))
    else:
        heads, rows = calibration_cells(logs)
        caption = "Samples, what was subtracted, samples repaired (input/output)"
        table = Table(caption, heads, tuple(rows))
        folded = f"The table of all {counted(len(rows), 'recording')}"
        many = len(rows) > _MOST_ROWS
        blocks.append(Folded(folded, (table,)) if many else table)
        shown = [
            Figures((_calibration_image(log, figures[log.name]),), _cut_sentence(log))
            for log in logs
            if log.name in figures
        ]
        if shown:
            blocks.append(Pairs(tuple(shown[:_MOST_OPEN])))
        if shown[_MOST_OPEN:]:
            blocks.append(_folded(shown[_MOST_OPEN:], "before and after calibration"))
        if not shown:
            text = "No figures: the configuration leaves the recordings as they are."
            blocks.append(Text(text, is_note=True))
    title = "Calibration: what was kept of each recording"
    return Section("calibration", title, "Calibration", tuple(blocks))


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


def _folded(figures: list[Figures], what: str) -> Folded:
    summary = f"{counted(len(figures), 'more recording')} {what}"
    return Folded(summary, (Pairs(tuple(figures)),))


def recordings_section(contents: ReportContents) -> Section:
    """Show the best model of each recording over the measurement."""
    blocks: list[Block] = []
    if not contents.simulated:
        blocks.append(Text("No models yet: run 'hwid identify CONFIG'.", is_note=True))
    names = [one.recording.name for one in contents.simulated]
    files = file_names(names, ("", _DETAIL))
    shown = [_simulation(one, files[one.recording.name]) for one in contents.simulated]
    if shown:
        blocks += simulation_note(contents, is_validation=True)
    blocks += shown[:_MOST_OPEN]
    if shown[_MOST_OPEN:]:
        what = f"{counted(len(shown) - _MOST_OPEN, 'more recording')}"
        rest = tuple(shown[_MOST_OPEN:])
        blocks.append(Folded(f"{what} with their best models", rest))
    if contents.simulated and contents.without_model:
        text = f"Without any model: {listed(contents.without_model)}."
        blocks.append(Text(text, is_note=True))
    title = "Best model of each recording"
    return Section("recordings", title, "Best models", tuple(blocks))


def _simulation(one: SimulatedRecording, file_name: str) -> Figures:
    name, unit = one.recording.name, one.recording.output_unit
    file = f"recordings/{file_name}"
    worst = int(np.nanargmax(np.abs(one.residual))) if _is_finite(one) else 0
    at = worst * one.recording.sample_time_s
    sentence = (
        f"{name} with {one.model}, {_WHY[one.choice]}: RMSD "
        f"{with_unit(one.rmsd, unit)}, fit {percent(one.fit_percent)}"
    )
    if _is_finite(one):
        largest = abs(float(one.residual[worst]))
        sentence += (
            f"; the largest residual, {with_unit(largest, unit)}, is at {at:.3g} s"
        )
    alt = f"Measured and simulated output of {name}, residual beneath"
    images = (
        drawn(file, simulation_figure(one, is_detail=False), alt),
        drawn(
            f"{file}{_DETAIL}",
            simulation_figure(one, is_detail=True),
            f"{alt}, in detail",
        ),
    )
    return Figures(images, f"{sentence}.")


def _is_finite(one: SimulatedRecording) -> bool:
    return bool(np.isfinite(one.residual).all())


def orders_section(contents: ReportContents) -> Section:
    """Show the RMSD of every model on its own recording over the orders."""
    grid = contents.grid
    blocks: list[Block] = []
    if grid is None:
        blocks.append(Text("No models yet: run 'hwid identify CONFIG'.", is_note=True))
    elif not np.isfinite(grid.rmsd).any():
        blocks.append(Text("Every fit failed: there is no RMSD to show.", is_note=True))
    else:
        blocks += simulation_note(contents, is_validation=False)
        alt = "Heat maps of RMSD over the orders nb and nk, one for each recording"
        figure = drawn("orders/rmsd", order_grid_figure(grid), alt)
        blocks.append(Figures((figure,), _grid_sentence(grid)))
    title = "RMSD on the own recording over the orders"
    return Section("orders", title, "Orders", tuple(blocks))


def _grid_sentence(grid: OrderGrid) -> str:
    low, high = np.nanargmin(grid.rmsd), np.nanargmax(grid.rmsd)
    text = (
        f"RMSD runs from {with_unit(grid.rmsd.flat[low], grid.unit)} "
        f"({_grid_name(grid, int(low))}) to "
        f"{with_unit(grid.rmsd.flat[high], grid.unit)} ({_grid_name(grid, int(high))}); "
        "a ring marks the best orders of each recording"
    )
    failed = int(np.sum(np.isnan(grid.rmsd)))
    if failed:
        text += f", hatched cells are {counted(failed, 'fit')} without a model"
    return f"{text}."


def _grid_name(grid: OrderGrid, place: int) -> str:
    name, nb, nk = np.unravel_index(place, grid.rmsd.shape)
    return f"{grid.recordings[name]}/{grid.nb[nb]}/{grid.nk[nk]}"


def crossval_section(contents: ReportContents) -> Section:
    """Show the widest model of each recording on all recordings."""
    matrix = contents.cross
    blocks: list[Block] = []
    if "crossval" in contents.outdated:
        text = "The stored tensor belongs to other models: run 'hwid crossval CONFIG'."
        blocks.append(Text(text, is_note=True))
    elif matrix is None:
        blocks.append(Text("Not run yet: run 'hwid crossval CONFIG'.", is_note=True))
    else:
        blocks += simulation_note(contents, is_validation=True)
        alt = "Heat map of the RMSD of each recording's widest model on all recordings"
        figure = drawn("crossval/matrix", rmsd_matrix_figure(matrix), alt)
        sentence = (
            f"{_coverage_sentence(matrix)} A dot marks an RMSD below "
            f"{with_unit(matrix.threshold, matrix.unit)}, a square the recording "
            "of the fit, the line in the colour bar the threshold."
        )
        blocks.append(Figures((figure,), sentence))
    title = "Cross-validation: the widest model of each recording"
    return Section("crossval", title, "Cross-validation", tuple(blocks))


def _coverage_sentence(matrix: RmsdMatrix) -> str:
    row, column = int(matrix.covers.argmax()), int(matrix.covered_by.argmin())
    if not matrix.covers[row]:
        return f"No model covers any of the {len(matrix.recordings)}, not even its own."
    widest = (
        f"{matrix.models[row]} covers the most, {matrix.covers[row]} of "
        f"{len(matrix.recordings)} (its own among them)"
    )
    if not matrix.covered_by[column]:
        nobody = np.flatnonzero(matrix.covered_by == 0)
        names = listed([matrix.recordings[place] for place in nobody])
        return f"{widest}; none of these models covers {names}."
    return (
        f"{widest}; hardest to cover is {matrix.recordings[column]}, by "
        f"{counted(int(matrix.covered_by[column]), 'model')}."
    )
