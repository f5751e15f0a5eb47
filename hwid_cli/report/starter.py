"""What ``hwid init`` guessed."""

from hwid_cli.files.messages import escaped
from hwid_cli.records.starter import FolderLayout, Proposal, Role
from hwid_cli.report.table import Code


def starter_summary(path: str, layout: FolderLayout, proposal: Proposal) -> Code:
    """Say what was guessed, why, and what to check.

    Parameters
    ----------
    path : str
        Of the configuration that was written.
    """
    lines = [
        f"files: {', '.join(map(escaped, layout.patterns))}",
        f"used: {', '.join(_trained(proposal))}",
        f"time: {_time(layout, proposal)}",
        f"input: {_role(layout.input)}",
        f"output: {_role(layout.output)}",
        *(f"note: {note}" for note in layout.notes),
        *(f"note: NOT SURE: {note}" for note in proposal.notes),
        *(f"skipped: {escaped(name)}: {why}" for name, why in layout.left),
        *(f"left out: {problem}" for problem in proposal.problems),
        f"kinds: {_kinds(proposal)}",
        f"calibrate: {proposal.recipe_reason}",
        f"threshold: {proposal.threshold:g}, {proposal.threshold_reason}",
    ]
    if proposal.held_out:
        held_out = ", ".join(proposal.held_out)
        lines.append(f"held out for the test: {held_out} ({proposal.held_out_reason})")
    lines += [
        "",
        f"{path} is written; check columns, units, threshold and recipes in it. Then:",
        f"  hwid check {path}",
        f"  hwid run {path}",
    ]
    return Code("\n".join(lines))


def _trained(proposal: Proposal) -> list[str]:
    if proposal.parts:
        return [*proposal.names]
    return [name for name in proposal.names if name not in proposal.held_out]


def _role(role: Role) -> str:
    called = repr(role.title) if role.title else f"column {role.key}"
    unit = f" in {role.unit}" if role.unit else ", unit not known"
    return f"{called}{unit}: {role.reason}"


def _time(layout: FolderLayout, proposal: Proposal) -> str:
    if layout.time is None:
        return f"sample time {layout.sample_time_s:g} s: {layout.clock_reason}"
    called = (
        repr(layout.time.title) if layout.time.title else f"column {layout.time.key}"
    )
    has_odd_steps = layout.resample and layout.sample_time_s is None
    more = "; jitters, so it is resampled" if has_odd_steps else ""
    if layout.output_time is not None:
        more = "; the output has a clock of its own: both are put on one"
    step = f"{proposal.sample_time_s:g} s"
    return f"{called}, a sample every {step}: {layout.time.reason}{more}"


def _kinds(proposal: Proposal) -> str:
    if proposal.parts:
        return "one file, cut into two recordings"
    found = [f"{kind} {', '.join(names)}" for kind, names in proposal.kinds.items()]
    if "other" in proposal.recipes and found:
        found.append("other the rest")
    return f"{'; '.join(found) or 'other'} ({proposal.kind_reason})"
