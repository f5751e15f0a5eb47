"""An output that counts against the input."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.diagnose import diagnose
from hwid_cli.diagnosis.direction import Reversal, reversal_sentence
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import in_turn, recordings, simulation
from tests.stages.diagnosed_drive import FRICTION

OPTIONS = DiagnoseOptions(effects=("coulomb_friction",), max_effects=1)


def found(given, of=None):
    return diagnose(given, of or simulation(), OPTIONS, in_turn, lambda what, n: None)


@pytest.mark.parametrize("effects", [{}, FRICTION], ids=["linear", "friction"])
def test_an_output_that_counts_the_other_way_is_refused(effects):
    turned = [replace(one, output=-one.output) for one in recordings(effects)]

    with pytest.raises(ConfigError, match=r"input_scale: the output moves against"):
        found(turned)


def test_the_scale_of_the_input_keeps_its_size():
    reversal = Reversal(as_given=1.0, reversed=0.1)
    assert "write input_scale: -1, or" in reversal_sentence(reversal)
    for scale, other in ((10.0, "-10"), (-0.25, "0.25")):
        text = reversal_sentence(reversal, input_scale=scale)
        assert f"write input_scale: {other}, or" in text


@pytest.mark.thorough
def test_a_force_constant_of_the_other_sign_mends_it():
    turned = [replace(one, output=-one.output) for one in recordings(FRICTION)]
    negative = -simulation().force_constant_N_per_A

    diagnosis = found(turned, replace(simulation(), force_constant_N_per_A=negative))

    assert [one.id for one in diagnosis.effects] == ["coulomb_friction"]


def test_noise_has_no_direction():
    rng = np.random.default_rng(0)
    noise = [
        replace(one, output=1e-4 * rng.standard_normal(one.output.size))
        for one in recordings({})
    ]

    assert found(noise).verdict in ("none", "parameters")
