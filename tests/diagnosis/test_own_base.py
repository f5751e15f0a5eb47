"""What a simulation of one's own leaves itself, beside its stand-in's base."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import own_base
from hwid_cli.diagnosis.own_base import (
    gap_without,
    is_beyond_factors,
    judged_by_own_base,
    with_own_base,
)
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.programs import Capabilities, FreeParameter
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up
from tests.diagnosis.small_drive import problem, recordings

FREE = {"gain": FreeParameter(2.0, (1.0, 4.0))}
ABLE = Capabilities(run=True, parameters=True)


@dataclass(frozen=True, eq=False)
class Found:
    """Findings as far as these functions look."""

    base: CandidateFit
    verdict: SimpleNamespace
    criteria: object = CRITERIA
    before: list = field(default_factory=lambda: ["of the stand-in"])
    own_base: CandidateFit | None = None
    own_before: list = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Verdict:
    word: str
    chosen: CandidateFit


def found(sse=300.0):
    one = replace(base(sse), names=(ParameterRef("base", "stiffness_N_per_m"),),
                  values=np.array([7.0]))  # fmt: skip
    return Found(one, Verdict("unknown", one))


@pytest.mark.parametrize(
    ("residual", "simulator", "is_own"),
    [
        (30.0, Simulator(ABLE, print, free=FREE), True),
        # The stand-in's base leaves no less; nothing of the simulation was fitted; it
        # cannot be run; it holds effects already.
        (1.0, Simulator(ABLE, print, free=FREE), False),
        (30.0, Simulator(ABLE, print), False),
        (30.0, Simulator(ABLE, None, free=FREE), False),
        (30.0, Simulator(ABLE, print, free=FREE, effects={"gravity": {}}), False),
    ],
)
def test_the_simulation_itself_says_how_much_it_leaves(
    monkeypatch, residual, simulator, is_own
):
    runs = [SimpleNamespace(residual=np.full(4, residual))] * 6
    monkeypatch.setattr(own_base, "compared_as_given", lambda _: runs)
    standing = problem(recordings())
    told = with_own_base(found(), standing, simulator)
    assert (told.own_base is not None) is is_own
    if is_own:
        np.testing.assert_array_equal(told.own_base.sse, np.full(6, 3600.0))
        assert told.own_base.values == standing.drive.stiffness_N_per_m
        assert gap_without(told).sum() == 6 * 3600.0
        judged = judged_by_own_base(told)
        assert judged.base is judged.verdict.chosen is told.own_base
        assert judged.before is runs
    else:
        assert judged_by_own_base(told) is told
        assert gap_without(told) is told.base.sse


@pytest.mark.parametrize(
    ("left", "is_beyond"),
    [
        # Factors of the stand-in leave as much as the effect, which has fewer parameters:
        # they may as well be what is off.
        (280.0, False),
        (150.0, True),
    ],
)
def test_an_effect_explains_more_than_factors_do(left, is_beyond):
    effect = made_up(("input_dead_zone",), left)
    own = base(3000.0)
    assert is_beyond_factors(replace(found(), own_base=own), effect) is is_beyond
    assert is_beyond_factors(found(), effect)
