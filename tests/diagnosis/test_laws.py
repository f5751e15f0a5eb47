"""Laws that no catalogue holds, in a machine with an integrator of its own."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import sympy

from hwid_cli import DiagnoseOptions, Recording, SimulationOptions, diagnose
from hwid_cli.config.extended_simulation import write_extended_simulation
from hwid_cli.config.load import experiment_of, load_experiment
from hwid_cli.diagnosis import diagnose as diagnose_module
from hwid_cli.diagnosis import law_names, laws, set_fits
from hwid_cli.diagnosis.candidate import (
    compared_with_fit,
    fit_candidate,
    fitted_drive,
)
from hwid_cli.diagnosis.latent_force import latent_force
from hwid_cli.diagnosis.law_search import MOST_TERMS
from hwid_cli.diagnosis.law_terms import Term
from hwid_cli.diagnosis.laws import _most_terms
from hwid_cli.diagnosis.rounds import RoundsResult, run_rounds
from hwid_cli.diagnosis.sentences import law_in_words
from hwid_cli.diagnosis.set_fits import fit_task
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.records.diagnosis import Law, LawTerm
from hwid_cli.records.own_effects import own_id
from hwid_cli.stages.diagnose import extended_options
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up
from tests.diagnosis.small_drive import (
    NOISE,
    STEP_S,
    fit,
    inputs,
    problem,
    recordings,
    search_start,
    sizes,
    white,
)
from tests.diagnosis.small_rounds import rounds_of
from tests.laws.machine import Base, Hidden, measured
from tests.stages.diagnosed_drive import FRICTION

SIMULATION = SimulationOptions(
    mass_kg=0.3,
    damping_N_s_per_m=13.0,
    stiffness_N_per_m=1100.0,
    force_constant_N_per_A=5.4,
)
# The catalogue is left out: it takes a minute to say that it knows nothing of this.
NOTHING = DiagnoseOptions(laws="only")


def machine(hidden, change=None):
    """Recordings; ``change`` may give one of them, by its name, something else."""
    rng = np.random.default_rng(4)
    found = []
    for name, u in inputs(500).items():
        own = (change or {}).get(name, hidden)
        y, _ = measured(u, STEP_S, Base(), own)
        noise = NOISE * rng.standard_normal(y.size)
        found.append(Recording(name, u, y + noise, STEP_S, kind=name.split("_")[0]))
    return found


ROOT = Hidden(lambda x, v, u, t, way: -1.0 * way - 700 * x * v, has_friction=True)


@pytest.fixture(scope="module")
def found():
    recordings = machine(ROOT)
    return recordings, diagnose(recordings, SIMULATION, NOTHING)


@pytest.mark.thorough
def test_a_law_of_two_terms_is_found_with_units_intervals_and_inclusion(found):
    _, diagnosis = found
    law = diagnosis.law
    assert (diagnosis.verdict, diagnosis.complete) == ("law", True)
    assert law.acts_on == "force"
    terms = {one.term: one for one in law.terms}
    assert set(terms) == {"sign(v)", "x*v"}
    assert law.terms[0].term == "x*v"
    for name, value, unit in (("sign(v)", -1.0, "N"), ("x*v", -700.0, "N s/m^2")):
        one = terms[name]
        assert one.value == pytest.approx(value, rel=0.02)
        assert one.low < one.value < one.high < 0
        assert one.unit == unit
        assert one.inclusion > 0.8
    assert diagnosis.explained_share > 0.99
    assert "The simulation lacks coulomb_friction (-0.9" in diagnosis.summary
    assert (
        "*sign(v)) and something that is no effect of the catalogue"
        in diagnosis.summary
    )


@pytest.mark.thorough
def test_a_law_of_one_term_takes_the_place_of_sets_that_would_imitate_it(monkeypatch):
    pull = Hidden(lambda x, v, u, t, way: 0.35 * u * u)
    sizes = []

    def spied(*of):
        result = run_rounds(*of)
        sizes.append(len(result.best))
        return result

    monkeypatch.setattr(diagnose_module, "run_rounds", spied)
    found = diagnose(machine(pull), SIMULATION, DiagnoseOptions(max_effects=2))
    assert (found.verdict, found.complete) == ("law", True)
    (term,) = found.law.terms
    assert term.term == "u**2"
    # A share of the input: 0.35 N/A^2 over 5 N/A.
    assert found.law.acts_on == "input"
    assert term.value == pytest.approx(0.07, rel=0.02)
    # No pair was looked for.
    assert sizes == [1]


@pytest.mark.thorough
def test_of_many_samples_a_part_leads_to_the_same_law_fitted_to_all(found, monkeypatch):
    recordings, of_all = found
    monkeypatch.setattr(set_fits, "MANY_SAMPLES", 1000)
    monkeypatch.setattr(laws, "_FEW_SAMPLES", 1000)
    sizes = []

    def spied(problem, ids, *rest):
        sizes.append((ids, rest[-1]))
        return fit_candidate(problem, ids, *rest)

    monkeypatch.setattr(laws, "fit_candidate", spied)
    law = diagnose(recordings, SIMULATION, NOTHING).law
    assert {one.term for one in law.terms} == {"sign(v)", "x*v"}
    for one, other in zip(law.terms, of_all.law.terms, strict=True):
        assert one.value == pytest.approx(other.value, rel=1e-3)
    # Several of each size on a part; one of each size on all.
    assert [most for _, most in sizes] == [1000, 1000, 1000, 1000, None] * 2


@pytest.mark.thorough
def test_sympy_reads_the_formula(found):
    _, diagnosis = found
    x, v = sympy.symbols("x v")
    read = sympy.sympify(diagnosis.law.formula)
    assert read.free_symbols == {x, v}
    at = float(read.subs({x: 0.01, v: -0.2}))
    assert at == pytest.approx(1.0 + 700 * 0.01 * 0.2, rel=0.02)


@pytest.mark.thorough
def test_the_extended_simulation_holds_the_law_and_lacks_nothing(found, tmp_path):
    recordings, diagnosis = found
    extended = extended_options(diagnosis, SIMULATION)
    columns = {"time": "t", "input": "i", "output": "x"}
    content = {"name": "mine", "recordings": {"files": "raw/*.csv", "columns": columns}}
    experiment = experiment_of(content, str(tmp_path / "c.yaml"))
    path = tmp_path / "results" / "extended_simulation.yaml"
    path.parent.mkdir()
    write_extended_simulation(path, experiment, extended)
    again = load_experiment(path)
    assert "law: {c1:" in path.read_text()
    told = diagnose(recordings, again.simulation, DiagnoseOptions(effects=("cogging",)))
    assert told.verdict == "none"
    assert [one.id for one in told.present] == ["law"]


@pytest.mark.thorough
def test_a_law_that_is_an_effect_of_the_catalogue_gets_its_name():
    friction = Hidden(lambda x, v, u, t, way: -0.9 * way, has_friction=True)
    told = diagnose(machine(friction), SIMULATION, NOTHING)
    assert (told.verdict, told.law) == ("named", None)
    (effect,) = told.effects
    assert effect.id == "coulomb_friction"
    assert effect.parameters[0].value == pytest.approx(0.9, rel=0.02)


@pytest.mark.parametrize(
    ("left", "most"), [(110.0, 1), (300.0, MOST_TERMS)], ids=["little", "much"]
)
def test_only_a_law_as_short_competes_with_what_leaves_hardly_more_than_noise(
    left, most
):
    # 1.05 and 1.7 times the noise.
    one = made_up(("stribeck_friction",), left, whiteness=20.0)
    of = SimpleNamespace(compares_command=False)
    rounds = SimpleNamespace(criteria=CRITERIA, base=base(3500.0), problem=of)
    named = DiagnosisVerdict("named", False, one, ())
    unknown = DiagnosisVerdict("unknown", False, base(3500.0), ())
    assert _most_terms(rounds, named) == most
    assert _most_terms(rounds, unknown) == MOST_TERMS
    assert _most_terms(rounds, replace(named, is_complete=True)) == 0


@pytest.mark.parametrize(("of_both", "word"), [(310.0, "named"), (200.0, "both")])
def test_effects_of_a_law_have_to_be_needed_like_those_of_a_set(
    of_both, word, monkeypatch
):
    # Friction leaves 320 of 9000; what the law adds to it brings much, or next to nothing.
    friction, hum = made_up(("coulomb_friction",), 320.0), made_up(("hum",), 8000.0)
    both = made_up(("coulomb_friction", "hum"), of_both)
    fits = {one.effects: one for one in (friction, hum, both)}
    of = SimpleNamespace(
        criteria=CRITERIA, base=base(9000.0), on_round=lambda what, count: None,
        problem=SimpleNamespace(compares_command=False),
    )  # fmt: skip
    for name, answer in {
        "_likely": [], "_tried": [], "_best": both, "_holds": True, "_refined": both,
        "_named": both,
    }.items():  # fmt: skip
        monkeypatch.setattr(laws, name, lambda *given, answer=answer: answer)
    given = DiagnosisVerdict("named", False, friction, ())
    found, _, law = laws.find_law(of, [], [], RoundsResult(fits), given)
    assert law is None
    assert found.chosen is (friction if word == "named" else both)


@pytest.mark.thorough
def test_a_law_that_held_out_recordings_do_not_share_is_refused():
    # Trained on damping that grows to one side, judged on what grows to the other.
    other = Hidden(lambda x, v, u, t, way: 700 * x * v)
    names = ("step_1", "sine_2", "sine_0")
    options = DiagnoseOptions(laws="only", hold_out=names)
    law = Hidden(lambda x, v, u, t, way: -700 * x * v)
    told = diagnose(machine(law, dict.fromkeys(names, other)), SIMULATION, options)
    assert told.verdict == "unknown"
    assert told.law is None


@pytest.mark.thorough
@pytest.mark.parametrize("place", [0.006, -0.009])
def test_a_magnet_beside_the_way_is_told_with_its_place_and_its_reach(place):
    def pull(x, v, u, t, way):
        return 2.0 / (1.0 + ((x - place) / 0.0018) ** 2)

    told = diagnose(machine(Hidden(pull)), SIMULATION, NOTHING)
    (term,) = told.law.terms
    shape = re.fullmatch(r"1/\(1 \+ \(\(x ([-+]) (.+)\)/(.+)\)\*\*2\)", term.term)

    assert told.complete
    assert re.search(r"formula holds: F = (2|2\.0\d+|1\.9\d+)/\(1 \+ ", told.summary)
    assert term.value == pytest.approx(2.0, rel=0.05)
    assert shape[1] == ("-" if place > 0 else "+")
    assert float(shape[2]) == pytest.approx(abs(place), rel=0.03)
    assert float(shape[3]) == pytest.approx(0.0018, rel=0.1)


@pytest.mark.thorough
def test_a_machine_that_lacks_nothing_has_no_law():
    told = diagnose(machine(Hidden()), SIMULATION, NOTHING)
    assert (told.verdict, told.law) == ("parameters", None)


@pytest.mark.thorough
def test_who_asks_for_some_effects_gets_no_law():
    options = DiagnoseOptions(effects=("input_delay",))
    told = diagnose(machine(ROOT), SIMULATION, options)
    assert told.law is None


@pytest.mark.thorough
def test_a_law_of_a_sensor_is_told_as_what_it_reads():
    sensor = Hidden(sensor=lambda x, v, u, t: x + 0.04 * np.abs(x))
    told = diagnose(machine(sensor), SIMULATION, NOTHING)
    assert (told.verdict, told.law.acts_on) == ("law", "output")
    (term,) = told.law.terms
    assert (term.term, term.unit) == ("abs(x)", "1")
    assert term.value == pytest.approx(0.04, rel=0.05)
    assert told.law.formula.startswith("x + 0.0")


@pytest.mark.filterwarnings("error")
def test_only_an_interval_on_one_side_of_zero_is_clear_however_large(monkeypatch):
    limits = {
        "c0": (1e200, 1e300),
        "c1": (-1e300, -1e200),
        "c2": (-1e300, 1e200),
        "c3": (0.0, 1.0),
        "c4": (np.nan, 1.0),
    }
    names = tuple(SimpleNamespace(owner="law", parameter=one) for one in limits)
    low, high = np.array(list(limits.values())).T
    monkeypatch.setattr(laws, "intervals", lambda *_: (low, high))
    rounds_of = SimpleNamespace(problem=None, baseline=SimpleNamespace(scales=None))
    tried = SimpleNamespace(fit=SimpleNamespace(names=names), identifier="law")

    assert laws._unclear_terms(rounds_of, tried) == ["c2", "c3", "c4"]


@pytest.mark.thorough
def test_a_period_in_time_cannot_leave_what_the_recordings_show():
    # Hardly anything swings: the best frequency is any that does not matter.
    of = rounds_of(FRICTION, ())
    term = Term("sin(2*pi*f*t)", (0, 0, 0), {"f": (20.0, "1/s")}, "swing sin")
    effect, values = laws._effect((term,), np.array([1e-3]), "force", ("N", "m", "A"))
    # Nor where a search has come to be far beyond it.
    identifier = own_id("law", effect)
    start = search_start(of.problem, {identifier: {**values, "f1": 1e5}})
    task = fit_task(of, (identifier,), [start], None)
    found = fit_candidate(*task.arguments)
    (frequency,) = [
        value
        for ref, value in zip(found.names, found.values, strict=True)
        if ref.parameter == "f1"
    ]
    assert 5.0 <= frequency <= 80.0


def test_a_power_that_is_hardly_one_is_tried_as_the_sign_alone(monkeypatch):
    # Near rest noise hides the direction of motion, and a steep power does as well.
    of = rounds_of(FRICTION, ())
    term = Term("abs(v)**0.5*sign(v)", (0.5, -0.5, 0), family="power of v")
    tried = SimpleNamespace(terms=(term,))
    asked = []

    def replaced(_, one, place, free, factor):
        asked.append((free.formula, factor))
        return SimpleNamespace(terms=(free,))

    monkeypatch.setattr(laws, "_replaced", replaced)
    for fitted in ("_simulated", "_with_few_samples"):
        monkeypatch.setattr(laws, fitted, lambda _, several, what: several)
    monkeypatch.setattr(laws, "_value_of", lambda one, start: 0.12)
    monkeypatch.setattr(laws, "_fit", lambda one: one)
    gain = {"sign(v)": 100.0, "abs(v)**0.12*sign(v)": 90.0}
    rounds = replace(
        of,
        criteria=SimpleNamespace(
            gain=lambda one, other: gain.get(one.terms[0].formula, 50.0)
        ),
    )
    found = laws._refined(rounds, tried)
    assert [one.formula for one in found.terms] == ["sign(v)"]
    size = of.baseline.scales.velocity_m_per_s
    (factor,) = [factor for formula, factor in asked if formula == "sign(v)"]
    assert factor == pytest.approx(size**0.5, rel=1e-5)


@pytest.mark.parametrize(
    ("own", "elsewhere", "agrees"),
    [
        (10.0, 15.0, True),
        # A formula that follows its own recordings and no others.
        (10.0, 29.0, False),
        # Below the noise nothing is better or worse.
        (0.1, 1.5, True),
    ],
)
def test_a_law_leaves_of_other_recordings_what_it_leaves_of_its_own(
    own, elsewhere, agrees
):
    left = {"law": (own, elsewhere), "base": (100.0, 110.0)}
    criteria = SimpleNamespace(
        noise=SimpleNamespace(rms=1.0),
        rms=lambda fit, held_out: left[fit][held_out],
    )
    rounds = SimpleNamespace(criteria=criteria, base="base")
    assert laws._is_as_good_elsewhere(rounds, "law") == agrees


@pytest.mark.thorough
@pytest.mark.parametrize("is_force", [False, True])
def test_what_sets_the_scale_stays_where_a_law_begins(is_force):
    """Under a current the mass, and under a force its constant: the mass is found."""
    measured = recordings({"cubic_stiffness": {"stiffness_N_per_m3": 8e5}})
    if is_force:
        measured = [
            replace(one, input=5.0 * one.input, input_unit="N") for one in measured
        ]
    of = problem(
        measured, mass_kg=0.27, force_constant_N_per_A=1.0 if is_force else 5.0
    )
    rounds = rounds_of(FRICTION, (), problem=of, base=fit(of))
    drive = fitted_drive(of.drive, rounds.base)
    rounds = replace(rounds, baseline=replace(rounds.baseline, drive=drive))
    before = compared_with_fit(of, rounds.base, sizes(of))
    smoothed = latent_force(before, drive, white())
    tried = laws._likely(rounds, before, smoothed, MOST_TERMS)

    held = "force_constant_N_per_A" if is_force else "mass_kg"
    moved = "mass_kg" if is_force else "force_constant_N_per_A"
    as_forces = [one.start.base for one in tried if one.acts_on == "force"]
    assert as_forces
    assert {one[held] for one in as_forces} == {getattr(drive, held)}
    assert any(one[moved] != getattr(drive, moved) for one in as_forces)
    # Ratios to the mass alone are known: 1184 N/m over 0.3 kg.
    nearest = min(
        abs(one["stiffness_N_per_m"] / one["mass_kg"] - 1184.0 / 0.3)
        for one in as_forces
    )
    assert nearest < 0.1 * 1184.0 / 0.3


@pytest.mark.parametrize(
    ("term", "high", "acts_on", "effect"),
    [
        ("sign(v)", -0.9, "force", "coulomb_friction"),
        ("v*abs(v)", -0.9, "force", "quadratic_drag"),
        # Pushing along, perhaps none, of the sensor, and without a name of its own.
        ("sign(v)", 0.9, "force", None),
        ("sign(v)", -0.9, "output", None),
        ("x*v", -0.9, "force", None),
    ],
)
def test_terms_of_a_law_that_have_a_name(term, high, acts_on, effect):
    terms = (
        LawTerm("abs(x)", -3.0, -4.0, -2.0, "N/m", 1.0),
        LawTerm(term, -1.0, -1.1, high, "N", 1.0),
    )
    expected = {} if effect is None else {f"-1*{term}": effect}
    assert law_names.known_terms(Law("F", acts_on, terms)) == expected


@pytest.mark.parametrize(
    ("beside", "inclusion", "is_named"),
    [
        ("x*abs(x)", 1.0, True),
        ("sign(v)", 1.0, True),
        ("x*v", 1.0, True),
        # A drag of another exponent makes up for it.
        ("abs(v)**1.5*sign(v)", 1.0, False),
        ("x*abs(x)", 0.5, False),
    ],
)
def test_a_drag_is_named_where_nothing_else_goes_with_the_velocity(
    beside, inclusion, is_named
):
    terms = (
        LawTerm(beside, 3.0, 2.0, 4.0, "N", 1.0),
        LawTerm("v*abs(v)", -1.0, -1.1, -0.9, "N", inclusion),
    )
    found = law_names.known_terms(Law("F", "force", terms))
    assert ("-1*v*abs(v)" in found) is is_named


@pytest.mark.parametrize(
    ("left", "own", "is_behind"),
    [
        (150.0, None, True),
        (2_990.0, None, False),
        (3_500.0, None, False),
        # Values of each recording make up for anything.
        (150.0, [0.1, -0.1] * 3, False),
    ],
)
def test_a_law_is_none_where_effects_of_the_catalogue_leave_clearly_less(
    left, own, is_behind
):
    law = SimpleNamespace(fit=made_up(("law",), 3_000.0))
    pair = made_up(("coulomb_friction", "torque_ripple"), left, own=own)
    rounds = SimpleNamespace(criteria=CRITERIA)
    assert laws._is_behind(rounds, law, RoundsResult({pair.effects: pair})) is is_behind


def test_a_law_does_not_hold_where_it_is_behind_the_catalogue(monkeypatch):
    for name in ("_is_as_good_elsewhere", "_unclear_terms"):
        answer = name != "_unclear_terms"
        monkeypatch.setattr(laws, name, lambda *_, answer=answer: answer)
    law = SimpleNamespace(fit=made_up(("law",), 3_000.0))
    pair = made_up(("coulomb_friction", "torque_ripple"), 150.0)
    rounds = SimpleNamespace(criteria=CRITERIA, base=base(90_000.0))
    unknown = DiagnosisVerdict("unknown", False, rounds.base, ())
    assert laws._holds(rounds, law, RoundsResult(), unknown)
    found = RoundsResult({pair.effects: pair})
    assert not laws._holds(rounds, law, found, unknown)


@pytest.mark.parametrize(("inclusion", "is_curve"), [(0.9, False), (0.3, True)])
def test_a_law_whose_terms_others_replace_is_a_curve(inclusion, is_curve):
    terms = (
        LawTerm("x*abs(x)", 3.0, 2.0, 4.0, "N", 1.0),
        LawTerm("x**3", -1.0, -1.1, -0.9, "N", inclusion),
    )
    fit = made_up(("law",), 110.0)
    said = law_in_words(
        CRITERIA, base(90_000.0), DiagnosisVerdict("law", False, fit, ()),
        Law("F", "force", terms), SimpleNamespace(equation="F = ..."),
    )  # fmt: skip
    assert ("Take it as a curve" in said) is is_curve
    assert ("chosen again in 30 %" in said) is is_curve


@pytest.mark.parametrize(("left", "is_fact"), [(110.0, True), (2_000.0, False)])
@pytest.mark.parametrize("term", ["x*abs(x)", "sign(v)"])
def test_a_law_that_leaves_much_is_a_lead_and_no_fact(left, is_fact, term):
    fit = made_up(("law",), left)
    terms = (
        LawTerm(term, 3.0, 2.0, 4.0, "N", 1.0),
        LawTerm("x**3", 1.0, 0.5, 2, "N", 1),
    )
    said = law_in_words(
        CRITERIA, base(90_000.0), DiagnosisVerdict("law", False, fit, ()),
        Law("F", "force", terms), SimpleNamespace(equation="F = ..."),
    )  # fmt: skip
    assert ("formula holds" in said) is is_fact
    assert ("As a lead" in said) is not is_fact
    assert ("What remains is not explained" in said) is not is_fact
