"""Configurations that cannot be used, and what must be said of each."""

import os

from tests.bad_input.trial import CONFIG, Case, csv_text

_FILE = "config.yaml"
_LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{chr(98 + n)}: &{chr(98 + n)} [{', '.join([f'*{chr(97 + n)}'] * 9)}]\n"
    for n in range(9)
)
_MERGES = "m0: &m0 {a: 1, b: 2}\n" + "".join(
    f"m{n + 1}: &m{n + 1} {{<<: [*m{n}, *m{n}, *m{n}]}}\n" for n in range(14)
)


def text(content):
    """Put other bytes into the configuration."""
    content = content if isinstance(content, bytes) else content.encode()
    return lambda folder: (folder / _FILE).write_bytes(content)


def more(section):
    """Add a section."""
    return text(f"{CONFIG}{section}\n")


def key(old, new):
    """Put something else in place of a part."""
    assert old in CONFIG
    return text(CONFIG.replace(old, new))


def _instead(make):
    def spoil(folder):
        (folder / _FILE).unlink()
        make(folder / _FILE)

    return spoil


def _case(name, make, *says):
    return Case(name, make, (_FILE, *says))


SYNTAX = [
    _case(
        "tabs",
        text("name: tiny\nrecordings:\n\tfiles: x\n"),
        "line 3",
        "replace the tabs",
    ),
    _case(
        "a key twice", more("name: again"), "line 6", "twice, first in line 1", "keep"
    ),
    _case(
        "billion laughs", text(_LAUGHS + CONFIG), "stands for more than 100000 values"
    ),
    _case("merged bomb", text(_MERGES + CONFIG), "stands for more than 100000 values"),
    _case("anchor in itself", more("calibrate: &a {step: *a}"), "holds itself"),
    _case("unknown alias", more("fit: *nope"), "undefined alias 'nope'"),
    _case("deep lists", text("name: " + "[" * 1000 + "]" * 1000), "nested too deeply"),
    _case(
        "no closing brace", text(CONFIG.replace("y}", "y")), "line 5", "expected valid"
    ),
    _case("two documents", text(f"{CONFIG}---\n{CONFIG}"), "single document"),
    _case("a table of measurements", text("t;u;y\n0;1;2\n"), "holds text", "hwid init"),
    _case("a list", text("- a\n- b\n"), "holds a list", "expected sections"),
    _case("nothing", text(""), "holds nothing", "expected sections"),
    _case("Python object", more("fit: !!python/object/apply:os.system [id]"), "tag"),
    _case("no such date", more("fit: {units: 2001-99-99}"), "line 6", "month must be"),
    _case("no float", more("fit: {units: !!float abc}"), "line 6", "'abc'", "quotes"),
    _case("no integer", more("fit: {units: !!int ''}"), "line 6", "cannot be read"),
    _case(
        "5000 digits", more(f"fit: {{units: {'9' * 5000}}}"), "line 6", "4300 digits"
    ),
    _case("list as a key", more("? [1, 2]\n: 3"), "unhashable key"),
    _case("null byte", text(CONFIG.encode() + b"a: \0\n"), "#x0000"),
    _case("escape sequence", text(CONFIG.encode() + b"a: \x1b[2J\n"), "#x001b"),
    _case("Latin-1", text("name: kräft\n".encode("latin-1")), "UTF-8", "0xe4"),
    _case("UTF-16", text(CONFIG.encode("utf-16")), "UTF-8", "0xff"),
    _case("300 kB", text("#" * 300_000 + f"\n{CONFIG}"), "larger than 256 kB"),
    _case("folder", _instead(lambda path: path.mkdir()), "is a folder"),
    _case("missing", _instead(lambda path: None), "no such file", "check the path"),
    _case("link to itself", _instead(lambda path: path.symlink_to(_FILE)), "Too many"),
    _case("pipe", _instead(os.mkfifo), "no plain file"),
    _case("/dev/zero", _instead(lambda path: path.symlink_to("/dev/zero")), "no plain"),
]
VALUES = [
    _case("unknown section", more("orderz: {}"), "orderz", "mean 'order' or 'orders'?"),
    _case("unknown key", key("nb:", "nbb:"), "orders.nbb", "did you mean 'nb'?"),
    _case("control key", more('"\\e[31mfit": 3'), "\\x1b[31mfit: unknown key"),
    _case("number as a key", more("5: 3"), "5: unknown key"),
    _case(
        "missing key", key("files: run.csv\n  ", ""), "recordings.files", "add the key"
    ),
    _case(
        "text as a number", more("fit: {units: ten}"), "fit.units", "'ten'", "integer"
    ),
    _case("half a unit", more("fit: {units: 2.5}"), "fit.units", "2.5", "an integer"),
    _case("nan units", more("fit: {units: .nan}"), "fit.units", "nan", "an integer"),
    _case(
        "infinite", more("crossval: {threshold: .inf}"), "crossval.threshold", "finite"
    ),
    _case("no value", more("fit: {units: }"), "fit.units", "no value", "an integer"),
    _case("10^9 units", more("fit: {units: 1000000000}"), "fit.units", "at most 1000"),
    _case(
        "10^400 units", more(f"fit: {{units: 1{'0' * 400}}}"), "fit.units", "integer"
    ),
    _case(
        "10^25 seed", more(f"simulate: {{kind: gun, seed: 1{'0' * 25}}}"), "18 digits"
    ),
    _case(
        "10^9 starts", more("fit: {starts: 1000000000}"), "fit.starts", "at most 1000"
    ),
    _case("10^9 delays", more("fit: {delays: [1000000000]}"), "fit.delays", "at most"),
    Case("long delay", more("fit: {delays: [1, 90]}"), ("run.csv", "a delay of 90")),
    _case("degree", more("fit: {degree: 1000000000}"), "fit.degree", "at most 100"),
    _case(
        "block", key("y}", "y}\n  average: 100000000000"), "recordings.average", "most"
    ),
    _case(
        "negative order", key("nb: [1, 2]", "nb: [-1, 2]"), "orders.nb", "-1", ">= 1"
    ),
    _case(
        "10^9 orders", key("nb: [1, 2]", "nb: [1, 1000000000]"), "orders.nb", "<= 1000"
    ),
    _case(
        "10^5 pairs of orders",
        key("nb: [1, 2], nk: [1, 2]", "nb: [1, 300], nk: [1, 400]"),
        "orders",
        "120000 pairs",
        "at most 2500",
    ),
    _case("orders back", key("nb: [1, 2]", "nb: [2, 1]"), "[2, 1]", "write [1, 2]"),
    _case("no orders", key("nb: [1, 2]", "nb: []"), "orders.nb", "at least one order"),
    _case("an order twice", key("nb: [1, 2]", "nb: [1, 2, 2]"), "2 is listed twice"),
    _case("role", key("nk: [1", "nk_role: pole, nk: [1"), "orders.nk_role", "'poles'"),
    _case("name with ..", key("name: tiny", "name: ../../x"), ": name", "'../../x'"),
    _case("absolute name", key("name: tiny", "name: /etc"), ": name", "'/etc'"),
    _case("name of dots", key("name: tiny", "name: '..'"), ": name", "'..'"),
    _case("long name", key("name: tiny", f"name: {'x' * 250}"), ": name", "200 bytes"),
    _case("name, null", key("name: tiny", 'name: "a\\0b"'), ": name", "'a\\x00b'"),
    _case("name, escape", key("name: tiny", 'name: "a\\e[2Jb"'), ": name", "control"),
    _case("name, turned", key("name: tiny", 'name: "a\\u202Eb"'), ": name", "control"),
    _case(
        "long text", key("y}", f'y}}\n  input_unit: "{"u" * 9999}"'), "9999 characters"
    ),
    _case(
        "surrogate", key("y}", 'y}\n  input_unit: "\\ud800"'), "input_unit", "control"
    ),
    _case(
        "no file", key("run.csv", "nothing.csv"), "recordings.files", "'nothing.csv'"
    ),
    _case(
        "long path", key("run.csv", "x" * 3000), "recordings.files", "no file matches"
    ),
    _case("variable", key("run.csv", "${NOPE_X}/a.csv"), "NOPE_X", "not set"),
    _case("column < 0", key("input: u", "input: -1"), "columns.input", "-1", ">= 0"),
    _case(
        "one column", key("input: u", "input: y"), "columns.output", "another column"
    ),
    _case("no clock", key("time: t, ", ""), "sample_time_s: missing", "name the time"),
    _case("scale 0", key("y}", "y}\n  input_scale: 0"), "input_scale", "other than 0"),
    _case("part", key("y}", "y}\n  parts: {'../a': [0, 70]}"), "parts.../a", "name of"),
    _case(
        "formula", key("y}", "y}\n  parts: {'=1+1': [0, 70]}"), "parts.=1+1", "name of"
    ),
    _case(
        "part of one", key("y}", "y}\n  parts: {a: [5]}"), "parts.a", "[5]", "[first,"
    ),
    _case("kind", key("y}", 'y}\n  kind: {stepp: "a*"}'), "recordings.kind", "'step'"),
    _case(
        "recipe", more("calibrate: {other: [cutt]}"), "calibrate.other", "mean 'cut'?"
    ),
    _case(
        "recording", more("identify: {recordings: [rum]}"), "identify", "mean 'run'?"
    ),
    _case(
        "leak",
        more("identify: {recordings: [run]}\ntest: {recordings: [run]}"),
        *("test.recordings", "'run' identifies too", "take it out"),
    ),
    _case("two rules", more("group: {keep: {best: true, top: 1}}"), "exactly one of"),
    _case(
        "huge rule", more(f"group: {{keep: {{top: 1{'0' * 400}}}}}"), "group.keep.top"
    ),
    _case("mass 0", more("simulation: {kind: drive, mass_kg: 0}"), "mass_kg", "> 0"),
    _case(
        "effect",
        more("simulation: {kind: drive, effects: {coulomb: {force_N: 1}}}"),
        *("simulation.effects", "did you mean 'coulomb_friction'?"),
    ),
    _case(
        "own file",
        more("fit: {input_map: {file: no.py, name: f}}"),
        "no.py'",
        "No such",
    ),
    _case(
        "own /dev/zero", more("fit: {input_map: {file: /dev/zero, name: f}}"), "plain"
    ),
    _case(
        "own function that raises",
        lambda folder: (
            (folder / "m.py").write_text("f = 1 / 0\n"),
            more("fit: {input_map: {file: m.py, name: f}}")(folder),
        ),
        *("fit.input_map", "ZeroDivisionError"),
    ),
    _case(
        "10^12 samples",
        more("simulate: {kind: gun, plan: {samples: 1000000000000}}"),
        *("simulate.plan.samples", "at most 10000000"),
    ),
]
# What looks odd and is good.
GOOD = {
    "byte order mark": text(b"\xef\xbb\xbf" + CONFIG.encode()),
    "CRLF": text(CONFIG.replace("\n", "\r\n")),
    "exponent without a point": more("crossval: {threshold: 1e-3}"),
    "names that differ in case": lambda folder: (
        (folder / "RUN.csv").write_text(csv_text()),
        key("run.csv", "'*.csv'")(folder),
    ),
}
CASES = [*SYNTAX, *VALUES]
