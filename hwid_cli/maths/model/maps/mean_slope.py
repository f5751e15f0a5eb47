"""Mean slope of a map over its domain, for kinds whose values are no parameters.

References
----------
docs/method.md, eq. (15).
"""

import numpy as np

from hwid_cli.maths.model.maps.rule import Differentiate
from hwid_cli.records.maps import StaticMap

# Points over the domain, [-]; units narrower than their distance hardly count.
_COUNT = 65


def mean_slope(
    static_map: StaticMap, differentiate: Differentiate
) -> tuple[float, np.ndarray]:
    """Standard deviation of a map's values, as a share of that of a line of slope one.

    Parameters
    ----------
    static_map : StaticMap
    differentiate : callable
        That of the map's rule.

    Returns
    -------
    float
    ndarray, shape (n_parameters,)
        Gradient by the parameters.
    """
    at = np.linspace(*static_map.domain, _COUNT)
    columns = np.empty((_COUNT, static_map.parameters.size))
    values, _ = differentiate(static_map, at, True, columns, 0)
    centred = values - values.mean()
    deviation, of_line = float(np.std(values)), float(np.std(at))
    gradient = centred @ columns / (_COUNT * of_line * (deviation or 1.0))
    return deviation / of_line, gradient
