"""Python that results may carry: which of it may become part of a model again.

Results and cache hold the text of a user's own functions, and simulating such a model
runs it. Whoever can write results could so have anything run. A stored function is
therefore taken only where the user has named the same text: in the configuration at
hand, or by leave for a model. A command allows what its configuration names before it
reads results.
"""

from collections.abc import Iterable

from hwid_cli.errors import UntrustedFunctionError
from hwid_cli.records.maps import OwnFunction

_allowed: set[tuple[str, str]] = set()
_is_all_allowed = False


def allow_only(functions: Iterable[OwnFunction], *, has_leave: bool = False) -> None:
    """Say which functions stored results may hold, from now on in this process.

    Parameters
    ----------
    functions : iterable of OwnFunction
        That the configuration at hand names.
    has_leave : bool
        Whether the user trusts every function.
    """
    global _is_all_allowed  # noqa: PLW0603, RUF100 - of the process, as its imports are
    _allowed.clear()
    _allowed.update((one.name, one.source) for one in functions)
    _is_all_allowed = has_leave


def is_allowed(function: OwnFunction) -> bool:
    """Whether the user has named this function, with this text."""
    return _is_all_allowed or (function.name, function.source) in _allowed


def check_function(function: OwnFunction) -> None:
    """Refuse a stored function that the user has not named.

    Raises
    ------
    UntrustedFunctionError
        Before anything of it has run.
    """
    if is_allowed(function):
        return
    is_other = function.name in {name for name, _ in _allowed}
    found = "names with another text" if is_other else "does not name"
    raise UntrustedFunctionError(
        f"holds a model with the Python function {function.name!r}, which the "
        f"configuration {found}; it was not run; expected its text in a file that "
        "fit.input_map or fit.output_map names"
    )
