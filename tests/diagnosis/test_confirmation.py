"""What is found beside a stand-in, put into the simulation itself."""

from types import SimpleNamespace

import pytest

from hwid_cli.diagnosis import confirmation
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up


@pytest.mark.parametrize(
    ("left", "whiteness", "is_named"), [(100.0, 0.9, True), (124.0, 30.0, False)]
)
def test_two_that_look_alike_are_no_fact_where_its_run_leaves_something(
    monkeypatch, left, whiteness, is_named
):
    pair = ("cubic_stiffness", "one_sided_stop:contact")
    run = made_up(pair, left, whiteness=whiteness)
    whole = base(600_000.0)
    findings = Findings(
        problem=None, criteria=CRITERIA, scales=None, given_sse=whole.sse, base=whole,
        before=[], force=[], where=(), found=None,
        verdict=DiagnosisVerdict("named", True, made_up(pair, 100.0), ()),
    )  # fmt: skip
    turn = SimpleNamespace(values_of_run={})
    monkeypatch.setattr(confirmation, "settled", lambda *_: turn)
    monkeypatch.setattr(confirmation, "is_as_good", lambda _: True)
    monkeypatch.setattr(
        confirmation,
        "_with_run",
        lambda *_: SimpleNamespace(verdict=SimpleNamespace(chosen=run)),
    )
    runs = SimpleNamespace(simulator=SimpleNamespace(run=print))
    found, _, is_confirmed = confirmation.confirm(findings, runs, {})
    assert is_confirmed is is_named
    if not is_named:
        assert found.verdict.word == "unknown"
