"""YAML files as plain dicts, lists and scalars, and back.

Every fault is one line with its place.

As safe as ``yaml.safe_load``, and stricter where that would be silently wrong: a key
that is given twice is an error, and ``1e-3`` is a number as in YAML 1.2, not text.
"""

import re
from pathlib import Path
from typing import Any

import yaml

from hwid_cli.config.yaml_size import count_values
from hwid_cli.errors import ConfigError
from hwid_cli.files.small_files import read_small_file

# What a file may hold in place of sections.
_CONTENTS = {type(None): "nothing", str: "text", int: "a number", float: "a number"}
# As the loader writes the letter that it cannot take.
_TAB = repr("\t")
_EXPONENT_WITHOUT_POINT = re.compile(r"^[-+]?(?:\d+\.?\d*|\.\d+)[eE][-+]?\d+$")


class _StrictLoader(yaml.SafeLoader):
    """Safe loader that refuses repeated keys, and knows where it is."""

    building = 0

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Build a value, and remember its line for a message."""
        self.building = node.start_mark.line + 1
        return super().construct_object(node, deep=deep)

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

    Raises
    ------
    ConfigError
        If the file cannot be read, is not valid YAML, repeats a key or holds no
        mapping.
    """
    try:
        text = read_small_file(path).decode("utf-8-sig")
    except FileNotFoundError:
        raise ConfigError(
            f"{path}: no such file; expected a YAML file that describes an experiment; "
            "check the path"
        ) from None
    except IsADirectoryError:
        raise ConfigError(
            f"{path}: is a folder; expected a YAML file that describes an experiment; "
            f"'hwid init {path}' writes one for the measurements in it"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        said = getattr(error, "strerror", None) or error
        raise ConfigError(
            f"{path}: cannot be read ({said}); expected a YAML file in UTF-8; check the "
            "path, or save the file again"
        ) from None
    content = _content(path, text)
    if not isinstance(content, dict):
        found = _CONTENTS.get(type(content), f"a {type(content).__name__}")
        raise ConfigError(
            f"{path}: holds {found}; expected sections such as 'name:' and "
            "'recordings:'; 'hwid init FOLDER' writes such a file for your measurements"
        )
    return content


def _content(path: Path, text: str) -> Any:
    """What the text holds; every fault of text or values is one line."""
    loader = None
    try:
        loader = _StrictLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        count_values(node)
        return loader.construct_document(node)
    except yaml.YAMLError as error:
        raise ConfigError(_one_line(path, error)) from None
    except RecursionError:
        raise ConfigError(
            f"{path}: is nested too deeply; expected a few levels of sections; look for "
            "brackets that are not closed"
        ) from None
    except (ArithmeticError, AttributeError, LookupError, ValueError) as error:
        # What PyYAML stumbles on where a value is not what its tag or look says.
        line = loader.building if loader else 0
        raise ConfigError(
            f"{path}, line {line}: holds a value that cannot be read ({error}); "
            "expected plain numbers and text; put text in quotes"
        ) from None
    finally:
        if loader is not None:
            loader.dispose()


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
    if _TAB in said:
        return (
            f"{path}, line {mark.line + 1}: begins with a tab; expected blanks, which "
            "are all that YAML indents with; replace the tabs"
        )
    return (
        f"{row}; expected valid YAML; check quotes, brackets and indentation near "
        f"column {mark.column + 1}"
    )
