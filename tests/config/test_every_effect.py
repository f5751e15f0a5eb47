"""Each effect of the catalogue as a user states it: with what it needs and no more."""

import pytest

from hwid_cli.config.load import load_experiment
from hwid_cli.drive.catalogue import CATALOGUE, entry_of, public_id
from hwid_cli.errors import ConfigError

SIMULATION = """\
name: x
recordings: {{files: r.csv, columns: {{input: u, output: y}}, sample_time_s: 0.001}}
simulation:
  mass_kg: 1.0
  damping_N_s_per_m: 2.0
  stiffness_N_per_m: 300.0
  force_constant_N_per_A: 3.0{more}
  effects:
    {name}: {{{values}}}
"""
ENTRIES = sorted(one.id for one in CATALOGUE.values() if not one.beside)


def _value(one):
    if one.words:
        return one.words[0]
    values = (0.1, 0.5, 1.5, 3.0, -0.5)
    return next(
        value for value in values if all(limit.holds(value) for limit in one.limits)
    )


def _configured(tmp_path, name, values):
    text = ", ".join(f"{key}: {value}" for key, value in values.items())
    path = tmp_path / "experiment.yaml"
    # A winding needs a voltage as the input.
    more = "\n  resistance_ohm: 1.0" if name == "winding_inductance" else ""
    path.write_text(SIMULATION.format(name=name, values=text, more=more))
    return load_experiment(path)


@pytest.mark.parametrize("identifier", ENTRIES)
def test_what_an_entry_needs_is_enough(tmp_path, identifier):
    entry = CATALOGUE[identifier]
    values = {one.name: _value(one) for one in entry.stated_keys() if one.is_needed}
    values |= entry.words
    name = public_id(identifier)
    experiment = _configured(tmp_path, name, values)
    (found,) = experiment.simulation.effects.values()
    assert dict(found) == values
    assert public_id(entry_of(name, values).id) == name


def test_a_shape_of_a_law_that_is_begun_is_asked_for_whole(tmp_path):
    bent = {"force_N": 1.0, "yield_m": 1e-4, "static_excess_N": 0.5}
    with pytest.raises(ConfigError, match=r"hysteresis\.velocity_m_per_s: missing"):
        _configured(tmp_path, "hysteresis", bent)
