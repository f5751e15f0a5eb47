"""Section about the search for groups of recordings."""

from functools import partial

from hwid_cli.records.groups import GroupSearch
from hwid_cli.records.report import ReportContents
from hwid_cli.report.figures.groups import coverage_histogram_figure, tree_figure
from hwid_cli.report.formats import counted
from hwid_cli.report.groups import (
    NOTHING_COVERED,
    chain_table,
    join_table,
    levels_table,
)
from hwid_cli.report.page import (
    Collapsible,
    Drawing,
    PageBlock,
    Section,
    section_notes,
)
from hwid_cli.report.table import Text

_JOINS = {
    "concatenate": "one after the other, so that their order matters",
    "experiments": "each with an initial state of its own, in no order",
}


def groups_section(contents: ReportContents) -> Section:
    """Show the search as a tree, as tables, and why it stopped."""
    search = contents.stored.search
    blocks: list[PageBlock] = []
    missing = ""
    if search is None or not search.groups:
        missing = "not run yet: run 'hwid group CONFIG'."
    else:
        joined = _JOINS.get(search.join, search.join)
        blocks.append(Text(f"Recordings are joined {joined}. {_stop(search)}"))
        blocks += section_notes(contents, is_validation=True)
        blocks += [Text(_chain(search)), chain_table(search)]
        blocks += [Text(_best_of_levels(search)), levels_table(search)]
        for level in search.levels[1:]:
            table = join_table(search, level)
            blocks.append(
                Collapsible(f"Coverage on level {level}: base and add-on", (table,))
            )
    title = "Grouping: recordings that share a model"
    return Section("groups", title, "Grouping", tuple(blocks), missing)


def _stop(search: GroupSearch) -> str:
    reason = search.reason.strip().rstrip(".")
    return f"The search stopped: {reason}." if reason else ""


def _chain(search: GroupSearch) -> str:
    covers = [group.coverage for group in search.chain_groups]
    of = len(search.validated_on)
    if not covers:
        return f"There is no chain: {NOTHING_COVERED}"
    winner = search.chain[-1]
    if len(covers) == 1:
        return f"The winner, {winner}, covers {covers[0]} of {of}."
    if len(set(covers)) == 1:
        how = f"keeps the coverage at {covers[0]}"
    else:
        verb = "raises" if covers[-1] > covers[0] else "moves"
        how = f"{verb} the coverage from {' to '.join(map(str, covers))}"
    return f"The chain to {winner} {how} of {of}."


def _best_of_levels(search: GroupSearch) -> str:
    """The best coverage of each level."""
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
        return "No group covers any recording, on any level."
    if len(best) == 1:
        return f"The best coverage is {best[0]}; {reach}."
    ways = ", ".join(map(str, best))
    return f"The best coverage of the levels is {ways}; on the last one {reach}."


def group_drawings(contents: ReportContents) -> tuple[Drawing, ...]:
    """The tree of groups and their coverage as files."""
    search = contents.stored.search
    if search is None or not search.groups:
        return ()
    return (
        Drawing("groups/tree.png", partial(tree_figure, search)),
        Drawing("groups/coverage.png", partial(coverage_histogram_figure, search)),
    )


# Sections of the page, in their order, and figures beside it.
SECTIONS = (groups_section,)
DRAWINGS = (group_drawings,)
