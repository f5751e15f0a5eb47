"""Licences of what is installed with the program: listed, and none that binds its users."""

import importlib.util
import re
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
ALLOWED = re.compile(
    r"\b(MIT|0?BSD|Apache|PSF|Python Software Foundation|ISC|Zlib|HPND|CC0)", re.I
)
# Readers of the extra `formats`, used unchanged as libraries.
COPYLEFT_OF_FORMATS = {"asammdf", "nptdms"}
REFUSED = re.compile(r"GPL|AGPL|SSPL|Proprietary|Commons Clause|Business Source", re.I)


@pytest.fixture(scope="module")
def licences():
    place = PROJECT / "tools" / "licences.py"
    spec = importlib.util.spec_from_file_location("licences", place)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def is_allowed(name, part, licence):
    if name in COPYLEFT_OF_FORMATS:
        return part == "formats" and re.search("LGPL|Lesser", licence) is not None
    return bool(ALLOWED.search(licence)) and not REFUSED.search(licence)


@pytest.mark.thorough
def test_every_package_has_a_licence_that_is_allowed(licences):
    needed = licences.needed()
    assert {"numpy", "scipy", "numba", "h5py", "click"} <= needed.keys()

    refused = {
        name: licences.licence_of(name)
        for name, part in needed.items()
        if not is_allowed(name, part, licences.licence_of(name))
    }
    assert refused == {}


def test_every_package_is_listed(licences):
    text = (PROJECT / "docs" / "licences.md").read_text()
    listed = set(re.findall(r"^\| ([a-z0-9-]+) \|", text, re.M))

    assert set(licences.needed()) - listed == set()


@pytest.mark.parametrize(
    "licence", ["GPL-3.0-only", "", "Proprietary", "GNU Affero General Public License"]
)
def test_the_rules_see_what_they_refuse(licence):
    assert not is_allowed("numpy", "hwid", licence)
    assert not is_allowed("asammdf", "hwid", "LGPLv3+")
