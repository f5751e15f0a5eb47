"""The search for groups as plain text, in the forms of the published tables."""

from hwid_cli.records.groups import Group, GroupSearch
from hwid_cli.records.units import behind
from hwid_cli.report.simulation_words import joined_words, simulation_words
from hwid_cli.report.text_table import WIDTH, number, split_table, text_table

# Tables of the thesis for groups of two, three and four.
_PUBLISHED = {2: "T3.3.3.1-2", 3: "T3.3.3.2-2", 4: "T3.3.3.3-2"}


def levels_table(search: GroupSearch, *, initial_state: str) -> str:
    """Show what each level tried, filtered and kept.

    Parameters
    ----------
    initial_state : str
        Rule of the fits.
    """
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
    heads = (
        "level",
        "joins",
        "groups",
        "models",
        "not self",
        "not cross",
        "widest",
        "reach it",
        "go on",
    )
    title = (
        f"Search for groups: models above {search.threshold:g}{behind(search.unit)} on their "
        "own recordings\n(not self), models below it on no recording (not cross), "
        "and the widest coverage\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    return text_table(title, heads, rows, text_columns=())


def join_table(
    search: GroupSearch, level: int, *, initial_state: str, width: int = WIDTH
) -> str:
    """Show the coverage of every join of a level, base by add-on.

    Parameters
    ----------
    level : int, [-]
        Recordings in the groups, at least 2.
    initial_state : str
        Rule of the fits.
    width : int, [characters]
        Of the screen; more add-ons than fit go into further blocks.

    Returns
    -------
    str
        A dash where the base holds the add-on; an asterisk marks groups that go on.
    """
    by_name = {one.name: one for one in search.groups}
    joins = [join for join in search.joins if join.level == level]
    cells = {(join.base, join.add_on): by_name[join.group] for join in joins}
    bases = list(dict.fromkeys(join.base for join in joins))
    heads = add_ons_of(search, level)
    rows = [
        (base, *(_cell(cells.get((base, name))) for name in heads), str(widest))
        for base in bases
        for widest in [
            max(one.coverage for (name, _), one in cells.items() if name == base)
        ]
    ]
    form = f" (form of {_PUBLISHED[level]})" if level in _PUBLISHED else ""
    title = (
        f"Groups of {level}: recordings covered of {len(search.validated_on)}, base by "
        f"add-on,\n* goes on{form}\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    return split_table(title, ("base", *heads, "widest"), rows, width=width)


def add_ons_of(search: GroupSearch, level: int) -> list[str]:
    """List what joined on a level, in the order of the experiment.

    Parameters
    ----------
    level : int, [-]
    """
    tried = {join.add_on for join in search.joins if join.level == level}
    # Single recordings come in the order of the experiment, others as they join.
    singles = [join.base for join in search.joins if join.level == 1]
    later = [join.add_on for join in search.joins]
    return [name for name in dict.fromkeys([*singles, *later]) if name in tried]


def chain_table(search: GroupSearch, *, initial_state: str) -> str:
    """Show the winner and what it grew from.

    Parameters
    ----------
    initial_state : str
        Rule of the fits.
    """
    if not search.chain:
        return f"No group covers anything: {search.reason}."
    rows = [
        (
            one.model_name,
            f"{one.coverage} of {len(search.validated_on)}",
            number(one.rmsd),
            number(one.validation_rmsd),
        )
        for one in search.chain_groups
    ]
    heads = ("model", "covers", "own RMSD", "validation RMSD")
    title = (
        f"The chain of groups, RMSD [{search.unit}]\n"
        f"{simulation_words(initial_state, is_validation=True)}\n"
        f"{joined_words(initial_state, search.join)}"
    )
    table = text_table(title, heads, rows, text_columns=(0,))
    return (
        f"{table}\nWhat a model covers, and its validation RMSD, which pools all "
        "samples, include the\nrecordings of its own fit. The search stopped: "
        f"{search.reason}."
    )


def _cell(group: Group | None) -> str:
    if group is None:
        return "-"
    return f"{group.coverage}{'*' if group.is_kept else ' '}"
