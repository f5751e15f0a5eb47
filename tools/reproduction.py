"""Write ``docs/reproduction.md``: published tables beside those of the virtual gun.

``python tools/reproduction.py STEPS MODEL1 MODEL2 > docs/reproduction.md`` takes three
results files: models of single steps, groups of steps, groups of steps and sines. Where
one is missing, or a stage in it, the document says so.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

# Run as a file, Python looks for modules beside it and not in the project.
sys.path.insert(0, str(Path(__file__).parents[1]))

from hwid_cli.errors import HwidError
from tools.reproduction_document import document
from tools.reproduction_results import Run, read_results, read_runs
from tools.reproduction_sections import RUNS


def main(arguments: Sequence[str] | None = None) -> int:
    """Read three results files and write the document to the standard output.

    Parameters
    ----------
    arguments : sequence of str or None
        Paths of the three files; None takes those of the command line.

    Returns
    -------
    int
        Exit code: 0 done, 1 a file cannot be read.
    """
    parser = argparse.ArgumentParser(
        description="Write docs/reproduction.md to the standard output."
    )
    for run in RUNS:
        parser.add_argument(run.argument, type=Path, help=f"{run.what}; may be missing")
    chosen = parser.parse_args(arguments)
    paths = [getattr(chosen, run.argument) for run in RUNS]
    for path in paths:
        if not path.is_file():
            sys.stderr.write(f"{path}: no such file; its tables stay empty\n")
    try:
        runs: tuple[Run, ...] = read_runs(paths)
        text = document(read_results(paths), runs)
    except HwidError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    sys.stdout.write(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
