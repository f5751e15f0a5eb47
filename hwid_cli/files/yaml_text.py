"""YAML files as plain dicts, lists and scalars, and back.

Every fault is one line with its place.

Stricter than ``yaml.safe_load`` where it would be silently wrong: a key that is given
twice is an error, and ``1e-3`` is a number as in YAML 1.2, not text.
"""

import re
from pathlib import Path
from typing import Any

import yaml

from hwid_cli.errors import ConfigError

_EXPONENT_WITHOUT_POINT = re.compile(r"^[-+]?(?:\d+\.?\d*|\.\d+)[eE][-+]?\d+$")


class _StrictLoader(yaml.SafeLoader):
    """Safe loader that refuses repeated keys."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        """Build a dict; raise where a key is repeated before merges are resolved."""
        seen: dict[object, int] = {}
        for key_node, _ in node.value:
            if key_node.tag == "tag:yaml.org,2002:merge":
                continue
            if not isinstance(key_node, yaml.ScalarNode):
                continue
            key = key_node.value
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None,
                    None,
                    f"key {key!r} is given twice, first in line {seen[key]}; "
                    "keep one of them",
                    key_node.start_mark,
                )
            seen[key] = key_node.start_mark.line + 1
        return super().construct_mapping(node, deep=deep)


_StrictLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float", _EXPONENT_WITHOUT_POINT, list("-+.0123456789")
)


class _StrictDumper(yaml.SafeDumper):
    """Safe dumper whose text the strict loader reads back to the same values."""


# Text that looks like a number to the loader has to be quoted.
_StrictDumper.add_implicit_resolver(
    "tag:yaml.org,2002:float", _EXPONENT_WITHOUT_POINT, list("-+.0123456789")
)


def yaml_text(content: dict[str, Any]) -> str:
    """Text of a mapping, the keys in their order, innermost sections in one line.

    Parameters
    ----------
    content : dict
        Of dicts, lists and scalars; floats keep all their digits.

    Returns
    -------
    str
    """
    return yaml.dump(
        content,
        Dumper=_StrictDumper,
        sort_keys=False,
        allow_unicode=True,
        default_flow_style=None,
        width=88,
    )


def read_yaml(path: Path) -> dict[Any, Any]:
    """Read the mapping that a YAML file holds.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict

    Raises
    ------
    ConfigError
        If the file cannot be read, is not valid YAML, repeats a key or holds no
        mapping.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise ConfigError(
            f"{path}: no such file; expected a YAML file that describes an experiment; "
            "check the path"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"{path}: cannot be read ({error}); expected a YAML file in UTF-8"
        ) from None
    try:
        content = yaml.load(text, Loader=_StrictLoader)
    except yaml.YAMLError as error:
        raise ConfigError(_one_line(path, error)) from None
    if not isinstance(content, dict):
        found = "nothing" if content is None else f"a {type(content).__name__}"
        raise ConfigError(
            f"{path}: holds {found}; expected sections such as 'name:' and "
            "'recordings:'; see configs/README.md"
        )
    return content


def _one_line(path: Path, error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    problem = getattr(error, "problem", None) or str(error)
    context = getattr(error, "context", None)
    said = " ".join(f"{problem} ({context})".split() if context else problem.split())
    if mark is None:
        return f"{path}: {said}; expected valid YAML"
    row = f"{path}, line {mark.line + 1}: {said}"
    if "given twice" in said:
        return row
    return (
        f"{row}; expected valid YAML; check quotes, brackets and indentation near "
        f"column {mark.column + 1}"
    )
