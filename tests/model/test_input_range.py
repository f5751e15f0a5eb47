import numpy as np

from hwid_cli.model.input_range import SAME_LEVEL, outside_share


def test_what_lies_outside_the_data_is_counted():
    share, low, high = outside_share(np.array([-2.0, 0.0, 1.0, 3.0]), (-1.0, 1.0))

    assert (share, low, high) == (0.5, -2.0, 3.0)
    assert outside_share(np.array([1.0 + 1e-12]), (-1.0, 1.0))[0] == 0.0


def test_the_noise_of_a_level_that_both_hold_takes_nothing_outside():
    signal = np.array([0.0, 8.025, 8.041, 8.5])

    assert outside_share(signal, (-3.75, 8.013))[0] == 0.75
    assert outside_share(signal, (-3.75, 8.013), same=SAME_LEVEL)[0] == 0.25
    assert outside_share(signal[:1], (0.0, 0.0), same=SAME_LEVEL)[0] == 0.0
