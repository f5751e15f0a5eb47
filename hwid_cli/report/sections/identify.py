"""Sections about models of single recordings: the best ones, residuals, orders."""

from functools import partial

import numpy as np

from hwid_cli.records.recordings import Recording
from hwid_cli.records.report import OrderGrid, ReportContents, SimulatedRecording
from hwid_cli.records.residuals import Correlation, ModelResiduals
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
from hwid_cli.report.figures.matrices import order_grid_figure
from hwid_cli.report.figures.recordings import simulation_figure
from hwid_cli.report.figures.residuals import residuals_figure
from hwid_cli.report.fits import best_models_table
from hwid_cli.report.formats import counted, listed, percent, with_unit
from hwid_cli.report.matrices import order_grid_table
from hwid_cli.report.page import (
    Collapsible,
    Drawing,
    PageBlock,
    Picker,
    Row,
    Section,
    collapsed_beyond,
    file_names,
    section_notes,
)
from hwid_cli.report.residuals import residual_table, residual_verdict
from hwid_cli.report.sections.model_answer import model_answer
from hwid_cli.report.table import Text

# Rows of a table that is shown open.
_MOST_ROWS = 12
# Curves of a recording on the page: input, measured, up to three models with residuals.
_CURVES = 8
_DETAIL = "_detail"
_WHY = {
    "own": "the best of its own models",
    "assigned": "the model that the final test assigns to it",
    "crossval": "the model of another recording that does best on it",
}
_NO_MODELS = "no models yet: run 'hwid identify CONFIG'."
# A simulation so many times beyond the measurement is not drawn, [-].
_ASTRAY = 1e2
_HOW = (
    "White residuals that do not follow the input leave nothing to model. Those that follow "
    "it show missing dynamics, those that follow its square a missing nonlinearity. "
    "Coloured ones that follow neither are noise, or follow the input in a way that these "
    "tests do not see (a sine shows least); standard errors are too small then. "
    "With many samples the tests find what no user would mind: read the RMSD beside them."
)


def recordings_section(contents: ReportContents) -> Section:
    """Show each recording with the models that matter for it."""
    recordings = contents.stored.recordings
    title = "Measured and simulated" if contents.simulated else "The recordings"
    blocks: list[PageBlock] = []
    if contents.simulated:
        blocks += section_notes(contents, is_validation=True)
    if recordings:
        simulated = {one.recording.name: one for one in contents.simulated}
        most = points_of_each(_CURVES * len(recordings))
        items = [
            (one.name, (_recording_chart(one, simulated.get(one.name), most),))
            for one in recordings
        ]
        blocks.append(Picker("recording", tuple(items)))
    if contents.best and contents.grid is not None:
        is_delay = contents.stored.nk_role == "delay"
        table = best_models_table(
            contents.best, contents.grid.unit, nk_is_delay=is_delay
        )
        blocks.append(Collapsible("The best models of each recording", (table,)))
    if contents.simulated and contents.without_model:
        text = f"Without any model: {listed(contents.without_model)}."
        blocks.append(Text(text, is_note=True))
    missing = "" if recordings else "run 'hwid calibrate CONFIG'."
    return Section("recordings", title, "Recordings", tuple(blocks), missing)


def _recording_chart(
    recording: Recording, simulated: SimulatedRecording | None, most: int
) -> Chart:
    """Output, residual and input of a recording above each other."""
    detail = (0, 0) if simulated is None else simulated.detail
    chosen = thinning(recording.n_samples, most, detail)
    step = recording.sample_time_s
    panels = [_outputs(recording, simulated, chosen)]
    if simulated is not None:
        panels.append(_residual_panel(simulated, chosen))
    current = Curve("input u", thinned(recording.input, chosen), "input")
    panels.append(Panel(f"input u [{recording.input_unit}]", (current,), height_px=110))
    sentence = (
        _simulation_sentence(simulated)
        if simulated is not None
        else f"{recording.name}: {recording.n_samples} samples, every {step:g} s."
    )
    what = "Measured and simulated output" if simulated else "Measured output"
    return Chart(
        name=recording.name,
        at=step * thinned_places(chosen),
        label="time t [s]",
        panels=tuple(panels),
        sentence=sentence + thinned_note(chosen),
        alt=f"{what} of {recording.name} over time, with its input",
        detail=None if detail[1] == 0 else (step * detail[0], step * detail[1]),
        has_model_menu=True,
    )


def _models_of(
    simulated: SimulatedRecording,
) -> list[tuple[str, str, np.ndarray, bool]]:
    """Legend, role and output of each model of a recording, and whether it begins hidden."""
    found = [(simulated.model, "simulated", simulated.output, False)]
    for one in simulated.others:
        role = "linear" if one.is_linear else "taken"
        found.append((one.model, role, one.output, one.is_linear))
    return found


def _outputs(
    recording: Recording, simulated: SimulatedRecording | None, chosen: Thinning
) -> Panel:
    curves = [Curve("measured y", thinned(recording.output, chosen), "measured")]
    for name, role, output, is_hidden in _models_of(simulated) if simulated else []:
        values = thinned(_readable(output, recording.output), chosen)
        curves.append(Curve(name, values, role, model=name, is_hidden=is_hidden))
    return Panel(f"output y [{recording.output_unit}]", tuple(curves), height_px=250)


def _residual_panel(simulated: SimulatedRecording, chosen: Thinning) -> Panel:
    measured = simulated.recording.output
    curves = []
    for name, role, output, is_hidden in _models_of(simulated):
        residual = measured - _readable(output, measured)
        curves.append(
            Curve(
                name, thinned(residual, chosen), role, model=name, is_hidden=is_hidden
            )
        )
    unit = simulated.recording.output_unit
    return Panel(f"residual e [{unit}]", tuple(curves), height_px=130, lines=(0.0,))


def _readable(output: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """A simulation with NaN where it has gone astray, so that the rest stays readable."""
    most = _ASTRAY * max(float(np.max(np.abs(measured))), np.finfo(float).tiny)
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(output) < most, output, np.nan)


def _simulation_sentence(one: SimulatedRecording) -> str:
    name, unit = one.recording.name, one.recording.output_unit
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
    for other in one.others:
        what = (
            "the linear model"
            if other.is_linear
            else f"the model to take, {other.model}"
        )
        sentence += f"; {what}: RMSD {with_unit(other.rmsd, unit)}"
    return f"{sentence}."


def _is_finite(one: SimulatedRecording) -> bool:
    return bool(np.isfinite(one.residual).all())


def residuals_section(contents: ReportContents) -> Section:
    """Show the tests of the residuals of each recording's best model."""
    tested = [one for one in contents.simulated if one.tests is not None]
    blocks: list[PageBlock] = []
    if tested:
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
        summary = f"The verdicts on all {counted(len(found), 'recording')}"
        blocks.append(collapsed_beyond(_MOST_ROWS, residual_table(found), summary))
        items = [(one.recording.name, _residual_blocks(one)) for one in tested]
        blocks.append(Picker("recording", tuple(items)))
    title = "Residuals: what the best models leave"
    missing = "" if tested else _NO_MODELS
    return Section("residuals", title, "Residuals", tuple(blocks), missing)


def _residual_blocks(one: SimulatedRecording) -> tuple[PageBlock, ...]:
    tests = one.tests
    if tests is None:
        return ()
    name = one.recording.name
    verdict = Text(
        f"{name} with {one.model}: residuals are {residual_verdict(tests)}. Shaded: 95 % of "
        "the values without any correlation; dashed: 95 % of cases have all values within."
    )
    panels = (
        (tests.with_itself, "residual with itself"),
        (tests.with_input, "residual with the whitened input"),
        (tests.with_square, "residual with the square of the input"),
    )
    charts = [
        _correlation_chart(name, correlation, title)
        for correlation, title in panels
        if correlation.lags.size
    ]
    blocks: list[PageBlock] = [verdict, Row(tuple(charts))]
    if not tests.with_square.lags.size:
        text = "The input has two levels: its square says nothing new."
        blocks.append(Text(text, is_note=True))
    return tuple(blocks)


def _correlation_chart(name: str, one: Correlation, title: str) -> Chart:
    is_beyond = np.abs(one.values) > one.common_band
    dashed = (("within chance", one.common_band), ("", -one.common_band))
    curves = (
        Curve("95 % band", -one.band, "noise", "band", upper=one.band),
        *(Curve(label, values, "chance") for label, values in dashed),
        Curve("within", np.where(is_beyond, np.nan, one.values), "map", "stems"),
        Curve("beyond", np.where(is_beyond, one.values, np.nan), "beyond", "stems"),
    )
    highest = 1.15 * max(np.abs(one.values).max(), one.common_band.max(), 1e-3)
    panel = Panel(
        "correlation [-]",
        curves,
        height_px=170,
        lines=(0.0,),
        limits=(-highest, highest),
    )
    sentence = f"{title[0].upper()}{title[1:]}: {counted(int(is_beyond.sum()), 'value')} beyond chance."
    return Chart(
        name=f"{name}, {title}",
        at=one.lags.astype(float),
        label="lag [samples]",
        panels=(panel,),
        sentence=sentence,
        alt=f"Correlation of the {title} over lags, for {name}",
    )


def orders_section(contents: ReportContents) -> Section:
    """Show the RMSD of every model on its own recording over the orders."""
    grid = contents.grid
    blocks: list[PageBlock] = []
    missing = ""
    if grid is None:
        missing = _NO_MODELS
    elif not np.isfinite(grid.rmsd).any():
        missing = "every fit failed: there is no RMSD to show."
    else:
        blocks += section_notes(contents, is_validation=False)
        blocks.append(Text(_grid_sentence(grid)))
        items = [
            (name, (order_grid_table(grid, place),))
            for place, name in enumerate(grid.recordings)
        ]
        blocks.append(Picker("recording", tuple(items)))
    title = "RMSD over the orders, in colours of each recording's own scale"
    return Section("orders", title, "Orders", tuple(blocks), missing)


def _grid_sentence(grid: OrderGrid) -> str:
    low, high = np.nanargmin(grid.rmsd), np.nanargmax(grid.rmsd)
    text = (
        f"RMSD on the own recording runs from {with_unit(grid.rmsd.flat[low], grid.unit)} "
        f"({_grid_name(grid, int(low))}) to "
        f"{with_unit(grid.rmsd.flat[high], grid.unit)} ({_grid_name(grid, int(high))})"
    )
    failed = int(np.sum(np.isnan(grid.rmsd)))
    if failed:
        text += f"; {counted(failed, 'fit')} without a model"
    return f"{text}."


def _grid_name(grid: OrderGrid, place: int) -> str:
    name, nb, nk = np.unravel_index(place, grid.rmsd.shape)
    return f"{grid.recordings[name]}/{grid.nb[nb]}/{grid.nk[nk]}"


def recording_drawings(contents: ReportContents) -> tuple[Drawing, ...]:
    """Figures of the recordings, of their residuals and of the orders, as files."""
    found = []
    names = [one.recording.name for one in contents.simulated]
    files = file_names(names, ("", _DETAIL))
    for one in contents.simulated:
        file = f"recordings/{files[one.recording.name]}"
        for end, is_detail in (("", False), (_DETAIL, True)):
            draw = partial(simulation_figure, one, is_detail=is_detail)
            found.append(Drawing(f"{file}{end}.png", draw))
    tested = [one for one in contents.simulated if one.tests is not None]
    files = file_names([one.recording.name for one in tested], ("",))
    for one in tested:
        file = f"residuals/{files[one.recording.name]}.png"
        found.append(Drawing(file, partial(residuals_figure, one)))
    grid = contents.grid
    if grid is not None and np.isfinite(grid.rmsd).any():
        found.append(Drawing("orders/rmsd.png", partial(order_grid_figure, grid)))
    return tuple(found)


# Answers, sections of the page in their order, and figures beside it.
ANSWERS = (model_answer,)
SECTIONS = (recordings_section, residuals_section, orders_section)
DRAWINGS = (recording_drawings,)
