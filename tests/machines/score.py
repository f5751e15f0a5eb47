"""Judges a diagnosis against a machine's truth.

right             an accepted answer is named, or is in an ambiguous list; where an honest
                  refusal is accepted `unknown`, `law` or part of the truth, not called
                  complete; where nothing can be seen `none` and `parameters`, too
partly            part of the truth is named, with `complete: false`
wrong             something is named that is in no accepted answer; an ambiguous list without
                  any accepted answer
refused           `unknown`, `law`, `none` or `parameters` though the catalogue has an answer
falsely complete  part of the truth is named as if it were all
false alarm       a clean machine with any other verdict than `none` or `parameters`
failed            no verdict
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

# A gap below this share of the noise cannot be seen.
INVISIBLE = 0.3
# A claim of completeness stands where held-out recordings are this close to the noise.
AT_NOISE = 1.05
QUIET = ("none", "parameters")


@dataclass(frozen=True)
class Score:
    """One machine's result."""

    outcome: str
    said: str
    falsely_complete: bool = False
    covered: int = 0
    intervals: int = 0
    missed_intervals: list[str] = field(default_factory=list)


def key(effects: Sequence[str]) -> tuple[str, ...]:
    """An answer, whatever its order."""
    return tuple(sorted(effects))


def answers(truth: dict, *kinds: str) -> set[tuple[str, ...]]:
    """Accepted answers of some kinds."""
    return {key(one) for kind in kinds for one in truth[kind]}


def named(diagnosis: dict) -> tuple[str, ...]:
    """Ids that a diagnosis names."""
    return key([one["id"] for one in diagnosis.get("effects", [])])


def listed(diagnosis: dict) -> set[tuple[str, ...]]:
    """All answers of an ambiguous diagnosis, the winning one included."""
    others = diagnosis.get("ambiguous_with", [])
    found = {key([one] if isinstance(one, str) else one) for one in others}
    winner = named(diagnosis)
    return found | ({winner} if winner else set())


def said(diagnosis: dict) -> str:
    """A diagnosis in a few words."""
    verdict, names = diagnosis["verdict"], " + ".join(named(diagnosis))
    if verdict == "ambiguous":
        rest = sorted(" + ".join(one) for one in listed(diagnosis) - {named(diagnosis)})
        return f"ambiguous: {names or '-'} / {' / '.join(rest)}"
    if verdict == "law":
        return f"law: {diagnosis.get('law', {}).get('formula', '')}"
    return names if verdict == "named" else verdict


def at_noise(truth: dict, diagnosis: dict) -> bool:
    """Whether what is left on held-out recordings cannot be told from the noise."""
    left = diagnosis["gap"]["after"]["held_out_rms"]
    return left is not None and left <= AT_NOISE * truth["noise_rms"]


def parts_of_answers(truth: dict) -> set[str]:
    """Every id of any accepted answer."""
    return {
        one for answer in answers(truth, "full", "near", "partial") for one in answer
    }


def falsely_complete(truth: dict, diagnosis: dict) -> bool:
    """Whether a diagnosis claims to be complete and is not."""
    if diagnosis["verdict"] != "named" or not diagnosis.get("complete"):
        return False
    names = named(diagnosis)
    if names in answers(truth, "full"):
        return False
    return names not in answers(truth, "near", "partial") or not at_noise(
        truth, diagnosis
    )


def outcome(truth: dict, diagnosis: dict) -> str:
    """The word of the list above for one diagnosis."""
    verdict, names = diagnosis["verdict"], named(diagnosis)
    whole = answers(truth, "full", "near")
    if truth["family"] == "clean":
        good = verdict in QUIET or (verdict == "named" and names in whole)
        good |= verdict == "ambiguous" and bool(listed(diagnosis) & whole)
        return "right" if good else "false alarm"
    if verdict in QUIET:
        return "right" if truth["gap_over_noise"] < INVISIBLE else "refused"
    if verdict in ("unknown", "law"):
        return "right" if truth["honest_refusal"] else "refused"
    if verdict == "ambiguous":
        if listed(diagnosis) & whole:
            return "right"
        return "partly" if listed(diagnosis) & answers(truth, "partial") else "wrong"
    if not set(names) <= parts_of_answers(truth):
        return "wrong"
    if names in whole:
        return "falsely complete" if falsely_complete(truth, diagnosis) else "right"
    if falsely_complete(truth, diagnosis):
        return "falsely complete"
    if truth["honest_refusal"]:
        return "right"
    # Nothing else can be seen, so part of the truth is all that can be said.
    return "right" if diagnosis.get("complete") else "partly"


def intervals(truth: dict, diagnosis: dict) -> tuple[int, list[str]]:
    """Number of 95 % intervals that can be checked, and those that miss."""
    if diagnosis["verdict"] != "named":
        return 0, []
    waiting = list(truth["parameters"])
    count, missed = 0, []
    for effect in diagnosis["effects"]:
        alike = [one for one in waiting if one["effect"] == effect["id"]]
        if not alike:
            continue
        # Of two effects of one kind, the one that fits is meant.
        meant = min(alike, key=lambda one: len(_missed(one, effect)[1]))
        waiting.remove(meant)
        checked, outside = _missed(meant, effect)
        count += checked
        missed += outside
    return count, missed


def _missed(true: dict, effect: dict) -> tuple[int, list[str]]:
    """Intervals of one effect that can be checked, and those that miss."""
    count, missed = 0, []
    for name, value in true["values"].items():
        given = effect["parameters"].get(name)
        if not isinstance(given, dict) or isinstance(value, str):
            continue
        limits = given.get("ci95") or [None, None]
        if None in limits:
            continue
        count += 1
        if not limits[0] <= value <= limits[1]:
            missed.append(
                f"{effect['id']}.{name}: {value:.4g} not in {limits[0]:.4g} ... {limits[1]:.4g}"
            )
    return count, missed


def score(truth: dict, diagnosis: dict | None) -> Score:
    """One machine's result; without a diagnosis it failed."""
    if diagnosis is None:
        return Score("failed", "-")
    count, missed = intervals(truth, diagnosis)
    return Score(
        outcome(truth, diagnosis),
        said(diagnosis),
        falsely_complete(truth, diagnosis),
        count - len(missed),
        count,
        missed,
    )
