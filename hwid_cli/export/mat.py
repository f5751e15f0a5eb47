"""A Hammerstein-Wiener model for MATLAB and Octave: numbers, and a function beside them."""

import io
import json
from pathlib import Path
from textwrap import indent
from typing import Any

import numpy as np
import scipy

from hwid_cli.export.c_source import card_text, filled
from hwid_cli.export.json_writer import described
from hwid_cli.export.map_parts import language_text, numbers_of
from hwid_cli.export.names import identifier
from hwid_cli.files.atomic import replace_file
from hwid_cli.files.small_files import read_small_file
from hwid_cli.model.static_map import RULES
from hwid_cli.records.exported import ExportedModel
from hwid_cli.records.maps import StaticMap


def write_mat(path: Path, exported: ExportedModel) -> Path:
    """Write a MAT file and a function that computes with it.

    Parameters
    ----------
    path : Path
        Of the MAT file.

    Returns
    -------
    Path
        Of the function.

    Raises
    ------
    ConfigError
        If MATLAB does not know a map.
    CacheError
        If a file cannot be written.
    """
    mat_file = path.name.replace("'", "''")
    name = identifier(exported.card.name)
    if _is_of_another(path.with_name(f"{name}.m"), mat_file):
        name = identifier(exported.card.name, is_taken=True)
    content = io.BytesIO()
    scipy.io.savemat(
        content, _variables(exported), long_field_names=True, oned_as="row"
    )
    words = card_text(exported.card, exported.sample_time_s)
    script = filled(
        "model.m",
        {
            **words,
            **_map_text(),
            "about": words["about"].replace("\n *", "\n%  "),
            "identifier": name,
            "IDENTIFIER": name.upper(),
            "mat_file": mat_file,
        },
    )
    replace_file(path, content.getvalue())
    beside = path.with_name(f"{name}.m")
    replace_file(beside, script.encode("utf-8"))
    return beside


def _is_of_another(path: Path, mat_file: str) -> bool:
    """Whether a function is there that loads the numbers of another model."""
    try:
        return f"'{mat_file}'" not in read_small_file(path).decode(errors="replace")
    except FileNotFoundError:
        return False
    except OSError:
        return True


def _variables(exported: ExportedModel) -> dict[str, Any]:
    model = exported.model
    content = described(exported)
    units, columns = content["units"], content["columns"]
    return {
        "name": content["name"],
        "title": content["title"],
        "created_by": content["created_by"],
        "schema_version": float(content["schema_version"]),
        "sample_time_s": model.sample_time_s,
        "nb": float(model.orders.nb),
        "nf": float(model.orders.nf),
        "nk": float(model.orders.nk),
        # As `filter` takes them: the delay is leading zeros.
        "B": np.concatenate([np.zeros(model.delay), model.numerator]),
        "F": model.denominator,
        "C": model.free_response,
        "static_gain": exported.static_gain,
        "input_map": _map("input", model.input_map),
        "output_map": _map("output", model.output_map),
        "initial_state": model.initial_state,
        "units": units,
        "columns": {key: "" if one is None else one for key, one in columns.items()},
        "scales": content["scales"],
        "input_range": np.array(content["input_range"]),
        # Nested configurations have keys that MATLAB refuses: jsondecode reads them.
        "provenance": json.dumps(content["provenance"]),
    }


def _map(side: str, one: StaticMap) -> dict[str, Any]:
    language_text(side, one, "MATLAB", RULES[one.kind].portable.matlab)
    content = {"kind": one.kind, **numbers_of(one), "domain": np.array(one.domain)}
    if one.extrapolation is not None:
        content["extrapolation"] = vars(one.extrapolation)
    return content


def _map_text() -> dict[str, str]:
    """Every kind of map that MATLAB knows, and the functions that they call."""
    forms = {kind: rule.portable for kind, rule in RULES.items()}
    cases, functions = [], []
    for kind, form in forms.items():
        if form.matlab is not None:
            cases.append(f"    case '{kind}'\n{indent(form.matlab, ' ' * 8)}".rstrip())
            functions.append(form.matlab_function.strip())
    # Several kinds may call the same one.
    called = [text for text in dict.fromkeys(functions) if text]
    return {"cases": "\n".join(cases), "functions": "\n\n\n".join(called)}
