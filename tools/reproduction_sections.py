"""The document's sections: each published table with the same table from here below it."""

from dataclasses import dataclass

import numpy as np

from hwid_cli.records.groups import FinalTest, GroupSearch
from tools.reproduction_evidence import Evidence, Matrix
from tools.reproduction_here import Results, growth_of
from tools.reproduction_markdown import paragraph
from tools.reproduction_published import VALIDATED_ON, published_iterations
from tools.reproduction_tables_groups import (
    chain_labels,
    growth_table,
    iterations_of,
    iterations_table,
    join_table,
    published_labels,
    published_test_labels,
)
from tools.reproduction_tables_machine import (
    assignment_table,
    covered_rows,
    margins_table,
)
from tools.reproduction_tables_models import (
    matrix_table,
    self_rmsd_table,
    widest_models_table,
)


@dataclass(frozen=True)
class RunPlace:
    """One of the three runs, for people.

    Parameters
    ----------
    argument : str
        Name of the command's argument.
    what : str
        What the run made.
    target : str
        The make target that makes it.
    """

    argument: str
    what: str
    target: str


RUNS = (
    RunPlace("steps", "models of single steps", "steps"),
    RunPlace("model1", "groups of steps (Combination Model 1)", "model1"),
    RunPlace("model2", "groups of steps and sines (Combination Model 2)", "model2"),
)


def single_models(
    published: Evidence, here: Evidence, results: Results
) -> tuple[str, ...]:
    """Section 3.2: models of single recordings.

    Parameters
    ----------
    published, here : Evidence
    results : Results

    Returns
    -------
    tuple of str
        Paragraphs.
    """
    if published.self_rmsd is None or published.widest is None:
        raise ValueError("the published tables lack section 3.2")
    run = RUNS[0]
    return (
        "## Section 3.2: models of single steps",
        "### T3.2.2-1: lowest RMSD of each step's models on that step",
        self_rmsd_table(published.self_rmsd, results),
        _missing(here.self_rmsd, run),
        "### T3.2.2.2-2: models that cover the most steps",
        widest_models_table(here.singles, results),
        "### T3.2.2.2-3: widest model of each step on all steps",
        "Published:",
        matrix_table(published_labels(published.widest), published.widest),
        "Here:",
        _matrix(here.widest, run),
    )


def groups(published: Evidence, here: Evidence, results: Results) -> tuple[str, ...]:
    """Section 3.3: the search for groups of steps, and its test.

    Parameters
    ----------
    published, here : Evidence
    results : Results

    Returns
    -------
    tuple of str
        Paragraphs.
    """
    if published.chain_tests is None:
        raise ValueError("the published tables lack section 3.3")
    run, search = RUNS[1], results.search_1
    theirs = published_iterations()
    ours = () if search is None else iterations_of(search)
    first = join_table(ours[0]) if ours else _missing(None, run)
    tests = (
        _missing(None, run)
        if here.chain_tests is None or results.final_1 is None
        else matrix_table(chain_labels(results.final_1), here.chain_tests, decimals=4)
    )
    return (
        "## Section 3.3: groups of steps",
        "### T3.3.3.1-2: coverage of every group of two",
        "Published:",
        join_table(theirs[0]),
        "Here:",
        first,
        "### T3.3.3.1-2, T3.3.3.2-2, T3.3.3.3-2: all iterations",
        "The numbered columns count the groups of each coverage.",
        iterations_table(theirs, ours),
        ""
        if search is None
        else paragraph(f"Why the search stopped here: {search.reason}"),
        "### T3.3.3.4-1: the chain on the test steps",
        "Published:",
        matrix_table(published_test_labels(), published.chain_tests, decimals=4),
        "Here:",
        tests,
    )


def chain_section(
    section: str, model: str, published: Evidence, here: Evidence, results: Results
) -> tuple[str, ...]:
    """Sections 3.4.1 and 3.4.2: one combination model on all recordings.

    Parameters
    ----------
    section : str
    model : str
        ``1`` or ``2``.
    published, here : Evidence
    results : Results

    Returns
    -------
    tuple of str
        Paragraphs.
    """
    theirs: Matrix = getattr(published, f"chain_{model}")
    ours: Matrix | None = getattr(here, f"chain_{model}")
    final: FinalTest | None = getattr(results, f"final_{model}")
    first, second = ("T3.4.1-1", "T3.4.1-2, -3") if model == "1" else ("T3.4.2-1",) * 2
    judges = VALIDATED_ON if model == "1" else theirs.recordings
    coverage = growth_table(
        published_labels(theirs),
        getattr(published, f"growth_{model}"),
        theirs,
        judges,
        head="printed",
    )
    rmsd = (
        _missing(None, RUNS[int(model)])
        if ours is None or final is None
        else matrix_table(chain_labels(final), ours)
    )
    lost = " (`?`: lost in the published table)" if np.isnan(theirs.rmsd).any() else ""
    return (
        f"## Section {section}: Combination Model {model} on all recordings",
        f"### {first}: coverage along the chain",
        "Published; as printed, then counted in T3.4.3-1:",
        coverage,
        "Here; as the search counts, then counted on all recordings:",
        _growth_here(model, here, results),
        f"### {second}: RMSD along the chain",
        f"Published{lost}:",
        matrix_table(published_labels(theirs), theirs),
        "Here:",
        rmsd,
    )


def _growth_here(model: str, here: Evidence, results: Results) -> str:
    """Coverage along our chain; by the search where its results are there."""
    ours: Matrix | None = getattr(here, f"chain_{model}")
    final: FinalTest | None = getattr(results, f"final_{model}")
    search: GroupSearch | None = getattr(results, f"search_{model}")
    if ours is None or final is None:
        return _missing(None, RUNS[int(model)])
    growth = growth_of(search)
    if growth is None or search is None or len(growth.values) != len(ours.models):
        growth, judges = ours.counts, ours.recordings
    else:
        judges = search.validated_on
    return growth_table(chain_labels(final), growth, ours, judges, head="search")


def all_models(
    published: Evidence, here: Evidence, results: Results
) -> tuple[str, ...]:
    """Section 3.4.3: all models on all recordings.

    Parameters
    ----------
    published, here : Evidence
    results : Results

    Returns
    -------
    tuple of str
        Paragraphs.
    """
    if published.machine is None:
        raise ValueError("the published tables lack section 3.4.3")
    rows = []
    for model, final in (("1", results.final_1), ("2", results.final_2)):
        theirs: Matrix = getattr(published, f"chain_{model}")
        ours: Matrix | None = getattr(here, f"chain_{model}")
        found = (
            _missing(None, RUNS[int(model)])
            if ours is None or final is None
            else covered_rows(chain_labels(final), ours)
        )
        rows += [
            f"Combination Model {model}, published:",
            covered_rows(published_labels(theirs), theirs),
            "Here:",
            found,
        ]
    return (
        "## Section 3.4.3: all models on all recordings",
        "### T3.4.3-1: how many recordings a model covers, how many models cover a recording",
        margins_table(published.machine, here.machine),
        _missing(here.machine, RUNS[2]),
        "### T3.4.3-1(2), (3): recordings that the chains cover",
        *rows,
        "### T3.4.3-2: which model serves which recording",
        assignment_table(results),
        _missing(results.final_2, RUNS[2]),
    )


def _matrix(found: Matrix | None, run: RunPlace) -> str:
    if found is None:
        return _missing(None, run)
    return matrix_table(published_labels(found), found)


def _missing(found: object | None, run: RunPlace) -> str:
    """Say what to run where there are no results; nothing otherwise."""
    if found is not None:
        return ""
    return f"No results yet of {run.what}: `make {run.target}` makes them."
