"""What a stage says of its tasks."""

import pytest

from hwid_cli.cli.stage_runner import _Part


@pytest.mark.parametrize(
    ("part", "said"),
    [
        (_Part("tasks", 1, 0), "1 task from the cache, 0 computed"),
        (_Part("fits", 0, 1), "0 fits from the cache, 1 computed"),
        (_Part("pairs", 18, 2), "18 pairs from the cache, 2 computed"),
    ],
)
def test_one_task_is_one(part, said):
    assert str(part) == said
