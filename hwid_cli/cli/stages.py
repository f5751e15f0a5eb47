"""What every stage's function has in common; light, so that ``hwid --help`` stays fast."""

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session

Result = TypeVar("Result")


def once(stage: Callable[["Session"], Result]) -> Callable[["Session"], Result]:
    """Run a stage's function once in a session: several stages may need its result.

    Parameters
    ----------
    stage : callable
        Takes the session.

    Returns
    -------
    callable
        Gives later callers what the first one got.
    """

    @wraps(stage)
    def first_time_only(session: "Session") -> Result:
        if stage.__name__ not in session.finished:
            session.finished[stage.__name__] = stage(session)
        result: Result = session.finished[stage.__name__]
        return result

    return first_time_only
