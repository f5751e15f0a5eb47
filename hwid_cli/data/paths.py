"""Which files the recordings of an experiment are, and how to say that there are none."""

import glob
import os
import re
from fnmatch import fnmatchcase
from pathlib import Path

from hwid_cli.data.kinds import PLAN_NAME
from hwid_cli.errors import ConfigError, MeasurementError
from hwid_cli.files.messages import shown
from hwid_cli.records.experiment import Experiment, RecordingsOptions

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


def find_files(experiment: Experiment, base: Path) -> list[Path]:
    """Find the files of an experiment's recordings.

    Parameters
    ----------
    base : Path
        Folder that the patterns are relative to, see ``recordings_base``.

    Returns
    -------
    list of Path
        In natural order (``step_2`` before ``step_10``); ``plan.csv`` and excluded
        files are left out. Empty only where ``recordings.optional`` allows it.

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
    paths = [path for path in found if not _is_excluded(path, options)]
    if not paths and options.optional:
        return []
    if barren or not paths:
        raise MeasurementError(missing_files_message(experiment, base))
    paths.sort(key=lambda path: (_natural(path.stem), str(path)))
    return paths


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
    return [_short(path) for path in paths if _is_file(path) and path.name != PLAN_NAME]


def _is_file(path: Path) -> bool:
    """Whether a path is a plain file: no folder, no pipe, no device."""
    try:
        return path.is_file()
    except OSError:
        # Such as a name that is too long; some folders may not be looked into.
        return False


def _is_excluded(path: Path, options: RecordingsOptions) -> bool:
    return any(
        fnmatchcase(path.stem, pattern) or fnmatchcase(path.name, pattern)
        for pattern in options.exclude
    )


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
