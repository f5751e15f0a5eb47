"""A pair of maps in words, and as keys of the configuration."""

from hwid_cli.records.answer import ChosenMaps
from hwid_cli.records.order import MapCandidate


def map_words(kind: str, units: int) -> str:
    """Kind of a map with its size.

    Examples
    --------
    >>> map_words("piecewise_linear", 5)
    'piecewise linear, 5'
    """
    words = kind.replace("_", " ")
    return f"{words}, {units}" if units else words


def fit_keys(pair: MapCandidate | ChosenMaps) -> str:
    """Keys of the section ``fit`` that ask for these maps.

    Not the section itself: who copies it would lose the other keys.
    """
    keys = []
    for side in ("input", "output"):
        keys.append(f"{side}_map: {getattr(pair, f'{side}_map')}")
        if units := getattr(pair, f"{side}_units"):
            keys.append(f"{side}_units: {units}")
    return ", ".join(keys)
