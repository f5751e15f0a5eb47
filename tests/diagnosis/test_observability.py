"""What free zeros take up cannot be seen, and is said; what they do not is not."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.observability import absorbed_effects
from hwid_cli.diagnosis.sentences import taken_up
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.noisy_plants import NOISE, recordings
from tests.diagnosis.small_drive import fit, problem, simulation, sizes
from tests.stages.diagnosed_drive import diagnosed

COULOMB = {"coulomb_friction": {"force_N": 0.5}}
ASYMMETRIC = {"asymmetric_friction": {"force_forward_N": 0.4, "force_backward_N": 0.9}}


def switched_on_anew(found):
    """The same recordings with another zero each."""
    shifts = np.random.default_rng(4).uniform(-1e-3, 1e-3, len(found))
    return [
        replace(one, output=one.output + shift)
        for one, shift in zip(found, shifts, strict=True)
    ]


def fitted(hides, size, start, *chosen):
    found = recordings(hides, size)
    found = switched_on_anew(found) if start == "held" else found
    options = DiagnoseOptions(initial_state=start)
    of = problem(found, options=options, hold="zero")
    return of, fit(of, *chosen)


def absorbed(of, found):
    return absorbed_effects(of, found, sizes(of), NOISE)


@pytest.mark.thorough
@pytest.mark.parametrize("hides", ["friction", "asymmetry"])
def test_free_zeros_hide_whether_friction_has_one_size(hides):
    of, found = fitted(hides, 0.4, "held", COULOMB)
    # Friction of 0.4 and 0.8 N is friction of 0.6 N beside a constant force.
    mean = 0.4 if hides == "friction" else 0.6
    assert found.whiteness <= 1.0
    assert found.values[-1] == pytest.approx(mean, rel=0.01)
    assert absorbed(of, found) == ("asymmetric_friction", "constant_load")


@pytest.mark.thorough
def test_one_known_zero_shows_it():
    of, found = fitted("asymmetry", 0.4, "estimated", ASYMMETRIC)
    assert found.whiteness <= 1.0
    assert found.values[-2:] == pytest.approx([0.4, 0.8], rel=0.01)
    assert absorbed(of, found) == ()
    of, one_size = fitted("asymmetry", 0.4, "estimated", COULOMB)
    assert one_size.whiteness > 10.0


@pytest.mark.thorough
def test_without_friction_only_a_load_hides():
    assert absorbed(*fitted("", 0.0, "held")) == ("constant_load",)
    assert absorbed(*fitted("", 0.0, "estimated")) == ()


@pytest.mark.parametrize("start", ["rest", "estimated"])
def test_zeros_that_were_found_hide_as_much(start):
    # Where starts are fitted, a lag beside them has one of its own.
    of, found = fitted("", 0.0, start)
    assert absorbed(of, found) == ()
    offsets = [np.full(one.output.size, 1e-4) for one in of.signals]
    signals = [
        replace(one, offset=offset, compared=one.compared + offset)
        for one, offset in zip(of.signals, offsets, strict=True)
    ]
    assert absorbed(replace(of, signals=tuple(signals)), found) == ("constant_load",)


def test_the_words_say_what_a_name_may_be_and_what_shows_it():
    (text,) = taken_up(["asymmetric_friction", "constant_load"], ["coulomb_friction"])
    assert "coulomb_friction may be asymmetric_friction" in text
    assert "one known zero" in text
    assert "diagnose.initial_state: estimated" in text
    (text,) = taken_up(["constant_load"], [])
    assert "may be" not in text
    assert taken_up([], ["coulomb_friction"]) == ()


@pytest.mark.thorough
@pytest.mark.parametrize("hides", ["friction", "asymmetry"])
def test_a_diagnosis_names_friction_and_says_what_it_cannot_tell(hides):
    found = diagnosed(
        switched_on_anew(recordings(hides, 0.4)),
        simulation(hold="zero"),
        initial_state="held",
    )
    assert (found.verdict, found.complete) == ("named", True), found.summary
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    assert any("may be asymmetric_friction" in one for one in found.not_observable)
