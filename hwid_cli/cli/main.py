"""The ``hwid`` command: its subcommands, log levels, and the one place for errors."""

import errno
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import click

from hwid_cli import __version__
from hwid_cli.cli.commands import COMMANDS, GROUPS
from hwid_cli.cli.examples import add_examples
from hwid_cli.cli.stopping import Stopped, stop_signals
from hwid_cli.errors import HwidError, NothingToDo
from hwid_cli.files.messages import escaped

# What a disk or a folder may refuse, which is no fault of the program.
_MENDABLE = (
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EACCES,
    errno.EPERM,
    errno.EROFS,
    errno.EIO,
    errno.ESTALE,
    errno.EISDIR,
    errno.ENOTDIR,
    errno.ENAMETOOLONG,
    errno.ELOOP,
)
EXIT_ERROR = 1


class _WrongUsage(click.UsageError):
    """Wrong usage that is told in one line, with the next step."""

    def show(self, file: IO[Any] | None = None) -> None:  # noqa: ARG002
        """Say it on stderr."""
        message = self.message.rstrip(".")
        name = "" if self.ctx is None else self.ctx.command_path
        # Of a command; before it there is only the program, which begins every line.
        place = self.ctx.info_name if self.ctx and self.ctx.parent else ""
        step = "" if message.endswith("?") else f"; '{name} --help' says what may stand"
        said = f"{message[:1].lower()}{message[1:]}{step}"
        _complain(f"{place}: {said}" if place else said)


@contextmanager
def _usage_in_one_line() -> Iterator[None]:
    try:
        yield
    except click.exceptions.NoArgsIsHelpError:
        raise
    except click.UsageError as error:
        raise _WrongUsage(error.format_message(), error.ctx) from None


class _Commands(click.Group):
    """Turns what a user can mend into one line and an exit code."""

    def make_context(self, *values: Any, **options: Any) -> click.Context:
        """Read the words before the command.

        Returns
        -------
        click.Context
        """
        with _usage_in_one_line():
            return super().make_context(*values, **options)

    def invoke(self, ctx: click.Context) -> object:
        """Run the chosen command.

        Returns
        -------
        object
            What the command returns.
        """
        try:
            with stop_signals(ctx), _usage_in_one_line():
                _require_current_folder()
                return super().invoke(ctx)
        except NothingToDo as reason:
            click.echo(f"skipped: {reason}")
            ctx.exit(0)
        except HwidError as error:
            _complain(str(error))
            ctx.exit(EXIT_ERROR)
        except OSError as error:
            if error.errno not in _MENDABLE:
                raise
            place = error.filename or "a file or the screen"
            _complain(f"{place}: {error.strerror}; mend it, or choose --out")
            ctx.exit(EXIT_ERROR)
        except Stopped as stopped:
            _complain(stopped.sentence)
            ctx.exit(stopped.exit_code)

    def format_commands(
        self,
        ctx: click.Context,  # noqa: ARG002
        formatter: click.HelpFormatter,
    ) -> None:
        """Write the commands in groups, so that a newcomer sees where to begin."""
        widest = max(map(len, self.commands))
        for title, names in GROUPS.items():
            with formatter.section(title):
                room = formatter.width - widest - 6
                rows = [
                    (name.ljust(widest), self.commands[name].get_short_help_str(room))
                    for name in names
                ]
                formatter.write_dl(rows)

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """Name the commands in the order in which they work."""
        return list(self.commands)


def _require_current_folder() -> None:
    """Raise HwidError where the current folder was deleted: many an import asks for it."""
    try:
        Path.cwd()
    except FileNotFoundError:
        message = "the current folder is gone; change to one that exists and run again"
        raise HwidError(message) from None


def _complain(message: str) -> None:
    # Names of files may hold what a terminal would obey.
    click.echo(f"hwid: {escaped(' '.join(message.split()))}", err=True)


def set_log_levels(*, verbose: bool, quiet: bool) -> None:
    """Send log lines to stderr, more or fewer of them.

    Parameters
    ----------
    verbose : bool
        Also what the program is doing.
    quiet : bool
        Errors only.
    """
    level = logging.ERROR if quiet else logging.DEBUG if verbose else logging.WARNING
    logger = logging.getLogger("hwid_cli")
    logger.setLevel(level)
    # Not the root logger: other libraries say more than a user wants to read.
    if not any(isinstance(handler, _ToStderr) for handler in logger.handlers):
        logger.addHandler(_ToStderr())


class _ToStderr(logging.Handler):
    """Writes log lines as the errors are written."""

    def emit(self, record: logging.LogRecord) -> None:
        _complain(self.format(record))


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hwid")
@click.pass_context
def main(ctx: click.Context) -> None:
    """Identify models of servo drives from few measurements, and diagnose simulations.

    Measurements of your own: 'hwid init FOLDER' writes a configuration, 'hwid run' runs
    it and ends with the answer. Commands take that one file; configs/README.md explains
    its keys. A stage runs the stages before it where they are missing, and answers from
    the cache what it has computed before. Results go to stdout, progress to stderr.
    """
    ctx.obj = set_log_levels
    # Of commands without these options, too.
    set_log_levels(verbose=False, quiet=False)


for _command in COMMANDS.values():
    main.add_command(add_examples(_command))
