"""A folder of measurements that nobody has described: its files, and how to read them.

For ``hwid init``.
"""

import glob
import re
import statistics
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path, PurePosixPath

import numpy as np

from hwid_cli.data import column_signs as signs
from hwid_cli.data.column_clocks import (
    FEWEST_SAMPLES,
    ROUND_STAMPS,
    TimeGuess,
    clocks_of,
    guess_time,
    long_columns,
    unit_of_column,
    unused_times,
)
from hwid_cli.data.column_roles import SignalGuess, guess_signals
from hwid_cli.data.column_words import counts_recordings, meaning_of
from hwid_cli.data.conditions import condition_notes
from hwid_cli.data.formats import SUFFIXES, has_reader, list_columns, reader_of
from hwid_cli.data.header_stamps import topic_of
from hwid_cli.data.packed import stem_of
from hwid_cli.data.recording_files import PLAN_NAME, SYSTEM_NAMES
from hwid_cli.data.sampling import missing_samples
from hwid_cli.data.split_files import split_recordings
from hwid_cli.data.units import factor_between
from hwid_cli.errors import ConfigError, MeasurementError, MissingLibraryError
from hwid_cli.files.messages import escaped
from hwid_cli.records.starter import FolderLayout, FoundColumn, FoundFile, Role

# Beyond this share of samples that are missing a signal is slower than its rows, [-].
_MOST_LOST = 0.05
_SLOW = -1
# Further files that are asked which signal answers to which.
_MOST_ASKED = 7
# Stands for every table of a file, and how deep these may lie.
STAR = "*"
_DEEPEST_TABLE = 3
# Clocks that differ by a smaller share are one, [-]. A recording that is so many times as
# slow as the usual one is left out: it would take too much from the others, [-].
_SAME_CLOCK, _MOST_SLOWER = 0.01, 5.0


def list_measurements(folder: Path) -> tuple[FoundFile, ...]:
    """List the files of a folder that may be measurements, with their columns.

    Parameters
    ----------
    folder : Path
        Its own files, or, where none of them holds a table, those of all folders below.
        Hidden files, files of the system and ``plan.csv`` are left out.

    Returns
    -------
    tuple of FoundFile
        By name; files that no reader knows are among them, and say so.

    Raises
    ------
    ConfigError
        If it is no folder, or holds no such file.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise ConfigError(
            f"{folder}: is no folder; expected one that holds measurement files "
            f"({', '.join(SUFFIXES)}); correct the path"
        )
    own = [_listed(path, folder) for path in _candidates(folder, "*")]
    if any(one.columns for one in own):
        return tuple(own)
    paths = _candidates(folder, "**/*")
    if not paths:
        raise ConfigError(
            f"{folder}: holds no measurement file; expected some of "
            f"{', '.join('*' + ending for ending in SUFFIXES)}; put the files there, "
            "unpacked, or convert them"
        )
    return tuple(_listed(path, folder) for path in paths)


def _candidates(folder: Path, pattern: str) -> list[Path]:
    """Files that may hold measurements, and those beside them; none without the first."""
    found = sorted(
        path
        for path in folder.glob(pattern)
        if path.name != PLAN_NAME
        and not path.name.startswith(SYSTEM_NAMES)
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        and path.is_file()
    )
    return found if any(map(has_reader, found)) else []


def _listed(path: Path, folder: Path) -> FoundFile:
    name = path.relative_to(folder).as_posix()
    if not has_reader(path):
        return FoundFile(name, problem=f"no reader for files named *{path.suffix}")
    try:
        columns = list_columns(path)
    # The readers of foreign formats raise whatever their parser stumbles on.
    except Exception as error:
        said = " ".join(str(error).removeprefix(f"{path}: ").split())
        if isinstance(error, MissingLibraryError):
            return FoundFile(name, problem=escaped(said), lacks_library=True)
        return FoundFile(name, problem=escaped(said[:160]) or type(error).__name__)
    return FoundFile(name, columns, "" if columns else "no table of numbers")


def _with_starred_tables(file: FoundFile) -> FoundFile:
    """Stand the first of tables with the same columns for all: each is a recording.

    So does a table with the name of its file, which is another one in every file.
    """
    stem = stem_of(PurePosixPath(file.name))
    for depth in range(1, _DEEPEST_TABLE + 1):
        tables: dict[str, dict[str | int, FoundColumn]] = {}
        for one in long_columns(file.columns):
            if (place := _split_at(one, depth)) is not None:
                tables.setdefault(place[0], {})[place[1]] = one
        for name, members in tables.items():
            alike = [own for own in tables.values() if own.keys() == members.keys()]
            if not _holds_signals(members.values()):
                continue
            if len(alike) > 1 or name == stem:
                beside = [one for one in file.columns if _is_beside(one, tables)]
                beside += _shared_settings(file.columns, tables, depth)
                starred = [
                    replace(one, key=key, variable=STAR) for key, one in members.items()
                ]
                return replace(file, columns=(*starred, *beside))
    return file


def _split_at(column: FoundColumn, depth: int) -> tuple[str, str | int] | None:
    """Table of a column and its key in there; None where it is in none so deep."""
    if column.variable is not None:
        return (column.variable, column.key) if depth == 1 else None
    marks = [found.start() for found in re.finditer(r"[./]", str(column.key))]
    if len(marks) < depth:
        return None
    key = str(column.key)
    return key[: marks[depth - 1]], key[marks[depth - 1] + 1 :]


def _shared_settings(
    columns: Iterable[FoundColumn], tables: Mapping[str, object], depth: int
) -> list[FoundColumn]:
    """Single numbers inside tables that are the same in all of them, once each."""
    found: dict[str | int, dict[str, FoundColumn]] = {}
    for one in columns:
        place = _split_at(one, depth) if one.values.size == 1 else None
        if place is not None and place[0] in tables:
            found.setdefault(place[1], {})[place[0]] = one
    return [
        next(iter(own.values()))
        for own in found.values()
        if len(own) == len(tables)
        and len({float(one.values[0]) for one in own.values()}) == 1
    ]


def _is_beside(column: FoundColumn, tables: Mapping[str, object]) -> bool:
    """Whether a column is in no table: a clock or a setting for all of them."""
    name = str(column.key)
    inside = any(name.startswith((f"{one}.", f"{one}/")) for one in tables)
    return column.variable is None and not inside


def _holds_signals(columns: Iterable[FoundColumn]) -> bool:
    """Whether columns may be an input and an output."""
    able = [one for one in columns if signs.changes(one.values)]
    return sum(signs.clock_of(one.values) is None for one in able) > 1


# Where nothing tells the time, [s]: wrong, and said to be.
UNKNOWN_SAMPLE_TIME_S = 1.0


def guess_layout(files: Sequence[FoundFile]) -> FolderLayout:
    """Guess how the files of a folder are read.

    Returns
    -------
    FolderLayout
        Of the largest set of files with the same columns.

    Raises
    ------
    MeasurementError
        If no file holds an input and an output.
    """
    files = [_with_starred_tables(one) for one in files]
    alike = _alike(files)
    if not any(_holds_signals(_table(one)) for one in alike):
        for split in split_recordings(files):
            layout = _layout_of_alike(split.files, split.files)
            if not split.is_marked(layout.input):
                return split.with_own_keys(layout)
    if not alike:
        raise MeasurementError(_no_signals(files))
    layout = _layout_of_alike(alike, files)
    if _is_named_input(layout.input):
        return layout
    return _with_named_command(files) or layout


def _is_named_input(role: Role) -> bool:
    return meaning_of(role.title, role.unit).role == "input"


def _with_named_command(files: Sequence[FoundFile]) -> FolderLayout | None:
    """Layout whose input, named so, stands in a file beside that of the output.

    A robot writes what it is told into another file than its positions and speeds.
    """
    for split in split_recordings(files):
        try:
            layout = _layout_of_alike(split.files, split.files)
        except MeasurementError:
            continue
        is_apart = split.is_marked(layout.output) and not split.is_marked(layout.input)
        if is_apart and _is_named_input(layout.input):
            return split.with_own_keys(layout)
    return None


def _layout_of_alike(
    alike: Sequence[FoundFile], files: Sequence[FoundFile]
) -> FolderLayout:
    """How files with the same columns are read.

    Raises
    ------
    MeasurementError
        If none of them shows an input and an output.
    """
    typical, signals = _typical(alike)
    long_ones = _table(typical)
    scalars = [one for one in typical.columns if one.values.size == 1]
    clocks = _clocks(signals.input, signals.output, long_ones, scalars)
    roles = {
        "input": signals.input,
        "output": signals.output,
        "time": clocks[0].column,
        "output_time": None if clocks[1] is None else clocks[1].column,
    }
    lacks = _lacking(alike, (signals.input, signals.output))
    there = {role: one for role, one in roles.items() if one is not None}
    used, left = _sorted_out(files, there, typical)
    layout = _layout(signals, clocks, (_patterns(used, files), left))
    conditions = condition_notes(used, {one.place for one in there.values()})
    layout = replace(
        layout,
        notes=(*layout.notes, *conditions),
        mixed=_of_mixed_units(used, there),
    )
    layout = _in_parts(layout, used, there.get("time"))
    layout = _with_lost_samples(layout, used, there.get("time"))
    if layout.variable == STAR:
        note = (
            "a file holds tables with the same columns: each is a recording; if they are "
            "not, name one in columns: {variable: ...}"
        )
        layout = replace(layout, notes=(*layout.notes, note))
    if layout.time is None:
        layout = replace(layout, notes=(*layout.notes, *unused_times(long_ones)))
    if lacks == _SLOW and layout.time is not None:
        note = (
            "a signal has no number in every row: all are put on one grid, that of the "
            "slower one"
        )
        return replace(layout, resample=True, notes=(*layout.notes, note))
    if lacks == _SLOW or layout.parts:
        return layout
    return replace(layout, first_sample=lacks)


def _typical(alike: Sequence[FoundFile]) -> tuple[FoundFile, SignalGuess]:
    """The first file that shows input and output, and which columns these are.

    In a recording that failed a signal may stand still: it tells nothing of the others.
    """
    changing = {
        one.name: {c.place for c in _table(one) if signs.changes(c.values)}
        for one in alike
    }
    counts = Counter(place for places in changing.values() for place in places)
    usual = {place for place, count in counts.items() if 2 * count > len(alike)}
    whole = [one for one in alike if usual <= changing[one.name]]
    others = sorted(alike, key=lambda one: -len(changing[one.name]))
    fault = ""
    for file in (*whole, *others):
        try:
            further = [_table(one) for one in whole if one is not file]
            return file, guess_signals(_table(file), further[:_MOST_ASKED])
        except MeasurementError as error:
            fault = fault or f"{escaped(file.name)}: {error}"
    more = f" (nor do the other {len(alike) - 1} files)" * (len(alike) > 1)
    raise MeasurementError(
        f"{fault}{more}; name the columns in a configuration by hand (configs/README.md)"
    )


def _lacking(files: Sequence[FoundFile], signals: Sequence[FoundColumn]) -> int:
    """Rows at the beginning without a number in a signal, or that one is slow."""
    first = 0
    for file in files:
        own = {column.place: column.values for column in file.columns}
        for column in signals:
            known = np.isfinite(own[column.place])
            begin = int(np.argmax(known))
            if np.mean(known[begin:]) < 1.0 - _MOST_LOST:
                return _SLOW
            first = max(first, begin)
    return first


def _no_signals(files: Sequence[FoundFile]) -> str:
    """What to say of a folder in which no file holds two signals."""
    for one in files:
        if one.lacks_library:
            return f"{escaped(one.name)}: {one.problem}"
    first = next((one for one in files if not one.problem), files[0])
    said = first.problem or _too_short(first.columns)
    said = said or "holds no two columns of the same table"
    return (
        f"{escaped(first.name)}: {said}; expected a file with an input and an output; "
        "export it again, or write a configuration by hand (configs/README.md)"
    )


def _too_short(columns: Sequence[FoundColumn]) -> str:
    """Say so where columns are too short for a measurement; empty where one is not."""
    rows = max((one.values.size for one in columns), default=0)
    if not 1 < rows <= FEWEST_SAMPLES:
        return ""
    return f"has {rows} rows, and at least {FEWEST_SAMPLES + 1} are needed"


def _sorted_out(
    files: Sequence[FoundFile], roles: Mapping[str, FoundColumn], typical: FoundFile
) -> tuple[list[FoundFile], tuple[tuple[str, str], ...]]:
    """Files that are used, and the others, each with its reason."""
    why = {one.name: _why_not(one, roles, typical) for one in files}
    used = [one for one in files if not why[one.name]]
    begins = {one.name: _begins(one, roles.get("time")) for one in used}
    if len(set(begins.values())) > 1:
        # The same rows are cut from every file.
        why |= {
            name: f"holds {len(found) + 1} recordings, the second from sample {found[0]}; "
            "cut it into files of one recording each"
            for name, found in begins.items()
            if found
        }
    used = [one for one in used if not why[one.name]]
    left = tuple((name, reason) for name, reason in why.items() if reason)
    if not used:
        raise MeasurementError(f"{escaped(left[0][0])}: {left[0][1]}")
    return used, left


def _begins(file: FoundFile, time: FoundColumn | None) -> tuple[int, ...]:
    """Samples at which further recordings begin in a file."""
    for column in long_columns(file.columns):
        if time is not None and column.place == time.place:
            found = signs.restarts_of(column.values)
        else:
            is_named = counts_recordings(column.title)
            found = signs.blocks_of(column.values) if is_named else ()
        if found:
            return found
    return ()


def _in_parts(
    layout: FolderLayout, files: Sequence[FoundFile], time: FoundColumn | None
) -> FolderLayout:
    """Cut files in which several recordings stand below one another."""
    begins = _begins(files[0], time)
    ends = [
        max(one.values.size for one in long_columns(file.columns)) for file in files
    ]
    bounds = [0, *begins, min(ends)]
    long_ones = [cut for cut in pairwise(bounds) if cut[1] - cut[0] > FEWEST_SAMPLES]
    if not begins or not long_ones:
        return layout
    note = (
        f"{len(begins) + 1} recordings stand below one another in a file: "
        f"{len(long_ones)} are long enough, and cut by recordings.parts"
    )
    parts: dict[str, tuple[int, ...]] = {
        f"part_{number}": cut for number, cut in enumerate(long_ones, 1)
    }
    return replace(layout, parts=parts, notes=(*layout.notes, note))


def _with_lost_samples(
    layout: FolderLayout, files: Sequence[FoundFile], time: FoundColumn | None
) -> FolderLayout:
    """Resample where any file needs it, and say how many samples are missing."""
    clocks = [
        (file.name, column.values)
        for file in files
        for column in long_columns(file.columns)
        if time is not None and column.place == time.place
    ]
    if layout.parts:
        cuts = layout.parts.values()
        clocks = [(name, one[slice(*cut)]) for name, one in clocks for cut in cuts]
    ticks = [(name, values, signs.clock_of(values)) for name, values in clocks]
    is_rough = any(one and one.jitter > ROUND_STAMPS for _, _, one in ticks)
    lost: Counter[str] = Counter()
    for name, values, one in ticks:
        if one is not None and (count := missing_samples(values)):
            lost[name] += count
    if not lost:
        return replace(layout, resample=layout.resample or is_rough)
    shown = ", ".join(f"{n} in {escaped(name)}" for name, n in list(lost.items())[:4])
    more = f", and some in {len(lost) - 4} more" if len(lost) > 4 else ""
    note = f"samples are missing: {shown}{more}; straight lines stand for them"
    return replace(layout, resample=True, notes=(*layout.notes, note))


def with_slower_grid(
    layout: FolderLayout, sample_times_s: Collection[float]
) -> FolderLayout:
    """Put recordings that were sampled faster than others on the grid of these.

    Parameters
    ----------
    sample_times_s : collection of float, [s]
        Of all recordings.

    Returns
    -------
    FolderLayout
        The same where they agree, or where there is no column of time to tell them.
    """
    if layout.time is None or layout.sample_time_s is not None or not sample_times_s:
        return layout
    usual = statistics.median_low(sample_times_s)
    step = max(one for one in sample_times_s if one <= _MOST_SLOWER * usual)
    faster = [one for one in sample_times_s if one < step * (1.0 - _SAME_CLOCK)]
    if not faster:
        return layout
    count = len(faster)
    return replace(
        layout,
        sample_time_s=step,
        resample=True,
        clock_reason=f"the slowest clock; {count} recordings tick faster, up to every "
        f"{min(faster):g} s",
        notes=(
            *layout.notes,
            f"{count} recordings are sampled every {min(faster):g} s or so, others every "
            f"{step:g} s: all are put on the slower grid",
        ),
    )


def _layout(
    signals: SignalGuess,
    clocks: tuple[TimeGuess, TimeGuess | None],
    files: tuple[tuple[str, ...], tuple[tuple[str, str], ...]],
) -> FolderLayout:
    time, other = clocks
    sample_time_s = time.sample_time_s
    if time.role is None and sample_time_s is None:
        sample_time_s = UNKNOWN_SAMPLE_TIME_S
    reference = signals.reference
    return FolderLayout(
        patterns=files[0],
        input=_role(signals.input, "input", signals.reasons["input"]),
        output=_role(signals.output, "output", signals.reasons["output"]),
        time=time.role,
        output_time=None if other is None else other.role,
        reference=(
            None if reference is None else _role(reference, "output", "by its name")
        ),
        variable=signals.input.variable or signals.output.variable,
        sample_time_s=sample_time_s,
        clock_reason=time.reason,
        resample=time.resample or other is not None,
        notes=(*time.notes, *signals.notes, *_notes(time, other)),
        left=files[1],
    )


def _alike(files: Sequence[FoundFile]) -> list[FoundFile]:
    """The largest set of files with the same columns, of those that hold signals."""
    sets: dict[tuple[object, ...], list[FoundFile]] = {}
    for one in files:
        table = _table(one) if one.columns else []
        if len(table) > 1:
            ending = PurePosixPath(one.name).suffix.lower()
            places = (ending, *(column.place for column in table))
            sets.setdefault(places, []).append(one)
    # The first of the largest ones: names in order make the choice repeatable.
    return max(
        sets.values(),
        key=lambda alike: (
            any(_holds_signals(_table(one)) for one in alike),
            len(alike),
        ),
        default=[],
    )


def _why_not(
    file: FoundFile, roles: Mapping[str, FoundColumn], typical: FoundFile
) -> str:
    """Why a file is not used; empty if it has the chosen columns in the same units."""
    if file.problem:
        return file.problem
    ending, usual = (PurePosixPath(one.name).suffix for one in (file, typical))
    if ending.lower() != usual.lower():
        return f"another kind of file than {escaped(typical.name)}"
    own = {column.place: column for column in long_columns(file.columns)}
    for role, column in roles.items():
        if column.place not in own:
            short = [one for one in file.columns if one.place == column.place]
            if _too_short(short):
                return _too_short(short)
            return f"has no column {column.title or column.key!r} for the {role}"
        of_role = "time" if role == "output_time" else role
        here, usual = (
            unit_of_column(one, of_role) for one in (own[column.place], column)
        )
        if here != usual and factor_between(here, usual) is None:
            return f"its {role} is in {here!r}, not in {usual!r}"
    return ""


def _of_mixed_units(
    files: Sequence[FoundFile], roles: Mapping[str, FoundColumn]
) -> tuple[str, ...]:
    """Roles whose unit is another one in some files."""

    def units(role: str) -> set[str]:
        place = roles[role].place
        columns = [one for file in files for one in file.columns if one.place == place]
        return {unit_of_column(one, role) for one in columns}

    there = [role for role in ("time", "input", "output") if role in roles]
    return tuple(role for role in there if len(units(role)) > 1)


def _table(file: FoundFile) -> list[FoundColumn]:
    """Long columns that belong together: one table, or vectors of one length.

    Columns of a text file may end early and stay together. Signals of several lengths
    belong together where each has a clock, and no set of one length has both signals, or
    more than one.
    """
    columns = long_columns(file.columns)
    if reader_of(Path(file.name)).is_one_table:
        tables = sorted({one.variable or "" for one in columns})
        sets = [[c for c in columns if (c.variable or "") == name] for name in tables]
    else:
        kinds = {(one.variable, one.values.size) for one in columns}
        sets = [
            [
                one
                for one in columns
                if one.values.size == size and _belongs(one, variable)
            ]
            for variable, size in sorted(kinds, key=lambda one: (one[0] or "", one[1]))
        ]
    usable = [found for found in sets if len(found) > 1]
    best = max(usable, key=_worth, default=[])
    timed = [one for found in usable if clocks_of(found) for one in found]
    both = [one for one in columns if any(one is other for other in timed)]
    plain = all(one.variable is None for one in both)
    is_better = _worth(both)[0] > _worth(best)[0] or not _holds_signals(best)
    return both if plain and len(usable) > 1 and is_better else best


def _belongs(column: FoundColumn, variable: str | None) -> bool:
    """Whether a column is of a table, or a clock that stands beside it."""
    if column.variable == variable:
        return True
    return column.variable is None and signs.clock_of(column.values) is not None


def _worth(found: Sequence[FoundColumn]) -> tuple[bool, int]:
    changing = [one for one in found if signs.changes(one.values)]
    roles = {meaning_of(one.title, one.unit).role for one in changing}
    return {"input", "output"} <= roles, len(found)


def _clocks(
    first: FoundColumn,
    last: FoundColumn,
    columns: Sequence[FoundColumn],
    scalars: Sequence[FoundColumn],
) -> tuple[TimeGuess, TimeGuess | None]:
    """Clock of the input, and that of the output where it is another one."""
    time = guess_time([*_beside(first, columns), *scalars])
    own = guess_time([*_beside(last, columns), *scalars])
    if own.column is None or time.column is None or own.column is time.column:
        return (time if time.column is not None else own), None
    one, other = time.column.values, own.column.values
    step = float(np.median(np.diff(one)))
    n = min(one.size, other.size, first.values.size, last.values.size)
    is_same = first.values.size == last.values.size and bool(
        np.max(np.abs(one[:n] - other[:n])) <= 0.01 * step
    )
    return time, None if is_same else own


def _beside(column: FoundColumn, columns: Sequence[FoundColumn]) -> list[FoundColumn]:
    """Columns among which the clock of a signal is: those of its group, or to its left."""
    number = next(n for n, one in enumerate(columns) if one is column)
    clocks = [one for one, _, _ in clocks_of(columns)]
    if not clocks:
        # One that shows large ticks only is none, and tells the sample time.
        return [one for one in columns if one.values.size == column.values.size]
    alike = [one for one in clocks if one.values.size == column.values.size]
    for one in alike:
        # When its publisher sampled a message, and not when it was recorded.
        topic = topic_of(one.title)
        if topic is not None and column.title.startswith(topic):
            return [one]
    group = _group_of(column)
    own = [one for one in alike if group and _group_of(one) == group]
    if own:
        return own
    named = [one for one in alike if meaning_of(one.title, one.unit).role == "time"]
    chosen = named or alike or clocks
    numbers = [n for n, one in enumerate(columns) if any(one is c for c in chosen)]
    left = [n for n in numbers if n < number]
    # A table with pairs of columns has the time of each signal to its left.
    is_paired = len(left) > 0 and len(numbers) > 1 and isinstance(column.key, str | int)
    return [columns[left[-1]]] if is_paired else chosen


def _group_of(column: FoundColumn) -> str:
    """Struct or group of a named variable; empty without one."""
    found = re.fullmatch(r"(.+)[./][^./]*", str(column.key))
    return found[1] if found and isinstance(column.key, str) else ""


def _role(column: FoundColumn, side: str, reason: str) -> Role:
    return Role(column.key, column.title, unit_of_column(column, side), reason)


def _patterns(
    alike: Sequence[FoundFile], files: Sequence[FoundFile]
) -> tuple[str, ...]:
    """One pattern where it finds these files and no others, else their names."""
    endings = {PurePosixPath(one.name).suffix for one in alike}
    others = {PurePosixPath(one.name).suffix for one in files if one not in alike}
    if len(alike) > 1 and not endings & others:
        below = "**/" if any("/" in one.name for one in alike) else ""
        return tuple(f"{below}*{ending}" for ending in sorted(endings))
    names = {PurePosixPath(one.name).name for one in alike}
    if len(alike) > 1 and len(names) == 1:
        name = names.pop()
        if all(
            PurePosixPath(one.name).name != name for one in files if one not in alike
        ):
            return (f"**/{glob.escape(name)}",)
    return tuple(glob.escape(one.name) for one in alike)


def _notes(time: TimeGuess, other: TimeGuess | None) -> list[str]:
    notes = []
    if other is not None:
        notes.append(
            "input and output have clocks of their own: both are resampled on one grid, "
            "that of the slower one"
        )
    if time.role is None and time.sample_time_s is None:
        notes.append(
            "THE SAMPLE TIME IS NOT KNOWN: 1 s stands for it; correct sample_time_s "
            "before you look at any number in seconds or hertz"
        )
    return notes
