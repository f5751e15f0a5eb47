"""The published tables, read from ``tests/reference`` (its README says what is in them).

Recordings get the names that the virtual gun's have: 1 to 15 are ``step_01`` to
``step_15``, 16 to 38 are ``sine_01`` to ``sine_23``.
"""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np

from tools.reproduction_evidence import (
    N_BEST,
    Counts,
    Evidence,
    Iteration,
    Matrix,
    SelfRmsd,
    own_cells,
)

REFERENCE = Path(__file__).parents[1] / "tests" / "reference"
THRESHOLD_M = 0.01
N_STEPS, N_SINES = 15, 23
TESTED_ON = ("step_05", "step_10", "step_11")
# From this sine on, the row of 6-9-1 in T3.4.1-3 has lost a value and is shifted.
FIRST_SHIFTED_SINE = 13


def recording_name(number: int) -> str:
    """Name of a recording of the thesis.

    Parameters
    ----------
    number : int, [-]
        1 to 38.

    Returns
    -------
    str

    Examples
    --------
    >>> recording_name(6), recording_name(20)
    ('step_06', 'sine_05')
    """
    if number <= N_STEPS:
        return f"step_{number:02d}"
    return f"sine_{number - N_STEPS:02d}"


def group_name(text: str) -> str:
    """Name of a group of the thesis in our form.

    Parameters
    ----------
    text : str

    Returns
    -------
    str

    Examples
    --------
    >>> group_name("20-16-9")
    'sine_05+sine_01+step_09'
    """
    return "+".join(recording_name(int(part)) for part in text.split("-"))


STEPS = tuple(recording_name(n) for n in range(1, N_STEPS + 1))
SINES = tuple(recording_name(N_STEPS + n) for n in range(1, N_SINES + 1))
VALIDATED_ON = tuple(name for name in STEPS if name not in TESTED_ON)


def read_rows(name: str, folder: Path = REFERENCE) -> list[dict[str, str]]:
    """Read a published table.

    Parameters
    ----------
    name : str
        Of the file, without ``.csv``.
    folder : Path

    Returns
    -------
    list of dict
        One for each row, by column.
    """
    with (folder / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def published_evidence(folder: Path = REFERENCE) -> Evidence:
    """What the published tables say about the claims.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    Evidence
    """
    tests = _matrix(
        read_rows("grouping_test", folder),
        {f"test_{int(name[5:])}": name for name in TESTED_ON},
    )
    one, two = _chain(1, folder), _chain(2, folder)
    machine = _stacked(_stacked(_single_coverage(folder), one), two)
    return Evidence(
        self_rmsd=_self_rmsd(folder),
        singles=Counts(
            tuple(
                int(row["coverage"]) for row in read_rows("coverage_by_model", folder)
            ),
            N_STEPS,
        ),
        widest=published_widest(folder),
        levels=_levels(folder),
        chain_tests=tests,
        growth_1=Counts(
            tuple(
                int(row["coverage"])
                for row in read_rows("model1_step_coverage", folder)
            ),
            len(VALIDATED_ON),
            one.part(tuple(range(len(one.models))), VALIDATED_ON).counts.values,
        ),
        growth_2=_growth_2(two, folder),
        chain_1=one,
        chain_2=two,
        machine=machine,
        chosen=_chosen(machine, folder),
    )


def published_widest(folder: Path = REFERENCE) -> Matrix:
    """T3.2.2.2-3: the widest model of each step on all steps.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    Matrix
        Rounded to three decimals: cells printed as 0.01 count as covered where the
        printed coverage of their row needs all of them.
    """
    columns = {str(n): recording_name(n) for n in range(1, N_STEPS + 1)}
    rows = read_rows("cross_rmsd", folder)
    found = _matrix(rows, columns)
    printed = np.array([int(row["printed_coverage"]) for row in rows])
    no_higher = found.rmsd <= THRESHOLD_M
    needs_all = no_higher.sum(axis=1) == printed
    covered = found.covered | (no_higher & needs_all[:, None])
    return replace(found, covered=covered)


def published_iterations(folder: Path = REFERENCE) -> tuple[Iteration, ...]:
    """T3.3.3.1-2, T3.3.3.2-2 and T3.3.3.3-2.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    tuple of Iteration
        With two, three and four recordings in a group.
    """
    tables = [read_rows(f"grouping_iteration_{n}", folder) for n in (1, 2, 3)]
    kept = [len({row["base"] for row in table}) for table in tables[1:]]
    iterations = []
    for level, (table, n_kept) in enumerate(
        zip(tables, [*kept, 0], strict=True), start=2
    ):
        cells = {
            (group_name(row["base"]), recording_name(int(row["add_on"]))): int(
                row["coverage"]
            )
            for row in table
            if row["coverage"]
        }
        values = list(cells.values())
        counts = {value: values.count(value) for value in sorted(set(values))}
        # Order matters in the thesis: every cell is a group of its own.
        iterations.append(
            Iteration(level, cells, len(cells), counts, n_kept, len(VALIDATED_ON))
        )
    return tuple(iterations)


def published_assignment(folder: Path = REFERENCE) -> dict[str, str]:
    """T3.4.3-2: which model serves which recording.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    dict of str to str
        Group by recording, without recordings that the table leaves out.
    """
    found = {}
    for table, names in (("model_to_step", STEPS), ("model_to_sine", SINES)):
        rows = read_rows(table, folder)
        for number, name in enumerate(names, start=1):
            for row in rows:
                if row[str(number)] == "1":
                    found[name] = group_name(row["group"])
    return found


def _self_rmsd(folder: Path) -> SelfRmsd:
    rows = read_rows("self_rmsd_top3", folder)
    return SelfRmsd(
        tuple(recording_name(int(row["dataset"])) for row in rows),
        np.array(
            [[float(row[f"rmsd_{n}"]) for n in range(1, N_BEST + 1)] for row in rows]
        ),
        THRESHOLD_M,
    )


def _matrix(rows: list[dict[str, str]], columns: dict[str, str]) -> Matrix:
    """A table of RMSDs; ``columns`` gives the recording of each of its columns."""
    head = "group" if "group" in rows[0] else "identified_on"
    models = tuple(group_name(row[head]) for row in rows)
    rmsd = np.array([[float(row[column]) for column in columns] for row in rows])
    names = tuple(columns.values())
    return Matrix(models, names, rmsd, rmsd < THRESHOLD_M, own_cells(models, names))


def _levels(folder: Path) -> Counts:
    """Best coverage of each level; of the first one counted in T3.2.2.2-3."""
    widest = published_widest(folder)
    columns = [widest.recordings.index(name) for name in VALIDATED_ON]
    first = int(widest.covered[:, columns].sum(axis=1).max())
    later = [max(found.cells.values()) for found in published_iterations(folder)]
    return Counts((first, *later), len(VALIDATED_ON))


def _chain(number: int, folder: Path) -> Matrix:
    """One of the two combination models, level by level, on all 38 recordings."""
    parts = [
        _matrix(
            read_rows(f"model{number}_{kind}_rmsd", folder),
            {str(n): name for n, name in enumerate(names, start=1)},
        )
        for kind, names in (("step", STEPS), ("sine", SINES))
    ]
    rmsd = np.hstack([part.rmsd for part in parts])
    if number == 1:
        row = parts[1].models.index(group_name("6-9-1"))
        rmsd[row, N_STEPS + FIRST_SHIFTED_SINE - 1 :] = np.nan
    return Matrix(
        models=parts[0].models,
        recordings=STEPS + SINES,
        rmsd=rmsd,
        covered=_ones(read_rows(f"model{number}_coverage_38", folder)),
        is_own=own_cells(parts[0].models, STEPS + SINES),
    )


def _ones(rows: list[dict[str, str]]) -> np.ndarray:
    numbers = range(1, N_STEPS + N_SINES + 1)
    return np.array([[row[str(n)] == "1" for n in numbers] for row in rows])


def _growth_2(chain: Matrix, folder: Path) -> Counts:
    """As printed; the first level is blank in the table and counted in T3.4.3-1."""
    printed = [row["coverage"] for row in read_rows("model2_coverage", folder)]
    values = tuple(
        int(text) if text else counted
        for text, counted in zip(printed, chain.counts.values, strict=True)
    )
    return Counts(values, len(chain.recordings), chain.counts.values)


def _single_coverage(folder: Path) -> Matrix:
    """T3.4.3-1; a model's own recording, left blank there, counts as covered."""
    rows = read_rows("coverage_matrix_38", folder)
    models = tuple(recording_name(int(row["identified_on"])) for row in rows)
    is_own = own_cells(models, STEPS + SINES)
    unknown = np.full(is_own.shape, np.nan)
    return Matrix(models, STEPS + SINES, unknown, _ones(rows) | is_own, is_own)


def _stacked(upper: Matrix, lower: Matrix) -> Matrix:
    return Matrix(
        upper.models + lower.models,
        upper.recordings,
        np.vstack([upper.rmsd, lower.rmsd]),
        np.vstack([upper.covered, lower.covered]),
        np.vstack([upper.is_own, lower.is_own]),
    )


def _chosen(machine: Matrix, folder: Path) -> Matrix:
    """Models of T3.4.3-2; a name that occurs twice stands for the chain's model."""
    names = sorted(set(published_assignment(folder).values()))
    last = {name: row for row, name in enumerate(machine.models)}
    return machine.part(tuple(last[name] for name in names), machine.recordings)
