"""Tables of the search for groups and of its chains (sections 3.3, 3.4.1 and 3.4.2)."""

from collections import Counter
from collections.abc import Sequence

from hwid_cli.records.groups import FinalTest, GroupSearch
from tools.reproduction_evidence import Counts, Iteration, Matrix
from tools.reproduction_markdown import (
    group_label,
    kinds_of,
    paragraph,
    table,
    wide_table,
)
from tools.reproduction_published import read_rows
from tools.reproduction_tables_models import model_label


def iterations_of(search: GroupSearch) -> tuple[Iteration, ...]:
    """What a search tried, level by level, from the second level on.

    Parameters
    ----------
    search : GroupSearch

    Returns
    -------
    tuple of Iteration
    """
    coverage = {group.name: group.coverage for group in search.groups}
    found = []
    for level in search.levels:
        if level == 1:
            continue
        joins = [join for join in search.joins if join.level == level]
        groups = [group for group in search.groups if group.level == level]
        counts = Counter(group.coverage for group in groups)
        found.append(
            Iteration(
                level,
                {(join.base, join.add_on): coverage[join.group] for join in joins},
                len(groups),
                {value: counts[value] for value in sorted(counts)},
                sum(group.is_kept for group in groups),
                len(search.validated_on),
            )
        )
    return tuple(found)


def join_table(found: Iteration) -> str:
    """T3.3.3.1-2: coverage by add-on (rows) and base (columns).

    Parameters
    ----------
    found : Iteration

    Returns
    -------
    str
        Blank where a join was not tried.
    """
    bases = tuple(dict.fromkeys(base for base, _ in found.cells))
    add_ons = sorted(dict.fromkeys(add_on for _, add_on in found.cells))
    rows = [
        [str(found.cells.get((base, add_on), "")) for base in bases]
        for add_on in add_ons
    ]
    heads = [group_label(base) for base in bases]
    return wide_table(
        r"add-on \ base", [group_label(name) for name in add_ons], heads, rows
    )


def iterations_table(published: Sequence[Iteration], here: Sequence[Iteration]) -> str:
    """All iterations side by side: how many groups of each coverage.

    Parameters
    ----------
    published, here : sequence of Iteration

    Returns
    -------
    str
    """
    every = [*published, *here]
    values = range(max(max(found.by_coverage) for found in every) + 1)
    rows = []
    for level in sorted({found.level for found in every}):
        for who, iterations in (("published", published), ("here", here)):
            rows += [
                (
                    str(level - 1),
                    who,
                    str(len(found.cells)),
                    str(found.n_groups),
                    str(found.n_kept),
                    f"{max(found.by_coverage)} of {found.of}",
                    *(str(found.by_coverage.get(value, "")) for value in values),
                )
                for found in iterations
                if found.level == level
            ]
    heads = ("iteration", "", "joins", "groups", "went on", "most", *map(str, values))
    return table(heads, rows, text_columns=(0, 1))


def growth_table(
    labels: Sequence[str],
    growth: Counts,
    matrix: Matrix,
    validated_on: Sequence[str],
    *,
    head: str,
) -> str:
    """T3.4.1-1 and T3.4.2-1: coverage along a chain.

    Parameters
    ----------
    labels : sequence of str
        One for each model of the chain.
    growth : Counts
        As the search or the published table counts.
    matrix : Matrix
        The chain on all recordings, from which the same is counted again.
    validated_on : sequence of str
        Recordings that ``growth`` counts.
    head : str
        Of the column of ``growth``.

    Returns
    -------
    str
    """
    parts = {f"counted, of {len(validated_on)}": tuple(validated_on)}
    for kind, names in kinds_of(matrix.recordings).items():
        parts[f"{kind}, of {len(names)}"] = names
    parts[f"all, of {len(matrix.recordings)}"] = matrix.recordings
    counted = [
        matrix.part(tuple(range(len(matrix.models))), names).covered.sum(axis=1)
        for names in parts.values()
    ]
    rows = [
        (label, f"{growth.values[row]} of {growth.of}", *(str(n[row]) for n in counted))
        for row, label in enumerate(labels)
    ]
    differ = [
        label
        for label, value, count in zip(labels, growth.values, counted[0], strict=True)
        if value != count
    ]
    text = table(("model", head, *parts), rows)
    if differ:
        text += "\n\n" + paragraph(
            f"The first two columns differ for {'; '.join(differ)}."
        )
    return text


def chain_labels(final: FinalTest) -> tuple[str, ...]:
    """Names of a chain's models for people, level by level.

    Parameters
    ----------
    final : FinalTest

    Returns
    -------
    tuple of str
    """
    return tuple(model_label(model) for model in final.chain)


def published_labels(matrix: Matrix) -> tuple[str, ...]:
    """Names of published models for people.

    Parameters
    ----------
    matrix : Matrix

    Returns
    -------
    tuple of str
    """
    return tuple(group_label(model) for model in matrix.models)


def published_test_labels() -> tuple[str, ...]:
    """Names and orders of the models of T3.3.3.4-1.

    Returns
    -------
    tuple of str
    """
    return tuple(
        f"step {row['group']} {row['nb']}/{row['nk']}"
        for row in read_rows("grouping_test")
    )
