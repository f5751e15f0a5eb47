"""Why the smallest good one of some candidates is to be taken, in words."""

import textwrap
from collections.abc import Sequence

from hwid_cli.records.order import Judgement


def reason_to_take(
    judgement: Judgement, tolerance: float, things: str, best: str | None
) -> str:
    """Say why candidates are taken that other recordings have judged.

    Parameters
    ----------
    judgement : Judgement
    tolerance : float, [-]
    things : str
        What the candidates are, in the plural.
    best : str or None
        The best ones; None where these are taken.

    Returns
    -------
    str
        Goes on behind a colon.
    """
    on = (
        "recordings that the models were not fitted to"
        if judgement.n_judges > 1
        else "the one recording that it was not fitted to"
    )
    if best is None:
        return (
            f"they have the lowest RMSD on {on}, and no smaller ones come within "
            f"{100 * tolerance:g} % or one standard error of it."
        )
    within = f"the tolerance of {100 * tolerance:g} %"
    if judgement.factor > 1.0 + tolerance:
        within = (
            f"one standard error ({judgement.standard_error:.2g}) of the difference"
        )
    return (
        f"on {on} they are on average {100 * (judgement.factor - 1):.3g} % further off than "
        f"the best {best}; that is within {within}, and no smaller {things} are."
    )


def beyond_sentence(judgement: Judgement) -> str:
    """Say which pairs of model and recording do not judge.

    Parameters
    ----------
    judgement : Judgement

    Returns
    -------
    str
        Empty where all do.
    """
    count = judgement.n_beyond
    if not count:
        return ""
    return (
        f"{count} pair{'s' * (count != 1)} of model and recording {'do' if count != 1 else 'does'} "
        "not judge: there the input goes beyond what the model has seen, and a map is only "
        "a continuation."
    )


def outlier_sentence(judgement: Judgement) -> str:
    """Say how many samples of the judging recordings do not count.

    Parameters
    ----------
    judgement : Judgement

    Returns
    -------
    str
        Empty where all do.
    """
    count = judgement.n_outliers
    if not count:
        return ""
    return (
        f"{count} sample{'s' * (count != 1)} of the judging recordings "
        f"{'are outliers' if count != 1 else 'is an outlier'} and "
        f"{'do' if count != 1 else 'does'} not count here, as in the fits (fit.loss)."
    )


def paragraphs(sentences: Sequence[str], width: int) -> str:
    """Give each reason a paragraph of its own.

    Parameters
    ----------
    sentences : sequence of str
        Empty ones are left out.
    width : int, [characters]
        Of a line.

    Returns
    -------
    str
    """
    return "\n".join(
        textwrap.fill(one, width, subsequent_indent="  ") for one in sentences if one
    )
