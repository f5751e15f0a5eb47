"""A diagnosis in and out of ``results.h5:/diagnose``, and as CSV files.

``diagnosis.json``: what a diagnosis found.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.errors import CacheError
from hwid_cli.files.atomic import replace_file
from hwid_cli.files.csv_tables import write_table_csv
from hwid_cli.files.messages import shown
from hwid_cli.records.diagnosis import (
    BaseParameter,
    Diagnosis,
    FittedEffect,
    FittedParameter,
    Law,
)
from hwid_cli.records.recordings import SignalUnit
from hwid_cli.store.result_files import Provenance

# What the report relies on; a value that is absent or null is not shown.
_FORMS: dict[str, type] = {
    "effects": list,
    "ambiguous_with": list,
    "not_observable": list,
    "warnings": list,
    "where": list,
    "figures": list,
    "gap": dict,
    "gap.before": dict,
    "gap.after": dict,
    "provenance": dict,
    "next_experiment": dict,
}
_WORDS: dict[type, str] = {list: "a list", dict: "an object"}
# Longer ones are no counts; as floats they can be shown.
_MOST_DIGITS = 18


# Key of the SHA-256 of all that stands before it, written in the same way.
_CHECKSUM = "sha256"


def read_diagnosis(path: Path) -> dict[str, Any] | None:
    """Read a diagnosis.

    Returns
    -------
    dict or None
        None where there is no such file.

    Raises
    ------
    CacheError
        If the file holds something else.
    """
    if not path.is_file():
        return None
    try:
        found = json.loads(path.read_text(encoding="utf-8"), parse_int=_integer)
    except (OSError, RecursionError, ValueError) as error:
        raise CacheError(
            f"{path}: cannot be read ({error}); expected the results of diagnose; run "
            "'hwid diagnose' again"
        ) from error
    if not isinstance(found, dict):
        raise CacheError(
            f"{path}: holds a {type(found).__name__}; expected an object with the "
            "results of diagnose; run 'hwid diagnose' again"
        )
    _check_forms(path, found)
    said = found.pop(_CHECKSUM, None)
    # Files of earlier versions have none.
    if said is not None and said != sha256(_text(found).encode()).hexdigest():
        raise CacheError(
            f"{path}: content and checksum do not match; expected what 'hwid diagnose' "
            "has written; run it again"
        )
    return found


def _check_forms(path: Path, found: dict[str, Any]) -> None:
    """Refuse what cannot have been written here; readers rely on these forms."""
    for key, form in _FORMS.items():
        value: Any = found
        for name in key.split("."):
            value = value.get(name) if isinstance(value, dict) else None
        if value is not None and not isinstance(value, form):
            raise CacheError(
                f"{path}: {key}: found {shown(value)}; expected {_WORDS[form]} as "
                "diagnose writes it; run 'hwid diagnose' again"
            )
    for number, effect in enumerate(found.get("effects") or ()):
        parameters = effect.get("parameters", {}) if isinstance(effect, dict) else None
        is_known = isinstance(parameters, dict) and all(
            isinstance(one, dict) and isinstance(one.get("ci95") or [], list)
            for one in parameters.values()
        )
        if not is_known:
            raise CacheError(
                f"{path}: effects.{number}: found {shown(effect)}; expected an object "
                "with parameters as diagnose writes it; run 'hwid diagnose' again"
            )
    for one in found.get("ambiguous_with") or ():
        if not isinstance(one, str | list):
            raise CacheError(
                f"{path}: ambiguous_with: found {shown(one)}; expected ids of effects, "
                "or lists of them; run 'hwid diagnose' again"
            )
    for name in found.get("figures") or ():
        # They are looked for in a folder, which a name must not leave.
        if not isinstance(name, str) or name != Path(name).name:
            raise CacheError(
                f"{path}: figures: found {shown(name)}; expected names of files; run "
                "'hwid diagnose' again"
            )


def _integer(digits: str) -> float:
    return int(digits) if len(digits) <= _MOST_DIGITS else float(digits)


def write_diagnosis_json(
    path: Path,
    diagnosis: Diagnosis,
    seconds: float,
    origin: Provenance,
    *,
    figures: Sequence[str] = (),
    units: Sequence[SignalUnit] = (),
) -> None:
    """Write ``diagnosis.json``.

    Parameters
    ----------
    seconds : float, [s]
        What the run took that gave the diagnosis.
    origin : Provenance
        Of that run.
    figures : sequence of str
        Names of the figures that show it.
    units : sequence of SignalUnit
        Of the recordings' files, and what was converted.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    content = {
        **_content(diagnosis),
        "seconds": seconds,
        "figures": list(figures),
        "provenance": {**_provenance(origin), "units": [asdict(one) for one in units]},
    }
    plain = _without_nan(content)
    signed = {**plain, _CHECKSUM: sha256(_text(plain).encode()).hexdigest()}
    replace_file(path, f"{_text(signed)}\n".encode())


def _text(content: Any) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)


def _gap(diagnosis: Diagnosis) -> dict[str, Any]:
    return {
        "noise_rms": diagnosis.noise.rms,
        "given": asdict(diagnosis.given),
        "before": asdict(diagnosis.before),
        "refitted": asdict(diagnosis.refitted),
        "after": asdict(diagnosis.after),
        "explained_share": diagnosis.explained_share,
        "unit": diagnosis.output_unit,
    }


def _content(diagnosis: Diagnosis) -> dict[str, Any]:
    return {
        "verdict": diagnosis.verdict,
        "complete": diagnosis.complete,
        "confirmed": diagnosis.confirmed,
        "capabilities": [
            name for name, is_so in asdict(diagnosis.capabilities).items() if is_so
        ],
        "judged_on": diagnosis.judged_on,
        "summary": diagnosis.summary,
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "present": [_effect(effect) for effect in diagnosis.present],
        "ambiguous_with": [_ids(one) for one in diagnosis.ambiguous_with],
        "gap": _gap(diagnosis),
        "noise": asdict(diagnosis.noise),
        "reference": {
            "current_A": diagnosis.reference_current_A,
            "displacement_m": diagnosis.reference_displacement_m,
        },
        "base": {
            **{
                moment: {one.name: getattr(one, moment) for one in diagnosis.base}
                for moment in ("before", "refitted", "after")
            },
            "ci95": {one.name: _interval(one) for one in diagnosis.base},
        },
        "where": [asdict(place) for place in diagnosis.places],
        **({} if diagnosis.law is None else {"law": _law(diagnosis.law)}),
        "axis": diagnosis.axis,
        "units": asdict(diagnosis.units),
        "output": diagnosis.output,
        "hold": diagnosis.hold,
        "remains": diagnosis.remains,
        "not_observable": list(diagnosis.not_observable),
        "warnings": list(diagnosis.warnings),
        "next_experiment": asdict(diagnosis.next_experiment),
        "recordings": {
            "train": list(diagnosis.train),
            "held_out": list(diagnosis.held_out),
        },
    }


def _effect(effect: FittedEffect) -> dict[str, Any]:
    return {
        "id": effect.id,
        "sentence": effect.sentence,
        "equation": effect.equation,
        "parameters": {
            one.name: {
                "value": one.text or one.value,
                "ci95": _interval(one),
                **({"unit": one.unit} if one.unit else {}),
                **_beside(one),
            }
            for one in effect.parameters
        },
    }


def _beside(one: FittedParameter) -> dict[str, float]:
    """What a parameter was before, of an effect that the simulation has."""
    before = {"given": one.before, "refitted": one.refitted}
    return {name: value for name, value in before.items() if math.isfinite(value)}


def _law(law: Law) -> dict[str, Any]:
    return {
        "formula": law.formula,
        "terms": [
            {
                "term": one.term,
                "coefficient": {"value": one.value, "ci95": [one.low, one.high]},
                "unit": one.unit,
                "inclusion": one.inclusion,
            }
            for one in law.terms
        ],
        "acts_on": law.acts_on,
    }


def _interval(parameter: FittedParameter | BaseParameter) -> list[float] | None:
    bounds = [parameter.low, parameter.high]
    return bounds if any(math.isfinite(bound) for bound in bounds) else None


def _ids(joined: str) -> str | list[str]:
    """Id of one effect, or the list of ids of a set."""
    ids = joined.split("+")
    return ids if len(ids) > 1 else joined


def _provenance(origin: Provenance) -> dict[str, Any]:
    config = json.dumps(origin.config, sort_keys=True)
    return {
        "key": origin.key,
        "config_sha256": sha256(config.encode()).hexdigest(),
        "inputs": dict(sorted(origin.inputs.items())),
        "versions": dict(sorted(origin.versions.items())),
    }


def _without_nan(value: Any) -> Any:
    """JSON knows no NaN and no infinity: both are null."""
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    # Numbers of numpy are no numbers to the writer.
    plain = value.item() if hasattr(value, "item") else value
    if isinstance(plain, float) and not math.isfinite(plain):
        return None
    return plain


RANKING_COLUMNS = (
    "rank",
    "effects",
    "is_fitted",
    "forecast_share",
    "train_rms",
    "held_out_rms",
    "bic_gain",
    "explained_share",
    "improved_share",
    "whiteness",
    "note",
)
WHERE_COLUMNS = ("about", "variable", "share", "rms", "sentence")
GAPS_COLUMNS = (
    "recording",
    "kind",
    "is_held_out",
    "rms_given",
    "rms_before",
    "rms_after",
    "factor",
)
SIMULATED_COLUMNS = ("time_s", "input", "measured", "simulated")
_STAGE = "diagnose"
# In a table the simulation without any further effect.
_BASE = "base"


def write_diagnosis_tables(folder: Path, diagnosis: Diagnosis) -> None:
    """Write ``ranking.csv``, ``where.csv`` and ``gaps.csv``.

    Parameters
    ----------
    diagnosis : Diagnosis
        A missing number is written as ``nan``.

    Raises
    ------
    CacheError
        If one cannot be written.
    """
    ranking = (
        (
            rank,
            "+".join(one.effects) or _BASE,
            int(one.is_fitted),
            *(getattr(one, name) for name in RANKING_COLUMNS[3:]),
        )
        for rank, one in enumerate(diagnosis.candidates, start=1)
    )
    write_table_csv(folder / "ranking.csv", RANKING_COLUMNS, ranking)
    where = (
        tuple(getattr(place, name) for name in WHERE_COLUMNS)
        for place in diagnosis.places
    )
    write_table_csv(folder / "where.csv", WHERE_COLUMNS, where)
    gaps = (
        (
            gap.name,
            gap.kind,
            int(gap.is_held_out),
            gap.rms_given,
            gap.rms_before,
            gap.rms_after,
            gap.factor,
        )
        for gap in diagnosis.gaps
    )
    write_table_csv(folder / "gaps.csv", GAPS_COLUMNS, gaps)


def write_simulated_csv(path: Path, curves: Sequence[np.ndarray]) -> None:
    """Write what a physics simulation makes of a recording's input.

    Parameters
    ----------
    curves : sequence of ndarray, shape (n_samples,)
        Time [s], input, measured and simulated output.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    columns = [curve.tolist() for curve in curves]
    write_table_csv(path, SIMULATED_COLUMNS, zip(*columns, strict=True))
