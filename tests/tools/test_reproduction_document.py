"""The document as a whole: complete, narrow, and honest about what has not run."""

import doctest
import importlib
import re
from pathlib import Path

import pytest

from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.store.final_test_results import write_final_test
from hwid_cli.store.group_results import write_group
from hwid_cli.store.result_files import Provenance
from hwid_cli.store.results import write_crossval, write_fits
from tests.tools.reproduction_examples import full_results
from tools.reproduction import document, main
from tools.reproduction_claims import CLAIMS
from tools.reproduction_here import Results, Run
from tools.reproduction_markdown import WIDTH, table, wide_table

TOOLS = Path(__file__).parents[2] / "tools"
NOT_RUN = (Run({}),) * 3
TABLES = (
    "T3.2.2-1",
    "T3.2.2.2-2",
    "T3.2.2.2-3",
    "T3.3.3.1-2",
    "T3.3.3.2-2",
    "T3.3.3.3-2",
    "T3.3.3.4-1",
    "T3.4.1-1",
    "T3.4.1-2",
    "T3.4.2-1",
    "T3.4.3-1",
    "T3.4.3-2",
)


@pytest.fixture(scope="module")
def full():
    return full_results()


@pytest.mark.parametrize("module", sorted(path.stem for path in TOOLS.glob("*.py")))
def test_the_examples_in_the_docstrings_are_true(module):
    done = doctest.testmod(importlib.import_module(f"tools.{module}"))
    assert done.failed == 0


def test_every_published_table_has_its_heading(full):
    heads = [line for line in document(full, NOT_RUN).splitlines() if line[:1] == "#"]
    for name in TABLES:
        assert any(re.search(rf"{re.escape(name)}\b", head) for head in heads), name


@pytest.mark.parametrize("results", [Results(), full_results()], ids=["empty", "full"])
def test_no_line_is_wider_than_the_page(results):
    text = document(results, NOT_RUN)
    assert [line for line in text.splitlines() if len(line) > WIDTH] == []


def test_rows_of_a_table_have_as_many_cells_as_its_head(full):
    cells = 0
    for line in document(full, NOT_RUN).splitlines():
        if not line.startswith("|"):
            cells = 0
            continue
        found = line.replace(r"\|", "").count("|")
        assert cells in (0, found), line
        cells = found


def test_a_bar_in_a_name_does_not_open_a_cell():
    assert table(("name",), [("a|b",)]).splitlines()[-1] == r"| a\|b |"


def test_missing_results_are_named_with_the_command_that_makes_them():
    text = document(Results(), NOT_RUN)
    for target in ("steps", "model1", "model2"):
        assert f"`make {target}` makes them" in text
    assert text.splitlines()[-1].endswith("`make model2` makes them.")
    assert f"{len(CLAIMS)} are not judged" in text


def test_nothing_is_missing_once_everything_has_run(full):
    text = document(full, NOT_RUN)
    assert "No results yet" not in text
    assert "There are no results" not in text
    assert "Why the search stopped here: the coverage no longer grows" in text


def test_the_same_results_give_the_same_document(full):
    assert document(full, NOT_RUN) == document(full_results(), NOT_RUN)


def test_the_runs_are_told_by_config_key_and_seconds():
    provenance = Provenance(
        "0123456789abcdef", {"name": "thesis_steps"}, {"a": "x"}, seconds=533.4
    )
    text = document(Results(), (Run({"identify": provenance}), Run({}), Run({})))
    (row,) = [line for line in text.splitlines() if "thesis_steps" in line]
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[1:6] == ["thesis_steps", "identify", "0123456789ab", "1", "533"]


def test_a_wide_table_is_cut_into_even_blocks():
    heads = [f"{n:012d}" for n in range(20)]
    text = wide_table("model", ["a"], heads, [["1"] * 20])
    blocks = text.split("\n\n")
    assert [block.splitlines()[0].count("|") - 2 for block in blocks] == [7, 7, 6]
    assert max(map(len, text.splitlines())) <= WIDTH


def test_the_command_writes_what_the_files_hold(tmp_path, capsys, full):
    steps, model1, model2 = (tmp_path / f"{name}.h5" for name in ("s", "m1", "m2"))
    orders = OrdersOptions((2,), (2,))
    write_fits(steps, full.fits, orders, Provenance("k1"))
    write_crossval(steps, full.crossval, Provenance("k2"))
    write_group(model1, full.search_1, Provenance("k3"))
    write_final_test(model2, full.final_2, Provenance("k4"))

    code = main([str(steps), str(model1), str(model2)])

    said = capsys.readouterr()
    assert code == 0
    assert str(tmp_path) not in said.out
    results = Results(
        full.fits, full.crossval, search_1=full.search_1, final_2=full.final_2
    )
    expected = document(results, NOT_RUN)
    first = expected.index("## The claims")
    assert said.out[said.out.index("## The claims") :] == expected[first:]


def test_a_path_without_a_file_is_told_and_its_tables_stay_empty(tmp_path, capsys):
    assert main([str(tmp_path / name) for name in ("a.h5", "b.h5", "c.h5")]) == 0
    said = capsys.readouterr()
    assert said.err.count("no such file; its tables stay empty") == 3
    assert said.out == document(Results(), NOT_RUN)


def test_a_damaged_file_is_one_line_and_a_failure(tmp_path, capsys, full):
    path = tmp_path / "steps.h5"
    write_crossval(path, full.crossval, Provenance("k"))
    import h5py

    with h5py.File(path, "r+") as file:
        del file["crossval/rmsd"]

    assert main([str(path), "none", "none"]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert "steps.h5: cannot be read" in said.err
