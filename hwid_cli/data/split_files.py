"""Recordings whose input and output stand in files of their own, for ``hwid init``.

Some oscilloscopes write a file for each channel, some programs one for each message. The
names of two such files differ in one place, and differ there in every recording alike.
Their columns are put side by side, as if one file held them; those of the second file are
marked.
"""

import glob
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, takewhile
from pathlib import PurePosixPath

from hwid_cli.data.column_clocks import long_columns
from hwid_cli.data.column_signs import clock_of
from hwid_cli.data.column_words import meaning_of
from hwid_cli.data.units import split_unit
from hwid_cli.records.starter import FolderLayout, FoundColumn, FoundFile, Role

# In front of the keys of the second file: no column is called so.
_MARK = "\u21e2"
# What programs call the only signal of a file, whatever it is.
_ANY_SIGNAL = frozenset(("data", "value", "values", "val", "wert", "signal", "reading"))
# Files whose names are compared.
_MOST_FILES = 200


@dataclass(frozen=True, eq=False)
class SplitRecordings:
    """Pairs of files, each as one.

    Parameters
    ----------
    files : tuple of FoundFile
        With the name of the first file.
    change : tuple of two str
        What that name has, and that of the second file in its place.
    keys : mapping of str to (str or int)
        Keys in the second file, by their marked ones.
    """

    files: tuple[FoundFile, ...]
    change: tuple[str, str]
    keys: Mapping[str, str | int]

    def is_marked(self, role: Role) -> bool:
        """Whether a column is one of the second file."""
        return role.key in self.keys

    def with_own_keys(self, layout: FolderLayout) -> FolderLayout:
        """Layout whose output is in the second file, with the keys of that file."""
        clock = layout.output_time
        if clock is None and layout.time is not None:
            clock = self._same_clock(layout.time)
        note = (
            f"the output stands in a file of its own, which is called "
            f"{self.change[1]!r} where that of the input is called {self.change[0]!r}"
        )
        return replace(
            layout,
            patterns=self._patterns({name for name, _ in layout.left}),
            output=self._own(layout.output),
            output_time=None if clock is None else self._own(clock),
            output_file=self.change,
            notes=(note, *layout.notes),
        )

    def _patterns(self, left: Collection[str]) -> tuple[str, ...]:
        """One pattern where the first files have an ending of their own, else their names.

        Parameters
        ----------
        left : collection of str
            Files that are not used: no pattern finds the others alone.
        """
        names = [one.name for one in self.files if one.name not in left]
        ends = {name.rpartition(self.change[0])[2] for name in names}
        if not left and len(ends) == 1 and not set(self.change[0]) & set("[]*?"):
            below = "**/" if any("/" in name for name in names) else ""
            return (f"{below}*{self.change[0]}{ends.pop()}",)
        return tuple(glob.escape(name) for name in names)

    def _own(self, role: Role) -> Role:
        return replace(role, key=self.keys.get(str(role.key), role.key))

    def _same_clock(self, time: Role) -> Role | None:
        """Clock of the second file where it is called otherwise than the first one."""
        there = set(self.keys.values())
        if time.key in there:
            return None
        titled = [
            one
            for file in self.files[:1]
            for one in file.columns
            if one.key in self.keys and meaning_of(one.title, one.unit).role == "time"
        ]
        return replace(time, key=titled[0].key) if titled else None


def split_recordings(files: Sequence[FoundFile]) -> Iterator[SplitRecordings]:
    """Ways to put files side by side; each comes in both directions."""
    named = {one.name: one for one in files[:_MOST_FILES] if long_columns(one.columns)}
    counts = Counter(
        change
        for first, second in combinations(named, 2)
        if (change := _change(first, second)) is not None
    )
    for change in sorted(counts, key=lambda one: _rank(one, counts, named)):
        if counts[change] * 2 >= len(named) - 1:
            for ends in (change, change[::-1]):
                if found := _joined(named, ends):
                    yield found


def _rank(
    change: tuple[str, str],
    counts: Mapping[tuple[str, str], int],
    names: Mapping[str, FoundFile],
) -> tuple[int, bool, bool, int]:
    """What most files differ in comes first, of that names of signals, words, late ones."""
    roles = {meaning_of(one, "").role for one in change}
    is_number = not any(one.isalpha() for one in "".join(change))
    late = max(name.rfind(change[0]) for name in names)
    return -counts[change], not {"input", "output"} <= roles, is_number, -late


def _change(first: str, second: str) -> tuple[str, str] | None:
    """What differs between two names; None where it is more than one place."""
    begin = _alike_from_the_left(first, second)
    while begin and first[begin - 1].isalpha():
        begin -= 1
    ends = (first[begin:][::-1], second[begin:][::-1])
    end = _alike_from_the_left(*ends)
    here, there = (one[end:][::-1] for one in ends)
    while end and here and ends[0][end - 1].isalpha() and here[-1].isalpha():
        end -= 1
        here, there = (one[end:][::-1] for one in ends)
    if not here or not there or "/" in here + there:
        return None
    return (here, there) if _other_name(first, (here, there)) == second else None


def _alike_from_the_left(first: str, second: str) -> int:
    """Characters that two texts begin with alike."""
    pairs = zip(first, second, strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def _other_name(name: str, change: tuple[str, str]) -> str:
    before, found, after = name.rpartition(change[0])
    return f"{before}{change[1]}{after}" if found else ""


def _joined(
    files: Mapping[str, FoundFile], change: tuple[str, str]
) -> SplitRecordings | None:
    """Pairs of files as one each; None without any."""
    keys: dict[str, str | int] = {}
    found = []
    for name, file in files.items():
        other = files.get(_other_name(name, change))
        if (
            other is None
            or PurePosixPath(name).suffix != PurePosixPath(other.name).suffix
        ):
            continue
        own = [_titled(one, change[0]) for one in file.columns]
        for one in other.columns:
            keys[f"{_MARK}{one.key}"] = one.key
            own.append(replace(_titled(one, change[1]), key=f"{_MARK}{one.key}"))
        found.append(FoundFile(name, tuple(own)))
    return SplitRecordings(tuple(found), change, keys) if found else None


def _titled(column: FoundColumn, name: str) -> FoundColumn:
    """A column with a name: a signal that has none of its own gets that of its file."""
    if clock_of(column.values) is not None:
        return column
    last = re.split(r"[./]", split_unit(column.title)[0])[-1].strip().lower()
    is_named = bool(column.title) and last not in _ANY_SIGNAL
    return column if is_named else replace(column, title=name)
