"""``order.csv`` and ``maps.csv``: recommended orders and maps."""

import csv
from pathlib import Path

from hwid_cli.files.csv_tables import write_table_csv
from hwid_cli.records.answer import ChosenMaps
from hwid_cli.records.order import MapAdvice, OrderAdvice, OrderChoice

ORDER_COLUMNS = (
    "recording",
    "nb",
    "nk",
    "rmsd",
    "factor",
    "standard_error",
    "judges",
    "beyond",
    "outliers",
    "best_nb",
    "best_nk",
    "best_rmsd",
    "aic_nb",
    "aic_nk",
    "bic_nb",
    "bic_nk",
    "delay",
    "poles",
)
MAP_COLUMNS = (
    "input_map",
    "input_units",
    "output_map",
    "output_units",
    "parameters",
    "rmsd",
    "factor",
    "bic",
    "take",
)
# The first row, which is of no single recording.
ALL = "all recordings"


def write_order_csv(path: Path, advice: OrderAdvice) -> None:
    """Write ``order.csv``: a row for all recordings, then one for each.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    seen = {
        one.recording: (_known(one.delay, -1), _known(one.n_poles, 0))
        for one in advice.responses
    }
    total = (_known(advice.delay, -1), _known(advice.n_poles, 0))
    rows = [(ALL, *_cells(advice.overall), *total)]
    rows += [
        (one.recording, *_cells(one), *seen.get(one.recording, (None, None)))
        for one in advice.choices
    ]
    write_table_csv(path, ORDER_COLUMNS, rows)


def write_maps_csv(path: Path, advice: MapAdvice) -> None:
    """Write ``maps.csv``: a row for each pair of maps, the best first.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    rows = [
        (
            one.input_map,
            _known(one.input_units, 0),
            one.output_map,
            _known(one.output_units, 0),
            one.n_parameters,
            one.rmsd,
            one.factor,
            one.bic,
            int(one == advice.chosen),
        )
        for one in advice.candidates
    ]
    write_table_csv(path, MAP_COLUMNS, rows)


def read_chosen_maps(folder: Path) -> ChosenMaps | None:
    """Read which maps ``order.csv`` and ``maps.csv`` of a folder recommend.

    Returns
    -------
    ChosenMaps or None
        None where nothing was compared, or the files are not what was written.
    """
    try:
        orders = _rows(folder / "order.csv")
        maps = _rows(folder / "maps.csv")
        (taken,) = (row for row in maps if row["take"] == "1")
        return ChosenMaps(
            int(orders[0]["nb"]),
            int(orders[0]["nk"]),
            taken["input_map"],
            taken["output_map"],
            int(taken["input_units"] or 0),
            int(taken["output_units"] or 0),
        )
    except (OSError, ValueError, KeyError, IndexError, csv.Error):
        return None


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _cells(one: OrderChoice) -> tuple[object, ...]:
    return (
        one.nb,
        one.nk,
        one.evidence.rmsd,
        one.evidence.factor,
        one.evidence.standard_error,
        one.evidence.n_validation,
        one.evidence.n_unexcited,
        one.evidence.n_outliers,
        one.best_nb,
        one.best_nk,
        one.evidence.best_rmsd,
        *(_known(n, 0) for n in (one.aic_nb, one.aic_nk, one.bic_nb, one.bic_nk)),
    )


def _known(value: int, missing: int) -> int | None:
    return None if value == missing else value
