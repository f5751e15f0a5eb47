"""Sections about models of single recordings: the best ones, residuals, orders."""

import numpy as np

from hwid_cli.records.report import OrderGrid, ReportContents, SimulatedRecording
from hwid_cli.records.residuals import ModelResiduals
from hwid_cli.report.figures.matrices import order_grid_figure
from hwid_cli.report.figures.recordings import simulation_figure
from hwid_cli.report.figures.residuals import residuals_figure
from hwid_cli.report.fits import best_models_table
from hwid_cli.report.formats import counted, listed, percent, with_unit
from hwid_cli.report.page import (
    Collapsible,
    Figures,
    PageBlock,
    Section,
    drawn,
    file_names,
    section_notes,
)
from hwid_cli.report.residuals import residual_table, residual_verdict
from hwid_cli.report.table import Text

# Figures that are shown open; all others are folded.
_MOST_OPEN, _MOST_RESIDUALS = 4, 2
_DETAIL = "_detail"
_WHY = {
    "own": "the best of its own models",
    "assigned": "the model that the final test assigns to it",
    "crossval": "the model of another recording that does best on it",
}


_HOW = (
    "White residuals that do not follow the input leave nothing to model. Those that follow "
    "it show missing dynamics, those that follow its square a missing nonlinearity. "
    "Coloured ones that follow neither are noise, or follow the input in a way that these "
    "tests do not see (a sine shows least); standard errors are too small then. "
    "With many samples the tests find what no user would mind: read the RMSD beside them."
)


def recordings_section(contents: ReportContents) -> Section:
    """Show the best model of each recording over the measurement."""
    blocks: list[PageBlock] = []
    if not contents.simulated:
        blocks.append(Text("No models yet: run 'hwid identify CONFIG'.", is_note=True))
    names = [one.recording.name for one in contents.simulated]
    files = file_names(names, ("", _DETAIL))
    shown = [_simulation(one, files[one.recording.name]) for one in contents.simulated]
    if shown:
        blocks += section_notes(contents, is_validation=True)
    blocks += shown[:_MOST_OPEN]
    if shown[_MOST_OPEN:]:
        what = f"{counted(len(shown) - _MOST_OPEN, 'more recording')}"
        rest = tuple(shown[_MOST_OPEN:])
        blocks.append(Collapsible(f"{what} with their best models", rest))
    if contents.best and contents.grid is not None:
        is_delay = contents.stored.nk_role == "delay"
        table = best_models_table(
            contents.best, contents.grid.unit, nk_is_delay=is_delay
        )
        blocks.append(Collapsible("The best models as a table", (table,)))
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


def residuals_section(contents: ReportContents) -> Section:
    """Show the tests of the residuals of each recording's best model."""
    tested = [one for one in contents.simulated if one.tests is not None]
    blocks: list[PageBlock] = []
    if not tested:
        blocks.append(Text("No models yet: run 'hwid identify CONFIG'.", is_note=True))
    else:
        blocks.append(Text(_HOW))
        blocks += section_notes(contents, is_validation=True)
        found = [
            ModelResiduals(
                one.model,
                one.tests,
                flat=(),
                recording=one.recording.name,
                rmsd=one.rmsd,
                unit=one.recording.output_unit,
            )
            for one in tested
            if one.tests is not None
        ]
        blocks.append(residual_table(found))
        files = file_names([one.recording.name for one in tested], ("",))
        shown = [_residuals(one, files[one.recording.name]) for one in tested]
        blocks += shown[:_MOST_RESIDUALS]
        rest = tuple(shown[_MOST_RESIDUALS:])
        if rest:
            summary = f"Residuals of {counted(len(rest), 'more recording')}"
            blocks.append(Collapsible(summary, rest))
    title = "Residuals: what the best models leave"
    return Section("residuals", title, "Residuals", tuple(blocks))


def _residuals(one: SimulatedRecording, file: str) -> Figures:
    name = one.recording.name
    alt = f"Correlations of the residual of {name} with itself and with the input"
    verdict = "" if one.tests is None else residual_verdict(one.tests)
    sentence = (
        f"{name} with {one.model}: residuals are {verdict}. Shaded: 95 % of the values "
        "without any correlation; dashed: 95 % of cases have all values within."
    )
    drawing = residuals_figure(one)
    return Figures((drawn(f"residuals/{file}", drawing, alt),), sentence)


def orders_section(contents: ReportContents) -> Section:
    """Show the RMSD of every model on its own recording over the orders."""
    grid = contents.grid
    blocks: list[PageBlock] = []
    if grid is None:
        blocks.append(Text("No models yet: run 'hwid identify CONFIG'.", is_note=True))
    elif not np.isfinite(grid.rmsd).any():
        blocks.append(Text("Every fit failed: there is no RMSD to show.", is_note=True))
    else:
        blocks += section_notes(contents, is_validation=False)
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


# Sections of the page, in their order.
SECTIONS = (recordings_section, residuals_section, orders_section)
