"""What calibration did, as a table."""

from collections.abc import Sequence

from hwid_cli.records.recordings import CalibrationLog
from hwid_cli.report.formats import MISSING, number
from hwid_cli.report.table import Table, numbers, texts


def calibration_table(logs: Sequence[CalibrationLog]) -> Table:
    """Show what calibration did, one line for each recording."""
    rows = tuple(
        (
            log.name,
            f"{log.n_raw_input}/{log.n_raw_output}",
            str(log.first_sample),
            str(log.n_samples),
            number(log.input_offset) if "input_offset" in log.steps else MISSING,
            number(log.output_offset) if "output_offset" in log.steps else MISSING,
            f"{log.period_samples:.2f}" if log.period_samples else MISSING,
            f"{len(log.repaired_input)}/{len(log.repaired_output)}",
        )
        for log in logs
    )
    columns = (
        *texts("recording"),
        *numbers("raw in/out", "first", "kept", "in offset", "out offset", "period"),
        *numbers("repaired"),
    )
    caption = "Calibration: samples, what was subtracted, samples repaired (in/out)"
    return Table(caption, columns, rows)
