"""How far a prediction may be trusted, as sentences and tables."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.records.trust import Band, RecordingTrust
from hwid_cli.records.units import behind
from hwid_cli.report.formats import listed, number, share_text
from hwid_cli.report.table import Table, numbers, texts

# Share of the samples beyond all values that were recorded from which that is told.
_MUCH_BEYOND = 0.1
# Recordings that a sentence names.
_FEW = 3

# What the columns of the tables say.
COLUMNS = (
    "value, rate, frequency: share of the samples at which the fit has seen the like. By "
    "frequency the whole sample counts as new where one octave of the input is stronger than "
    "it ever was in the fit, however little that adds: steps of another size or length often "
    "are new throughout. The band is wider there; held: the share of what was measured that "
    "lies in it."
)


def band_note(band: Band, unit: str, judged_on: Sequence[str]) -> str:
    """Say how wide a band is, what tells that, and how much rests on data; a line each.

    Parameters
    ----------
    judged_on : sequence of str
        Recordings, or parts of one, that the fit was judged by.
    """
    where = band.inside
    told = "no recording beside the fit tells its width"
    if judged_on:
        which = listed(judged_on, most=_FEW)
        told = f"its width is told by {which}, held out or left out in turn"
    width = number(float(np.mean(band.upper - band.lower)))
    beyond = 1.0 - float(where.amplitude.mean())
    lines = [
        f"the band of 90 % is {width}{behind(unit)} wide on average; {told}",
        f"{share_text(where.all.mean())} of the samples rest on data in every respect "
        f"(value {share_text(where.amplitude.mean())}, rate "
        f"{share_text(where.rate.mean())}, frequency "
        f"{share_text(where.frequency.mean())}); the columns ..._known say which",
    ]
    if beyond >= _MUCH_BEYOND:
        lines.append(
            f"at the {share_text(beyond)} of the samples whose values no recording of the "
            "model had the band is wider, but nobody has checked that it holds 90 % there"
        )
    return "\n".join(lines)


TESTED = "How far models may be trusted on the test recordings"
HELD_OUT = "How far the simulation may be trusted on recordings that were held out"
VALIDATING = "How far models may be trusted on recordings of others"


def trust_table(found: Sequence[RecordingTrust], about: str = TESTED) -> Table:
    """Show how far models may be trusted on recordings that they have not used."""
    unit = found[0].unit if found else ""
    rows = tuple(
        (
            one.model,
            one.recording,
            share_text(one.inside_amplitude),
            share_text(one.inside_rate),
            share_text(one.inside_frequency),
            share_text(one.coverage),
            number(one.width),
            number(one.rmsd),
        )
        for one in found
    )
    return Table(
        f"{about}: samples inside what was visited, and the band of 90 % [{unit}]",
        (
            *texts("model", "recording"),
            *numbers("value", "rate", "frequency", "held", "width", "RMSD"),
        ),
        rows,
        (COLUMNS,) if rows else (),
        is_validation=True,
    )
