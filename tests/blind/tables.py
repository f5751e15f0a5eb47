"""Tables of the blind test's document, in Markdown."""

import itertools
import math
from collections import Counter

import numpy as np

# Quantile of the normal distribution for 95 % intervals.
_NORMAL_95 = 1.959964
SUITE_WORDS = {
    "full": "Every effect, 27 recordings",
    "poor": "Every effect, 15 one-way steps only",
    "clean": "Nothing hidden",
    "nuisance": "Nothing hidden, but a nuisance",
    "outside": "Effects outside the catalogue",
    "near": "Laws next to those of the catalogue",
    "pairs": "Two effects at once",
    "small": "Effects of 0.1 to 0.3 of their size",
}
# What a score calls right, where it is not the name of what is hidden.
RIGHT_MEANS = {
    "clean": "right: `parameters` or `none`",
    "nuisance": "right: not named, or the cause itself",
    "outside": "right: not named",
    "near": "right: a name that does it justice",
}


def wilson(hits, total):
    """95 % interval of a share."""
    if total == 0:
        return 0.0, 1.0
    z2 = _NORMAL_95**2
    share = hits / total
    middle = (share + z2 / (2 * total)) / (1 + z2 / total)
    half = math.sqrt(share * (1 - share) / total + z2 / (4 * total**2))
    half *= _NORMAL_95 / (1 + z2 / total)
    # At none or all the bound is the share itself; rounding must not pass it.
    low = 0.0 if hits == 0 else max(middle - half, 0.0)
    high = 1.0 if hits == total else min(middle + half, 1.0)
    return low, high


def share_text(hits, total):
    """A share with its interval and the number of cases."""
    if total == 0:
        return "-"
    low, high = wilson(hits, total)
    return f"{hits / total:.0%} ({low:.0%}-{high:.0%}, n={total})"


def _groups(outcomes, key):
    found = {}
    for one in outcomes:
        found.setdefault(key(one), []).append(one)
    return dict(sorted(found.items()))


def _suites(outcomes):
    """Outcomes by suite and noise, in the order of the suites."""
    order = list(SUITE_WORDS)
    return _groups(
        outcomes, lambda one: (order.index(one["suite"]), one["noise_percent"])
    )


def _table(heads, rows):
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def _count(outcomes, result):
    return sum(one["result"] == result for one in outcomes)


def verdict_table(outcomes):
    rows = []
    for (suite, noise), cases in _suites(outcomes).items():
        name = list(SUITE_WORDS)[suite]
        n = len(cases)
        meaning = f"; {RIGHT_MEANS[name]}" if name in RIGHT_MEANS else ""
        full = [one for one in cases if one["result"] == "right"]
        complete = sum(one["complete"] is True for one in full)
        rows.append(
            (
                SUITE_WORDS[name] + meaning,
                f"{noise:g}",
                share_text(len(full), n),
                share_text(_count(cases, "wrong"), n),
                str(_count(cases, "ambiguous")),
                str(_count(cases, "refused")),
                str(_count(cases, "failed")),
                share_text(sum(one["family_right"] for one in cases), n)
                if name not in {"clean", "nuisance", "outside"}
                else "-",
                f"{complete}/{len(full)}" if cases[0]["hidden"] else "-",
            )
        )
    heads = (
        "cases",
        "noise %",
        "right",
        "named wrongly",
        "ambiguous",
        "refused",
        "failed",
        "family right",
        "complete of the right",
    )
    return _table(heads, rows)


def _label(one):
    return "+".join(one["hidden"]) or one["nuisance"] or "nothing"


def effect_table(outcomes):
    rows = []
    order = {name: n for n, name in enumerate(SUITE_WORDS)}
    kinds = _groups(outcomes, lambda one: (order[one["suite"]], _label(one)))
    noises = sorted({one["noise_percent"] for one in outcomes})
    for (suite, label), cases in kinds.items():
        cells = []
        for noise in noises:
            here = [one for one in cases if one["noise_percent"] == noise]
            wrong = _count(here, "wrong")
            text = f"{_count(here, 'right')}/{len(here)}" if here else "-"
            cells.append(text + (f", {wrong} wrong" if wrong else ""))
        gap = np.median([one["gap_share"] for one in cases])
        rows.append((list(SUITE_WORDS)[suite], label, f"{gap:.1%}", *cells))
    heads = ("suite", "hidden", "gap, share of motion (median)")
    return _table((*heads, *(f"right at {noise:g} %" for noise in noises)), rows)


def small_table(outcomes):
    small = [one for one in outcomes if one["suite"] == "small"]
    if not small:
        return ""
    edges = (0.0, 0.02, 0.04, 0.07, 0.15, 0.3, math.inf)
    rows = []
    for low, high in itertools.pairwise(edges):
        cases = [one for one in small if low <= one["gap_to_noise"] < high]
        if cases:
            rows.append(
                (
                    f"{low:g} to {high:g}",
                    share_text(_count(cases, "right"), len(cases)),
                    share_text(_count(cases, "wrong"), len(cases)),
                    str(_count(cases, "ambiguous")),
                    str(_count(cases, "refused")),
                )
            )
    heads = ("gap / noise", "right", "named wrongly", "ambiguous", "refused")
    return _table(heads, rows)


def _quantiles(values, *levels):
    kept = [value for value in values if value is not None]
    if not kept:
        return ["-"] * len(levels)
    # A parameter that is missing counts as infinitely wrong: no value is made up of it.
    return [
        f"{value:.3g}" for value in np.quantile(kept, levels, method="inverted_cdf")
    ]


def gap_table(outcomes):
    rows = []
    for (suite, noise), cases in _suites(outcomes).items():
        right = [
            one
            for one in cases
            if one["result"] == "right" and one["verdict"] == "named"
        ]
        if right:
            closed = [one["closed"] for one in right]
            rows.append(
                (
                    list(SUITE_WORDS)[suite],
                    f"{noise:g}",
                    *_quantiles([one["before_to_noise"] for one in right], 0.5),
                    *_quantiles([one["after_to_noise"] for one in right], 0.5, 0.95),
                    *_quantiles(closed, 0.5, 0.05),
                )
            )
    heads = (
        "suite",
        "noise %",
        "before / noise, median",
        "after / noise, median",
        "95th percentile",
        "share of excess closed, median",
        "5th percentile",
    )
    text = "Held-out RMS over the noise that was added, where the name is right.\n\n"
    return text + _table(heads, rows) if rows else ""


def parameter_table(outcomes):
    errors, covered = {}, {}
    for one in outcomes:
        if one["suite"] in {"full", "pairs", "poor"}:
            for name, error in one["errors"].items():
                errors.setdefault((one["suite"], name), []).append(error)
            for name, is_covered in one["covered"].items():
                covered.setdefault((one["suite"], name), []).append(is_covered)
    if not errors:
        return ""
    rows = []
    for key, values in sorted(errors.items()):
        inside = covered.get(key, [])
        percent = [100 * value for value in values]
        rows.append(
            (
                *key,
                str(len(values)),
                *_quantiles(percent, 0.5, 0.9),
                f"{sum(inside)}/{len(inside)}",
            )
        )
    every = [100 * value for values in errors.values() for value in values]
    rows.append(("all", "all", str(len(every)), *_quantiles(every, 0.5, 0.9), ""))
    heads = ("suite", "parameter", "n", "error %, median", "90th percentile", "in 95 %")
    text = (
        "Relative error where the name is right, over all noise levels; the last column "
        "counts intervals that hold the true value.\n\n"
    )
    return text + _table(heads, rows)


def confusion_table(outcomes):
    counts = Counter()
    for one in outcomes:
        if one["result"] == "right":
            continue
        told = "+".join(one["named"]) if one["named"] else one["verdict"]
        if one["verdict"] == "ambiguous":
            others = ", ".join(
                name if isinstance(name, str) else "+".join(name)
                for name in one["ambiguous_with"]
            )
            told = f"ambiguous: {told} or {others}"
        counts[one["suite"], _label(one), one["noise_percent"], told] += 1
    rows = [
        (suite, label, f"{noise:g}", told, str(n))
        for (suite, label, noise, told), n in sorted(counts.items())
    ]
    heads = ("suite", "hidden", "noise %", "answer", "n")
    return _table(heads, rows) if rows else ""


def time_table(outcomes):
    rows = []
    for name in SUITE_WORDS:
        cases = [one for one in outcomes if one["suite"] == name]
        if cases:
            rows.append(
                (
                    name,
                    *_quantiles([one["seconds"] for one in cases], 0.5, 0.95),
                    *_quantiles([one["wall_seconds"] for one in cases], 0.5, 0.95),
                )
            )
    heads = (
        "suite",
        "seconds in `diagnosis.json`, median",
        "95th percentile",
        "whole command, median",
        "95th percentile",
    )
    return _table(heads, rows)
