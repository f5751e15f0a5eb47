import re
import shlex
import subprocess
from pathlib import Path

import numpy as np
import pytest

from hwid_cli.errors import ConfigError
from hwid_cli.export.c_source import c_source
from hwid_cli.export.map_parts import language_text
from hwid_cli.export.predict import predict
from hwid_cli.records.maps import OwnFunction, StaticMap
from tests.export.model_examples import (
    KINDS,
    STARTS,
    c_output,
    c_program,
    deviation,
    example_input,
    example_model,
    exported_of,
)
from tests.model.plants import MAPS

# What the C source promises over a whole recording, of the largest output.
PROMISED = 1e-12
DOCUMENT = Path(__file__).parents[2] / "docs" / "export.md"


def check(folder, model, seed):
    exported = exported_of(model)
    program, u = c_program(folder, exported), example_input(seed)
    for start in STARTS:
        expected = predict(exported, u, initial_state=start)
        assert deviation(c_output(program, u, start), expected) <= PROMISED, start


@pytest.mark.parametrize("place", range(0, len(KINDS), 2))
@pytest.mark.parametrize("is_extrapolated", [False, True])
def test_the_program_predicts_as_hwid_does(place, is_extrapolated, tmp_path):
    kinds = (KINDS[place], KINDS[place - 1])
    rule, seed = (
        ("zero", "steady", "estimated")[place // 2 % 3],
        place + is_extrapolated,
    )
    model = example_model(seed, kinds=kinds, nb=3, nf=4, nk=place // 2, rule=rule)

    check(tmp_path, model, place)


def test_default_maps_give_the_same_last_bit(tmp_path):
    model = example_model(5, kinds=("piecewise_linear",) * 2, nb=6, nf=9, nk=3)
    exported, u = exported_of(model), example_input(5)

    found = c_output(c_program(tmp_path, exported), u)
    assert np.array_equal(found, predict(exported, u))


@pytest.mark.parametrize("kind", ["sigmoid_network", "wavelet_network", "cubic_spline"])
def test_close_poles_do_not_enlarge_a_last_bit(kind, tmp_path):
    # Poles of a drive that is sampled fast: 1/F has a gain of ten million.
    model = example_model(7, kinds=(kind, kind), nb=5, nf=5, nk=1, rule="zero")
    block = {
        "numerator": np.array([1.0, 1.0, 1.0, 1.0, 1.0]) * 1e-9,
        "denominator": np.poly([0.97, 0.965, 0.96, 0.955, 0.95]),
    }
    check(tmp_path, type(model)(**{**vars(model), **block}), 7)


@pytest.mark.slow
@pytest.mark.parametrize("nf", range(11))
@pytest.mark.parametrize("rule", ["zero", "steady", "estimated"])
def test_all_maps_orders_delays_and_rules(nf, rule, tmp_path):
    for place, kind in enumerate(KINDS):
        kinds = (kind, KINDS[(place + 1 + nf) % len(KINDS)])
        nb, nk = 1 + (nf + place) % 10, (nf + place) % 6
        model = example_model(place, kinds=kinds, nb=nb, nf=nf, nk=nk, rule=rule)
        check(tmp_path / kind, model, nf)


def test_the_program_of_the_document_predicts(tmp_path):
    text = DOCUMENT.read_text()
    (main,) = re.findall(r"```c\n(#include <stdio.h>.*?)```", text, re.DOTALL)
    (build,) = re.findall(r"^cc .*main\.c.*$", text, re.MULTILINE)
    exported, u = exported_of(example_model(5, nb=3, nf=4, nk=1)), example_input(5)
    (tmp_path / "main.c").write_text(main)
    (tmp_path / "step_06_3_7.c").write_text(c_source(exported))
    subprocess.run(shlex.split(build), cwd=tmp_path, check=True)
    done = subprocess.run(
        [str(tmp_path / "predict")],
        input="\n".join(map(repr, u.tolist())),
        capture_output=True,
        text=True,
        check=True,
    )
    found = np.array(done.stdout.split(), dtype=float)

    assert deviation(found, predict(exported, u)) <= PROMISED


def test_names_cannot_break_the_source(tmp_path):
    name = 'a*/ b\\\n"??/'
    exported = exported_of(
        example_model(1), name=f"{name}/3/7", input_unit="*/", output_unit="µm"
    )

    assert c_source(exported).isascii()
    assert c_output(c_program(tmp_path, exported), [1.0]).size == 1


def test_a_kind_without_text_in_a_language_is_refused():
    with pytest.raises(ConfigError) as error:
        language_text("input", MAPS["dead_zone"], "C", None)
    assert str(error.value) == (
        "--format: the input map is of the kind dead_zone, which C does not know; "
        "expected another kind of map; use --format json"
    )


def test_a_python_function_is_refused():
    own = StaticMap("own_function", np.zeros(1), function=OwnFunction("mine", ""))
    model = example_model(1)
    model = type(model)(**{**vars(model), "output_map": own})

    with pytest.raises(ConfigError, match=r"output map is the Python function 'mine'"):
        c_source(exported_of(model))
