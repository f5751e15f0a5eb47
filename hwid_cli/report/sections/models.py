"""Section about the chosen models: maps, frequency response, poles and zeros."""

from hwid_cli.records.report import ModelView, ReportContents
from hwid_cli.report.figures.models import bode_figure, maps_figure, poles_figure
from hwid_cli.report.page import Block, Figures, Heading, Section, Text
from hwid_cli.report.sections.words import counted, drawn, file_name, with_unit


def models_section(contents: ReportContents) -> Section:
    """Show the chain of groups, or else the widest models, from all sides.

    Parameters
    ----------
    contents : ReportContents

    Returns
    -------
    Section
    """
    blocks: list[Block] = []
    if not contents.models:
        text = (
            "No models chosen yet: run 'hwid crossval CONFIG' or 'hwid group CONFIG'."
        )
        blocks.append(Text(text, is_note=True))
    elif contents.stored.search is not None:
        blocks.append(Text("The chain of groups, from one recording to the winner."))
    else:
        blocks.append(Text("The models that cover the most recordings."))
    for view in contents.models:
        blocks += [Heading(view.model), _figures(view)]
    return Section("models", "The chosen models", "Models", tuple(blocks))


def _figures(view: ModelView) -> Figures:
    file = f"models/{file_name(view.model)}"
    images = (
        drawn(
            f"{file}_maps",
            maps_figure(view),
            f"Input and output map of {view.model} with their break-points",
        ),
        drawn(
            f"{file}_bode",
            bode_figure(view),
            f"Magnitude and phase of the linear block of {view.model}",
        ),
        drawn(
            f"{file}_poles",
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
    return (
        f"Covers {view.coverage} of {view.covers_of} with an RMSD of "
        f"{with_unit(view.rmsd, view.output_unit)} on its own recordings; "
        f"{corners[0]} corners in the input map and {corners[1]} in the output map; the "
        f"linear block is {stable}, has {counted(len(view.poles), 'pole')}, "
        f"{counted(len(view.zeros), 'zero')} and a delay of "
        f"{counted(view.delay, 'sample')}, and passes most at "
        f"{with_unit(view.response.frequency_Hz[peak], 'Hz')}."
    )
