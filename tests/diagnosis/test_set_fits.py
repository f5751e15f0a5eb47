"""Fits of sets of effects: which is better, which is worth a larger set."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.set_fits import SetFits
from tests.diagnosis.made_up_fits import base as made_up_base
from tests.diagnosis.made_up_fits import made_up
from tests.diagnosis.small_rounds import rounds_of_fits


def test_a_further_effect_is_measured_by_its_own_part_beside_values_of_recordings():
    # A change between recordings leaves little of what its values are fitted to; friction
    # and a stop leave less of all, and much less than the stop alone.
    fits = SetFits(rounds_of_fits())
    changing = made_up(("parameter_change:damping",), 400.0, own=np.ones(6))
    stop, both = made_up(("end_stop",), 900.0), made_up(("a", "end_stop"), 350.0)
    fits.found = {one.effects: one for one in (changing, stop, both)}

    assert fits.is_better(both, changing)
    assert not fits.is_better(both, made_up(("x",), 400.0))


@pytest.mark.parametrize(("of_base", "goes_on"), [(400.0, True), (1e6, False)])
def test_of_little_that_only_a_complete_set_could_name_one_effect_takes_half(
    of_base, goes_on
):
    # Two fifths of what a single effect leaves: much, or next to nothing, of all.
    fits = SetFits(replace(rounds_of_fits(), base=made_up_base(of_base)))
    one = made_up(("end_stop",), 300.0)
    assert fits.is_better(made_up(("a", "end_stop"), 220.0), one) == goes_on
    assert fits.is_better(made_up(("a", "end_stop"), 180.0), one)
    assert fits.is_better(made_up(("a", "end_stop"), 220.0, whiteness=0.5), one)
