"""The folders that a command writes to, locked while it runs."""

from pathlib import Path

import click

from hwid_cli.cli.stopping import KEPT_IN
from hwid_cli.files.locks import claim_folder, share_folder


def enter_folders(out: Path, cache: Path, *, is_alone: bool) -> None:
    """Lock the folders until the command ends, and note where its results are kept.

    Parameters
    ----------
    out : Path
        Of the results; exists.
    cache : Path
        Of what was computed before; other runs may use it as well.
    is_alone : bool
        Whether no other run may work in the folder of the results.

    Raises
    ------
    CacheError
        If another run does, or the folder cannot be written.
    """
    context = click.get_current_context(silent=True)
    locks = [claim_folder(out)] if is_alone else []
    locks += [lock for lock in map(share_folder, (out, cache)) if lock is not None]
    if context is None:
        # A session outside of a command, whose end nobody tells.
        for lock in locks:
            lock.close()
        return
    for lock in locks:
        context.call_on_close(lock.close)
    context.find_root().meta[KEPT_IN] = cache
