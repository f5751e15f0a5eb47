"""Section about the chosen models: maps, frequency response, poles and zeros."""

from math import isfinite, sqrt

from hwid_cli.records.report import ModelView, ReportContents
from hwid_cli.report.figures.models import bode_figure, maps_figure, poles_figure
from hwid_cli.report.formats import counted, with_unit
from hwid_cli.report.groups import NOTHING_COVERED
from hwid_cli.report.page import (
    Figures,
    PageBlock,
    Section,
    drawn,
    file_names,
    section_notes,
)
from hwid_cli.report.table import Heading, Text

# What the files of a model's figures end with.
_FIGURES = ("_maps", "_bode", "_poles")


def models_section(contents: ReportContents) -> Section:
    """Show the chain of groups, or else the widest models, from all sides."""
    blocks: list[PageBlock] = []
    if not contents.models:
        blocks.append(Text(_why_none(contents), is_note=True))
    elif contents.stored.search is not None:
        blocks.append(Text("The chain of groups, from one recording to the winner."))
    else:
        blocks.append(Text("The models that cover the most recordings."))
    if contents.models:
        blocks += section_notes(contents, is_validation=True)
    files = file_names([view.model for view in contents.models], _FIGURES)
    for view in contents.models:
        file = f"models/{files[view.model]}"
        blocks += [Heading(view.model), _figures(view, file)]
    return Section("models", "The chosen models", "Models", tuple(blocks))


def _why_none(contents: ReportContents) -> str:
    search = contents.stored.search
    if search is not None and not search.chain:
        return f"No model is chosen: {NOTHING_COVERED}"
    if contents.cross is not None:
        return "No model is chosen: every fit failed."
    return "No models chosen yet: run 'hwid crossval CONFIG' or 'hwid group CONFIG'."


def _figures(view: ModelView, file: str) -> Figures:
    maps, bode, pole_zero = (f"{file}{ending}" for ending in _FIGURES)
    images = (
        drawn(
            maps,
            maps_figure(view),
            f"Input and output map of {view.model} with their corners",
        ),
        drawn(
            bode,
            bode_figure(view),
            f"Magnitude and phase of the linear block of {view.model}",
        ),
        drawn(
            pole_zero,
            poles_figure(view),
            f"Poles and zeros of {view.model} and the unit circle",
        ),
    )
    return Figures(images, _sentence(view))


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
