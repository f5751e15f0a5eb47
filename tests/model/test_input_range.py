import numpy as np

from hwid_cli.model.input_range import outside_share


def test_what_lies_outside_the_data_is_counted():
    share, low, high = outside_share(np.array([-2.0, 0.0, 1.0, 3.0]), (-1.0, 1.0))

    assert (share, low, high) == (0.5, -2.0, 3.0)
    assert outside_share(np.array([1.0 + 1e-12]), (-1.0, 1.0))[0] == 0.0
