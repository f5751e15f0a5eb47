"""Syntax trees of source files, each read once."""

import ast
from functools import cache
from pathlib import Path


@cache
def tree_of(path: Path) -> ast.Module:
    """What a file says; not to be altered."""
    return ast.parse(path.read_text(encoding="utf-8"))
