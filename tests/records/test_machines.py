import numpy as np
import pytest

from hwid_cli.records.machines import (
    GunMachine,
    GunPlan,
    ParameterChange,
    Sensors,
    ServoMachine,
    VirtualMeasurement,
)
from hwid_cli.records.mechanics import Contact, Friction, Mechanics


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ServoMachine(kind="gun"), "kind must be 'servo', got 'gun'"),
        (lambda: GunMachine(kind="servo"), "kind must be 'gun', got 'servo'"),
        (lambda: ServoMachine(inertia_kg_m2=0.0), "inertia_kg_m2 must be a number > 0"),
        (
            lambda: ServoMachine(currents_A=(1.0, 0.0)),
            "currents_A must be a number > 0",
        ),
        (lambda: ServoMachine(rest_s=0.5), "rest_s must be shorter than"),
        (
            lambda: ServoMachine(noise_relative=-1.0),
            "noise_relative must be a number >=",
        ),
        (lambda: Friction(3.0, 2.0), "break_away_N must be at least coulomb_N = 3.0"),
        (lambda: Contact(position_m=0.0), "position_m must be a number > 0"),
        (
            lambda: Mechanics(mass_kg=float("nan")),
            "mass_kg must be a number > 0, got n",
        ),
        (lambda: ParameterChange(parameter="mass"), "parameter must be one of stiff"),
        (lambda: ParameterChange(share=1.5), "share must be a number from 0 to 1"),
        (
            lambda: Sensors(current_noise_A=-0.1),
            "current_noise_A must be a number >= 0",
        ),
        (lambda: GunPlan(samples=0), "samples must be an integer >= 1, got 0"),
        (lambda: GunPlan(sine_left_out=("4-5",)), "cells such as 4x5"),
        (
            lambda: GunPlan(longest_lead_in_samples=10),
            "longest_lead_in_samples must be at least shortest_lead_in_samples = 150",
        ),
    ],
)
def test_number_out_of_its_range_is_refused_by_name(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_virtual_measurement_has_a_time_for_every_sample_of_the_longer_column():
    with pytest.raises(ValueError, match="as long as the longer column, 4, got 3"):
        VirtualMeasurement(
            "a", "step", np.arange(3.0), np.zeros(3), np.zeros(4), plan={}
        )


def test_virtual_measurement_has_a_known_kind():
    with pytest.raises(ValueError, match="kind 'ramp' is none of"):
        VirtualMeasurement("a", "ramp", np.zeros(3), np.zeros(3), np.zeros(2), plan={})
