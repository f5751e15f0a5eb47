"""What was run on what, and what came out, in a few sentences."""

from hwid_cli.records.report import ChainOnTests, ReportContents
from hwid_cli.report.fits import fits_status
from hwid_cli.report.formats import MISSING, counted, listed, with_unit
from hwid_cli.report.groups import NOTHING_COVERED
from hwid_cli.report.page import (
    Collapsible,
    PageBlock,
    Section,
    collapsed_beyond,
    section_notes,
)
from hwid_cli.report.table import Cell, Code, Table, Text, numbers, texts

# Characters of a hash that tell files and runs apart for the eye.
_SHORT = 10
# Recordings whose table is shown open.
_MOST_OPEN = 12


def summary_section(contents: ReportContents) -> Section:
    """Write the first section."""
    stored = contents.stored
    blocks: list[PageBlock] = [Text(line) for line in _headline(contents)]
    blocks += section_notes(contents, is_validation=True)
    blocks.append(_stages_table(contents))
    blocks += [Text(line, is_note=True) for line in _remarks(contents)]
    if stored.recordings:
        summary = f"All {counted(len(stored.recordings), 'recording')}"
        blocks.append(
            collapsed_beyond(_MOST_OPEN, _recordings_table(contents), summary)
        )
    configuration = "The configuration with all defaults filled in"
    blocks.append(Collapsible(configuration, (Code(stored.config),), is_printed=False))
    return Section("summary", "Summary", "Summary", tuple(blocks))


def _headline(contents: ReportContents) -> list[str]:
    stored, lines = contents.stored, []
    if stored.recordings:
        about = counted(len(stored.recordings), "recording")
        if stored.fits:
            ended = fits_status(contents.statuses)
            about += f" and {counted(len(stored.fits), 'fitted model')} ({ended})"
        lines.append(f"{about}.")
    if contents.cross is not None:
        cross = contents.cross
        row = int(cross.covers.argmax())
        below = f"with an RMSD below {with_unit(cross.threshold, cross.unit)}"
        lines.append(
            f"The widest model of a single recording, {cross.models[row]}, covers "
            f"{cross.covers[row]} of {counted(len(cross.recordings), 'recording')} {below}."
            if cross.covers[row]
            else f"No model of a single recording covers any recording {below}."
        )
    if stored.search is not None and not stored.search.chain:
        lines.append(f"Grouping: {NOTHING_COVERED}")
    elif stored.search is not None:
        winner = stored.search.chain_groups[-1]
        lines.append(
            f"Grouping: the group {winner.name} covers {winner.coverage} of "
            f"{len(stored.search.validated_on)} with its model {winner.model_name}."
        )
    if (
        contents.trend is not None
        and contents.trend.models
        and contents.trend.recordings
    ):
        lines.append(_trend_line(contents.trend))
    if stored.diagnosis is not None:
        verdict = str(stored.diagnosis.get("verdict", MISSING))
        lines.append(f"Diagnosis of the simulation: {verdict}.")
    return lines


def _trend_line(trend: ChainOnTests) -> str:
    first, last = (with_unit(trend.mean[place], trend.unit) for place in (0, -1))
    ways = (
        f"is {first} with {trend.models[0]}"
        if len(trend.models) == 1
        else f"goes from {first} with the first model of the chain to {last} with the "
        "last"
    )
    return (
        f"On {counted(len(trend.recordings), 'test recording')} that nothing else "
        f"has used, the mean RMSD {ways}, which covers {trend.covers[-1]} of them."
    )


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


def _remarks(contents: ReportContents) -> list[str]:
    """Versions, said once where all stages agree."""
    known = [run for run in contents.stored.stages if run.versions]
    groups: dict[str, list[str]] = {}
    for run in known:
        packages = {name: n for name, n in run.versions.items() if name != "hwid"}
        text = ", ".join(f"{name} {number}" for name, number in packages.items())
        groups.setdefault(text, []).append(run.stage)
    if len(groups) == 1:
        return [f"Computed with {next(iter(groups))}."]
    return [
        f"{listed(stages)}: computed with {text}." for text, stages in groups.items()
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
