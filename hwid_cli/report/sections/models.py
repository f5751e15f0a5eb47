"""Section about the chosen models: maps, frequency response, poles and zeros."""

from functools import partial
from math import isfinite, sqrt

import numpy as np

from hwid_cli.records.report import MapCurve, ModelView, ReportContents
from hwid_cli.report.charts import Chart, Curve, Panel, on_common_axis
from hwid_cli.report.figures.models import bode_figure, maps_figure, poles_figure
from hwid_cli.report.formats import counted, with_unit
from hwid_cli.report.groups import NOTHING_COVERED
from hwid_cli.report.page import (
    Drawing,
    PageBlock,
    Picker,
    Row,
    Section,
    file_names,
    section_notes,
)
from hwid_cli.report.table import Text

# What the files of a model's figures end with.
_FIGURES = ("_maps", "_bode", "_poles")
# Points of the unit circle's upper half.
_CIRCLE = 90


def models_section(contents: ReportContents) -> Section:
    """Show the chain of groups, or else the widest models, from all sides."""
    blocks: list[PageBlock] = []
    missing = "" if contents.models else _why_none(contents)
    if contents.models:
        is_chain = contents.stored.search is not None
        which = (
            "The chain of groups, the winner first."
            if is_chain
            else "The models that cover the most recordings."
        )
        views = contents.models[::-1] if is_chain else contents.models
        blocks += [Text(which), *section_notes(contents, is_validation=True)]
        items = [(view.model, _model_blocks(view)) for view in views]
        blocks.append(Picker("model", tuple(items)))
    return Section("models", "The chosen models", "Models", tuple(blocks), missing)


def model_drawings(contents: ReportContents) -> tuple[Drawing, ...]:
    """Figures of the chosen models as files."""
    files = file_names([view.model for view in contents.models], _FIGURES)
    draws = (maps_figure, bode_figure, poles_figure)
    return tuple(
        Drawing(f"models/{files[view.model]}{end}.png", partial(draw, view))
        for view in contents.models
        for end, draw in zip(_FIGURES, draws, strict=True)
    )


def _why_none(contents: ReportContents) -> str:
    search = contents.stored.search
    if search is not None and not search.chain:
        return f"no model is chosen: {NOTHING_COVERED}"
    if contents.cross is not None:
        return "no model is chosen: every fit failed."
    return "no models chosen yet: run 'hwid crossval CONFIG' or 'hwid group CONFIG'."


def _model_blocks(view: ModelView) -> tuple[PageBlock, ...]:
    maps = (
        _map_chart(view, view.input_curve, "input", view.input_range),
        _map_chart(view, view.output_curve, "output", view.block_range),
    )
    block = (_step_chart(view), _bode_chart(view), _poles_chart(view))
    return (Text(_sentence(view)), Row(maps), Row(block))


def _map_chart(
    view: ModelView, curve: MapCurve, side: str, visited: tuple[float, float]
) -> Chart:
    """A static map with its corners; what the fit has visited is shaded."""
    at, (line, corners) = on_common_axis(
        (curve.argument, curve.value), (curve.corners, curve.corner_values)
    )
    curves = [Curve(f"{side} map", line, "map")]
    if curve.corners.size:
        curves.append(Curve("corners", corners, "corner", "points"))
    of, to = ("u", "w") if side == "input" else ("x", "y")
    units = (view.input_unit, view.input_unit)
    if side == "output":
        units = (view.input_unit, view.output_unit)
    panel = Panel(f"{to} [{units[1]}]", tuple(curves), spans=(visited,))
    return Chart(
        name=f"{view.model}, {side} map",
        at=at,
        label=f"{of} [{units[0]}]",
        panels=(panel,),
        sentence=(
            f"The {side} map; shaded is what the fit has visited, from "
            f"{with_unit(visited[0], units[0])} to {with_unit(visited[1], units[0])}. "
            "Beyond it the map is extrapolated."
        ),
        alt=f"The {side} map of {view.model}: {to} over {of}, with the range visited",
        has_gaps_closed=True,
    )


def _step_chart(view: ModelView) -> Chart:
    step = view.step
    final = float(step.value[-1])
    curve = Curve("step response", step.value, "map")
    return Chart(
        name=f"{view.model}, step response",
        at=step.time_s,
        label="time t [s]",
        panels=(Panel("step response x [-]", (curve,), lines=(final,)),),
        sentence=f"Step response of the linear block; it ends at {final:.3g}.",
        alt=f"Step response of the linear block of {view.model} over time",
    )


def _bode_chart(view: ModelView) -> Chart:
    response = view.response
    with np.errstate(divide="ignore"):
        decibel = 20.0 * np.log10(response.magnitude)
    magnitude = Curve("magnitude", decibel, "map")
    phase = Curve("phase", response.phase_deg, "map")
    return Chart(
        name=f"{view.model}, Bode plot",
        at=response.frequency_Hz,
        label="frequency [Hz]",
        panels=(
            Panel("magnitude [dB]", (magnitude,), height_px=120),
            Panel("phase [deg]", (phase,), height_px=100),
        ),
        sentence="Bode plot of the linear block up to half the sampling frequency.",
        alt=f"Magnitude and phase of the linear block of {view.model} over frequency",
        is_log=True,
    )


def _poles_chart(view: ModelView) -> Chart:
    angle = np.linspace(np.pi, 0.0, _CIRCLE)
    at, (upper, lower, poles, zeros) = on_common_axis(
        (np.cos(angle), np.sin(angle)),
        (np.cos(angle), -np.sin(angle)),
        (view.poles.real, view.poles.imag),
        (view.zeros.real, view.zeros.imag),
    )
    most = 1.15 * max(
        1.0, *np.abs(view.poles), *np.abs(view.zeros[np.abs(view.zeros) < 3.0])
    )
    near = np.where(np.abs(zeros) > most, np.nan, zeros)
    curves = (
        Curve("unit circle", upper, "frame"),
        Curve("unit circle", lower, "frame"),
        Curve("poles", poles, "pole", "cross"),
        Curve("zeros", near, "zero", "points"),
    )
    inside = int(np.sum(np.abs(view.poles) < 1.0))
    away = int(np.sum(np.abs(view.zeros) > most))
    outside = f"; {counted(away, 'zero')} farther out" if away else ""
    return Chart(
        name=f"{view.model}, poles and zeros",
        at=at,
        label="real part [-]",
        panels=(Panel("imaginary part [-]", curves, limits=(-most, most)),),
        sentence=(
            f"Poles (crosses) and zeros (circles): {inside} of "
            f"{counted(len(view.poles), 'pole')} inside the unit circle{outside}."
        ),
        alt=f"Poles and zeros of {view.model} with the unit circle",
        window=(-most, most),
        has_gaps_closed=True,
        is_square=True,
    )


def _sentence(view: ModelView) -> str:
    """What the figures show, from the model's own numbers."""
    stable = "stable" if view.is_stable else "not stable"
    corners = len(view.input_curve.corners), len(view.output_curve.corners)
    peak = int(view.response.magnitude.argmax())
    # A peak at the lowest frequency drawn may lie further down: its place says nothing.
    most = (
        f"most at {with_unit(view.response.frequency_Hz[peak], 'Hz')}"
        if peak
        else "low frequencies most"
    )
    return (
        f"Covers {view.coverage} of {view.covers_of} with an RMSD of "
        f"{with_unit(view.rmsd, view.output_unit)} on its own recordings; "
        f"{corners[0]} corners in the input map and {corners[1]} in the output map; the "
        f"linear block is {stable}, has {counted(len(view.poles), 'pole')}, "
        f"{counted(len(view.zeros), 'zero')} and a delay of "
        f"{counted(view.delay, 'sample')}, and passes {most}.{_criteria(view)}"
    )


def _criteria(view: ModelView) -> str:
    """What weighs the fit against its parameters; nothing where it was not worked out."""
    known = view.information
    if not isfinite(known.aic):
        return ""
    return (
        f" The data determine {counted(known.n_parameters, 'parameter')}: AIC "
        f"{known.aic:.0f}, BIC {known.bic:.0f}, root of the final prediction error (FPE) "
        f"{with_unit(sqrt(known.fpe), view.output_unit)}."
    )
