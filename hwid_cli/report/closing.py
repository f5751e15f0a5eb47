"""What a command says last: the answer, where to look, and what to do next."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hwid_cli.records.best_model import BestModel
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.groups import SpoiltJoin
from hwid_cli.records.next import NextRecordings
from hwid_cli.records.order import MapAdvice, OrderAdvice
from hwid_cli.report.final_test import joining_clause
from hwid_cli.report.formats import counted, listed, share_text, with_unit
from hwid_cli.report.map_words import fit_keys, map_words
from hwid_cli.report.orders import axes_to_widen, delay_keys, no_choice

# Room for the words on the left, [characters].
_LABELS = 12
_FEW = 3
# A name of more characters fills a line.
LONG_NAME = 60
# Share of the RMSD of the maps below which a linear model is better, not as good.
_CLEARLY = 0.9
# A band of 90 % that holds less than this on average is too narrow to rely on, [-].
_LEAST_HELD = 0.75
# Keys of the configuration that ask for linear models.
LINEAR_KEYS = "input_map: none, output_map: none"
# Rows that people copy: a line break would spoil them.
_WHOLE = ("page", "tables", "results", "next")


def closing_text(title: str, rows: Sequence[tuple[str, str]], width: int) -> str:
    """Write the block that ends a command.

    Parameters
    ----------
    rows : sequence of (str, str)
        What is said, and a word that says what it is about; rows of one word follow each
        other. Commands and paths are never broken.
    width : int, [characters]
        Of a line.

    Examples
    --------
    >>> print(closing_text("gun: done", [("page", "report.html")], 80))
    gun: done
      page        report.html
    """
    lines = [title]
    before = ""
    for label, text in rows:
        shown = "" if label == before else label
        before = label
        start = f"  {shown:<{_LABELS - 2}}  "
        lines += (
            [start + text]
            if label in _WHOLE
            else textwrap.wrap(
                text,
                width,
                initial_indent=start,
                subsequent_indent=" " * len(start),
                break_long_words=False,
                break_on_hyphens=False,
            )
        )
    return "\n".join(lines)


def best_model_sentences(best: BestModel) -> list[str]:
    """Say which model to take, how good it is on recordings that it has not seen.

    Examples
    --------
    >>> found = BestModel("a/2/3", "test", ("c",), 0.002, "m", 0.01, linear_rmsd=0.03,
    ...                   linear_name="linear:a/1/2")
    >>> for said in best_model_sentences(found):
    ...     print(*said.split())
    a/2/3: RMSD 0.002 m on 1 recording never used (c); below the 0.01 m of crossval.threshold
    best linear model, linear:a/1/2: 0.03 m
    """
    which = listed(best.judged_on, most=_FEW)
    many = counted(len(best.judged_on), "recording")
    on = {
        "test": f"{many} never used ({which})",
        "unseen": f"{many} that no group may hold ({which})",
        "others": f"{many} besides its own ({which})",
        "own": f"its own {many} ({which}); no other has judged it",
    }[best.judge]
    if best.has_estimated_starts:
        on = f"{on}, starts estimated from the measured output"
    mean = "mean RMSD" if len(best.judged_on) > 1 else "RMSD"
    if not best.is_usable:
        return _nothing_to_take(best, on)
    if best.is_linear_better:
        return _linear_sentences(best, mean, on)
    said = [f"{_told(best.name)}: {mean} {_judged(best.rmsd, on, best)}"]
    if best.own_maps:
        maps = " and ".join(map_words(*one) for one in best.own_maps)
        said.append(f"its maps, {maps}, come closest to recordings left out in turn")
    if best.spoilt is not None:
        said.append(spoilt_clause(best.spoilt, best.unit))
    return [*said, *_beside(best)]


def spoilt_clause(spoilt: SpoiltJoin, unit: str) -> str:
    """Say why no joined model is taken, and which recording may have spoilt it.

    Examples
    --------
    >>> said = spoilt_clause(SpoiltJoin("a+b+c/1/2", 0.4, 0.1, "b"), "V")
    >>> print(said.rpartition("; ")[2])
    look at it, and leave it out if it went wrong (recordings.exclude)
    """
    count = counted(spoilt.model.count("+") + 1, "recording")
    joined, single = (with_unit(one, unit) for one in (spoilt.rmsd, spoilt.single_rmsd))
    text = (
        f"a model of {count} together is farther off its own ones ({joined}) than this one "
        f"off those that it has not seen ({single})"
    )
    if not spoilt.suspect:
        return f"{text}: some recordings contradict others"
    return (
        f"{text}: {spoilt.suspect} stands alone; look at it, and leave it out if it went "
        "wrong (recordings.exclude)"
    )


def _beside(best: BestModel) -> list[str]:
    """What stands beside a model: the linear one, single ones, how far its band holds."""
    said = []
    if np.isfinite(best.linear_rmsd):
        linear = with_unit(best.linear_rmsd, best.unit)
        said.append(f"{_linear_model(best)}: {linear}")
        if best.linear_rmsd < best.rmsd:
            # Few recordings, and the others speak for the maps.
            said[-1] += (
                f"; over all recordings but its own {_told(best.name)} leaves "
                f"{best.linear_ratio:.2g} times as much as that"
            )
    if best.singles is not None:
        joining = joining_clause(best.rmsd, best.singles, best.unit)
        said += [joining] if joining else []
    if narrow := narrow_band_clause(best.held):
        said.append(narrow)
    return said


def narrow_band_clause(held: Sequence[tuple[str, float]]) -> str:
    """Warn where a band of 90 % holds far less on recordings that nothing has used.

    Parameters
    ----------
    held : sequence of (str, float)
        Recordings, and the share of each that the band holds, [-].

    Returns
    -------
    str
        Empty where it holds enough, or there is no band.

    Examples
    --------
    >>> print(*narrow_band_clause([("a", 0.59), ("b", 0.8)]).split())
    do not rely on its band of 90 %: it holds 70 % of the recordings never used, 59 % of a
    """
    if not held:
        return ""
    mean = float(np.mean([share for _, share in held]))
    if mean >= _LEAST_HELD:
        return ""
    name, least = min(held, key=lambda one: one[1])
    worst = "" if len(held) == 1 else f", {share_text(least)} of {name}"
    what = f"of {name}" if len(held) == 1 else "of the recordings never used"
    return (
        f"do not rely on its band of 90\N{NO-BREAK SPACE}%: it holds {share_text(mean)} "
        f"{what}{worst}"
    )


def _linear_model(best: BestModel) -> str:
    """Which linear model stands beside a model; one without a name has its orders."""
    if not best.linear_name:
        return "linear model of the same orders"
    return f"best linear model, {_short_name(best.linear_name)}"


def _short_name(name: str) -> str:
    """Name a model by its orders where many recordings make its name a long one.

    Examples
    --------
    >>> _short_name("linear:a+b+c+d/4/5"), _short_name("linear:a+b/4/5")
    ('of 4 recordings, orders 4/5', 'linear:a+b/4/5')
    """
    joined, _, orders = name.partition("/")
    count = joined.count("+") + 1
    return name if count <= _FEW else f"of {count} recordings, orders {orders}"


def _told(name: str) -> str:
    """Name a model in a sentence; of one whose name fills a line, what it is.

    Examples
    --------
    >>> _told("step_06/3/7"), _told("linear:" + "+".join(8 * ["2024-03-11_step"]) + "/1/3")
    ('step_06/3/7', 'the one of 8 recordings, orders 1/3')
    """
    return name if len(name) <= LONG_NAME else f"the one {_short_name(name)}"


def _nothing_to_take(best: BestModel, on: str) -> list[str]:
    """Say that the mean of the output would be closer than any model."""
    linear = best.linear_fit_percent
    also = f", the linear one {_percent(linear)}" if np.isfinite(linear) else ""
    return [
        f"no model predicts these recordings: {_told(best.name)} has a fit of "
        f"{_percent(best.fit_percent)}{also} on {on}; a constant has 0 %"
    ]


def nothing_hint(source: str) -> str:
    """Say what to look at where no model predicts anything."""
    return (
        f"in {source} look at columns, signs and units (recordings:), at delays and orders "
        "(fit.delays, orders:), and whether the recordings that judge go where the others "
        "have never been"
    )


def _percent(value: float) -> str:
    """Write a share that is a percentage already; an output that is not finite has none."""
    if not np.isfinite(value):
        return "no finite output"
    return f"{value:.1f}\N{NO-BREAK SPACE}%"


def linear_is(linear_rmsd: float, own_rmsd: float) -> str:
    """How a linear model that wins stands to the maps: a few percent say little."""
    return "better" if linear_rmsd < _CLEARLY * own_rmsd else "as good"


def _linear_sentences(best: BestModel, mean: str, on: str) -> list[str]:
    """Say that maps make a model worse where its fit has not seen the recordings."""
    own = with_unit(best.rmsd, best.unit)
    how = linear_is(best.linear_rmsd, best.rmsd)
    return [
        f"a linear model is {how}, {_told(best.linear_name)}: "
        f"{mean} {_judged(best.linear_rmsd, on, best)}",
        f"{_told(best.name)}: {own}; these maps are not worth it here",
    ]


def _judged(rmsd: float, on: str, best: BestModel) -> str:
    """Write an RMSD, on what, and on which side of the threshold it lies."""
    written, limit = (with_unit(one, best.unit) for one in (rmsd, best.threshold))
    if not np.isfinite(best.threshold):
        return f"{written} on {on}"
    side = "below" if rmsd < best.threshold else "NOT below"
    by = ""
    if limit == written and rmsd != best.threshold:
        # Both look alike as they are rounded.
        by = f", by {_percent(100.0 * abs(rmsd / best.threshold - 1.0))}"
    return f"{written} on {on}; {side} the {limit} of crossval.threshold{by}"


def why_other_orders(name: str, own: tuple[int, int], advised: tuple[int, int]) -> str:
    """Say why a model does not have the recommended orders; empty where it has them.

    Parameters
    ----------
    name : str
        Of the model, as the reader knows it.
    own, advised : tuple of int, [-]
        Places in the order grid.
    """
    if own == advised:
        return ""
    return (
        f"{name} has {own[0]}/{own[1]}, which other recordings chose for it; the advice is "
        "an average over models of one recording"
    )


def orders_sentence(
    orders: OrderAdvice, maps: MapAdvice | None, best: BestModel | None = None
) -> str:
    """Recommended orders, and maps where some were compared.

    Parameters
    ----------
    best : BestModel or None
        The model that stands beside them.
    """
    if reason := no_choice(orders.overall.evidence, orders.unit):
        return f"none recommended: {reason}"
    said = f"nb = {orders.overall.nb}, nk = {orders.overall.nk}"
    if maps is not None and maps.evidence.predicts:
        pair = (maps.chosen.input_map, maps.chosen.output_map)
        named = " and ".join(one.replace("_", " ") for one in pair)
        said += ", no maps" if set(pair) == {"none"} else f", maps {named}"
    why = ""
    if best is not None and best.is_usable and not best.is_linear_better:
        advised = (orders.overall.nb, orders.overall.nk)
        why = why_other_orders("the model above", best.place, advised)
    if why:
        # One answer: the model that is named, and not what another grid might hold.
        said += f" on average (hwid order says why); {why}: take the model"
    else:
        said += " recommended (hwid order says why)"
        if maps is not None and maps.evidence.predicts and maps.chosen != maps.given:
            said += f": put {fit_keys(maps.chosen)} into fit"
    axes = axes_to_widen(orders, orders.overall.nb, orders.overall.nk)
    if delays := orders.further_delays:
        said += (
            f"; models are better with a delay of up to {delays[-1]} samples, which these "
            f"orders do not reach: put {delay_keys(delays)} into fit"
        )
    elif axes and not why:
        said += f"; they lie at the edge of the grid: widen {' and '.join(axes)}"
    return said


def recordings_sentence(found: NextRecordings, folder: Path) -> str:
    """Which recordings to take next, and where their inputs are; or that none is needed.

    Parameters
    ----------
    folder : Path
        Of the files that can be played.
    """
    if found.is_enough or not found.proposals:
        return "enough is known: no further recording is proposed"
    first, *others = found.proposals
    more = f" and {len(others)} more" if others else ""
    return f"{first.name}{more}; files to play: {folder} (hwid next says why)"


# Where two kinds of evidence disagree on maps: parts of the recordings of the fits, and
# recordings that they have not seen.
UNDECIDED_MAPS = (
    "'hwid order' prefers these maps, the recordings that judge a linear model: let more "
    "recordings judge (test.recordings)"
)


# What a configuration needs so that 'hwid next' can propose recordings.
NEXT_KEYS = "next: {limits: {amplitude: ..., rate: ..., duration_s: ...}}"


def above_threshold_hint(source: str, *, has_order: bool, has_next: bool) -> str:
    """Say what may bring a model below the threshold.

    Parameters
    ----------
    has_order : bool
        Whether orders and maps have been compared already.
    has_next : bool
        Whether the configuration says what could be recorded.
    """
    steps = [] if has_order else ["hwid order compares orders and maps"]
    asks = "hwid next" if has_next else f"hwid next, with '{NEXT_KEYS}' in {source},"
    steps.append(f"{asks} says which recordings are missing")
    return (
        f"above the threshold: {'; '.join(steps)}; an effect that no map can hold shows in "
        "hwid diagnose"
    )


def keys_hint(keys: str, source: str) -> str:
    """Say which keys of the configuration ask for better models."""
    return f"for better models put '{keys}' into fit in {source} and run it again"


def diagnosis_sentence(diagnosis: Diagnosis) -> str:
    """The verdict and its sentence."""
    return f"{diagnosis.verdict}: {diagnosis.summary}"
