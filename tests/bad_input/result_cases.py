"""Damaged results and cache entries, and what must be said of each."""

import os

import h5py
import numpy as np

from hwid_cli.files.checksums import with_checksum
from tests.bad_input.trial import Case


def _flipped(name, share):
    def spoil(folder):
        path = folder / "out" / name
        content = bytearray(path.read_bytes())
        content[int(len(content) * share)] ^= 1
        path.write_bytes(content)

    return spoil


def _bytes(name, content):
    return lambda folder: (folder / "out" / name).write_bytes(content)


def _edited(name, change):
    """What another version of this program would write, checksum and all."""

    def spoil(folder):
        path = folder / "out" / name
        with h5py.File(path, "a") as file:
            change(file)
        path.write_bytes(with_checksum(path.read_bytes()))

    return spoil


def _pipe(name):
    def spoil(folder):
        path = folder / "out" / name
        path.unlink()
        os.mkfifo(path)

    return spoil


def _folder(name):
    def spoil(folder):
        path = folder / "out" / name
        path.unlink()
        path.mkdir()

    return spoil


def _put(place, **options):
    """Another data set in place of one."""

    def change(file):
        del file[place]
        file.create_dataset(place, **options)

    return change


def _without(place):
    return lambda file: file.__delitem__(place)


def _attribute(name, value):
    return lambda file: file.attrs.__setitem__(name, value)


def _case(name, spoil, *says, command="report"):
    return Case(name, spoil, says, command)


def _file_as_figures(folder):
    for path in sorted((folder / "out" / "figures").rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    (folder / "out" / "figures").rmdir()
    (folder / "out" / "figures").write_text("no folder")


def _page_as_folder(folder):
    (folder / "out" / "report.html").mkdir()


_AWAY = "move the file away and run 'hwid"
_INPUT = "recordings/step_02/input"
CASES = []
for _name in ("calibrated.h5", "results.h5"):
    CASES += [
        _case(f"{_name}: bit", _flipped(_name, 0.5), _name, "checksum", _AWAY),
        _case(
            f"{_name}: first bytes", _flipped(_name, 0.001), _name, "checksum", _AWAY
        ),
        _case(f"{_name}: empty", _bytes(_name, b""), _name, "signature", _AWAY),
        _case(
            f"{_name}: text", _bytes(_name, b"hello" * 99), _name, "signature", _AWAY
        ),
        _case(f"{_name}: pipe", _pipe(_name), _name, "no such file", "run 'hwid"),
        _case(f"{_name}: folder", _folder(_name), _name, "no such file", "run 'hwid"),
        _case(
            f"{_name}: of a later version",
            _edited(_name, _attribute("schema_version", 99)),
            *(_name, "version 99", _AWAY),
        ),
        _case(
            f"{_name}: of another program",
            _edited(_name, _attribute("format", "other")),
            *(_name, "holds other version 1", _AWAY),
        ),
    ]
CASES += [
    _case(
        "calibrated.h5: no names",
        _edited("calibrated.h5", _without("names")),
        *("calibrated.h5", "'names' doesn't exist", _AWAY),
    ),
    _case(
        "calibrated.h5: names that climb",
        _edited("calibrated.h5", _put("names", data=["../../etc"])),
        *("calibrated.h5", "cannot be read", _AWAY),
    ),
    _case(
        "calibrated.h5: NaN",
        _edited(
            "calibrated.h5", lambda file: file[_INPUT].__setitem__(5, float("nan"))
        ),
        *("calibrated.h5", "not finite", _AWAY),
    ),
    _case(
        "calibrated.h5: bomb",
        _edited(
            "calibrated.h5",
            _put(_INPUT, shape=(10**9,), dtype="f8", chunks=(2**20,), compression=9),
        ),
        *("calibrated.h5", "unpacks to more than 512 MB", _AWAY),
    ),
    _case(
        "results.h5: no tensor",
        _edited("results.h5", _without("crossval/rmsd")),
        *("results.h5", "'rmsd' doesn't exist", "hwid crossval"),
    ),
    _case(
        "results.h5: another shape",
        _edited("results.h5", _put("crossval/rmsd", data=[1.0])),
        *("results.h5", "must have shape", "hwid crossval"),
    ),
    _case(
        "results.h5: axes of other orders",
        _edited("results.h5", _put("crossval/nk", data=[7])),
        *("results.h5: crossval: has no place for the model step_02/1/1", "--force"),
    ),
    _case(
        "results.h5: no fits",
        _edited("results.h5", _without("identify/fit")),
        *("results.h5", "'fit' doesn't exist", "hwid identify"),
    ),
    _case(
        "results.h5: a number as a stage",
        _edited("results.h5", _put("crossval", data=1)),
        *("results.h5", "cannot be read", "hwid crossval"),
    ),
    _case(
        "results.h5: a list as configuration",
        _edited("results.h5", _put("crossval/provenance/config", data="[1]")),
        *("results.h5", "the configuration is a list", _AWAY),
    ),
]


def _number(place, value):
    """Another first number in a data set."""

    def change(file):
        values = file[place][()]
        values.flat[0] = value
        file[place][...] = values

    return change


def _resized(place, change):
    """Another data set in the place of one, made of it."""

    def spoil(file):
        values = file[place][()]
        _put(place, data=change(values))(file)

    return spoil


def _attribute_of(place, name, value):
    return lambda file: file[place].attrs.modify(name, value)


_MODEL = "identify/fit/model"
_MAP = f"{_MODEL}/input_map"
# Place, what is planted there, and what must be said of the place, value and expectation.
for _place, _change, *_says in (
    (
        f"{_MODEL}/sample_time_s",
        -1.0,
        f"/{_MODEL}, row 0",
        "got -1.0",
        "1e-12 to 1e+09",
    ),
    (f"{_MODEL}/sample_time_s", float("nan"), "sample_time_s", "got nan"),
    (f"{_MODEL}/numerator", 1e308, "numerator", "got 1e+308", "up to 1e+130"),
    (f"{_MODEL}/free_response", float("inf"), "free_response", "got inf"),
    (f"{_MODEL}/denominator", 2.0, f"/{_MODEL}, row 0: denominator must start with 1"),
    ("identify/fit/orders/nf", 9, "name: 'step_02/1/1' is a fit of 'step_02/1/9'"),
    (f"{_MODEL}/delay", -1, "nk must be an integer >= 0, got -1"),
    (f"{_MAP}/parameters", -1e308, f"/{_MAP}, row 0: parameters", "got -1e+308"),
    (f"{_MAP}/parameters", 1e9, f"/{_MAP}, row 0: parameters", "the first", "rise"),
    (f"{_MAP}/domain", 1e9, "domain", "the lower one first", "1000000000.0"),
    (f"{_MAP}/extrapolation/values", 1e308, "extrapolation", "got 1e+308"),
):
    CASES.append(
        _case(
            f"results.h5: {_change:g} in {_place}",
            _edited("results.h5", _number(_place, _change)),
            *("results.h5", *_says, f"{_AWAY} identify' again"),
        )
    )
CASES += [
    _case(
        "results.h5: a map of three numbers",
        _edited("results.h5", _resized(f"{_MAP}/parameters", lambda one: one[:, :3])),
        *("results.h5", f"/{_MAP}, row 0: parameters", "3 numbers", _AWAY),
    ),
    _case(
        "results.h5: a start of other orders",
        _edited(
            "results.h5",
            _resized(f"{_MODEL}/free_response", lambda one: np.tile(one, (1, 3))),
        ),
        *("results.h5", f"/{_MODEL}, row 0: free_response", "or none", _AWAY),
    ),
    _case(
        "calibrated.h5: more samples than a file holds",
        _edited("calibrated.h5", _attribute_of("logs/step_02", "n_raw_input", 2**62)),
        *("calibrated.h5", "/logs/step_02: n_raw_input", f"got {2**62}", _AWAY),
    ),
    *(
        _case(
            f"calibrated.h5: another name in {part}",
            _edited(
                "calibrated.h5", _attribute_of(f"{part}/step_02", "name", "nobody")
            ),
            *("calibrated.h5", "step_02: is named 'nobody' inside", _AWAY),
        )
        for part in ("recordings", "logs")
    ),
    _case(
        "calibrated.h5: 1e308",
        _edited("calibrated.h5", _number(_INPUT, 1e308)),
        *("calibrated.h5", "/recordings/step_02: input", "got 1e+308", _AWAY),
    ),
]
for _what, _text, _says in (
    ("no JSON", b"{", "Expecting property name"),
    ("a list", b"[]", "holds a list"),
    ("no UTF-8", b"\xff\xfe", "0xff"),
    ("deep", b"[" * 100_000, "recursion"),
    ("a number as a gap", b'{"gap": {"before": 3}}', "gap.before: found 3"),
    ("a number as effects", b'{"effects": 3}', "effects: found 3"),
    ("a number as an effect", b'{"effects": [3]}', "effects.0: found 3"),
    ("a number as ids", b'{"ambiguous_with": [3]}', "ambiguous_with: found 3"),
    ("figures elsewhere", b'{"figures": ["../x"]}', "figures: found '../x'"),
):
    CASES.append(
        _case(
            f"diagnosis.json: {_what}",
            _bytes("diagnosis.json", _text),
            *("diagnosis.json", _says, "run 'hwid diagnose' again"),
        )
    )
CASES += [
    _case("figures: a file", _file_as_figures, "figures", "Not a directory", "--out"),
    _case("report.html: folder", _page_as_folder, "report.html", "Is a directory"),
    _case(
        "crossval.csv: folder",
        _folder("crossval.csv"),
        *("crossval.csv", "Is a directory", "--out"),
        command="crossval",
    ),
]
