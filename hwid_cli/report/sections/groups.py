"""Section about the search for groups of recordings."""

from hwid_cli.records.groups import Group, GroupSearch
from hwid_cli.records.report import ReportContents
from hwid_cli.report.figures.groups import coverage_histogram_figure, tree_figure
from hwid_cli.report.group_tables import add_ons_of
from hwid_cli.report.page import Block, Cell, Figures, Folded, Section, Table, Text
from hwid_cli.report.sections.words import (
    NOTHING_COVERED,
    counted,
    drawn,
    simulation_note,
    with_unit,
)

_JOINS = {
    "concatenate": "one after the other, so that their order matters",
    "experiments": "each with an initial state of its own, in no order",
}


def groups_section(contents: ReportContents) -> Section:
    """Show the search as a tree, as tables, and why it stopped."""
    search = contents.stored.search
    blocks: list[Block] = []
    if search is None or not search.groups:
        blocks.append(Text("Not run yet: run 'hwid group CONFIG'.", is_note=True))
    else:
        joined = _JOINS.get(search.join, search.join)
        blocks.append(Text(f"Recordings are joined {joined}. {_stop(search)}"))
        blocks += simulation_note(contents, is_validation=True)
        blocks += [_tree(search), _histogram(search), _levels_table(search)]
        tables = [_join_table(search, level) for level in search.levels if level > 1]
        for level, table in zip(search.levels[1:], tables, strict=True):
            summary = f"Coverage on level {level}: base and add-on"
            blocks.append(Folded(summary, (table,)))
    title = "Grouping: recordings that share a model"
    return Section("groups", title, "Grouping", tuple(blocks))


def _stop(search: GroupSearch) -> str:
    reason = search.reason.strip().rstrip(".")
    return f"The search stopped: {reason}." if reason else ""


def _tree(search: GroupSearch) -> Figures:
    alt = "Tree of the kept groups, level by level, with their coverage"
    sentence = (
        f"{_chain(search)} The number in each box and its filled part are the coverage."
    )
    return Figures((drawn("groups/tree", tree_figure(search), alt),), sentence)


def _chain(search: GroupSearch) -> str:
    covers = [group.coverage for group in search.chain_groups]
    of = len(search.validated_on)
    if not covers:
        return f"There is no chain: {NOTHING_COVERED}"
    winner = search.chain[-1]
    if len(covers) == 1:
        return f"The winner, {winner} (bold, blue), covers {covers[0]} of {of}."
    if len(set(covers)) == 1:
        how = f"keeps the coverage at {covers[0]}"
    else:
        verb = "raises" if covers[-1] > covers[0] else "moves"
        how = f"{verb} the coverage from {' to '.join(map(str, covers))}"
    return f"The chain to {winner} (bold, blue) {how} of {of}."


def _histogram(search: GroupSearch) -> Figures:
    alt = "Number of groups by coverage, one histogram for each level"
    best = [
        max(group.coverage for group in search.groups if group.level == level)
        for level in search.levels
    ]
    at_best = sum(
        group.level == search.levels[-1] and group.coverage == best[-1]
        for group in search.groups
    )
    reach = f"{counted(at_best, 'group')} {'reaches' if at_best == 1 else 'reach'} it"
    if not any(best):
        sentence = "No group covers any recording, on any level."
    elif len(best) == 1:
        sentence = f"The best coverage is {best[0]}; {reach}."
    else:
        ways = ", ".join(map(str, best))
        sentence = (
            f"The best coverage of the levels is {ways}; on the last one {reach}."
        )
    figure = coverage_histogram_figure(search)
    return Figures((drawn("groups/coverage", figure, alt),), sentence)


def _levels_table(search: GroupSearch) -> Table:
    rows = []
    for level in search.levels:
        groups = [group for group in search.groups if group.level == level]
        rows.append(
            (
                str(level),
                str(len(groups)),
                str(sum(group.n_models for group in groups)),
                str(sum(group.n_self_passed for group in groups)),
                str(sum(group.n_cross_passed for group in groups)),
                str(sum(group.is_kept for group in groups)),
                str(max(group.coverage for group in groups)),
            )
        )
    heads = (
        "level",
        "groups",
        "models fitted",
        "passed on own",
        "cover any",
        "groups kept",
        "best coverage",
    )
    caption = "What each level tried and what its filters left"
    reason = search.reason.strip().rstrip(".")
    if reason:
        caption += f"; the search stopped after the last: {reason}"
    return Table(caption, heads, tuple(rows), text_columns=())


def _join_table(search: GroupSearch, level: int) -> Table:
    """Coverage of every join of a level: bases downwards, add-ons across."""
    joins = [join for join in search.joins if join.level == level]
    by_name = {group.name: group for group in search.groups}
    bases = list(dict.fromkeys(join.base for join in joins))
    add_ons = add_ons_of(search, level)
    group_of = {(join.base, join.add_on): by_name[join.group] for join in joins}
    most = max(1, len(search.validated_on))
    rows: list[tuple[Cell | str, ...]] = []
    for base in bases:
        groups = [group_of.get((base, one)) for one in add_ons]
        cells = [_join_cell(group, search, most) for group in groups]
        rows.append((base, *cells))
    caption = (
        f"Level {level}: recordings of {len(search.validated_on)} covered by the best "
        "model; frames mark what was kept"
    )
    return Table(caption, ("base", *add_ons), tuple(rows))


def _join_cell(group: Group | None, search: GroupSearch, most: int) -> Cell:
    if group is None:
        return Cell("")
    told = (
        f"{group.model_name or group.name}: RMSD {with_unit(group.rmsd, search.unit)}"
    )
    share = group.coverage / most
    return Cell(str(group.coverage), title=told, share=share, is_marked=group.is_kept)
