"""A second effect, beside one that the simulation's own run bears out."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import beside_stand_in, further_effects
from hwid_cli.diagnosis.further_effects import with_further_effect
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.diagnosis.told_by_runs import ToldByRuns
from hwid_cli.records.candidates import ParameterRef
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import Capabilities
from tests.black_boxes.plants import Hidden
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up
from tests.diagnosis.small_drive import problem, recordings
from tests.diagnosis.test_foreign import FREE, GIVEN, TRUE, diagnosis, simulate

FEW = ("coulomb_friction", "quadratic_drag", "cubic_stiffness", "input_delay")


@pytest.mark.thorough
def test_a_second_effect_is_told_beside_the_run_with_the_first(monkeypatch):
    def only_single(standing, options, *args, **more):
        assert options.max_effects == 1, "no set beside the uncorrected stand-in"
        return find(standing, options, *args, **more)

    find = beside_stand_in.find
    monkeypatch.setattr(beside_stand_in, "find", only_single)
    hidden = Hidden("both", (), dry=2.0, force=lambda x, v, t: -1.5e6 * x**3)
    able = Capabilities(run=True, parameters=True, force=True)
    found, _ = diagnosis(
        Simulator(able, simulate, {}, FREE, GIVEN), hidden=hidden, effects=FEW
    )
    named = {one.id: one.parameters[0].value for one in found.effects}
    assert (found.verdict, found.confirmed) == ("named", "simulation")
    assert named == pytest.approx(
        {"coulomb_friction": 2.0, "cubic_stiffness": 1.5e6}, rel=0.02
    )
    for one in found.base:
        assert one.after == pytest.approx(TRUE[one.name], rel=0.01)
    # Intervals go with their own values.
    for effect in found.effects:
        (parameter,) = effect.parameters
        assert parameter.low < parameter.value < parameter.high


def test_values_of_a_pair_stand_in_the_order_of_its_effects():
    fit = replace(
        made_up(("actuator_lag",), 1.0, parameters=3),
        names=(
            ParameterRef("", "stiffness_N_per_m"),
            ParameterRef("cubic_stiffness", "stiffness_N_per_m3"),
            ParameterRef("actuator_lag", "time_constant_s"),
        ),
        values=np.array([1.0, 2.0, 3.0]),
        valleys=np.array([[10.0, 20.0, 30.0]]),
    )
    pair = further_effects._as_pair(fit, "cubic_stiffness")
    assert pair.effects == ("actuator_lag", "cubic_stiffness")
    assert [one.owner for one in pair.names] == ["", *pair.effects]
    np.testing.assert_array_equal(pair.values, [1.0, 3.0, 2.0])
    np.testing.assert_array_equal(pair.valleys, [[10.0, 30.0, 20.0]])


@pytest.mark.parametrize(
    ("effect", "most"), [("coulomb_friction", 1), ("parameter_change:mass", 2)]
)
def test_one_effect_stays_alone_where_no_second_may_be_asked_for(
    monkeypatch, effect, most
):
    monkeypatch.setattr(further_effects, "find", None)
    chosen = made_up((effect,), 1.0, parameters=1)
    one = SimpleNamespace(verdict=SimpleNamespace(chosen=chosen))
    first = ToldByRuns(one, {}, is_all=False)
    options = DiagnoseOptions(max_effects=most)
    runs = SimpleNamespace(run_tasks=SimpleNamespace(are_spent=False))
    assert with_further_effect(first, runs, options, None) is first
    nothing = ToldByRuns(None, {}, is_all=False)
    assert with_further_effect(nothing, None, options, None) is nothing


def test_no_second_effect_is_asked_for_once_the_runs_are_spent(monkeypatch):
    monkeypatch.setattr(further_effects, "find", None)
    chosen = made_up(("coulomb_friction",), 1.0, parameters=1)
    one = SimpleNamespace(verdict=SimpleNamespace(chosen=chosen))
    first = ToldByRuns(one, {}, is_all=False)
    runs = SimpleNamespace(run_tasks=SimpleNamespace(are_spent=True))
    assert with_further_effect(first, runs, DiagnoseOptions(), None) is first


@pytest.mark.parametrize(
    ("left", "holds_both", "is_pair"),
    [(109.0, True, False), (100.0, True, True), (100.0, False, False)],
)
def test_a_pair_is_told_only_where_it_may_be_named(
    monkeypatch, left, holds_both, is_pair
):
    """Beside it stands all that was fitted before, and the first effect itself.

    A dead zone that was fitted through the simulation's own runs has no values of the
    stop that acts in it.
    """
    one, two = "coulomb_friction", "cubic_stiffness"
    alone = made_up((one,), 110.0, whiteness=0.5 if not is_pair else 3.0)
    owners = (one, two) if holds_both else (two, two)
    both = replace(
        made_up((two,), left, parameters=2, whiteness=0.5),
        names=tuple(ParameterRef(owner, "force_N") for owner in owners),
        values=np.ones(2),
    )
    of = problem(recordings({}))
    monkeypatch.setattr(further_effects, "unclear_effects", lambda *_: ())
    monkeypatch.setattr(further_effects, "replace", replaced)

    def findings(chosen, fits):
        return SimpleNamespace(
            problem=of, criteria=CRITERIA, base=base(), given_sse=np.full(6, 500.0),
            found=SimpleNamespace(fits=fits), scales=None,
            verdict=SimpleNamespace(chosen=chosen),
        )  # fmt: skip

    first = findings(alone, {(one,): alone})
    again = made_up((one,), 1.0)
    found = further_effects._with_known(
        first, findings(both, {(two,): both, (one,): again}), one
    )
    assert (found is not None) == is_pair
    if found is not None:
        assert found.verdict.chosen.effects == (one, two)
        assert set(found.found.fits) == {(one,), (one, two)}
        assert found.found.fits[(one,)] is alone


def replaced(what, **changes):
    """As ``dataclasses.replace``, of what stands for a record too."""
    if isinstance(what, SimpleNamespace):
        return SimpleNamespace(**{**vars(what), **changes})
    return replace(what, **changes)
