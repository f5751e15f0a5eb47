"""docs/notebook.ipynb runs from its first to its last cell, and shows what it says."""

import ast
import json
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[2] / "docs" / "notebook.ipynb"


def cells():
    content = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    return ["".join(c["source"]) for c in content["cells"] if c["cell_type"] == "code"]


def run(source, scope):
    """Run a cell as a notebook does: its last expression is what it shows."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, NOTEBOOK.name, "exec"), scope)
    if last is not None:
        return eval(compile(ast.Expression(last.value), NOTEBOOK.name, "eval"), scope)
    return None


@pytest.fixture(scope="module")
def ran():
    scope = {}
    return [run(source, scope) for source in cells()], scope


@pytest.mark.thorough
def test_every_cell_runs(ran):
    shown, scope = ran
    assert [one for one in shown[2:] if one is None] == []
    assert repr(shown[1]).startswith("<Recording 'step_1'")
    assert len(scope["grid"]) == 16


@pytest.mark.thorough
def test_what_it_promises_is_found(ran):
    _, scope = ran
    (effect,) = scope["found"].effects
    assert effect.id == "coulomb_friction"
    # The made-up drive's friction.
    assert effect.parameters[0].value == pytest.approx(0.8, rel=0.02)
    assert ran[0][-1] > 0.8
    # The best model elsewhere is below the threshold on most recordings.
    assert scope["foreign"]["rmsd"].min() < 6e-4


def test_it_is_committed_without_outputs():
    content = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    assert all(c.get("outputs", []) == [] for c in content["cells"])
