"""Arguments and options that every stage command has."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import Any

import click


@dataclass(frozen=True)
class Choices:
    """What the command line says: where and how fast, never what.

    Parameters
    ----------
    config : Path
        Configuration file.
    out : Path or None
        Folder of the results; None means ``results/<name>``.
    cache : Path or None
        Folder of what was computed before; None means ``cache`` in that folder.
    jobs : int or None, [-]
        Processes; None means one for each core.
    backend : str
        Where tasks run.
    scheduler : str or None
        Address of a dask scheduler.
    force : bool
        Ignore cached results of this stage.
    verbose, quiet : bool
        More on the screen, or errors only.
    """

    config: Path
    out: Path | None = None
    cache: Path | None = None
    jobs: int | None = None
    backend: str = "loky"
    scheduler: str | None = None
    force: bool = False
    verbose: bool = False
    quiet: bool = False


_OPTIONS: tuple[Callable[..., Any], ...] = (
    click.argument("config", type=click.Path(path_type=Path)),
    click.option(
        "--out",
        type=click.Path(path_type=Path),
        metavar="DIR",
        help="Folder of the results.  [default: results/<name>]",
    ),
    click.option(
        "--cache",
        type=click.Path(path_type=Path),
        metavar="DIR",
        help="Folder of what was computed before; experiments may share one.  "
        "[default: cache in the folder of the results]",
    ),
    click.option(
        "--jobs",
        type=click.IntRange(min=1),
        metavar="N",
        help="Processes that compute.  [default: one for each core]",
    ),
    click.option(
        "--backend",
        type=click.Choice(("loky", "dask")),
        default="loky",
        show_default=True,
        help="Where they run: on this machine, or on a dask cluster.",
    ),
    click.option(
        "--scheduler",
        metavar="ADDRESS",
        help="Address of a running dask scheduler.",
    ),
    click.option("--force", is_flag=True, help="Ignore cached results of this stage."),
    click.option("-v", "--verbose", is_flag=True, help="Say what is being done."),
    click.option("-q", "--quiet", is_flag=True, help="Say errors only."),
)


def stage_options(function: Callable[..., None]) -> Callable[..., None]:
    """Give a command the common argument and options.

    Parameters
    ----------
    function : callable
        Takes ``Choices``, and by name what the command has of its own.

    Returns
    -------
    callable
        For ``click.command``.
    """

    @wraps(function)
    def with_choices(**values: Any) -> None:
        common = {field.name: values.pop(field.name) for field in fields(Choices)}
        choices = Choices(**common)
        if choices.scheduler is not None and choices.backend != "dask":
            raise click.UsageError(
                f"--scheduler {choices.scheduler}: needs --backend dask"
            )
        if choices.verbose and choices.quiet:
            raise click.UsageError("--verbose and --quiet: choose one of them")
        set_log_levels = click.get_current_context().obj
        if set_log_levels is not None:
            set_log_levels(verbose=choices.verbose, quiet=choices.quiet)
        function(choices, **values)

    decorated: Callable[..., None] = with_choices
    for option in reversed(_OPTIONS):
        decorated = option(decorated)
    return decorated
