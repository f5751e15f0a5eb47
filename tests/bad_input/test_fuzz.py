"""Readers on damaged files, in a process of their own: read, or refused in one line."""

import pytest

from tests.bad_input.fuzz import tried

# About half a minute each on two busy cores.
COUNTS = {
    "csv": 4000,
    "yaml": 3000,
    "npz": 8000,
    "mat": 8000,
    "h5": 1000,
    "xlsx": 4000,
    "tdms": 4000,
    "mf4": 1000,
    "parquet": 2000,
    "feather": 2000,
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", COUNTS)
def test_damaged_files_are_read_or_refused_and_nothing_else(kind, tmp_path):
    outcomes, broken = tried(kind, 7, COUNTS[kind], tmp_path)

    assert broken == []
    assert sum(outcomes.values()) == COUNTS[kind]
    # Damage that is never noticed, or always, would try nothing.
    assert outcomes["refused"] > 0
    assert outcomes["read"] > 0


@pytest.mark.thorough
def test_a_few_damaged_files_of_every_kind_are_read_or_refused(tmp_path):
    _, broken = tried(",".join(COUNTS), 1, 40 * len(COUNTS), tmp_path)

    assert broken == []
