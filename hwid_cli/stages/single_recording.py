"""One measurement file as a recording, for programs that have no configuration file."""

import glob
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hwid_cli.config.load import experiment_of
from hwid_cli.data.packed import stem_of
from hwid_cli.data.recordings import read_recordings
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import Columns
from hwid_cli.records.recordings import Recording

# Named in messages in place of a configuration file.
_SOURCE = "load_recording"


def load_recording(
    path: str | Path,
    columns: Mapping[str, str | int] | Columns,
    sample_time_s: float | None = None,
    *,
    kind: str = "other",
    input_unit: str | None = None,
    output_unit: str | None = None,
) -> Recording:
    r"""Recording that a CSV, MAT, NPZ or HDF5 file holds.

    Reads and checks the file as the commands do: finite numbers, a uniform clock, input
    and output of equal length that change. Nothing is cut or subtracted.

    Parameters
    ----------
    columns : mapping or Columns
        Where input, output and time are, as in ``recordings.columns`` of a configuration:
        ``{"time": "time_s", "input": "current_A", "output": "position_m"}``.
    sample_time_s : float, optional, [s]
        Needed where there is no time column.
    kind : str
        One of ``step``, ``sine``, ``random``, ``other``.
    input_unit, output_unit : str, optional
        Labels; numbers are not converted. None: what the file says, else A and m.

    Returns
    -------
    Recording
        Named after the file, without its ending.

    Raises
    ------
    ConfigError
        If the columns are described wrongly.
    MeasurementError
        If the file cannot be used, in one line with row, value and expectation.

    Examples
    --------
    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = Path(folder.name) / "run_1.csv"
    >>> lines = [f"{0.01 * k:.2f};{k % 7};{k % 5}" for k in range(100)]
    >>> _ = path.write_text("t;i;x\n" + "\n".join(lines))
    >>> recording = load_recording(path, {"time": "t", "input": "i", "output": "x"})
    >>> recording.name, recording.n_samples, recording.sample_time_s
    ('run_1', 100, 0.01)
    >>> folder.cleanup()
    """
    path = Path(path)
    if not path.is_file():
        raise MeasurementError(
            f"{path}: no such file; expected a measurement; correct the path"
        )
    described: dict[str, Any] = {
        "files": glob.escape(str(path.resolve())),
        "columns": _plain(columns),
        "sample_time_s": sample_time_s,
        "kind": {kind: ["*"]},
        "input_unit": input_unit,
        "output_unit": output_unit,
    }
    # The smallest orders: how long a recording must be is for the fit to say.
    content = {
        "name": "recording",
        "recordings": described,
        "orders": {"nb": [1], "nk": [0]},
    }
    (raw,) = read_recordings(experiment_of(content, _SOURCE), Path())
    return Recording(
        name=stem_of(path),
        input=raw.input,
        output=raw.output,
        sample_time_s=raw.sample_time_s,
        kind=raw.kind,
        sha256=raw.sha256,
        input_unit=raw.input_unit,
        output_unit=raw.output_unit,
        reference=raw.reference,
    )


def _plain(columns: Mapping[str, str | int] | Columns) -> dict[str, Any]:
    given = asdict(columns) if isinstance(columns, Columns) else dict(columns)
    return {role: key for role, key in given.items() if key is not None}
