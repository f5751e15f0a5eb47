"""Which model serves which recording, as text."""

from collections.abc import Sequence

from hwid_cli.records.groups import FinalTest, Prediction
from hwid_cli.report.simulation_words import simulation_words
from hwid_cli.report.text_table import (
    GAP,
    MISSING,
    WIDTH,
    joined_names,
    number,
    text_table,
)

# Room for names of recordings, however long the names of models are, [characters].
_LEAST_ROOM = 24


def smallest_set_table(
    final: FinalTest, *, initial_state: str, width: int = WIDTH
) -> str:
    """Show the smallest set of models and what each serves (as T3.4.3-2).

    Parameters
    ----------
    final : FinalTest
    initial_state : str
        Rule of the fits.
    width : int, [characters]
        Of the screen.

    Returns
    -------
    str
        Models are numbered M1, M2, ... for the table of predictions.
    """
    if not final.smallest_set:
        return "No model covers any recording, so no set of models is of use."
    short = _short_labels(final)
    taken = [max(map(len, (*final.smallest_set, "model"))), len("M99"), len("serves")]
    room = max(_LEAST_ROOM, width - sum(taken) - 3 * len(GAP))
    rows = []
    for model in final.smallest_set:
        served = _served_by(model, final)
        first, *others = joined_names(served, width=room)
        rows.append((short[model], model, str(len(served)), first))
        rows += [("", "", "", line) for line in others]
    n_covered = len(final.recordings) - len(final.uncovered)
    title = (
        f"Fewest models that cover all that any model covers: {len(final.smallest_set)} of "
        f"{len(final.models)} models\nfor {n_covered} of {len(final.recordings)} "
        "recordings; each served by the lowest RMSD, * covered\n(form of T3.4.3-2)\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    heads = ("", "model", "serves", "recordings")
    return text_table(title, heads, rows, text_columns=(0, 1, 3))


def _served_by(model: str, final: FinalTest) -> list[str]:
    """Recordings that a model of the smallest set serves, marked where covered."""
    values = final.rmsd[final.models.index(model)]
    return [
        name + ("*" if value < final.threshold else "")
        for name, value, chosen in zip(
            final.recordings, values, final.assigned_in_set, strict=True
        )
        if chosen == model
    ]


def _short_labels(final: FinalTest) -> dict[str, str]:
    labels = {model: f"M{n}" for n, model in enumerate(final.smallest_set, 1)}
    return labels | {"": MISSING}


def prediction_table(final: FinalTest, *, initial_state: str) -> str:
    """Show which model the input alone tells to use, and how that went.

    Parameters
    ----------
    final : FinalTest
    initial_state : str
        Rule of the fits.

    Returns
    -------
    str
        Beneath the table stands how often the choice was right.
    """
    short = _short_labels(final)
    rows = [
        (
            told.recording,
            "test" if told.recording in final.tested_on else "",
            told.nearest or MISSING,
            f"{told.distance:.3f}" if told.nearest else MISSING,
            short[told.model],
            number(told.rmsd) + ("*" if told.is_right else " "),
            short[told.best_model],
            number(told.best_rmsd) + ("*" if told.is_possible else " "),
        )
        for told in final.predictions
    ]
    heads = (
        "recording",
        "",
        "nearest",
        "distance",
        "model",
        "RMSD ",
        "best",
        "its RMSD ",
    )
    title = (
        "Model for a recording told from its input: that of the recording of nearest input,"
        f"\nRMSD [{final.unit}], * covered; models fitted to the recording itself are "
        f"left out\n{simulation_words(initial_state, is_validation=True)}"
    )
    table = text_table(title, heads, rows, text_columns=(0, 1, 2))
    return f"{table}\n{prediction_line(final)}"


def prediction_line(final: FinalTest) -> str:
    """Say how often the model that the input told was right.

    Parameters
    ----------
    final : FinalTest

    Returns
    -------
    str
    """
    tests = [told for told in final.predictions if told.recording in final.tested_on]
    return (
        f"Right for {_rights(final.predictions)} recordings ({_rights(tests)} test "
        f"recordings);\nsome model that could have been chosen covers "
        f"{sum(told.is_possible for told in final.predictions)} "
        f"({sum(told.is_possible for told in tests)}) of them."
    )


def _rights(predictions: Sequence[Prediction]) -> str:
    return f"{sum(told.is_right for told in predictions)} of {len(predictions)}"
