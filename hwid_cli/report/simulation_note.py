"""How a printed number was simulated: in free run, and from which initial state.

Prediction or simulation, and from which state, decides what an RMSD means; every table
and figure of fits says it in these words.
"""

# What numbers of fits that bear outliers still count.
HUBER_NOTE = (
    "Fitted with Huber's loss; RMSD and fit % count outliers in full, criteria do not."
)

_OWN = {
    "zero": "initial state zero",
    "steady": "initial state steady at the first input",
    "estimated": "initial state estimated with the model",
}
_VALIDATED = {
    "zero": "initial state zero",
    "steady": "initial state steady at the first input",
    "estimated": "initial state estimated on each recording",
}

# Of an exported model, which has no recording beside it.
_PREDICTED = _OWN | {
    "estimated": "initial state that of the first recording of its fit"
}
# Rules that ``hwid predict`` puts in the place of the model's own.
_ASKED = {"steady": "steady", "empty": "zero"}


def simulation_note(initial_state: str, *, is_validation: bool) -> str:
    """Say that numbers are of a free-run simulation, and how it starts.

    Parameters
    ----------
    initial_state : str
        Rule of the fit; one of ``model.INITIAL_STATES``.
    is_validation : bool
        Whether the models are simulated after the fit, on whatever recordings: then an
        estimated initial state, and nothing else, is fitted to each of them. Else the
        numbers are those of the fit itself.

    Examples
    --------
    >>> simulation_note("zero", is_validation=True)
    'Free-run simulation, no prediction; initial state zero.'
    >>> simulation_note("estimated", is_validation=False)
    'Free-run simulation, no prediction; initial state estimated with the model.'
    """
    start = (_VALIDATED if is_validation else _OWN)[initial_state]
    return f"Free-run simulation, no prediction; {start}."


def joined_note(initial_state: str, join: str) -> str:
    """Say how the fit of several joined recordings starts.

    Parameters
    ----------
    initial_state : str
        Rule of the fit; one of ``model.INITIAL_STATES``.
    join : str
        One of ``model.JOINS``.

    Examples
    --------
    >>> joined_note("estimated", "concatenate")
    'In a fit, joined recordings start once, with an estimated state.'
    >>> joined_note("zero", "experiments")
    'In a fit, each joined recording starts by itself, with a zero state.'
    """
    state = {
        "zero": "a zero state",
        "steady": "the steady state",
        "estimated": "an estimated state",
    }[initial_state]
    if join == "concatenate":
        return f"In a fit, joined recordings start once, with {state}."
    return f"In a fit, each joined recording starts by itself, with {state}."


def prediction_note(start: str, model_rule: str | None) -> str:
    """Say from which initial state an exported model predicts.

    Parameters
    ----------
    start : str
        One of ``STARTS_OF_PREDICTIONS``.
    model_rule : str or None
        Rule of the model's fit; None for a physics simulation.

    Examples
    --------
    >>> prediction_note("fitted", "steady")
    'Free-run simulation; initial state steady at the first input.'
    >>> prediction_note("steady", None)
    'Free-run simulation; it starts at rest.'
    """
    if model_rule is None:
        return "Free-run simulation; it starts at rest."
    return f"Free-run simulation; {_PREDICTED[_ASKED.get(start, model_rule)]}."
