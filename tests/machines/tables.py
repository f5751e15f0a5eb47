"""Results as markdown: the answer first, then one row for each machine."""

from collections import Counter
from math import sqrt

from tests.machines.score import INVISIBLE

# Two-sided 95 % of a normal distribution.
Z = 1.959964
ORDER = (
    "right",
    "partly",
    "refused",
    "wrong",
    "falsely complete",
    "false alarm",
    "failed",
)


def wilson(hits: int, total: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share.

    >>> [round(end, 3) for end in wilson(8, 10)]
    [0.49, 0.943]
    """
    if total == 0:
        return 0.0, 1.0
    share, extra = hits / total, Z * Z / total
    middle = (share + extra / 2) / (1 + extra)
    half = Z * sqrt(share * (1 - share) / total + extra / (4 * total)) / (1 + extra)
    return max(0.0, middle - half), min(1.0, middle + half)


def share(hits: int, total: int) -> str:
    """A share in percent, with its interval."""
    if total == 0:
        return "-"
    low, high = wilson(hits, total)
    return f"{100 * hits / total:.0f} % ({hits} of {total}; {100 * low:.0f} to {100 * high:.0f} %)"


def covered(rows: list[dict]) -> str:
    """Share of the intervals that hold the true value."""
    return share(sum(r["covered"] for r in rows), sum(r["intervals"] for r in rows))


def number(value: float | None) -> str:
    """Three digits, or a dash."""
    return "-" if value is None else f"{value:.3g}"


def summary(rows: list[dict]) -> list[str]:
    """The answer in a few lines: shares of the machines with and without an effect."""
    hidden = [row for row in rows if row["family"] != "clean"]
    clean = [row for row in rows if row["family"] == "clean"]
    counts = Counter(row["outcome"] for row in hidden)
    named = [row for row in hidden if row["verdict"] == "named"]
    whole = [row for row in rows if row["complete"]]
    part = [row for row in rows if not row["complete"]]
    invisible = sum(row["gap_over_noise"] < INVISIBLE for row in hidden)
    seconds = sorted(row["seconds"] for row in rows if row["seconds"] is not None)
    lines = [
        "| of machines with an effect | share (95 % interval) |",
        "|---|---|",
        *(
            f"| {word} | {share(counts[word], len(hidden))} |"
            for word in ORDER
            if word != "false alarm"
        ),
        f"| named effects that are wrong | {share(sum(r['outcome'] == 'wrong' for r in named), len(named))} |",
        f"| claims to be complete that are false, of all that name | {share(sum(r['falsely_complete'] for r in named), len(named))} |",
        f"| effects too small to see (gap below {INVISIBLE:g} of the noise) | {invisible} of {len(hidden)} |",
        "",
        "| of clean machines | share (95 % interval) |",
        "|---|---|",
        f"| right | {share(sum(r['outcome'] == 'right' for r in clean), len(clean))} |",
        f"| false alarm | {share(sum(r['outcome'] == 'false alarm' for r in clean), len(clean))} |",
        f"| failed | {share(sum(r['outcome'] == 'failed' for r in clean), len(clean))} |",
        "",
        f"True parameters inside their 95 % intervals: {covered(whole)} where the diagnosis says it",
        f"is complete, {covered(part)} where it says it is not.",
    ]
    if seconds:
        lines.append(
            f"Processor seconds of a diagnosis: median {seconds[len(seconds) // 2]:.0f}, largest {seconds[-1]:.0f}."
        )
    return lines


def by_family(rows: list[dict]) -> list[str]:
    """Outcomes of each family of machines."""
    families = list(dict.fromkeys(row["family"] for row in rows))
    lines = [
        "| family | machines | " + " | ".join(ORDER) + " |",
        "|---" * (len(ORDER) + 2) + "|",
    ]
    for family in families:
        counts = Counter(row["outcome"] for row in rows if row["family"] == family)
        cells = [str(counts[word]) if counts[word] else "" for word in ORDER]
        lines.append(
            f"| {family} | {sum(counts.values())} | " + " | ".join(cells) + " |"
        )
    return lines


def machines(rows: list[dict]) -> list[str]:
    """One row for each machine."""
    lines = [
        "| machine | hidden | said | complete | true gap | before | after | explained | intervals | s | score |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        complete = {True: "yes", False: "no", None: ""}[row["complete"]]
        checked = f"{row['covered']}/{row['intervals']}" if row["intervals"] else ""
        said = row["said"].replace("|", "\\|")
        lines.append(
            f"| {row['name']} | {' + '.join(row['hidden']) or '-'} | {said} | {complete} "
            f"| {number(row['gap_over_noise'])} | {number(row['before'])} | {number(row['after'])} "
            f"| {number(row['explained'])} | {checked} | {number(row['seconds'])} | {row['outcome']} |"
        )
    return lines


def document(rows: list[dict], seeds: str) -> str:
    """The whole page."""
    missed = [
        f"- {row['name']}: {one}" for row in rows for one in row["missed_intervals"]
    ]
    parts = [
        f"# Diagnosis of {len(rows)} machines, seeds `{seeds}`",
        "",
        *summary(rows),
        "",
        "True gap: what a simulation without the effects cannot reach after a refit, over the",
        "noise. Before and after: held-out error over the noise, as the diagnosis reports it.",
        "",
        *by_family(rows),
        "",
        *machines(rows),
    ]
    if missed:
        parts += ["", "Intervals that miss the true value:", "", *missed]
    return "\n".join(parts) + "\n"
