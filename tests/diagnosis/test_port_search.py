"""Which effects at the ports a simulation's own runs try."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import port_search, told_by_runs
from hwid_cli.diagnosis.port_effects import PortStart
from hwid_cli.diagnosis.port_screening import AtPorts, LikelyAtPort
from hwid_cli.diagnosis.told_by_runs import TriedEffects
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.candidates import ParameterRef
from tests.diagnosis.made_up_fits import CRITERIA, PROBLEM, base, made_up
from tests.drive.drive_cases import SCALES


def tried_at_ports(monkeypatch, lefts, sses, shares=(), said=None):
    """What is fitted through runs, of effects that screening calls likely.

    Parameters
    ----------
    lefts, sses : dict of str to float
        What each leaves of few recordings, over the noise, and of all of them.
    shares : sequence of str
        Effects that were looked for.
    said : float or None
        Over the noise, what the stand-in says that an effect on the motion leaves.
    """
    weight = None if said is None else made_up(("gravity",), 100.0 * said)
    of_stand_in = {} if weight is None else {("gravity",): weight}
    findings = SimpleNamespace(
        criteria=CRITERIA,
        problem=PROBLEM,
        base=base(900.0),
        own_base=None,
        scales=SCALES,
        found=SimpleNamespace(shares={(one,): 0.1 for one in shares}, fits=of_stand_in),
    )
    runs = SimpleNamespace(run_tasks=SimpleNamespace(are_spent=False))
    likely = tuple(
        LikelyAtPort(0.3, made_up((one,), 100.0), {}) for one in list(lefts)[:2]
    )
    fitted = []

    def begin(_findings, one, _runs, values):
        return PortStart(one, values, lefts[one.effects[0]], 0.5)

    def fit(_findings, start, _runs):
        (effect,) = start.fit.effects
        fitted.append(effect)
        white = 0.5 if sses[effect] <= 100.0 else 9.0
        names = [one.name for one in CATALOGUE[effect].parameters]
        run = made_up((effect,), sses[effect], parameters=len(names), whiteness=white)
        owned = tuple(ParameterRef(effect, name) for name in names)
        run = replace(run, names=(*run.names[:3], *owned))
        return SimpleNamespace(fit=run, sse=run.sse, values_of_run={})

    monkeypatch.setattr(
        port_search, "screened_at_ports", lambda *_: AtPorts({}, likely)
    )
    monkeypatch.setattr(port_search, "begin_at_port", begin)
    monkeypatch.setattr(port_search, "with_port_effects", fit)
    for room in (port_search, told_by_runs):
        monkeypatch.setattr(room, "fit_of_run", lambda _, turn: turn.fit)
    tried = TriedEffects(findings)
    port_search.at_ports_by_runs_alone(tried, runs, {}, may_pair=False)
    first = list(fitted)
    port_search.at_ports_later(tried, runs)
    return first, fitted[len(first) :]


def test_what_leaves_much_of_few_recordings_waits_until_others_have_been_tried(
    monkeypatch,
):
    lefts = {"input_saturation": 30.0, "sensor_lag": 8.0}
    sses = {"input_saturation": 500.0, "sensor_lag": 800.0}
    found = tried_at_ports(monkeypatch, lefts, sses)
    assert found == (["sensor_lag"], ["input_saturation"])
    # Not at all where the first one leaves nothing, or far less of the same recordings.
    sses = {"input_saturation": 500.0, "sensor_lag": 100.0}
    assert tried_at_ports(monkeypatch, lefts, sses) == (["sensor_lag"], [])
    sses = {"input_saturation": 500.0, "sensor_lag": 700.0}
    assert tried_at_ports(monkeypatch, lefts, sses) == (["sensor_lag"], [])
    lefts, sses["sensor_lag"] = {"input_saturation": 33.0, "sensor_lag": 8.0}, 800.0
    assert tried_at_ports(monkeypatch, lefts, sses) == (["sensor_lag"], [])


def test_the_richer_law_follows_where_the_plain_one_leaves_too_much(monkeypatch):
    richer = "sensor_lag:second_order"
    lefts = {"input_delay": 11.0, "sensor_lag": 3.0, richer: 1.0}
    sses = {"input_delay": 500.0, "sensor_lag": 300.0, richer: 100.0}
    found = tried_at_ports(monkeypatch, lefts, sses, shares=("sensor_lag", richer))
    assert found == (["sensor_lag", richer], [])
    # Only where it was asked for, and where something is left.
    found = tried_at_ports(monkeypatch, lefts, sses, shares=("sensor_lag",))
    assert found == (["sensor_lag"], ["input_delay"])
    sses["sensor_lag"] = 100.0
    found = tried_at_ports(monkeypatch, lefts, sses, shares=("sensor_lag", richer))
    assert found == (["sensor_lag"], [])


def test_what_leaves_no_less_than_one_tried_in_vain_is_not_tried(monkeypatch):
    """Three lags that leave the same took 1000 runs, and friction was missing."""
    richer = "sensor_lag:second_order"
    lefts = {"sensor_lag": 21.5, "actuator_lag": 21.6, richer: 21.7}
    sses = dict.fromkeys(lefts, 2300.0)
    options = {"shares": ("sensor_lag", richer), "said": 20.0}
    found = tried_at_ports(monkeypatch, lefts, sses, **options)
    assert found == (["sensor_lag"], [])
    # Clearly less is worth it.
    lefts |= {"actuator_lag": 50.0, richer: 9.5}
    found = tried_at_ports(monkeypatch, lefts, sses, **options)
    assert found == (["sensor_lag", richer], [])


ZONE, DELAY = "input_dead_zone", "input_delay"


def owning(values, effects, sse=1.0):
    """A made-up fit of effects whose parameters are among some values, each 1."""
    owned = [ParameterRef.of_text(one) for one in values if "/" in one]
    owned = tuple(one for one in owned if one.owner in effects)
    white = 0.5 if sse <= 100.0 else 9.0
    fit = made_up(effects, sse, whiteness=white)
    return replace(fit, names=owned, values=np.ones(len(owned)))


def pair_findings(said):
    """Findings beside a base far from the noise; `said` times that an effect leaves."""
    stand_in = made_up(("gravity",), 100.0 * said)
    return SimpleNamespace(
        criteria=CRITERIA, problem=PROBLEM, base=base(1e4), own_base=None,
        scales=SCALES,
        found=SimpleNamespace(shares={}, fits={("gravity",): stand_in}),
    )  # fmt: skip


def fitted_pairs(monkeypatch, values, screened, begin):
    """Effects that are fitted to all recordings, in turn, as a list that grows."""
    done = []

    def fit(_findings, start, _runs):
        done.append(start.fit.effects)
        run = owning(values, start.fit.effects, 100.0 * start.left)
        return SimpleNamespace(fit=run, sse=run.sse, values_of_run={"gain": 2.0})

    monkeypatch.setattr(port_search, "screened_at_ports", screened)
    monkeypatch.setattr(port_search, "begin_at_port", begin)
    monkeypatch.setattr(port_search, "with_port_effects", fit)
    for room in (port_search, told_by_runs):
        monkeypatch.setattr(room, "fit_of_run", lambda _, turn: turn.fit)
    monkeypatch.setattr(
        port_search, "port_effects", lambda _, each: owning(values, tuple(each))
    )
    return done


@pytest.mark.parametrize(
    ("said", "left_alone", "left_both", "left_of_second", "fitted"),
    [
        # A dead zone takes most and leaves much: with a delay beside it nothing is left ...
        (60.0, 50.0, 1.0, 40.0, [(ZONE, DELAY)]),
        # ... which may be all of it, alone ...
        (60.0, 50.0, 1.0, 1.0, [(ZONE, DELAY), (DELAY,)]),
        # ... or takes too little.
        (60.0, 50.0, 30.0, 40.0, [(ZONE,)]),
        # No second one where the first leaves nothing, or the stand-in knows a better one.
        (60.0, 1.5, 1.0, 40.0, [(ZONE,)]),
        (4.0, 50.0, 1.0, 40.0, []),
        # What leaves much from the start is not even begun beside a far better one.
        (2.0, 50.0, 1.0, 40.0, []),
    ],
)
def test_a_second_effect_at_a_port_is_tried_beside_the_first(
    monkeypatch, said, left_alone, left_both, left_of_second, fitted
):
    lefts = {(ZONE,): left_alone, (ZONE, DELAY): left_both, (DELAY,): left_of_second}
    values = {"gain": 2.0, f"{ZONE}/threshold_A": 1.0, f"{DELAY}/delay_s": 3.0}
    findings, beside = pair_findings(said), []
    runs = SimpleNamespace(run_tasks=SimpleNamespace(are_spent=False))

    def screened(_findings, _runs, own, known=None):
        beside.append(known)
        effects = (ZONE, DELAY) if known else (ZONE,)
        return AtPorts({}, (LikelyAtPort(0.3, owning(values, effects), own),))

    def begin(_findings, one, _runs, _values):
        return PortStart(owning(values, one.effects), values, lefts[one.effects], 0.3)

    done = fitted_pairs(monkeypatch, values, screened, begin)
    tried = TriedEffects(findings)
    port_search.at_ports_by_runs_alone(tried, runs, {"gain": 2.0}, may_pair=True)
    assert done == fitted
    known = {ZONE: {"threshold_A": 1.0}}
    assert beside == [None, known] if left_alone > 9.0 and said > 25.0 else [None]
    waiting = tried.later if said > 3.0 else tried.unbegun
    assert [one.fit.effects for one in waiting] == ([] if fitted else [(ZONE,)])
    assert len(tried.later) + len(tried.unbegun) == len(waiting)
    if not fitted:
        # Nothing else was all that is missing.
        port_search.at_ports_later(tried, runs)
        assert done == [(ZONE,)]


@pytest.mark.parametrize(
    ("share", "begun"),
    [
        # One that leaves next to nothing is enough, unless another is as likely.
        (0.9, ["input_delay"]),
        (0.15, ["input_delay", "sensor_lag"]),
    ],
)
def test_a_second_likely_effect_is_begun_beside_one_that_leaves_nothing(
    monkeypatch, share, begun
):
    asked = []

    def begin(_findings, one, _runs, values):
        asked.append(one.effects[0])
        return PortStart(one, values, 1.0, 0.1)

    monkeypatch.setattr(port_search, "begin_at_port", begin)
    likely = (
        LikelyAtPort(0.1, made_up(("input_delay",), 1.0), {}),
        LikelyAtPort(share, made_up(("sensor_lag",), 1.0), {}),
    )
    runs = SimpleNamespace(run_tasks=SimpleNamespace(are_spent=False))
    tried = TriedEffects(SimpleNamespace())
    port_search._begun_at_ports(tried, likely, runs)
    assert asked == begun


@pytest.mark.parametrize(
    ("left_of_other", "left_of_pair", "fitted"),
    [
        # Beside the same dead zone both lags leave nothing ...
        (28.0, 1.0, [("actuator_lag", ZONE), ("sensor_lag", ZONE)]),
        # ... unless the other one leaves more of few recordings, alone or with it.
        (50.0, 1.0, [("actuator_lag", ZONE)]),
        (28.0, 30.0, [("actuator_lag", ZONE)]),
    ],
)
def test_a_pair_that_leaves_nothing_has_others_alike_in_its_first_ones_place(
    monkeypatch, left_of_other, left_of_pair, fitted
):
    """A lag before a motor was told for that of its tachometer, beside a dead zone."""
    first, other = "actuator_lag", "sensor_lag"
    lefts = {(first,): 27.0, (other,): left_of_other, (ZONE,): 60.0,
             (first, ZONE): 1.0, (other, ZONE): left_of_pair}  # fmt: skip
    values = {"gain": 2.0, f"{first}/time_constant_s": 0.1,
              f"{other}/time_constant_s": 0.1, f"{ZONE}/threshold_A": 1.0}  # fmt: skip
    findings, begun = pair_findings(60.0), []
    runs = SimpleNamespace(run_tasks=SimpleNamespace(are_spent=False))

    def screened(_findings, _runs, own, known=None):
        pairs = [(first, ZONE)] if known else [(first,), (other,)]
        likely = (LikelyAtPort(0.3, owning(values, one), own) for one in pairs)
        return AtPorts({}, tuple(likely))

    def begin(_findings, one, _runs, given):
        # One effect at most is begun at any size; of the other its values are known.
        begun.append({name.partition("/")[0] for name in given} - {"gain"})
        own = {name: value for name, value in values.items()
               if name.partition("/")[0] in (*one.effects, "gain")}  # fmt: skip
        return PortStart(owning(values, one.effects), own, lefts[one.effects], 0.3)

    done = fitted_pairs(monkeypatch, values, screened, begin)
    tried = TriedEffects(findings)
    port_search.at_ports_by_runs_alone(tried, runs, {"gain": 2.0}, may_pair=True)

    assert done == fitted
    assert begun[4:] == [{ZONE}] * (left_of_other < 40.0)


@pytest.mark.parametrize(
    ("shares", "count"),
    [((0.10, 0.11, 0.115), 3), ((0.10, 0.3, 0.31), 2), ((0.1,) * 6, 4), ((), 0)],
)
def test_effects_that_are_about_as_likely_are_all_fitted(shares, count):
    # A delay and two lags, before the simulation's parameters have followed them.
    likely = [LikelyAtPort(one, made_up((), 1.0), {}) for one in shares]

    assert len(port_search._likeliest(likely)) == count
