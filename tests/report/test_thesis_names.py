import pytest

from hwid_cli.report.thesis_names import names_of_groups, thesis_name
from tests.report.report_examples import group_search


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("step_06", "NLHW-Step-6-3-7-1"),
        ("sine_23", "NLHW-Sine-23-3-7-1"),
        ("step_06+step_09+sine_01", "NLHW-Step-6-9-Sine-1-3-7-1"),
        ("idf_neg_0.04_1", "NLHW-idf_neg_0.04_1-3-7-1"),
    ],
)
def test_models_are_named_as_in_the_published_tables(name, expected):
    assert thesis_name(name, 3, 7) == expected


def test_groups_are_named_by_the_orders_of_their_best_models():
    search = group_search(levels=2)
    names = names_of_groups(search)

    assert len(names) == len({one.model_name for one in search.groups})
    assert names["step_01+step_02/2/2"] == "NLHW-Step-1-2-2-2-1"
    assert names_of_groups(None) == {}
