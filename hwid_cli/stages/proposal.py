"""``init``: what to do with the recordings of a folder, proposed from their content."""

import glob
import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from hwid_cli.data import column_signs as signs
from hwid_cli.data.doubtful import copies, doubts
from hwid_cli.data.signal_features import LEAST_QUIET, find_onset
from hwid_cli.errors import HwidError
from hwid_cli.records.experiment import CalibrateOptions
from hwid_cli.records.recordings import KINDS, CalibrationLog, RawRecording
from hwid_cli.records.starter import Proposal, Reached
from hwid_cli.records.units import behind
from hwid_cli.report.formats import listed
from hwid_cli.stages.calibrate import calibrate_all
from hwid_cli.stages.proposed_starts import (
    ALIKE_LEVELS,
    NO_LEVEL,
    begins_at_rest,
    rest_level,
    rests_anywhere,
    rests_at_operating_points,
    start_of_diagnosis,
    start_of_fits,
    swing_of,
)
from hwid_cli.trust.designs import working_level

# Words in file names, German and English; the first kind that has one of them is it.
_KIND_WORDS = {
    "random": (
        *("random", "rand", "noise", "rausch", "prbs", "aprbs", "multisin", "zufall"),
        *("chirp", "sweep"),
    ),
    "sine": ("sine", "sin", "sinus"),
    "step": ("step", "sprung", "jump", "schritt", "stufe", "ramp", "rampe"),
}
# Recipes of calibration, the best one first; each is tried on the data. A random signal
# holds stretches that look like a rest: 'cut' alone may go on into the motion. Of a sine it
# keeps no rest, without which nobody knows how the machine stood.
_RECIPES: dict[str, tuple[tuple[str, ...], ...]] = {
    "step": (("cut", "output_offset"), ("cut",)),
    "sine": (),
    "random": (),
    "other": (),
}
# The same for columns of different length: with an offset 'cut' keeps the rest.
_CUT_RECIPES = {
    **{kind: (*found, ("cut",)) for kind, found in _RECIPES.items()},
    "random": (("cut", "output_offset"), ("cut",)),
}
# Words of file names that say what a recording is for.
_TEST_WORDS = (
    *("test", "val", "valid", "validation", "validate", "pruef", "prüf", "pruefung"),
    *("prüfung", "verify", "verification", "holdout", "check"),
)
_TRAIN_WORDS = ("train", "training", "est", "estimation", "ident", "learn")
# Inputs that differ by less than this share of their spread are one, [-].
_ALIKE = 0.2
# The same of their lengths.
_ALIKE_LENGTH = 0.8
# Least power in the same third octaves, [-]: a multisine of other phases has nearly all,
# sines of other frequencies have none.
_ALIKE_SPECTRA = 0.5
# A recipe that keeps less than this share of a recording has misjudged it, [-].
_LEAST_KEPT = 0.5
# Fits that a first run may take without asking, [-].
_MOST_FITS = 600
# A model counts as good within this share of the output's swing, [-].
_GOOD_SHARE = 0.05
# Samples in the time in which the output forgets, beyond which a model of few orders
# sees nothing change from one to the next, [samples].
_ENOUGH_SAMPLES = 50
# An input that exceeds the others by less than this share of their swing goes as far, [-].
_BEYOND = 0.02
# One file is cut where each part is still a measurement, [samples].
_LEAST_TO_CUT = 600


def propose(
    raws: Sequence[RawRecording],
    excluded: Sequence[str] = (),
    problems: Sequence[str] = (),
    *,
    may_cut: bool = True,
) -> Proposal:
    """Propose what to do with recordings.

    Parameters
    ----------
    raws : sequence of RawRecording
        At least one.
    excluded : sequence of str
        Names of files that cannot be used.
    problems : sequence of str
        Why so.
    may_cut : bool
        Whether an only recording is cut in two, where its file is read as a whole.
    """
    raws, doubled = _without_copies(raws)
    problems = (*problems, *doubled.values())
    kinds, kind_reason = _kinds(raws)
    recipes, recipe_reason = _recipes(raws, kinds)
    names = [raw.name for raw in raws]
    parts = _parts(raws) if may_cut else {}
    held_out, held_out_reason = _held_out(raws, kinds)
    if parts:
        held_out, held_out_reason = ("last",), "the end of the only recording"
    identify = ("first",) if parts else tuple(n for n in names if n not in held_out)
    is_large = len(identify) * 12 > _MOST_FITS
    memory = int(np.median([signs.memory_samples(raw.output) for raw in raws]))
    threshold, threshold_reason = _threshold(raws)
    return Proposal(
        kinds=_patterns(kinds, names),
        kind_reason=kind_reason,
        recipes=recipes,
        recipe_reason=recipe_reason,
        nb=(1, 2) if is_large else (1, 3),
        nk=(1, 3) if is_large else (1, 4),
        order_reason=(
            f"{len(identify)} recordings: a small grid first"
            if is_large
            else "enough for a drive with a spring; raise them after a look"
        ),
        threshold=threshold,
        threshold_reason=threshold_reason,
        sample_time_s=raws[0].sample_time_s,
        reached=_reached(raws),
        exclude=tuple(glob.escape(name) for name in (*excluded, *doubled)),
        parts=parts,
        identify=identify if held_out else (),
        held_out=held_out,
        held_out_reason=held_out_reason,
        names=tuple(names),
        notes=tuple(
            f"{name}: {note}" for name, notes in doubts(raws).items() for note in notes
        ),
        problems=tuple(problems),
        average=max(1, memory // _ENOUGH_SAMPLES),
        fit_start=start_of_fits(raws, recipes, kinds, is_cut=bool(parts)),
        initial_state=start_of_diagnosis(raws, recipes, is_cut=bool(parts)),
    )


# What numbers recordings: digits, or one letter behind a line.
_NUMBER = re.compile(r"[\W_]*\d+$|[\W_]+[A-Za-z]$")


def _without_copies(
    raws: Sequence[RawRecording],
) -> tuple[list[RawRecording], dict[str, str]]:
    """Recordings of their own, and by name what to say of the copies among them."""
    doubled = copies(raws)
    said = {
        one: f"{one}: holds the same numbers as {first}"
        for one, first in doubled.items()
    }
    return [raw for raw in raws if raw.name not in doubled], said


def _threshold(raws: Sequence[RawRecording]) -> tuple[float, str]:
    """What a model may miss, and what that is of the usual swing, rounded as it is."""
    swings = [np.ptp(raw.output[np.isfinite(raw.output)]) for raw in raws]
    swing = float(np.median(swings))
    threshold = float(f"{_GOOD_SHARE * swing:.1g}")
    if not swing > 0.0:
        return threshold, "the output does not move"
    share, unit = 100.0 * threshold / swing, behind(raws[0].output_unit)
    said = f"about {share:.2g} % of the usual swing of the output, {swing:.3g}{unit}"
    return threshold, said


def kind_named(name: str) -> str:
    """Kind that the name of a file says.

    Returns
    -------
    str
        Empty where it says none.

    Examples
    --------
    >>> kind_named("Sprung_03"), kind_named("multisine2"), kind_named("run7")
    ('step', 'random', '')
    """
    words = re.findall(r"[a-zäöü]+", name.lower())
    for kind, known in _KIND_WORDS.items():
        for word in words:
            # Short words are no part of longer ones: "sin" is not in "using".
            if any(word == one or (len(one) > 3 and one in word) for one in known):
                return kind
    return ""


def _kinds(raws: Sequence[RawRecording]) -> tuple[dict[str, str], str]:
    """Kind of each recording, and what it was told from."""
    by_name = {raw.name: kind_named(raw.name) for raw in raws}
    if all(by_name.values()):
        return by_name, "told from the names of the files"
    found = {raw.name: by_name[raw.name] or _kind_of_signal(raw.input) for raw in raws}
    found = _alike_in_families(found)
    if any(by_name.values()):
        return found, "told from the names of the files, else from the inputs"
    return found, "told from the inputs"


def _alike_in_families(kinds: dict[str, str]) -> dict[str, str]:
    """One kind for recordings that are numbered alike: that of most of them.

    Else a recipe would be for some of them, and shift these against the others.

    Examples
    --------
    >>> _alike_in_families({"move_a": "other", "move_b": "step", "move_c": "step"})
    {'move_a': 'step', 'move_b': 'step', 'move_c': 'step'}
    """
    stems = {name: _NUMBER.sub("", name) for name in kinds}
    found = dict(kinds)
    for stem in set(stems.values()):
        family = [name for name in kinds if stems[name] == stem]
        kind, count = Counter(kinds[name] for name in family).most_common(1)[0]
        if stem and len(family) > 2 and 2 * count > len(family):
            found |= dict.fromkeys(family, kind)
    return found


def _reached(raws: Sequence[RawRecording]) -> Reached:
    """Level, largest value about it, steepest slope and length of the inputs."""
    level = working_level([raw.input for raw in raws])
    inputs = [raw.input - level for raw in raws]
    slopes = [np.diff(raw.input) / raw.sample_time_s for raw in raws]
    largest, fastest = (
        max(float(np.nanmax(np.abs(one), initial=0.0)) for one in signals)
        for signals in (inputs, slopes)
    )
    longest_s = max(raw.input.size * raw.sample_time_s for raw in raws)
    return Reached(level, largest, fastest, longest_s)


def _kind_of_signal(values: np.ndarray) -> str:
    if signs.is_stepwise(values):
        return "step"
    return "sine" if signs.is_sine(values) else "other"


def _patterns(
    kinds: dict[str, str], names: Sequence[str]
) -> dict[str, tuple[str, ...]]:
    """Patterns that give every recording its kind and no other one."""
    found: dict[str, tuple[str, ...]] = {}
    for kind in KINDS[:-1]:
        own = [name for name in names if kinds[name] == kind]
        if not own:
            continue
        start = _common_letters(own)
        others = [name for name in names if kinds[name] != kind]
        is_clear = len(start) > 1 and not any(n.startswith(start) for n in others)
        found[kind] = (f"{start}*",) if is_clear else tuple(glob.escape(n) for n in own)
    return found


def _common_letters(names: Sequence[str]) -> str:
    """Letters with which all names begin."""
    start = ""
    for letters in zip(*names, strict=False):
        if len(set(letters)) > 1 or not letters[0].isalpha():
            break
        start += letters[0]
    return start


def _recipes(
    raws: Sequence[RawRecording], kinds: dict[str, str]
) -> tuple[dict[str, tuple[str, ...]], str]:
    """For each kind the first recipe that works on all of its recordings."""
    recipes: dict[str, tuple[str, ...]] = {}
    for kind in KINDS:
        own = [raw for raw in raws if kinds[raw.name] == kind]
        if not own:
            continue
        needs_cut = any(raw.input.size != raw.output.size for raw in own)
        candidates = _CUT_RECIPES[kind] if needs_cut else _RECIPES[kind]
        fitting = [one for one in candidates if _works(one, kind, own)]
        recipes[kind] = fitting[0] if fitting else ()
    recipes, level = _with_levels(raws, kinds, recipes)
    some = [
        kind
        for kind, recipe in recipes.items()
        if recipe
        and all(begins_at_rest(raw) for raw in raws if kinds[raw.name] == kind)
    ]
    if some:
        reason = f"tried: {listed(some)} recordings begin with a rest"
        if recipes.get("random") == ():
            reason += "; random ones are left whole: a cut may begin in mid-motion"
        return recipes, reason + level
    if all(begins_at_rest(raw) for raw in raws):
        return recipes, "nothing is cut: the rest before may be a level of the input"
    return recipes, "no rest is cut: not all recordings begin with one"


def _with_levels(
    raws: Sequence[RawRecording],
    kinds: dict[str, str],
    recipes: dict[str, tuple[str, ...]],
) -> tuple[dict[str, tuple[str, ...]], str]:
    """Recipes that treat the levels at which recordings rest alike in all kinds.

    What is subtracted from steps alone shifts these against all others: the zero of a
    sensor, a room's temperature, the level that belongs to an input at which a machine
    is held.

    Returns
    -------
    recipes : dict
    reason : str
        What stays or goes and why; empty where nothing was to decide.
    """
    own = [raw for raw in raws if "output_offset" in recipes[kinds[raw.name]]]
    without = {
        kind: tuple(step for step in recipe if step != "output_offset")
        for kind, recipe in recipes.items()
    }
    if own and rests_at_operating_points(own):
        reason = "; the level at which the output rests goes with the input, and stays"
        return without, reason
    all_rest = all(map(begins_at_rest, raws))
    # A battery at another charge, an axis at another place: no model of the input knows.
    if all_rest and rests_anywhere(raws):
        of_all = _without_levels(raws, kinds, recipes)
        if of_all is not None and of_all != recipes:
            reason = "; at other levels under one input, each of which is subtracted"
            return of_all, reason
    swing = swing_of([raw.output for raw in raws])
    levels = np.array([rest_level(raw) for raw in own])
    # A zero that is another one in each recording is subtracted where it is known.
    if len(own) in (0, len(raws)) or np.ptp(levels) > ALIKE_LEVELS * swing:
        return recipes, ""
    size = abs(float(np.mean(levels))) / swing
    is_zero = all_rest and size <= ALIKE_LEVELS
    of_all = _without_levels(raws, kinds, recipes) if is_zero else None
    if of_all is not None:
        # A sine would lose the mean over a period, which of a bent map is no zero.
        if "sine" in of_all:
            stays = "; the zero of the sensor stays in all of them"
            return without, stays if size > NO_LEVEL else ""
        return of_all, "; where all others rest is their zero, too"
    if size <= NO_LEVEL:
        return recipes, ""
    level = f"{np.mean(levels):.3g}{behind(raws[0].output_unit)}"
    return (
        without,
        f"; the level at which the output rests, {level}, stays in all of them",
    )


def _without_levels(
    raws: Sequence[RawRecording],
    kinds: dict[str, str],
    recipes: dict[str, tuple[str, ...]],
) -> dict[str, tuple[str, ...]] | None:
    """Recipes that subtract the level of recordings that all rest; None if one cannot."""
    found = {
        kind: recipe if "output_offset" in recipe else (*recipe, "output_offset")
        for kind, recipe in recipes.items()
    }
    works = all(
        _works(recipe, kind, [raw for raw in raws if kinds[raw.name] == kind])
        for kind, recipe in found.items()
    )
    return found if works else None


def _works(recipe: tuple[str, ...], kind: str, raws: Sequence[RawRecording]) -> bool:
    """Whether a recipe finds a rest in every recording and keeps most of it."""
    options = CalibrateOptions(**{kind: recipe})  # type: ignore[arg-type]
    as_kind = [_of_kind(raw, kind) for raw in raws]
    try:
        logs = calibrate_all(as_kind, options)[1]
    except HwidError:
        return False
    is_long = all(
        log.n_samples >= _LEAST_KEPT * min(log.n_raw_input, log.n_raw_output)
        for log in logs
    )
    differ = any(log.n_raw_input != log.n_raw_output for log in logs)
    is_random = kind == "random"
    onsets = [find_onset(raw.input, quiet_is_rest=not is_random) for raw in raws]
    is_seen = all((onset or 0) >= LEAST_QUIET for onset in onsets)
    rests = is_seen and all(begins_at_rest(raw) for raw in raws)
    if not all(_begins_where_it_rests(*one) for one in zip(raws, logs, strict=True)):
        return False
    return is_long and (rests or (differ and "output_offset" not in recipe))


def _begins_where_it_rests(raw: RawRecording, log: CalibrationLog) -> bool:
    """Whether the output is still at its first level where the recipe cuts.

    Under a controller the input starts to move in the noise, later than the output.
    """
    first = max(log.first_sample, LEAST_QUIET)
    start, end = raw.output[:LEAST_QUIET], raw.output[first - LEAST_QUIET : first]
    swing = float(np.nanmax(raw.output) - np.nanmin(raw.output))
    moved = float(np.nanmean(end) - np.nanmean(start))
    return abs(moved) <= ALIKE_LEVELS * swing


def _of_kind(raw: RawRecording, kind: str) -> RawRecording:
    about = {name: getattr(raw, name) for name in RawRecording.__dataclass_fields__}
    return RawRecording(**{**about, "kind": kind})


def _held_out(
    raws: Sequence[RawRecording], kinds: dict[str, str]
) -> tuple[tuple[str, ...], str]:
    """Recordings that only judge, and why these."""
    names = [raw.name for raw in raws]
    if len(names) < 2:
        return (), ""
    named = tuple(name for name in names if _is_word_in(name, _TEST_WORDS))
    if named and len(named) < len(names):
        return named, "named so"
    free = [name for name in names if not _is_word_in(name, _TRAIN_WORDS)]
    families = [one for one in _families(raws) if one[-1].name in free]
    if families:
        are_the_same = all(_is_same_input(one[0], one[-1]) for one in families)
        which = (
            "repeat of each input" if are_the_same else "of the inputs that are alike"
        )
        return tuple(one[-1].name for one in families), f"the last {which}"
    beyond = _beyond_the_others(raws)
    inside = [raw for raw in raws if raw.name in free and raw.name not in beyond]
    chosen = [
        name
        for kind in KINDS
        for name in _quarter_by_size(
            [raw for raw in inside if kinds[raw.name] == kind],
            sum(kinds[name] == kind for name in names),
        )
    ]
    if chosen:
        reason = "about a quarter of each kind; none goes beyond what the others reach"
        return tuple(name for name in names if name in chosen), reason
    return tuple(free[-1:] or names[-1:]), "the last one"


def _beyond_the_others(raws: Sequence[RawRecording]) -> set[str]:
    """Names of recordings whose input goes where no other one's does.

    A model that is judged there is judged on what it has never seen.
    """
    ends = np.array([(np.nanmin(raw.input), np.nanmax(raw.input)) for raw in raws])
    room = _BEYOND * swing_of([raw.input for raw in raws])
    found = set()
    for row, raw in enumerate(raws):
        others = np.delete(ends, row, axis=0)
        is_below = ends[row, 0] < others[:, 0].min() - room
        if is_below or ends[row, 1] > others[:, 1].max() + room:
            found.add(raw.name)
    return found


def _quarter_by_size(raws: Sequence[RawRecording], of: int) -> list[str]:
    """Names of a quarter of some recordings, of all sizes, rounded up from three on.

    Parameters
    ----------
    of : int
        Recordings of which they are to be a quarter.
    """
    count = min((of + 1) // 4, len(raws))
    ranked = sorted(raws, key=lambda raw: float(np.nanstd(raw.input)))
    places = ((2 * n + 1) * len(ranked) // (2 * count) for n in range(count))
    return [ranked[place].name for place in places]


def _is_word_in(name: str, known: Sequence[str]) -> bool:
    return any(word in known for word in re.findall(r"[a-zäöü]+", name.lower()))


def _families(raws: Sequence[RawRecording]) -> list[list[RawRecording]]:
    """Recordings of each input that occurs more than once, or has others like it."""
    families: list[list[RawRecording]] = []
    for raw in raws:
        own = next((one for one in families if _is_repeat(one[0], raw)), None)
        if own is None:
            families.append([raw])
        else:
            own.append(raw)
    return [one for one in families if len(one) > 1]


def _is_same_input(one: RawRecording, other: RawRecording) -> bool:
    """Whether two recordings have one input, noise and a cut end apart."""
    parts = _as_long_and_high(one, other)
    if parts is None:
        return False
    a, b = parts
    return float(np.std(a - b)) <= _ALIKE * max(float(np.std(a)), float(np.std(b)))


def _is_repeat(one: RawRecording, other: RawRecording) -> bool:
    """Whether two recordings have one input, or may have.

    Names that differ in their last number alone may be repeats of an input that is
    measured, and so never the same: then its level, size, memory and spectrum must be
    alike.
    """
    parts = _as_long_and_high(one, other)
    if parts is None:
        return False
    if _is_same_input(one, other):
        return True
    a, b = parts
    stems = {re.sub(r"\d+$", "", raw.name) for raw in (one, other)}
    sizes = sorted((float(np.std(a)), float(np.std(b))))
    memories = sorted((signs.memory_samples(a), signs.memory_samples(b)))
    return (
        len(stems) == 1
        and sizes[0] >= (1.0 - _ALIKE) * sizes[1]
        and memories[0] >= 0.5 * memories[1]
        and signs.shared_power(a, b) >= _ALIKE_SPECTRA
    )


def _as_long_and_high(
    one: RawRecording, other: RawRecording
) -> tuple[np.ndarray, np.ndarray] | None:
    """Both inputs as far as they go together; None where lengths or levels differ."""
    n = min(one.input.size, other.input.size)
    if n < _ALIKE_LENGTH * max(one.input.size, other.input.size):
        return None
    a, b = one.input[:n], other.input[:n]
    spread = max(float(np.std(a)), float(np.std(b)))
    is_as_high = abs(float(np.mean(a) - np.mean(b))) <= _ALIKE * spread
    return (a, b) if is_as_high else None


def _parts(raws: Sequence[RawRecording]) -> dict[str, tuple[int, ...]]:
    """A single long file identifies with its first two thirds."""
    if len(raws) != 1 or raws[0].input.size != raws[0].output.size:
        return {}
    n = raws[0].input.size
    return (
        {} if n < _LEAST_TO_CUT else {"first": (0, 2 * n // 3), "last": (2 * n // 3, n)}
    )
