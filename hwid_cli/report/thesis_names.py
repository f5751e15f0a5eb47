"""Names of models as the published tables have them."""

import re

from hwid_cli.records.groups import GroupSearch
from hwid_cli.records.model import Orders


def thesis_name(identified_on: str, nb: int, nk: int, nf: int | None = None) -> str:
    """Name of a model in the form of the published tables.

    Parameters
    ----------
    identified_on : str
        Name of the recording, or of several joined by ``+``.
    nb, nk : int, [-]
        Its place in the order grid.
    nf : int or None, [-]
        Number of poles where ``nk`` is a delay; None where ``nk`` counts the poles.

    Returns
    -------
    str
        Ends with the orders ``[nb nf nk]``.

    Examples
    --------
    >>> thesis_name("step_06", 3, 7)
    'NLHW-Step-6-3-7-1'
    >>> thesis_name("step_06+step_09", 3, 7)
    'NLHW-Step-6-9-3-7-1'
    >>> thesis_name("run7b", 2, 3, nf=4)
    'NLHW-run7b-2-4-3'
    """
    parts = identified_on.split("+")
    numbered = [re.fullmatch(r"([A-Za-z]+)_0*(\d+)", part) for part in parts]
    who = identified_on
    if all(numbered):
        kinds = [match[1].capitalize() for match in numbered if match]
        numbers = [match[2] for match in numbered if match]
        who = "-".join(
            number if i and kinds[i] == kinds[i - 1] else f"{kinds[i]}-{number}"
            for i, number in enumerate(numbers)
        )
    orders = f"{nb}-{nk}-1" if nf is None else f"{nb}-{nf}-{nk}"
    return f"NLHW-{who}-{orders}"


def thesis_name_of(identified_on: str, orders: Orders) -> str:
    """Name of a model in the form of the published tables, by its orders.

    Parameters
    ----------
    orders : Orders
        With the delay that was found.
    """
    return thesis_name(identified_on, orders.nb, orders.nk, orders.nf)


def names_of_groups(search: GroupSearch | None) -> dict[str, str]:
    """Name the best models of groups.

    Returns
    -------
    dict of str to str
        By our names.
    """
    if search is None:
        return {}
    return {
        group.model_name: thesis_name_of(group.name, fit.orders)
        for group, fit in zip(search.groups, search.fits, strict=True)
        if fit is not None
    }
