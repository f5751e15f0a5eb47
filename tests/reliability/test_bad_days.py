"""Days drawn by chance (bad_days.py): the promises hold whatever meets whatever."""

import pytest

from tests.reliability import bad_days
from tests.reliability.warm_process import draw_nothing

SEED = 1


def test_days_are_the_same_for_the_same_seed_and_meet_every_fault():
    days = [bad_days.draw(number, SEED) for number in range(500)]

    assert days == [bad_days.draw(number, SEED) for number in range(500)]
    assert {day.fault for day in days} == set(bad_days.FAULTS)
    assert {day.stage for day in days} == set(bad_days.STAGES)


@pytest.mark.slow
def test_five_hundred_bad_days_lose_nothing(undisturbed, monkeypatch):
    draw_nothing(monkeypatch)
    tries, broken = bad_days.run_days(range(500), SEED, undisturbed, print)

    assert sum(tries.values()) == 500
    assert broken == []
