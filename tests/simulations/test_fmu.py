import re
import signal
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from hwid_cli.errors import SimulationError
from hwid_cli.export.formats import write_exported
from hwid_cli.export.predict import predict
from hwid_cli.records.programs import FmuSimulation, FreeParameter, RunRequest
from hwid_cli.simulations import fmu
from tests.export.model_examples import (
    deviation,
    example_input,
    example_model,
    exported_of,
)
from tests.simulations.fmu_examples import (
    MASS_KG,
    STARTS,
    fmpy,
    make_fmu,
    needs_compiler,
)

pytestmark = needs_compiler
STEP_S = 1e-3
TIMES = STEP_S * np.arange(1000)
CURRENT = np.sin(2 * np.pi * 4 * TIMES)
FORCE = np.interp(TIMES, [0.2, 0.3, 0.5, 0.7], [0.0, 3.0, -2.0, 0.0])


@pytest.fixture(scope="module", params=[2, 3])
def plant(request, tmp_path_factory):
    return section(make_fmu(tmp_path_factory.mktemp("fmu"), request.param))


@pytest.fixture(scope="module")
def plant_2(tmp_path_factory):
    return section(make_fmu(tmp_path_factory.mktemp("fmu")))


@pytest.fixture(autouse=True)
def _own_process():
    yield
    fmu._PROCESS.end()


def section(path, **changes):
    names = {
        "input": "current_A",
        "output": "displacement_m",
        "force_input": "force_N",
        "velocity": "velocity_m_per_s",
    }
    return FmuSimulation(file=str(path), **{**names, **changes})


def run(options, force=None, current=CURRENT, step_s=STEP_S):
    force = np.zeros(0) if force is None else force
    return fmu.KIND.run(
        options, RunRequest("a", step_s, current, force, options.values)
    )


def told(options, call=run):
    """The line that a user sees."""
    with pytest.raises(SimulationError) as caught:
        call(options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def moved(force, times=TIMES, *, damping=15.0, start=(0.0, 0.0), is_line=True):
    """Position and velocity by SciPy's solution of the state equation."""
    matrix = [[0, 1], [-STARTS["stiffness"] / MASS_KG, -damping / MASS_KG]]
    system = (matrix, [[0], [1 / MASS_KG]], np.eye(2), np.zeros((2, 1)))
    return lsim(system, force, times, X0=start, interp=is_line)[1].T


@pytest.mark.thorough
def test_inputs_are_straight_lines_between_samples(plant):
    found = run(replace(plant, step_s=5e-5), FORCE)

    position, velocity = moved(STARTS["kt"] * CURRENT + FORCE)
    assert found.output == pytest.approx(position, abs=1e-6 * np.ptp(position))
    assert found.velocity == pytest.approx(velocity, abs=1e-6 * np.ptp(velocity))


@pytest.mark.thorough
def test_a_step_of_the_sample_time_holds_the_mean(plant):
    found = run(plant, FORCE)

    push = STARTS["kt"] * CURRENT + FORCE
    means = np.r_[0.5 * (push[1:] + push[:-1]), 0.0]
    position = moved(means, is_line=False)[0]
    assert found.output == pytest.approx(position, abs=1e-8 * np.ptp(position))
    # Against a straight line this is of the second order; a delay would be of the first.
    exact = moved(push)[0]
    assert found.output == pytest.approx(exact, abs=1e-3 * np.ptp(exact))


@pytest.mark.thorough
def test_a_unit_of_fixed_step_samples_its_inputs(tmp_path):
    path = make_fmu(
        tmp_path,
        change=lambda text: text.replace(
            'canHandleVariableCommunicationStepSize="true"', ""
        ),
    )

    found = run(section(path))

    position = moved(STARTS["kt"] * CURRENT, is_line=False)[0]
    assert found.output == pytest.approx(position, abs=1e-8 * np.ptp(position))


@pytest.mark.thorough
def test_parameters_and_starts_are_set_by_name(plant):
    values = {"damping": FreeParameter(3.0, (1.0, 9.0)), "start_m": 1e-3}
    found = run(replace(plant, parameters=values, step_s=1e-4))

    position = moved(STARTS["kt"] * CURRENT, damping=3.0, start=(1e-3, 0.0))[0]
    assert found.output == pytest.approx(position, abs=1e-5 * np.ptp(position))


@pytest.mark.thorough
def test_a_run_leaves_nothing_for_the_next_one(plant):
    first = run(plant)
    run(plant, FORCE)
    run(replace(plant, parameters={"damping": 1.0}))

    again = run(plant)

    assert np.array_equal(again.output, first.output)
    assert np.array_equal(again.velocity, first.velocity)


@pytest.mark.parametrize(
    ("reset", "expected"), [("begin(u); return 0;", 1), ("return 3;", 3)]
)
def test_an_instance_is_used_again_where_it_can_be_reset(tmp_path, reset, expected):
    from hwid_cli.simulations.fmu_unit import FmuNames, FmuRequest, FmuUnit

    made = []

    class Counted(FmuUnit):
        def _instance(self):
            made.append(1)
            return super()._instance()

    path = make_fmu(tmp_path, reset=reset, name="counted")
    unit = Counted(fmpy.extract(str(path), tmp_path / "unpacked"))
    names = FmuNames("current_A", "displacement_m", None, None, ())
    request = FmuRequest(names, CURRENT[:50, np.newaxis], {}, STEP_S, 1)

    for _ in range(2):
        unit.run(request)

    # A refused reset shows in the run that tries it, and each run begins anew.
    assert len(made) == expected


@pytest.mark.thorough
@pytest.mark.parametrize("delay", [0, 2])
def test_an_fmu_of_hwids_own_gives_what_its_model_does(tmp_path, delay):
    exported = exported_of(example_model(2, nb=2, nf=3, nk=delay))
    (path,) = write_exported(tmp_path, exported, "fmu")
    options = FmuSimulation(file=str(path), input="u", output="y")
    signal = example_input(1, 200)

    found = [run(options, current=signal).output for _ in range(2)]

    expected = predict(exported, signal)
    assert deviation(found[0], expected) <= 1e-12
    assert np.array_equal(found[1], found[0])


@pytest.mark.thorough
@pytest.mark.parametrize("reset", ["return 3;", "return 0;"])
def test_an_fmu_without_a_true_reset_starts_fresh(tmp_path, plant_2, reset):
    options = section(make_fmu(tmp_path, reset=reset, name="stubborn"))

    found = [run(options).output for _ in range(3)]

    expected = run(plant_2).output
    assert all(np.array_equal(one, expected) for one in found)


@pytest.mark.thorough
def test_two_thousand_runs(plant):
    current = CURRENT[:20]
    first = run(plant, current=current).output
    process = fmu._PROCESS._process

    for _ in range(2000):
        last = run(plant, current=current).output

    assert np.array_equal(first, last)
    assert fmu._PROCESS._process is process


@pytest.mark.parametrize(("free", "force"), [(True, True), (False, False)])
def test_what_it_can_do(free, force):
    values = {"damping": FreeParameter(3.0)} if free else {"damping": 3.0}
    options = section("a.fmu", parameters=values)
    options = options if force else replace(options, force_input=None)

    found = fmu.KIND.capabilities(options)

    assert (found.run, found.step) == (True, True)
    assert (found.parameters, found.force) == (free, force)


@pytest.mark.thorough
def test_content_follows_the_file(tmp_path, plant_2):
    first = fmu.KIND.content(plant_2)
    other = make_fmu(tmp_path, internal_step_s=2e-4)

    assert fmu.KIND.content(section(other)) != first
    assert fmu.KIND.content(replace(plant_2, parameters={"kt": 3.0})) == first


@pytest.mark.thorough
def test_a_file_that_changes_is_opened_again(tmp_path):
    path = make_fmu(tmp_path)
    before = run(section(path)).output
    make_fmu(tmp_path, change=lambda text: text, coulomb_N=2.0)

    after = run(section(path)).output

    assert np.ptp(after) < 0.95 * np.ptp(before)


@pytest.mark.thorough
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ("nan", "gave 'displacement_m' = nan at 0.052 s"),
        ("error", r"its step gave Error at 0.05 s: '.*solver failed"),
        ("crash", signal.SIGSEGV.name),
        ("hang", "did not come back within 1 s"),
    ],
)
def test_a_run_that_fails_is_one_line_and_loses_nothing(
    tmp_path, plant_2, version, fault, expected
):
    path = make_fmu(tmp_path, version, fault=fault)
    limit_s = 1.0 if fault == "hang" else 60.0
    options = section(path, time_limit_s=limit_s, parameters={"damping": 2.0})

    said = told(options)

    assert re.search(expected, said)
    assert said.startswith("simulation: run of recording 'a' with damping=2: ")
    assert np.isfinite(run(plant_2).output).all()


@pytest.mark.thorough
def test_a_short_run_of_a_faulty_one_is_good_after_a_fault(tmp_path, plant_2):
    options = section(make_fmu(tmp_path, fault="error"))
    told(options)

    found = run(options, current=CURRENT[:40]).output

    assert np.array_equal(found, run(plant_2, current=CURRENT[:40]).output)


def test_one_that_asks_to_end(tmp_path):
    path = make_fmu(tmp_path, 3, ends=True)

    assert "its step gave Discard at 0.051 s" in told(section(path))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"input": "currentA"}, "simulation.input: found 'currentA'.*mean 'current_A'"),
        ({"input": "kt"}, "simulation.input: found 'kt', a tunable parameter; .*input"),
        ({"force_input": "velocity_m_per_s"}, "simulation.force_input: .* output"),
        ({"output": "current_A"}, "simulation.output: found 'current_A', a .*input"),
        ({"velocity": "speed"}, "simulation.velocity: found 'speed', which"),
        ({"output": "mode"}, "simulation.output: found 'mode', a fixed parameter"),
        ({"parameters": {"dampng": 1.0}}, "simulation.parameters: .*mean 'damping'"),
        ({"parameters": {"current_A": 1.0}}, "'current_A', a continuous input; expected"),
        ({"parameters": {"mass_kg": 1.0}}, "'mass_kg', a constant local; expected"),
        ({"parameters": {"poles": 1.0}}, "'poles', a fixed calculatedParameter"),
        ({"parameters": {"mode": 1.0}}, "'mode', of type Int.*Real or Float64"),
        ({"parameters": {"displacement_m": 1.0}}, "'displacement_m', a .*output"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("call", [run, fmu.KIND.content])
def test_a_name_that_does_not_fit(plant, changes, expected, call):
    assert re.search(expected, told(replace(plant, **changes), call))


@pytest.mark.thorough
def test_an_array(tmp_path):
    path = make_fmu(tmp_path, 3)

    assert "'table', an array of Float64; expected a scalar" in told(
        section(path, output="table")
    )


@pytest.mark.thorough
@pytest.mark.parametrize("step_s", [3e-4, 2e-3])
def test_a_step_that_does_not_divide_the_sample_time(plant_2, step_s):
    said = told(replace(plant_2, step_s=step_s))

    assert said.startswith(f"simulation.step_s: found {step_s:g}; expected")
    assert "0.001 s; take" in said


def test_no_file(tmp_path):
    assert "No such file" in told(section(tmp_path / "no.fmu"), fmu.KIND.content)


def test_no_archive(tmp_path):
    (tmp_path / "a.fmu").write_text("text")

    assert "simulation.file: a.fmu is no FMU" in told(section(tmp_path / "a.fmu"))


@pytest.mark.thorough
def test_no_description(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.fmu", "w") as archive:
        archive.writestr("readme.txt", "")

    assert "it holds no modelDescription.xml" in told(section(tmp_path / "a.fmu"))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("CoSimulation", "ModelExchange", "is for model exchange only"),
        ("</fmiModelDescription>", "", "modelDescription.xml that cannot be read"),
    ],
)  # fmt: skip
def test_a_description_of_something_else(tmp_path, old, new, expected):
    path = make_fmu(tmp_path, change=lambda text: text.replace(old, new))

    assert expected in told(section(path))


@pytest.mark.thorough
def test_the_first_version_of_the_standard(tmp_path):
    text = (
        '<fmiModelDescription fmiVersion="1.0" modelName="a" modelIdentifier="a" '
        'guid="1" numberOfContinuousStates="0" numberOfEventIndicators="0">'
        "<ModelVariables/></fmiModelDescription>"
    )
    path = make_fmu(tmp_path, change=lambda _: text)

    assert "is of FMI version 1.0; expected 2.0 or 3.0" in told(section(path))


@pytest.mark.thorough
def test_another_platform(tmp_path):
    other = "win64" if fmpy.platform != "win64" else "linux64"
    path = make_fmu(tmp_path, platform=other)

    said = told(section(path))

    assert f"other platforms ({other}); expected binaries/{fmpy.platform}/drive" in said


def test_no_fmpy(tmp_path, plant_2, monkeypatch):
    (tmp_path / "fmpy.py").write_text("raise ImportError(\"No module named 'fmpy'\")")
    monkeypatch.syspath_prepend(tmp_path)

    said = told(plant_2, fmu.KIND.content)

    assert "pip install 'hwid[fmu]'" in said
