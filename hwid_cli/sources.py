"""What the program is made from: the sources behind a module, and checksums of sources.

For what is derived from sources: compiled loops, the page and its figures. Computed
results have keys of their inputs and of the versions of their stages, never of sources.
"""

import re
from collections.abc import Iterable, Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path

PACKAGE = Path(__file__).parent
_IMPORT = re.compile(
    rf"^\s*(?:from ({PACKAGE.name}[\w.]*) import (\([^)]*\)|.*)|import ({PACKAGE.name}[\w.]*))",
    re.MULTILINE,
)


@cache
def checksum_of_folder(folder: Path = PACKAGE) -> str:
    """Checksum of all files of a folder, templates too; read once in a process.

    Parameters
    ----------
    folder : Path
        The package, or a folder of it.

    Returns
    -------
    str
    """
    files = (path for path in folder.rglob("*") if "__pycache__" not in path.parts)
    return checksum_of_files((path for path in files if path.is_file()), folder)


def checksum_of_files(files: Iterable[Path], folder: Path = PACKAGE) -> str:
    """Checksum of files and of their places in a folder, in whatever order.

    Parameters
    ----------
    folder : Path
        Holds all files.

    Returns
    -------
    str
    """
    checksum = sha256()
    for path in sorted(files):
        name = path.relative_to(folder).as_posix()
        checksum.update(f"{name} {_checksum_of_file(path)} ".encode())
    return checksum.hexdigest()


@cache
def _checksum_of_file(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()


def sources_behind(source: Path) -> set[Path]:
    """Files of this package that a module imports, directly or not, and its own.

    Parameters
    ----------
    source : Path
        File of a module of this package.

    Returns
    -------
    set of Path
    """
    found, todo = set(), [source]
    while todo:
        path = todo.pop()
        if path not in found:
            found.add(path)
            todo += _imports(path)
    return found


@cache
def _imports(source: Path) -> tuple[Path, ...]:
    return tuple(
        path
        for module in _modules_named(source.read_text(encoding="utf-8"))
        for path in (
            PACKAGE.parent.joinpath(*module.split(".")).with_suffix(".py"),
            PACKAGE.parent.joinpath(*module.split("."), "__init__.py"),
        )
        if path.exists()
    )


def _modules_named(text: str) -> Iterator[str]:
    """Names in import lines, also those that turn out to be no modules."""
    for package, names, module in _IMPORT.findall(text):
        yield package or module
        for name in re.findall(r"\w+", re.sub(r"#.*| as \w+", "", names)):
            yield f"{package}.{name}"
