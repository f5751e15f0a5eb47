"""The search for groups as tables."""

import numpy as np

from hwid_cli.records.groups import Group, GroupSearch
from hwid_cli.records.units import behind
from hwid_cli.report.formats import MISSING, number, with_unit
from hwid_cli.report.simulation_note import joined_note
from hwid_cli.report.table import Cell, Column, Row, Table, Text, numbers, texts

NOTHING_COVERED = "no group covers any recording."

# Tables of the thesis for groups of two, three and four.
_PUBLISHED = {2: "T3.3.3.1-2", 3: "T3.3.3.2-2", 4: "T3.3.3.3-2"}


def levels_table(search: GroupSearch) -> Table:
    """Show what each level tried, filtered and kept."""
    rows = []
    for level in search.levels:
        groups = [one for one in search.groups if one.level == level]
        best = max(one.coverage for one in groups)
        rows.append(
            (
                str(level),
                str(sum(join.level == level for join in search.joins)),
                str(len(groups)),
                str(sum(one.n_models for one in groups)),
                str(sum(one.n_models - one.n_self_passed for one in groups)),
                str(sum(one.n_self_passed - one.n_cross_passed for one in groups)),
                f"{best} of {len(search.validated_on)}",
                str(sum(one.coverage == best for one in groups)),
                str(sum(one.is_kept for one in groups)),
            )
        )
    heads = ("level", "joins", "groups", "models", "not self", "not cross", "widest")
    caption = (
        f"Search for groups: models above {search.threshold:g}{behind(search.unit)} on their "
        "own recordings (not self), models below it on no recording (not cross), and the "
        "widest coverage"
    )
    return Table(
        caption,
        numbers(*heads, "reach it", "go on"),
        tuple(rows),
        is_validation=True,
    )


def join_table(search: GroupSearch, level: int) -> Table:
    """Show the coverage of every join of a level, base by add-on.

    Parameters
    ----------
    level : int, [-]
        Recordings in the groups, at least 2.

    Returns
    -------
    Table
        A dash where the base holds the add-on; groups that go on are marked.
    """
    by_name = {one.name: one for one in search.groups}
    joins = [join for join in search.joins if join.level == level]
    groups = {(join.base, join.add_on): by_name[join.group] for join in joins}
    add_ons = _add_ons(search, level)
    rows: tuple[Row, ...] = tuple(
        (
            base,
            *(_join_cell(groups.get((base, one)), search) for one in add_ons),
            str(max(one.coverage for (name, _), one in groups.items() if name == base)),
        )
        for base in dict.fromkeys(join.base for join in joins)
    )
    caption = (
        f"Groups of {level}: recordings covered of {len(search.validated_on)}, base by "
        "add-on, * goes on"
    )
    return Table(
        caption,
        (*texts("base"), *numbers(*add_ons), Column("widest", stays=True)),
        rows,
        is_validation=True,
        published=_PUBLISHED.get(level, ""),
    )


def _add_ons(search: GroupSearch, level: int) -> list[str]:
    """What joined on a level, in the order of the experiment."""
    tried = {join.add_on for join in search.joins if join.level == level}
    # Single recordings come in the order of the experiment, others as they join.
    singles = [join.base for join in search.joins if join.level == 1]
    later = [join.add_on for join in search.joins]
    return [name for name in dict.fromkeys([*singles, *later]) if name in tried]


def _join_cell(group: Group | None, search: GroupSearch) -> Cell:
    if group is None:
        return Cell(MISSING)
    return Cell(
        str(group.coverage),
        title=f"{group.model_name or group.name}: RMSD {with_unit(group.rmsd, search.unit)}",
        share=group.coverage / max(1, len(search.validated_on)),
        is_marked=group.is_kept,
    )


def chain_table(search: GroupSearch) -> Table | Text:
    """Show the winner and what it grew from, level by level: the chain of groups."""
    if not search.chain:
        return Text(f"No group covers anything: {search.reason}.")
    has_unseen = any(np.isfinite(one.unseen_rmsd) for one in search.groups)
    rows = tuple(
        (
            one.model_name,
            f"{one.coverage} of {len(search.validated_on)}",
            number(one.rmsd),
            number(one.validation_rmsd),
            *((number(one.unseen_rmsd),) if has_unseen else ()),
        )
        for one in search.chain_groups
    )
    heads = ("covers", "own RMSD", "validation RMSD")
    unseen = ("RMSD of no member",) if has_unseen else ()
    columns = (*texts("model"), *numbers(*heads, *unseen))
    rules = dict.fromkeys(one.options.initial_state for one in search.fits if one)
    how = tuple(joined_note(rule, search.join) for rule in rules)
    note = (
        "What a model covers, and its validation RMSD, which pools all samples, include "
        f"the recordings of its own fit. The search stopped: {search.reason}."
    )
    chosen = (
        "The winner is the best on validation recordings that no group may hold.",
    )
    caption = (
        f"The chain of groups, from one recording to the winner: RMSD [{search.unit}]"
    )
    notes = (note, *(chosen if has_unseen else ()))
    return Table(caption, columns, rows, notes, how, is_validation=True)
