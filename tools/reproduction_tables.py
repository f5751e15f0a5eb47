"""The document's tables, in the order of the thesis.

Single recordings' models (section 3.2) and RMSDs of any models, the search for groups and
its chains (3.3, 3.4.1, 3.4.2), and all models on all recordings (3.4.3).
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from hwid_cli.records.groups import FinalTest, GroupSearch
from hwid_cli.records.model import Fit
from hwid_cli.stages.ranking import best_fits, score_models
from tools.reproduction_evidence import Counts, Iteration, Matrix, SelfRmsd
from tools.reproduction_here import Results, identified_on
from tools.reproduction_markdown import (
    counted,
    group_label,
    kind_and_number,
    kinds_of,
    name_list,
    paragraph,
    short_number,
    table,
    wide_table,
)
from tools.reproduction_published import published_assignment, read_rows, recording_name

N_WIDEST = 15
# Characters between two spaces in a row of covered recordings.
_STRIDE = 5


def in_order(recordings: Sequence[str]) -> tuple[str, ...]:
    """Recordings once each, kind by kind as the kinds first occur, by number within.

    Parameters
    ----------
    recordings : sequence of str

    Returns
    -------
    tuple of str
    """
    found = kinds_of(tuple(dict.fromkeys(recordings)))
    return tuple(name for names in found.values() for name in sorted(names))


def self_rmsd_table(published: SelfRmsd, results: Results) -> str:
    """T3.2.2-1: the three lowest RMSD of each recording's models, side by side.

    Parameters
    ----------
    published : SelfRmsd
    results : Results

    Returns
    -------
    str
    """
    theirs = dict(zip(published.recordings, published.lowest, strict=True))
    by_delay = results.crossval is not None and results.crossval.nk_role == "delay"
    ours = {
        best[0].name: [_fit_cell(fit, by_delay) for fit in best]
        for best in best_fits(results.fits, published.lowest.shape[1])
        if best
    }
    count = published.lowest.shape[1]
    blank = ["-"] * count
    rows = []
    for name in in_order([*theirs, *ours]):
        left = (
            [short_number(value, 4) for value in theirs[name]]
            if name in theirs
            else blank
        )
        right = [*ours.get(name, []), *blank][:count]
        rows.append((group_label(name), *left, *right))
    heads = ("recording", *["published", "", ""][:count], *["here", "", ""][:count])
    return table(heads, rows)


def _fit_cell(fit: Fit, by_delay: bool) -> str:
    nk = fit.orders.nk if by_delay else fit.orders.nf
    return f"{short_number(fit.rmsd, 4)} ({fit.orders.nb}/{nk})"


def widest_models_table(singles: Counts | None, results: Results) -> str:
    """T3.2.2.2-2: the models that cover the most recordings, side by side.

    Parameters
    ----------
    singles : Counts or None
        Of all models here.
    results : Results

    Returns
    -------
    str
    """
    theirs = [
        (
            f"{published_number(int(row['identified_on']))} {row['nb']}/{row['nk']}",
            row["coverage"],
        )
        for row in read_rows("coverage_by_model")
    ]
    ours = []
    if results.crossval is not None and results.fits:
        for score in score_models(results.fits, results.crossval)[:N_WIDEST]:
            label = f"{group_label(score.identified_on)} {score.nb}/{score.nk}"
            ours.append((label, str(score.coverage), short_number(score.rmsd, 4)))
    rows = []
    for place in range(max(min(N_WIDEST, len(theirs)), len(ours))):
        left = theirs[place] if place < len(theirs) else ("-", "-")
        right = ours[place] if place < len(ours) else ("-", "-", "-")
        rows.append((str(place + 1), *left, *right))
    heads = ("rank", "published", "covers", "here", "covers", "own RMSD")
    parts = [
        table(heads, rows, text_columns=(1, 3)),
        paragraph(
            f"Published: {_histogram([int(count) for _, count in theirs])}, of 15."
        ),
    ]
    if singles is not None:
        parts.append(paragraph(f"Here: {_histogram(singles.values)}, of {singles.of}."))
    return "\n\n".join(parts)


def _histogram(counts: Sequence[int]) -> str:
    found = Counter(counts)
    return ", ".join(
        f"{found[count]} {'model covers' if found[count] == 1 else 'models cover'} {count}"
        for count in sorted(found, reverse=True)
    )


def matrix_table(labels: Sequence[str], matrix: Matrix, decimals: int = 3) -> str:
    """RMSD of models on recordings, one block for each kind; an asterisk is covered.

    Parameters
    ----------
    labels : sequence of str
        One for each model.
    matrix : Matrix
    decimals : int, [-]
        Of an RMSD that is neither very small nor very large.

    Returns
    -------
    str
    """
    blocks = []
    for kind, names in kinds_of(matrix.recordings).items():
        columns = [matrix.recordings.index(name) for name in names]
        rows = [
            [
                *(
                    short_number(rmsd, decimals) + ("*" if is_covered else " ")
                    for rmsd, is_covered in zip(
                        values[columns], covered[columns], strict=True
                    )
                ),
                str(int(covered[columns].sum())),
            ]
            for values, covered in zip(matrix.rmsd, matrix.covered, strict=True)
        ]
        heads = [kind_and_number(name)[1] or name for name in names]
        blocks.append(wide_table(kind, labels, [*heads, "covers"], rows))
    return "\n\n".join(blocks)


def model_label(model: str) -> str:
    """Name of a model for people.

    Parameters
    ----------
    model : str

    Returns
    -------
    str

    Examples
    --------
    >>> model_label("step_06+step_09/3/7")
    'step 6-9 3/7'
    """
    name = identified_on(model)
    return f"{group_label(name)} {model[len(name) + 1 :]}"


def published_number(number: int) -> str:
    """Label of a recording that the thesis knows by its number.

    Parameters
    ----------
    number : int, [-]
        1 to 38.

    Returns
    -------
    str

    Examples
    --------
    >>> published_number(20)
    'sine 5'
    """
    return group_label(recording_name(number))


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


def margins_table(published: Matrix, here: Matrix | None) -> str:
    """T3.4.3-1: what each recording's model covers, and how many models cover it.

    Parameters
    ----------
    published : Matrix
    here : Matrix or None

    Returns
    -------
    str
        Models of single recordings only; a model and its own recording are left out.
    """
    theirs = _margins(published)
    ours = ({}, {}) if here is None else _margins(here)
    rows = []
    for name in in_order([*theirs[1], *ours[1]]):
        cells = [theirs[0], ours[0], theirs[1], ours[1]]
        values = [str(counts.get(name, "-")) for counts in cells]
        rows.append((group_label(name), *values))
    heads = (
        "recording",
        "covers, published",
        "covers, here",
        "covered by, published",
        "covered by, here",
    )
    return table(heads, rows)


def _margins(matrix: Matrix) -> tuple[dict[str, int], dict[str, int]]:
    singles = matrix.part(matrix.singles, matrix.recordings)
    others = singles.covered & ~singles.is_own
    covers = dict(zip(singles.models, map(int, others.sum(axis=1)), strict=True))
    covered_by = dict(
        zip(singles.recordings, map(int, others.sum(axis=0)), strict=True)
    )
    return covers, covered_by


def covered_rows(labels: Sequence[str], matrix: Matrix) -> str:
    """T3.4.3-1(2) and (3): which recordings each model of a chain covers.

    Parameters
    ----------
    labels : sequence of str
    matrix : Matrix

    Returns
    -------
    str
        One character for each recording, kind by kind: 1 covered, a point not.
    """
    kinds = kinds_of(matrix.recordings)
    heads, width = [], max(map(len, labels))
    rows: list[list[str]] = [[] for _ in labels]
    for kind, names in kinds.items():
        columns = [matrix.recordings.index(name) for name in names]
        cells = [
            _spaced("".join("1" if value else "." for value in covered[columns]))
            for covered in matrix.covered
        ]
        # A head longer than its few recordings pushes them apart.
        size = max(len(kind), len(cells[0]))
        heads.append(kind.ljust(size))
        for row, cell in zip(rows, cells, strict=True):
            row.append(cell.ljust(size))
    lines = [f"{'':{width}}  {'   '.join(heads)}  covers"]
    for label, row, count in zip(labels, rows, matrix.counts.values, strict=True):
        lines.append(f"{label:{width}}  {'   '.join(row)}  {count:6d}")
    return "\n".join(["```", *lines, "```"])


def _spaced(text: str) -> str:
    return " ".join(text[i : i + _STRIDE] for i in range(0, len(text), _STRIDE))


def assignment_table(results: Results) -> str:
    """T3.4.3-2: which model serves each recording, side by side.

    Parameters
    ----------
    results : Results

    Returns
    -------
    str
        Here once from the two chains, as in the thesis, once from the smallest set of
        models that covers whatever can be covered.
    """
    theirs = published_assignment()
    finals = [
        final for final in (results.final_1, results.final_2) if final is not None
    ]
    chains = _best_of_chains(finals)
    two = results.final_2
    chosen = (
        {} if two is None else dict(zip(two.recordings, _set_cells(two), strict=True))
    )
    rows = [
        (
            group_label(name),
            group_label(theirs[name]) if name in theirs else "-",
            chains.get(name, "-"),
            chosen.get(name, "-"),
        )
        for name in in_order([*theirs, *chains, *chosen])
    ]
    heads = (
        "recording",
        "published",
        "here, of the chains",
        "here, of the smallest set",
    )
    text = table(heads, rows, text_columns=(0, 1, 2, 3))
    if two is not None:
        names = "; ".join(model_label(model) for model in two.smallest_set) or "none"
        text += "\n\n" + paragraph(
            f"Smallest set of Combination Model 2's run, "
            f"{counted(len(two.smallest_set), 'model')}: {names}. Covered by no model at all: {name_list(two.uncovered)}."
        )
    return text


def _best_of_chains(finals: Sequence[FinalTest]) -> dict[str, str]:
    """Lowest RMSD among the models of all chains, by recording."""
    best: dict[str, tuple[float, str]] = {}
    for final in finals:
        first = len(final.models) - len(final.chain)
        for row, model in enumerate(final.models[first:], start=first):
            for name, rmsd in zip(final.recordings, final.rmsd[row], strict=True):
                if np.isfinite(rmsd) and rmsd < best.get(name, (np.inf, ""))[0]:
                    is_covered = bool(rmsd < final.threshold)
                    best[name] = (float(rmsd), _served(model, float(rmsd), is_covered))
    return {name: cell for name, (_, cell) in best.items()}


def _set_cells(final: FinalTest) -> list[str]:
    cells = []
    for column, model in enumerate(final.assigned_in_set):
        if not model:
            cells.append("-")
            continue
        rmsd = float(final.rmsd[final.models.index(model), column])
        cells.append(_served(model, rmsd, rmsd < final.threshold))
    return cells


def _served(model: str, rmsd: float, is_covered: bool) -> str:
    return f"{model_label(model)}: {short_number(rmsd)}{'*' if is_covered else ''}"
