"""Models of smaller orders that a model contains: its parameters with some zeros.

A fit that goes on from them is never worse, and a grid of orders grows from its corner.
"""

from dataclasses import replace

import numpy as np

from hwid_cli.records.model import HammersteinWiener, Orders


def enlarged(model: HammersteinWiener, orders: Orders) -> HammersteinWiener:
    """Same model written with larger orders.

    Parameters
    ----------
    model : HammersteinWiener
    orders : Orders
        That contain the model's.

    Returns
    -------
    HammersteinWiener
        Gives the same output for every input and initial state.
    """
    numerator = np.zeros(orders.nb)
    first = model.delay - orders.nk
    numerator[first : first + model.numerator.size] = model.numerator
    denominator = np.zeros(orders.nf + 1)
    denominator[: model.denominator.size] = model.denominator
    free = model.free_response
    if free.size:
        free = np.concatenate([free, np.zeros(orders.n_state - free.size)])
    return replace(
        model,
        numerator=numerator,
        denominator=denominator,
        delay=orders.nk,
        free_response=free,
    )
