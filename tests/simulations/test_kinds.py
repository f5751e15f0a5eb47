from pathlib import Path

import pytest

import hwid_cli.simulations
from hwid_cli.simulations.kinds import KINDS, kind_named


@pytest.mark.parametrize("name", KINDS)
def test_a_kind_can_be_simulated(name):
    assert callable(kind_named(name).simulate)


def test_every_module_with_a_kind_is_in_the_list():
    room = Path(hwid_cli.simulations.__file__).parent
    made = {one.stem for one in room.glob("*.py") if "\nKIND = " in one.read_text()}

    assert made == set(KINDS)
