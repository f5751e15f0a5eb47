"""Whether two states of the program give the same numbers, bit by bit.

``python tools/golden.py record TREE FILE [PART ...]`` runs the program of a checkout on
the examples below and writes a digest of all that it leaves: every value and path in the
HDF5 files and in the cache, with the keys of the cache, every value of the JSON files,
the CSV files and the names of figures. ``python tools/golden.py compare OLD NEW`` lists
what differs (exit code 1). ``make golden BASE=COMMIT`` does both for a commit and the
working tree. Last digits depend on the processor, so no digest is kept.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

# Differ from run to run, or tell which program it was.
VOLATILE = {"seconds", "created_by", "versions", "package_version"}
# Places in the file, which HDF5 chooses.
POINTERS = {"DIMENSION_LIST", "REFERENCE_LIST"}
# Example, and the commands that run it.
PARTS = {
    "smoke": ("run configs/smoke.yaml",),
    "demo": (
        "run configs/demo.yaml",
        "export configs/demo.yaml --model step_08/4/2",
    ),
    "hsm150": ("run configs/hsm150.yaml",),
    "diagnose_demo": ("diagnose configs/diagnose_demo.yaml",),
    "diagnose_emps": ("diagnose configs/diagnose_emps.yaml",),
    "diagnose_ffwheel": ("diagnose configs/diagnose_ffwheel.yaml",),
    "diagnose_silverbox": ("diagnose configs/diagnose_silverbox.yaml",),
    "diagnose_hsm150": ("diagnose configs/diagnose_hsm150.yaml",),
    "model1": ("run configs/model1.yaml",),
}
# Blind cases: the first of every so many of each suite.
BLIND, CASES_OF_A_SUITE = "blind", 4


def short_hash(content: bytes) -> str:
    """Enough of a SHA-256 to tell two contents apart."""
    return hashlib.sha256(content).hexdigest()[:16]


def values_of_hdf5(path: Path) -> Iterator[tuple[str, str]]:
    """Path and digest of every attribute and data set of a file."""
    found: list[tuple[str, str]] = []

    def look_at(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if VOLATILE & set(name.split("/")):
            return
        for key in sorted(set(item.attrs) - VOLATILE - POINTERS):
            found.append((f"{name}@{key}", repr(np.asarray(item.attrs[key]).tolist())))
        if isinstance(item, h5py.Dataset):
            is_text = item.dtype.kind == "O"
            values = np.asarray(item.asstr()[()] if is_text else item[()])
            content = repr(values.tolist()).encode() if is_text else values.tobytes()
            found.append((name, f"{item.dtype}{item.shape}{short_hash(content)}"))
        else:
            found.append((f"{name}/", ""))

    with h5py.File(path) as file:
        look_at("", file)
        file.visititems(look_at)
    yield from found


def values_of_json(value: object, place: str = "") -> Iterator[tuple[str, str]]:
    """Place and value of everything in plain data."""
    if isinstance(value, dict):
        for key in value.keys() - VOLATILE:
            yield from values_of_json(value[key], f"{place}.{key}")
    elif isinstance(value, list):
        for number, one in enumerate(value):
            yield from values_of_json(one, f"{place}[{number}]")
    else:
        yield place, repr(value)


def digest(folder: Path) -> dict[str, str]:
    """What a run has left, by file and place."""
    found: dict[str, str] = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.suffix == ".h5":
            found |= {f"{name}:{place}": text for place, text in values_of_hdf5(path)}
        elif path.suffix == ".json":
            content = json.loads(path.read_text())
            found |= {f"{name}:{key}": text for key, text in values_of_json(content)}
        elif path.suffix in (".csv", ".yaml"):
            found[name] = short_hash(path.read_bytes())
        elif path.suffix == ".png":
            found[name] = "figure"
    return found


def record(tree: Path, target: Path, parts: list[str]) -> None:
    """Run the examples with the program of a checkout, and write their digests."""
    result = json.loads(target.read_text()) if target.is_file() else {}
    environment = {**os.environ, "PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as work:
        for name in parts or [*PARTS, BLIND]:
            out = Path(work) / name
            lines = [[sys.executable, "-c", _BLIND_CASES, str(out)]]
            if name != BLIND:
                program = [sys.executable, "-m", "hwid_cli"]
                lines = [
                    [*program, *one.split(), "--out", str(out)] for one in PARTS[name]
                ]
            for line in lines:
                subprocess.run(
                    line,
                    cwd=tree,
                    env=environment,
                    check=True,
                    stdout=subprocess.DEVNULL,
                )
            result[name] = digest(out / "diagnoses" if name == BLIND else out)
            target.write_text(json.dumps(result, indent=0))
            print(f"{name}: {len(result[name])} values")


_BLIND_CASES = f"""
import sys
from tests.blind.cases import SUITES, cases_of
from tests.blind.run_blind import run_case
for suite in SUITES:
    cases = cases_of(suite, "development", 1)
    step = max(1, len(cases) // {CASES_OF_A_SUITE})
    for case in cases[::step][:{CASES_OF_A_SUITE}]:
        run_case(case, sys.argv[1])
"""


def compare(old: Path, new: Path, most: int = 20) -> bool:
    """Print what differs between two records, and say whether nothing does."""
    before, after = json.loads(old.read_text()), json.loads(new.read_text())
    is_same = True
    for part in sorted(before.keys() & after.keys()):
        places = sorted(before[part].keys() | after[part].keys())
        other = [one for one in places if before[part].get(one) != after[part].get(one)]
        print(f"{part}: {len(other)} of {len(places)} values differ")
        for place in other[:most]:
            print(f"  {place}: {before[part].get(place)} -> {after[part].get(place)}")
        is_same = is_same and not other
    return is_same


def main() -> int:
    """Do what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("record")
    one.add_argument("tree", type=Path)
    one.add_argument("file", type=Path)
    one.add_argument("parts", nargs="*", metavar="PART")
    two = commands.add_parser("compare")
    two.add_argument("old", type=Path)
    two.add_argument("new", type=Path)
    given = parser.parse_args()
    if given.command == "record":
        record(given.tree.resolve(), given.file, given.parts)
        return 0
    return 0 if compare(given.old, given.new) else 1


if __name__ == "__main__":
    sys.exit(main())
