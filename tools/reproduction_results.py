"""Read what the document is made of: the results of three runs, and where they are from."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hwid_cli.records.groups import FinalTest, GroupSearch
from hwid_cli.store.final_test_results import read_final_test
from hwid_cli.store.group_results import read_group
from hwid_cli.store.result_files import Provenance, has_left_results, read_provenance
from hwid_cli.store.results import read_crossval, read_fits
from tools.reproduction_here import Results

STAGES = ("identify", "crossval", "group", "test")


@dataclass(frozen=True)
class Run:
    """Where one of the three results files came from.

    Parameters
    ----------
    stages : dict of str to Provenance
        By stage, those that have run.
    """

    stages: dict[str, Provenance]


def read_runs(paths: Sequence[Path]) -> tuple[Run, ...]:
    """Read where results came from.

    Parameters
    ----------
    paths : sequence of Path
        Results files; may be missing.

    Returns
    -------
    tuple of Run

    Raises
    ------
    CacheError
        If a file cannot be read.
    """
    return tuple(
        Run(
            {
                stage: read_provenance(path, stage)
                for stage in STAGES
                if has(path, stage)
            }
        )
        for path in paths
    )


def read_results(paths: Sequence[Path]) -> Results:
    """Read the records of the three runs.

    Parameters
    ----------
    paths : sequence of Path, length 3
        Results files of single steps, Combination Model 1 and Combination Model 2.

    Returns
    -------
    Results

    Raises
    ------
    CacheError
        If a file cannot be read.
    """
    steps, one, two = paths
    return Results(
        fits=read_fits(steps) if has(steps, "identify") else (),
        crossval=read_crossval(steps) if has(steps, "crossval") else None,
        search_1=_group(one),
        search_2=_group(two),
        final_1=_final(one),
        final_2=_final(two),
    )


def has(path: Path, stage: str) -> bool:
    """Whether a results file holds a stage.

    Parameters
    ----------
    path : Path
    stage : str

    Returns
    -------
    bool
    """
    return has_left_results(path, stage)


def _group(path: Path) -> GroupSearch | None:
    return read_group(path) if has(path, "group") else None


def _final(path: Path) -> FinalTest | None:
    return read_final_test(path) if has(path, "test") else None
