"""What stands last on the page: which stages ran, on what, with which program."""

from collections.abc import Sequence

from hwid_cli.records.report import ReportContents
from hwid_cli.report.fits import fits_status
from hwid_cli.report.formats import MISSING, counted, listed
from hwid_cli.report.page import Collapsible, PageBlock, Section, to_copy
from hwid_cli.report.table import Cell, Code, Heading, Table, Text, numbers, texts

# Characters of a hash that tell files and runs apart for the eye.
_SHORT = 10


def about_section(contents: ReportContents, missing: Sequence[Section]) -> Section:
    """Say what was not run, and fold what a result can be traced by.

    Parameters
    ----------
    missing : sequence of Section
        Those without anything to show.
    """
    stored = contents.stored
    blocks: list[PageBlock] = []
    if stored.recordings:
        about = counted(len(stored.recordings), "recording")
        if stored.fits:
            ended = fits_status(contents.statuses)
            about += f" and {counted(len(stored.fits), 'fitted model')} ({ended})"
        blocks.append(Text(f"{about}."))
    changed = [
        f"{run.stage}: {_state(contents, run.stage, run.changed)}"
        for run in stored.stages
        if run.changed or run.stage in contents.outdated
    ]
    blocks += [Text(one) for one in changed]
    if missing:
        blocks.append(Heading("Not shown"))
        blocks += [
            Text(to_copy(f"{one.short}: {one.missing}", stored), is_note=True)
            for one in missing
        ]
    blocks.append(
        Collapsible(
            "Stages, keys and versions of packages",
            (_stages_table(contents), *_versions(contents)),
        )
    )
    if stored.recordings:
        summary = (
            f"All {counted(len(stored.recordings), 'recording')} with their hashes"
        )
        blocks.append(Collapsible(summary, (_recordings_table(contents),)))
    configuration = "The configuration with all defaults filled in"
    blocks.append(Collapsible(configuration, (Code(stored.config),), is_printed=False))
    return Section("about", "About these results", "About", tuple(blocks))


def _stages_table(contents: ReportContents) -> Table:
    rows = []
    for run in contents.stored.stages:
        rows.append(
            (
                run.stage,
                f"{run.seconds:.1f}" if run.seconds == run.seconds else "unknown",
                Cell(run.key[:_SHORT], title=run.key),
                run.versions.get("hwid", "unknown"),
                _state(contents, run.stage, run.changed),
            )
        )
    return Table(
        "Stages whose results are shown; seconds are those of the run that gave them",
        (
            *texts("stage"),
            *numbers("seconds [s]"),
            *texts("key"),
            *numbers("hwid"),
            *texts("state"),
        ),
        tuple(rows),
    )


def _state(contents: ReportContents, stage: str, changed: tuple[str, ...]) -> str:
    if stage in contents.outdated:
        return f"older than the models; run 'hwid {stage}' again"
    if changed:
        return f"other settings now: {listed(changed)}"
    return "as configured"


def _versions(contents: ReportContents) -> list[Text]:
    """Versions, said once where all stages agree."""
    known = [run for run in contents.stored.stages if run.versions]
    groups: dict[str, list[str]] = {}
    for run in known:
        packages = {name: n for name, n in run.versions.items() if name != "hwid"}
        text = ", ".join(f"{name} {number}" for name, number in packages.items())
        groups.setdefault(text, []).append(run.stage)
    if len(groups) == 1:
        return [Text(f"Computed with {next(iter(groups))}.", is_note=True)]
    return [
        Text(f"{listed(stages)}: computed with {text}.", is_note=True)
        for text, stages in groups.items()
    ]


def _recordings_table(contents: ReportContents) -> Table:
    rows = tuple(
        (
            recording.name,
            recording.kind,
            str(recording.n_samples),
            f"{recording.sample_time_s:g}",
            f"{recording.n_samples * recording.sample_time_s:.3g}",
            Cell(recording.sha256[:_SHORT] or MISSING, title=recording.sha256),
        )
        for recording in contents.stored.recordings
    )
    return Table(
        "Recordings after calibration; the hash is that of the measured file",
        (
            *texts("recording", "kind"),
            *numbers("samples", "sample time [s]", "length [s]"),
            *texts("SHA-256"),
        ),
        rows,
    )
