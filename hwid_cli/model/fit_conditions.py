"""What a fit needs: arguments that make sense, and data that can determine a model."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.linear_block import is_stable
from hwid_cli.records.model import (
    FitOptions,
    HammersteinWiener,
    Orders,
)
from hwid_cli.records.recordings import Recording

# Sizes whose squares, and those of their ratios, still are numbers of 64 bits.
_SMALLEST, _LARGEST = 1e-60, 1e60


def check_arguments(
    recordings: Sequence[Recording],
    orders: Orders,
    options: FitOptions,
    starts: Sequence[HammersteinWiener],
) -> None:
    """Refuse arguments that make no sense together, whatever the data are.

    Raises
    ------
    TypeError
        If ``recordings`` is a single one, or ``orders`` are no ``Orders``.
    ValueError
        If there is no recording, the sample times differ, a start has other orders or
        kinds of maps, or a frozen linear block has other orders.
    """
    _check_types(recordings, orders)
    if len({one.sample_time_s for one in recordings}) > 1:
        raise ValueError("recordings of one fit must share their sample time")
    kinds = (options.input_map, options.output_map)
    for start in starts:
        nk = start.delay if start.delay in options.delays else orders.nk
        if (start.input_map.kind, start.output_map.kind) != kinds or (
            start.orders != replace(orders, nk=nk)
        ):
            raise ValueError(f"a start must have the orders {orders} and maps {kinds}")
    block = options.linear_block
    if block is not None and block.frozen and block.orders != orders:
        raise ValueError(
            f"the frozen linear block has the orders {block.orders}, not {orders}"
        )


def reason_not_to_fit(
    recordings: Sequence[Recording], orders: Orders, options: FitOptions
) -> str:
    """Say why data cannot determine a model.

    Returns
    -------
    str
        Empty if they can.
    """
    block = options.linear_block
    if block is not None and block.frozen:
        radius = options.largest_pole_radius
        if not is_stable(np.array(block.denominator), radius):
            return f"the frozen linear block has a pole at or beyond radius {radius:g}"
    total = sum(one.n_samples for one in recordings)
    delay = min(options.delays, default=orders.nk)
    needed = _least_parameters(orders, options) + replace(orders, nk=delay).n_state
    if total <= needed:
        return f"{total} samples cannot determine a model that needs more than {needed}"
    longest = total
    if options.join == "experiments":
        longest = max(one.n_samples for one in recordings)
    if delay >= longest:
        return f"a delay of {delay} samples leaves nothing of a record of {longest}"
    for side in ("input", "output"):
        signal = np.concatenate([getattr(one, side) for one in recordings])
        largest = float(np.max(np.abs(signal)))
        if largest > _LARGEST:
            return f"the {side} reaches {largest:.3g}, beyond {_LARGEST:g}"
        span = float(np.ptp(signal))
        if span == 0.0:
            return f"the {side} is constant at {signal[0]:g}"
        if span < _SMALLEST:
            return f"the {side} spans {span:.3g}, less than {_SMALLEST:g}"
    return ""


def _check_types(recordings: Sequence[Recording], orders: Orders) -> None:
    """Refuse what a program that nobody type-checks hands over easily."""
    if isinstance(recordings, Recording):
        raise TypeError(
            "recordings must be a sequence of Recording; put it into a list"
        )
    if not isinstance(orders, Orders):
        raise TypeError(
            f"orders must be Orders(nb=..., nf=..., nk=...), got {orders!r}"
        )
    if not recordings:
        raise ValueError("fit needs at least one recording")


def _least_parameters(orders: Orders, options: FitOptions) -> int:
    """Parameters of a model, each shared gain counted once."""
    maps = (
        static_map.identity(one.kind, one, np.array([0.0, 1.0]))
        for one in (options.of_input, options.of_output)
    )
    n_block = 0 if options.keeps_block else orders.nb + orders.nf
    return n_block + sum(one.parameters.size for one in maps)
