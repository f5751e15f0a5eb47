"""The module that an extended simulation is written as says the same simulation."""

import runpy
from dataclasses import replace

import pytest

from hwid_cli.export.python_module import BASE_FOLDER, write_module
from hwid_cli.records.axis import MotionUnits
from hwid_cli.records.drive import Drive, StandIn
from hwid_cli.records.programs import PythonSimulation
from hwid_cli.simulations.extended import ExtendedSimulation

PLAIN = Drive(0.3, 12.0, 1184.0, 5.0)
CURVED = StandIn(
    0.3, 12.0, 1184.0, 5.0, cubic_N_per_m3=2e5, own_units=MotionUnits("N", "mm", "V")
)
FRICTION = {"coulomb_friction": {"force_N": 0.8}}


@pytest.mark.parametrize(
    "plain", [PLAIN, CURVED, replace(CURVED, own_units=MotionUnits())]
)
def test_the_module_holds_what_was_exported(tmp_path, plain):
    (tmp_path / "plant.py").write_text(
        "def simulate(time_s, inputs, parameters): ...\n"
    )
    base = PythonSimulation(
        file=str(tmp_path / "plant.py"), input="u", output="x", parameters={"c": 12.0}
    )
    given = ExtendedSimulation(base, plain, replace(plain, effects=FRICTION))

    *_, module = write_module(
        tmp_path / "models", given, title="bench", exactness="as it is"
    )

    found = runpy.run_path(str(module))["EXTENDED"]
    assert (found.plain, found.stand_in) == (given.plain, given.stand_in)
    copied = tmp_path / "models" / BASE_FOLDER / "plant.py"
    assert found.base == replace(base, file=str(copied.resolve()))
