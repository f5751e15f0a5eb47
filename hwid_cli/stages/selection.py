"""Which recordings take part in a stage."""

from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from typing import Any, TypeVar, get_args, get_type_hints

from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import OF_RECORDINGS, Experiment
from hwid_cli.records.recordings import RawRecording, Recording

Chosen = TypeVar("Chosen", Recording, RawRecording)


def select_recordings(
    recordings: Sequence[Chosen],
    names: Sequence[str] | None,
    *,
    key: str,
    held_out: Sequence[str] = (),
) -> tuple[Chosen, ...]:
    """Choose recordings by name, in their own order.

    Parameters
    ----------
    names : sequence of str or None
        None means all that are not held out.
    key : str
        Key of the configuration that holds the names, for messages.
    held_out : sequence of str
        Recordings that only the final test may see.

    Raises
    ------
    ConfigError
        If a name is unknown, or nothing is left.
    """
    known = [recording.name for recording in recordings]
    for name in (*(names or ()), *held_out):
        if name not in known:
            place = key if name in (names or ()) else "test.recordings"
            close = get_close_matches(name, known, n=1)
            expected = f"did you mean {close[0]!r}?" if close else _list(known)
            raise ConfigError(f"{place}: no recording {name!r}; {expected}")
    wanted = set(known) - set(held_out) if names is None else set(names)
    chosen = tuple(recording for recording in recordings if recording.name in wanted)
    if not chosen:
        raise ConfigError(f"{key}: no recording is left; {_list(known)}")
    return chosen


def _list(known: Sequence[str]) -> str:
    shown = ", ".join(known[:6]) + (", ..." if len(known) > 6 else "")
    return f"expected some of {shown}"


def named_recordings(experiment: Experiment) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Give every list of names of recordings in a configuration.

    Yields
    ------
    str
        Its key.
    tuple of str
        The names.
    """
    for section in fields(experiment):
        options = getattr(experiment, section.name)
        if not is_dataclass(options):
            continue
        hints = get_type_hints(type(options), include_extras=True)
        for one in fields(options):
            names = getattr(options, one.name)
            # "auto" stands for a choice that the program makes.
            if _names_recordings(hints[one.name]) and not isinstance(names, str):
                yield f"{section.name}.{one.name}", names or ()


def _names_recordings(hint: Any) -> bool:
    """Whether an annotation, or a member of its union, is marked ``OF_RECORDINGS``."""
    marks = getattr(hint, "__metadata__", ())
    return OF_RECORDINGS in marks or any(map(_names_recordings, get_args(hint)))
