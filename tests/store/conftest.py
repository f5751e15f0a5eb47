import pytest

from hwid_cli.store.trusted_functions import allow_only


@pytest.fixture(autouse=True)
def _functions_are_trusted():
    """Which functions may be read is the matter of tests/security."""
    allow_only((), has_leave=True)
    yield
    allow_only(())
