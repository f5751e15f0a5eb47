"""What recordings of input and output cannot tell of a simulation: only its ratios."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import untold
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.diagnosis.untold import Untold, without_forces_told
from hwid_cli.records.diagnosis import FittedEffect, FittedParameter
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import Capabilities, FreeParameter, RunRequest
from tests.diagnosis.test_foreign import (
    GIVEN,
    TRUE,
    Count,
    diagnosis,
    recordings,
    simulate,
)

# The box itself has a mass of 0.8.
ALL = {**GIVEN, "unused": 3.0}
ABLE = Capabilities(run=True, parameters=True, force=True)


def simulator(*names, mass=(0.008, 80.0)):
    free = {one: FreeParameter(ALL[one], (0.01 * ALL[one], 100 * ALL[one]))
            for one in names}  # fmt: skip
    if "m" in free:
        free["m"] = FreeParameter(ALL["m"], mass)
    return Simulator(ABLE, simulate, {}, free, ALL)


def of_them(found, word="these recordings do not tell "):
    (said,) = [one for one in found.warnings if one.startswith(word)]
    return said.removeprefix(word).partition(":")


@pytest.mark.thorough
def test_a_common_factor_of_all_forces_and_the_mass_is_not_told():
    found, _ = diagnosis(simulator("m", "c", "k", "kt"), effects=("coulomb_friction",))
    assert (found.verdict, found.complete) == ("named", True)
    names, _, said = of_them(found)
    assert names == "m, c, k and kt"
    assert "the forces of the effects follow" in said
    assert "hold what you know, as in 'parameters: {m: 0.8}'" in said
    ((force,),) = (one.parameters for one in found.effects)
    assert np.isnan(force.low)
    assert np.isnan(force.high)
    # What is told is the friction over the mass: 2 N of 0.8 kg.
    mass = next(one.after for one in found.base if one.name == "m")
    assert force.value / mass == pytest.approx(2.0 / 0.8, rel=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("free", "open_ones"),
    [(("c", "k", "kt"), []), (("c", "k", "kt", "unused"), ["unused"])],
)
def test_what_is_told_is_not_questioned(free, open_ones):
    found, _ = diagnosis(simulator(*free), effects=("coulomb_friction",))
    assert (found.verdict, found.complete) == ("named", True)
    said = [one for one in found.warnings if "do not tell" in one]
    assert [one.split(":")[0].rpartition(" ")[2] for one in said] == open_ones
    assert not any("forces of the effects" in one for one in said)
    ((force,),) = (one.parameters for one in found.effects)
    assert force.low < 2.0 < force.high
    # A force between samples is off by more than the noise tells.
    assert all(np.isnan(one.low) for one in found.base)


@pytest.mark.thorough
def test_intervals_of_parameters_hold_on_fresh_noise():
    rng = np.random.default_rng(8)
    inside = []
    for _ in range(6):
        given = [replace(one, output=plain(one) + 2e-3 * rng.standard_normal(one.n_samples))
                 for one in recordings()]  # fmt: skip
        found = diagnose_foreign(
            given, simulator("c", "k", "kt"), DiagnoseOptions(effects=("coulomb_friction",)),
            Count(), lambda what, n: None,
        )  # fmt: skip
        assert found.verdict == "parameters"
        inside += [one.low < TRUE[one.name] < one.high for one in found.base]
    assert 14 <= sum(inside) <= len(inside) == 18


def plain(recording):
    """What the true parameters give."""
    nothing = np.zeros(0)
    values = {**ALL, **TRUE}
    request = RunRequest("r", recording.sample_time_s, recording.input, nothing, values)
    return simulate(request).output


@pytest.mark.thorough
def test_a_simulation_that_lacks_nothing_is_asked_too():
    found, _ = diagnosis(simulator("m", "c", "k", "kt"), None, ("coulomb_friction",))
    assert found.verdict in ("parameters", "none")
    names, _, said = of_them(found)
    assert names == "m, c, k and kt"
    assert "the forces" not in said


@pytest.mark.thorough
def test_bounds_tell_what_the_recordings_do_not():
    given = simulator("m", "c", "k", "kt", mass=(0.76, 0.84))
    found, _ = diagnosis(given, None, ("coulomb_friction",))
    assert found.verdict in ("parameters", "none")
    assert not any("do not tell" in one for one in found.warnings)


@pytest.mark.thorough
@pytest.mark.parametrize(("leak", "is_told"), [(6e-6, True), (6e-7, False)])
def test_a_weak_parameter_is_told_where_a_fifth_of_it_shows(leak, is_told):
    # Beside the other parameters the noise leaves 5e-7 of the input open.
    given = [
        replace(one, output=one.output + 3.0 * leak * one.input) for one in recordings()
    ]

    def leaking(request):
        found = simulate(request)
        more = leak * request.parameters["unused"] * request.input
        return replace(found, output=found.output + more)

    names = ("c", "k", "kt", "unused")
    found = diagnose_foreign(
        given, replace(simulator(*names), run=leaking),
        DiagnoseOptions(effects=("coulomb_friction",)), Count(), lambda what, n: None,
    )  # fmt: skip
    assert found.verdict in ("parameters", "none")
    said = [one for one in found.warnings if "do not tell unused:" in one]
    assert len(said) == (not is_told)
    has_interval = {one.name: np.isfinite(one.low) for one in found.base}
    assert has_interval == {**dict.fromkeys(names, True), "unused": is_told}


def test_nothing_is_said_where_all_is_told():
    assert Untold().sentences == ()


def test_only_forces_lose_their_intervals():
    parameters = (
        FittedParameter("break_away_N", 2.0, 1.9, 2.1),
        FittedParameter("stribeck_velocity_m_per_s", 0.1, 0.05, 0.2),
        FittedParameter("stiffness_N_per_m", 5.0, 4.0, 6.0),
    )
    effect = FittedEffect("stribeck_friction", "", "", parameters)
    first, speed, last = without_forces_told(effect).parameters
    assert np.isnan([first.low, first.high, last.low, last.high]).all()
    assert (speed.low, speed.high) == (0.05, 0.2)
    assert (first.value, last.value) == (2.0, 5.0)


@pytest.mark.parametrize(("ratio", "size"), [(0.9, 1.0), (5.0, 5.0)])
def test_what_is_left_counts_as_noise_of_its_own_size(monkeypatch, ratio, size):
    moving = SimpleNamespace(
        size=1, errors=np.zeros_like, slopes=lambda _: np.full((100, 1), 10.0)
    )
    monkeypatch.setattr(untold._Moving, "of", lambda *_: moving)
    findings = SimpleNamespace(
        pieces=None,
        criteria=SimpleNamespace(ratio=lambda _: ratio),
        verdict=SimpleNamespace(chosen=None),
    )
    runs = SimpleNamespace(simulator=simulator("c"))
    found = untold.untold_parameters(runs, findings, ALL)
    assert found.deviations == pytest.approx({"c": size * 0.01})
