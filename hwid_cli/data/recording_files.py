"""Which recordings an experiment has: their files, the parts of a file, their kinds.

A kind comes from the configuration's patterns, else from ``plan.csv``.
"""

import csv
import glob
import io
import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

from hwid_cli.data.columns import FileColumns, keep_rows, with_each
from hwid_cli.data.packed import stem_of
from hwid_cli.errors import ConfigError, MeasurementError
from hwid_cli.files.messages import shown
from hwid_cli.files.small_files import read_small_file
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.experiment import Experiment, RecordingsOptions
from hwid_cli.records.recordings import KINDS

PLAN_NAME = "plan.csv"
# How files begin that systems and office programs, while a table is open, put beside others.
SYSTEM_NAMES = ("~$", "._", "Thumbs", "desktop")
_OTHER = "other"
REAL_DATA_VARIABLE = "HWID_REALDATA"
# Of a path in a message.
_LONGEST_PATH = 400


def recordings_base(experiment: Experiment, out: Path) -> Path:
    """Say which folder ``recordings.files`` is relative to.

    Parameters
    ----------
    out : Path
        Folder of the results.

    Returns
    -------
    Path
        ``out`` where the experiment simulates its measurements, else the folder of
        the configuration file.
    """
    return Path(out) if experiment.simulate else Path(experiment.source).parent


def find_files(experiment: Experiment, base: Path) -> dict[Path, str]:
    """Find the files of an experiment's recordings, each with its name.

    Parameters
    ----------
    base : Path
        Folder that the patterns are relative to, see ``recordings_base``.

    Returns
    -------
    dict of Path to str
        In natural order (``step_2`` before ``step_10``); ``plan.csv`` and excluded
        files are left out, which changes no name. Empty only where
        ``recordings.optional`` allows it.

    Raises
    ------
    ConfigError
        If there is no ``recordings:`` section or a path names an unset variable.
    MeasurementError
        If a pattern matches no file.
    """
    options = recordings_options(experiment)
    found: dict[Path, None] = {}
    barren = []
    for pattern in options.files:
        matches = _matches(pattern, experiment, base)
        found.update(dict.fromkeys(matches))
        if not matches:
            barren.append(pattern)
    names = names_of_files(list(found))
    paths = [path for path in found if not _is_excluded(path, names[path], options)]
    if not paths and options.optional:
        return {}
    if barren or not paths:
        raise MeasurementError(missing_files_message(experiment, base))
    paths.sort(key=lambda path: (_natural(stem_of(path)), str(path)))
    return {path: names[path] for path in paths}


def missing_files_message(experiment: Experiment, base: Path) -> str:
    """Say in one line which files were looked for and where to put them.

    Parameters
    ----------
    base : Path
        As for ``find_files``.
    """
    for pattern in recordings_options(experiment).files:
        if not _matches(pattern, experiment, base):
            break
    else:
        return (
            f"{experiment.source}: recordings.exclude leaves no file; expected at "
            "least one; make its patterns narrower"
        )
    full = os.path.normpath(
        base.absolute() / _readable(expand_variables(pattern, experiment))
    )
    if experiment.simulate:
        step = f"run 'hwid simulate {experiment.source}' first"
    elif REAL_DATA_VARIABLE in pattern:
        step = (
            f"put the data there, or set {REAL_DATA_VARIABLE} to the folder that "
            "holds them"
        )
    elif "\\" in pattern and os.sep == "/":
        step = "write / in place of \\, and the folder as this machine names it"
    else:
        step = "put the files there or correct recordings.files"
    return (
        f"{experiment.source}: recordings.files: no file matches {shown(pattern)}; "
        f"expected {full[:_LONGEST_PATH]}; {step}"
    )


def recordings_options(experiment: Experiment) -> RecordingsOptions:
    """Give the ``recordings`` section.

    Raises
    ------
    ConfigError
        If there is none.
    """
    if experiment.recordings is None:
        raise ConfigError(
            f"{experiment.source}: recordings: missing; expected which files hold the "
            "measurements; add the section (configs/README.md explains it)"
        )
    return experiment.recordings


def _matches(pattern: str, experiment: Experiment, base: Path) -> list[Path]:
    """Files that a pattern or a plain name stands for, the plan left out."""
    expanded = expand_variables(pattern, experiment)
    # Path.glob refuses absolute patterns.
    found = glob.glob(expanded, root_dir=base, recursive=True)  # noqa: PTH207
    plain = _readable(expanded)
    if not found and _is_file(base / plain):
        found = [plain]
    paths = [base / match for match in found]
    return [_short(path) for path in paths if _is_file(path) and not _is_beside(path)]


def _is_beside(path: Path) -> bool:
    """Whether a file is the plan, or one that a system has put there."""
    return path.name == PLAN_NAME or path.name.startswith(SYSTEM_NAMES)


def _is_file(path: Path) -> bool:
    """Whether a path is a plain file: no folder, no pipe, no device."""
    try:
        return path.is_file()
    except OSError:
        # Such as a name that is too long; some folders may not be looked into.
        return False


def _is_excluded(path: Path, name: str, options: RecordingsOptions) -> bool:
    return any(
        fnmatchcase(called, pattern)
        for pattern in options.exclude
        for called in (stem_of(path), path.name, name)
    )


def names_of_files(paths: Sequence[Path]) -> dict[Path, str]:
    """Names of the recordings of some files: without ending, or those of their folders.

    Examples
    --------
    >>> list(names_of_files([Path("x/run_1.csv"), Path("x/run_2.csv")]).values())
    ['run_1', 'run_2']
    >>> list(names_of_files([Path("bag 1/joint.csv"), Path("bag 2/joint.csv")]).values())
    ['bag_1', 'bag_2']
    >>> told = [Path("a/slow.csv"), Path("b/slow.csv"), Path("b/fast.csv")]
    >>> list(names_of_files(told).values())
    ['a_slow', 'b_slow', 'fast']
    """
    counts = Counter(stem_of(path) for path in paths)
    is_one = len(counts) == 1
    found = {}
    for path in paths:
        parts = [] if is_one else [stem_of(path)]
        if counts[stem_of(path)] > 1 and path.parent.name:
            parts.insert(0, _as_name(path.parent.name))
        found[path] = "_".join(parts) or stem_of(path)
    return found


def expand_variables(pattern: str, experiment: Experiment) -> str:
    """Put the values of ``${NAME}`` into a path.

    Parameters
    ----------
    experiment : Experiment
        Its place in the file system is where real data are looked for.

    Raises
    ------
    ConfigError
        If a variable is not set.
    """

    def value(match: re.Match[str]) -> str:
        name = match.group(1)
        if name in os.environ:
            return glob.escape(os.environ[name])
        if name == REAL_DATA_VARIABLE:
            project = Path(experiment.source).absolute().parent.parent
            return glob.escape(str(project.parent / "shared" / "realdata"))
        raise ConfigError(
            f"{experiment.source}: recordings.files: {pattern!r} names the environment "
            f"variable {name}, which is not set; set it or write the path out"
        )

    return re.sub(r"\$\{(\w+)\}", value, pattern)


def _readable(pattern: str) -> str:
    """Undo ``glob.escape``, for people to read."""
    return re.sub(r"\[([*?[])\]", r"\1", pattern)


def _short(path: Path) -> Path:
    """Drop ``folder/..`` from a path where it names the same file without."""
    short = Path(os.path.normpath(path))
    return short if short.exists() and short.samefile(path) else path


def _natural(name: str) -> list[tuple[int, int, str]]:
    """Key that sorts numbers in names by value."""
    parts = re.split(r"(\d+)", name)
    return [(0, int(p), "") if p.isdecimal() else (1, 0, p) for p in parts if p]


@dataclass(frozen=True)
class FilePart:
    """A stretch of a file that becomes a recording.

    Parameters
    ----------
    name : str
        Of the recording.
    part : str
        Name of the part; empty where the file is taken as a whole.
    first : int, [samples]
    stop : int or None, [samples]
        The sample after the last one; None for the file's end.
    table : str
        Of several in the file; empty for the one that the configuration names.
    """

    path: Path
    name: str
    part: str
    first: int
    stop: int | None
    table: str = ""

    @property
    def place(self) -> Path:
        """The file, for messages, with table and part where there are some."""
        inside = [self.table] if self.table else []
        inside += [f"part {self.part}"] if self.part else []
        return Path(f"{self.path} ({', '.join(inside)})") if inside else self.path


def parts_of_files(
    names: Mapping[Path, str], options: RecordingsOptions
) -> list[FilePart]:
    """Say which recordings the files of an experiment hold.

    Parameters
    ----------
    names : mapping of Path to str
        Of the files, from ``find_files``.

    Returns
    -------
    list of FilePart
        File by file; named after the part where there is one file, after file and part
        where there are several.
    """
    if not options.parts:
        last = options.last_sample
        stop = None if last is None else last + 1
        return [
            FilePart(path, name, "", options.first_sample, stop)
            for path, name in names.items()
        ]
    return [
        FilePart(
            path,
            part if len(names) == 1 else f"{name}_{part}",
            part,
            cut[0],
            cut[1],
        )
        for path, name in names.items()
        for part, cut in options.parts.items()
    ]


def parts_of_tables(
    parts: Sequence[FilePart], tables: Sequence[str], *, is_only_file: bool
) -> list[FilePart]:
    """Take the parts of a file from each of its tables.

    Returns
    -------
    list of FilePart
        Named after the table too where there are several; after it alone where the
        experiment has one file, which is not cut.
    """
    # A point in front of a digit is one of a number: sine_0.5Hz.
    last = [_as_name(re.split(r"/|\.(?!\d)", table)[-1]) for table in tables]
    if len(set(last)) < len(last):
        last = [_as_name(table) for table in tables]
    found = []
    for table, own in zip(tables, last, strict=True):
        for part in parts:
            name = f"{part.name}_{own}"
            if is_only_file and not part.part:
                name = own
            found.append(
                replace(part, table=table, name=part.name if len(tables) == 1 else name)
            )
    return found


def _as_name(table: str) -> str:
    return re.sub(r"[^\w-]+", "_", table).strip("_") or "table"


def cut_part(columns: FileColumns, part: FilePart) -> FileColumns:
    """Keep the rows of a part.

    Parameters
    ----------
    columns : FileColumns
        Of the whole file.

    Raises
    ------
    MeasurementError
        If a named part goes beyond the end of the file.
    """
    size = max(columns.input.values.size, columns.output.values.size)
    if part.part and part.stop is not None and part.stop > size:
        raise MeasurementError(
            f"{part.path}: has {size} samples; expected at least {part.stop} for "
            f"recordings.parts.{part.part}; correct that part"
        )
    selection = slice(part.first, part.stop)
    return with_each(columns, lambda column: keep_rows(column, selection))


def _is_named(pattern: str, path: Path, name: str) -> bool:
    """Whether a pattern is on a recording's name, or on its file's without the ending."""
    return any(
        fnmatchcase(one, pattern) for one in (name or stem_of(path), stem_of(path))
    )


def without_excluded(
    parts: Sequence[FilePart], options: RecordingsOptions
) -> list[FilePart]:
    """Recordings of a file that no pattern of ``recordings.exclude`` leaves out by name.

    Raises
    ------
    MeasurementError
        If none is left.
    """
    kept = [
        part
        for part in parts
        if not any(fnmatchcase(part.name, pattern) for pattern in options.exclude)
    ]
    if kept or not parts:
        return kept
    raise MeasurementError(
        f"{parts[0].path}: recordings.exclude leaves none of its {len(parts)} "
        "recordings; expected at least one; make its patterns narrower, or leave out "
        "the file"
    )


def unmatched_kinds(
    parts: Sequence[FilePart], patterns: Mapping[str, tuple[str, ...]]
) -> list[tuple[str, str]]:
    """Kinds with those of their patterns that no recording has.

    Returns
    -------
    list of (str, str)
        Kind and pattern.
    """
    return [
        (kind, pattern)
        for kind, of_kind in patterns.items()
        for pattern in of_kind
        if not any(_is_named(pattern, one.path, one.name) for one in parts)
    ]


def kind_of(
    path: Path,
    patterns: Mapping[str, tuple[str, ...]],
    plan: Mapping[str, str],
    *,
    name: str = "",
) -> str:
    """Find the kind of a recording.

    Parameters
    ----------
    patterns : mapping of str to tuple of str
        Patterns on the recording's name, or on the file's name without its ending, for
        each kind.
    plan : mapping of str to str
        Kinds by recording name, as ``read_plan`` gives them.
    name : str
        Of the recording; empty means the file's name without its ending.

    Returns
    -------
    str
        One of ``records.recordings.KINDS``; ``other`` where nothing says more.

    Raises
    ------
    MeasurementError
        If patterns of two kinds match.
    """
    matching = [
        kind
        for kind, of_kind in patterns.items()
        if any(_is_named(pattern, path, name) for pattern in of_kind)
    ]
    if len(matching) > 1:
        raise MeasurementError(
            f"{path}: matches the patterns of {' and '.join(matching)} in "
            "recordings.kind; expected one kind for each file; make the patterns "
            "narrower"
        )
    if matching:
        return matching[0]
    return plan.get(name or stem_of(path), plan.get(stem_of(path), _OTHER))


def read_plan(folder: Path) -> dict[str, str]:
    """Read the kinds that a folder's ``plan.csv`` states.

    Returns
    -------
    dict of str to str
        Kind by recording name; empty where there is no plan, or one without the
        columns ``name`` and ``kind``.

    Raises
    ------
    MeasurementError
        If a row states an unknown kind.
    """
    path = folder / PLAN_NAME
    if not path.is_file():
        return {}
    kinds = {}
    try:
        text = read_small_file(path).decode("utf-8-sig", errors="replace")
        reader = csv.DictReader(io.StringIO(text, newline=""))
        if not {"name", "kind"} <= set(reader.fieldnames or ()):
            return {}
        for row in reader:
            kind = (row["kind"] or "").strip()
            if kind not in KINDS:
                raise MeasurementError(
                    f"{path}, row {reader.line_num}: the kind is {shown(kind)}; "
                    f"{did_you_mean(kind, KINDS)}"
                )
            kinds[(row["name"] or "").strip()] = kind
    except (OSError, csv.Error) as error:
        raise MeasurementError(
            f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}); "
            "expected a table with the columns name and kind; mend the file or remove it"
        ) from error
    return kinds
