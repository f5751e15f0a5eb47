"""``hwid calibrate``: raw measurements in, recordings of equal length out."""

from typing import TYPE_CHECKING

import click

from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session
    from hwid_cli.records.recordings import RawRecording
    from hwid_cli.store.results import Calibrated


# Keys of the configuration that name recordings.
NAME_LISTS = {
    "identify": ("recordings",),
    "crossval": ("recordings",),
    "group": ("start", "candidates", "validate"),
    "test": ("recordings",),
    "diagnose": ("recordings", "hold_out"),
}


@click.command("calibrate")
@stage_options
def command(choices: Choices) -> None:
    """Cut recordings to their useful part and take offsets off.

    Reads the raw recordings, applies the recipe of each kind, replaces single damaged
    samples, and writes calibrated.h5 and a figure before/after of each recording.
    """
    from hwid_cli.cli.session import open_session, say
    from hwid_cli.report.calibration import calibration_table
    from hwid_cli.report.table import as_text

    session = open_session(choices, "calibrate")
    calibrated = calibrate_stage(session)
    say(session, as_text([calibration_table(calibrated.logs)]))
    say(session, f"results: {session.calibrated_path}, {session.out / 'figures'}")


@once
def calibrate_stage(session: "Session") -> "Calibrated":
    """Bring ``calibrated.h5`` up to date."""
    from hwid_cli.cli.session import provenance, read_unchanged, say, start_timer
    from hwid_cli.data.recordings import read_recordings
    from hwid_cli.stages.calibrate import calibrate_all, calibration_key
    from hwid_cli.store.results import Calibrated, read_calibrated, write_calibrated

    find_measurements(session)
    timer = start_timer()
    raws = read_recordings(session.experiment, session.out)
    session.read.update({raw.source: raw.sha256 for raw in raws})
    _check_names(session, raws)
    options = session.experiment.calibrate
    key = calibration_key(raws, options)
    calibrated = read_unchanged(session, "calibrate", key, read_calibrated)
    is_old = calibrated is not None
    if calibrated is None:
        recordings, logs = calibrate_all(raws, options)
        origin = provenance(session, key, recordings, seconds=timer.seconds)
        write_calibrated(session.calibrated_path, recordings, logs, origin)
        calibrated = Calibrated(recordings, logs, key)
    if options is not None:
        draw_figures(session, raws, calibrated, only_missing=is_old)
    state = "from the cache" if is_old else "done"
    say(
        session,
        f"calibrate: {len(raws)} recordings {state}, "
        f"{_what_changed(session, calibrated)}, {timer()}",
    )
    return calibrated


def _check_names(session: "Session", raws: "list[RawRecording]") -> None:
    """Refuse a misspelt recording in any section before anything is computed."""
    from hwid_cli.stages.selection import select_recordings

    experiment = session.experiment
    for section, keys in NAME_LISTS.items():
        options = getattr(experiment, section)
        for key in keys if options is not None else ():
            names = getattr(options, key)
            # The one word that stands for a choice of names.
            if names != "auto":
                place = f"{experiment.source}: {section}.{key}"
                select_recordings(raws, names, key=place)


def _what_changed(session: "Session", calibrated: "Calibrated") -> str:
    options = session.experiment.calibrate
    if options is None:
        return "left as they are (no calibrate: section)"
    kinds = {recording.kind for recording in calibrated.recordings}
    bare = sorted(kind for kind in kinds if not getattr(options, kind))
    left = f"calibrate: has no recipe for {' and '.join(bare)}"
    if len(bare) == len(kinds):
        return f"left as they are, not repaired either ({left})"
    n_repaired = sum(
        len(log.repaired_input) + len(log.repaired_output) for log in calibrated.logs
    )
    changed = f"{n_repaired} damaged samples replaced"
    return f"{changed}, some left as they are ({left})" if bare else changed


def find_measurements(session: "Session") -> None:
    """Make virtual measurements up to date, or end the program if optional ones lack.

    Raises
    ------
    click.exceptions.Exit
        With code 0 and one line that says where to put the data.
    """
    from hwid_cli.cli.simulate import simulate_stage
    from hwid_cli.data.paths import find_files, missing_files_message, recordings_base

    if session.experiment.simulate is not None:
        simulate_stage(session)
    base = recordings_base(session.experiment, session.out)
    if not find_files(session.experiment, base):
        click.echo(f"skipped: {missing_files_message(session.experiment, base)}")
        raise click.exceptions.Exit(0)


def draw_figures(
    session: "Session",
    raws: "list[RawRecording]",
    calibrated: "Calibrated",
    *,
    only_missing: bool,
) -> None:
    """Draw each recording before and after calibration.

    Parameters
    ----------
    calibrated : Calibrated
        In the same order.
    only_missing : bool
        Whether figures that are there may stay.
    """
    folder = session.out / "figures" / "calibrate"
    paths = [folder / f"{raw.name}.png" for raw in raws]
    if only_missing and all(path.is_file() for path in paths):
        return
    from hwid_cli.files.atomic import replace_file
    from hwid_cli.report.plots import as_png, calibration_figure

    for path, raw, recording, log in zip(
        paths, raws, calibrated.recordings, calibrated.logs, strict=True
    ):
        if not (only_missing and path.is_file()):
            replace_file(path, as_png(calibration_figure(raw, recording, log)))
