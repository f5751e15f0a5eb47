"""Settings that hold for every test."""

import logging

import pytest
from hypothesis import settings

# Compiled loops build on their first call, which no deadline can foresee; examples are
# derived from the test's name, so that a run can be repeated.
settings.register_profile("hwid", deadline=None, derandomize=True)
settings.load_profile("hwid")


@pytest.fixture(autouse=True)
def _log_level_as_before():
    yield
    logging.getLogger("hwid_cli").setLevel(logging.NOTSET)
