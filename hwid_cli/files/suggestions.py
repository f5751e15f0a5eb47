"""What a user may have meant by a name that is not known."""

from collections.abc import Iterable
from difflib import SequenceMatcher, get_close_matches

from hwid_cli.files.messages import escaped

# Below this likeness a suggestion misleads more often than it helps.
_LIKENESS = 0.6
# A second suggestion is nearly as like as the first, [-].
_ALMOST_AS_CLOSE = 0.1
_LISTED = 12
# Longer names are cut: a message is one line to read.
_LONGEST = 60


def did_you_mean(found: object, known: Iterable[object]) -> str:
    """Next step for an unknown name: the closest known ones, or all of them.

    Parameters
    ----------
    found : object
        The name as the user wrote it.
    known : iterable of object
        The names that would have been understood.

    Returns
    -------
    str
        The end of an error message, without a full stop.

    Examples
    --------
    >>> did_you_mean("nkk", ["nb", "nk"])
    "did you mean 'nk'?"
    >>> did_you_mean("voltage", ["nb", "nk"])
    'expected one of nb, nk'
    >>> did_you_mean("order_grid", ["name", "order", "orders"])
    "did you mean 'order' or 'orders'?"
    >>> did_you_mean("voltage", [])
    'expected none'
    """
    names = [_short(str(name)) for name in known]
    folded = {name.casefold(): name for name in reversed(names)}
    wanted = _short(str(found)).casefold()
    close = get_close_matches(wanted, folded, n=2, cutoff=_LIKENESS)
    if close:
        likeness = [SequenceMatcher(None, one, wanted).ratio() for one in close]
        close = close[: 1 + (likeness[-1] > likeness[0] - _ALMOST_AS_CLOSE)][:2]
        return f"did you mean {' or '.join(repr(folded[one]) for one in close)}?"
    if not names:
        return "expected none"
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return f"expected one of {', '.join(names[:_LISTED])}{more}"


def _short(name: str) -> str:
    return escaped(name if len(name) <= _LONGEST else f"{name[: _LONGEST - 3]}...")
