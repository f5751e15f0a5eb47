import numpy as np
import pytest

from hwid_cli.model import static_map
from hwid_cli.model.maps import own_function
from hwid_cli.records.maps import MapOptions, OwnFunction, StaticMap
from tests.model.plants import SOFT_LIMIT

CUBIC = """
import numpy as np
from hwid_cli import MapFunction

def value(v, p):
    return v + p[0] * v**3

cubic = MapFunction(
    value=value,
    by_argument=lambda v, p: 1 + 3 * p[0] * v**2,
    by_parameters=lambda v, p: v[:, None] ** 3,
    start=[0.1],
)
"""


def options(source=CUBIC, name="cubic"):
    return MapOptions("own_function", function=OwnFunction(name, source))


def test_it_starts_at_its_own_parameters():
    (one,) = static_map.starting_maps("own_function", options(), -1.0, 2.0)
    np.testing.assert_allclose(
        static_map.evaluate(one, np.array([0.0, 2.0])), [0.0, 2.8]
    )
    assert static_map.parameter_names(one) == ("p[0]",)


def test_several_rows_are_several_starts():
    source = CUBIC.replace("start=[0.1]", "start=[[0.1], [-0.3]]")
    starts = static_map.starting_maps("own_function", options(source), -1.0, 2.0)
    assert [float(one.parameters[0]) for one in starts] == [0.1, -0.3]


def test_names_of_parameters_are_its_own():
    (one,) = static_map.starting_maps(
        "own_function", options(SOFT_LIMIT.source, "soft_limit"), -1.0, 2.0
    )
    assert static_map.parameter_names(one) == ("limit", "offset")


def test_parameters_keep_their_meaning_when_a_fit_scales_its_data():
    one = StaticMap(
        "own_function", np.array([0.1]), function=OwnFunction("cubic", CUBIC)
    )
    scaled = static_map.stretch(one, 0.25)
    np.testing.assert_array_equal(scaled.parameters, one.parameters)
    v = np.array([-2.0, 0.5, 3.0])
    np.testing.assert_allclose(
        static_map.evaluate(scaled, 0.25 * v), 0.25 * static_map.evaluate(one, v)
    )


def test_a_step_to_where_it_has_no_value_gives_nan():
    source = CUBIC.replace(
        "return v + ", "if p[0] < 0: raise ValueError\n    return v + "
    )
    one = StaticMap(
        "own_function", np.array([-1.0]), function=OwnFunction("cubic", source)
    )
    assert np.isnan(static_map.evaluate(one, np.ones(3))).all()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("import numpy as np", "import nonsense", "does not run: ModuleNotFoundError"),
        (
            "cubic = ",
            "quadratic = ",
            "found no such name; expected cubic = MapFunction",
        ),
        ("cubic = MapFunction(", "cubic = dict(", "found dict; expected cubic = Map"),
        ("v + p[0] * v**3", "v + p[7]", "value does not run: IndexError: index 7"),
        ("v + p[0] * v**3", "3.0", r"value: found shape \(\); expected \(41,\)"),
        ("v + p[0] * v**3", "np.log(v)", "value: found a value that is not finite at"),
        ("1 + 3 * p[0]", "1 + 2 * p[0]", "by_argument: found .* expected .* central"),
        ("v[:, None] ** 3", "v ** 3", r"by_parameters: found shape \(41,\); expected"),
        ("v[:, None] ** 3", "v[:, None]", "by_parameters, column 0: found"),
        ("start=[0.1]", "start=[]", "start: found .*; expected at least one finite"),
        ("start=[0.1]", "start=['a']", "start: found .*; expected at least one finite"),
        ("start=[0.1]", "start=[1.0], names=['a', 'b']", "names: found 2; expected 1"),
        ("start=[0.1]", "start=[1.0], check_range=(1, 0)", "check_range: found"),
    ],
)
def test_a_function_that_cannot_be_used_is_refused_in_one_line(old, new, message):
    source = CUBIC.replace(old, new)
    assert source != CUBIC
    with pytest.raises(ValueError, match=message) as caught:
        own_function.load("cubic", source)
    assert "\n" not in str(caught.value)


def test_a_kink_inside_the_range_is_no_contradiction():
    source = CUBIC.replace("v + p[0] * v**3", "np.abs(v) + p[0] * v**3")
    source = source.replace("1 + 3", "np.sign(v) + 3")
    assert own_function.load("cubic", source).start == [0.1]


TANH = """
import numpy as np
from hwid_cli import MapFunction

UNIT = 1.0

def by_parameters(v, p):
    t = np.tanh(v / p[1])
    return np.stack([-t, p[0] * v / p[1]**2 * (1 - t**2)], axis=1)

lossy = MapFunction(
    value=lambda v, p: v - p[0] * np.tanh(v / p[1]),
    by_argument=lambda v, p: 1 - p[0] / p[1] * (1 - np.tanh(v / p[1])**2),
    by_parameters=by_parameters,
    start=[[0.05 * UNIT, 0.3 * UNIT], [0.0, 0.05 * UNIT]],
    check_range=(-UNIT, UNIT),
)
"""


@pytest.mark.parametrize("unit", [1e-12, 1e-6, 1e6])
def test_a_function_in_any_unit_is_checked_as_closely(unit):
    source = TANH.replace("UNIT = 1.0", f"UNIT = {unit}")
    assert len(own_function.load("lossy", source).start) == 2
    wrong = source.replace("p[1]**2 *", "p[1]**2 * 1.01 *")
    with pytest.raises(ValueError, match="by_parameters, column 1"):
        own_function.load("lossy", wrong)


def test_a_function_that_ends_the_program_is_refused():
    source = CUBIC.replace("return v +", "raise SystemExit(3)\n    return v +")
    with pytest.raises(ValueError, match=r"value does not run: it called exit\(3\)"):
        own_function.load("cubic", source)
