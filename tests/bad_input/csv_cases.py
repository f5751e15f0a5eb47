"""CSV files and names of files that cannot be used, and what must be said of each."""

import os

from tests.bad_input.trial import Case, csv_text, signals

_FILE = "run.csv"
_TIME, _INPUT, _OUTPUT = signals()


def text(content):
    """Put other bytes into the measurement."""
    content = content if isinstance(content, bytes) else content.encode()
    return lambda folder: (folder / _FILE).write_bytes(content)


def row(number, cells):
    """Another row; the header is row 1."""
    lines = csv_text().splitlines()
    lines[number - 1] = cells
    return text("\n".join(lines) + "\n")


def columns(time=_TIME, current=_INPUT, output=_OUTPUT):
    return text(csv_text((time, current, output)))


def config(folder, old, new):
    path = folder / "config.yaml"
    content = path.read_text()
    assert old in content
    path.write_text(content.replace(old, new))


def _instead(make):
    def spoil(folder):
        (folder / _FILE).unlink()
        make(folder / _FILE)

    return spoil


def named(name, pattern="'*.csv'"):
    """Give the measurement another name."""

    def spoil(folder):
        (folder / _FILE).rename(folder / name)
        config(folder, _FILE, pattern)

    return spoil


def _case(name, make, *says):
    return Case(f"csv: {name}", make, (_FILE, *says))


def _name(name, make, *says):
    return Case(f"name: {name}", make, ("gives the recording name", *says, "rename"))


CONTENTS = [
    _case("empty", text(""), "is empty", "export it again"),
    _case("blank lines", text("\n\n\n"), "holds no rows", "export"),
    _case("header only", text("t,u,y\n"), "a header and no rows", "export"),
    _case("one sample", text("t,u,y\n0,1,2\n"), "has 1 rows", "expected a whole"),
    _case("two samples", text("t,u,y\n0,1,2\n1,2,3\n"), "2 samples", "more than 54"),
    _case("zip", text(b"PK\x03\x04" + b"\0" * 100), "row 1", "no column 'u'"),
    _case("null byte", row(5, "0.03,\0001,1"), "row 5", "'\\x001'", "a finite number"),
    _case(
        "text", row(5, "0.03,abc,1"), "row 5", "input 'u' is 'abc'", "correct the row"
    ),
    _case("NaN at the begin", row(2, "0,nan,1"), "row 2", "nan", "a finite number"),
    _case("infinite", row(5, "0.03,1,inf"), "row 5", "output 'y' is inf", "finite"),
    _case("1e400", row(5, "0.03,1e400,1"), "row 5", "infinite", "correct the row"),
    _case(
        "blank cells",
        row(5, "0.03,,1\n0.04,,1"),
        "row 5",
        "input 'u' is empty",
        "2 rows",
    ),
    _case("too many cells", row(5, "0.03,1,2,3"), "row 5", "4 cells", "expected 3"),
    # The last number of a row that ends early may be torn, too.
    _case("too few cells", row(2, "0,1"), "row 2", "input 'u' is empty"),
    _case("1_000", row(5, "0.03,1_000,1"), "row 5", "'1_000'", "a finite number"),
    _case("hexadecimal", row(5, "0.03,0x1F,1"), "row 5", "'0x1F'"),
    _case("formula", row(5, "0.03,=1+1,1"), "row 5", "'=1+1'", "not a number"),
    _case("escape sequence", row(5, "0.03,\x1b[2J,1"), "row 5", "'\\x1b[2J'"),
    _case("huge cell", row(5, f"0.03,{'9' * 200_000},1"), "row 5", "field limit"),
    _case("open quote", row(5, '0.03,"1,1'), "row 81", "not a number"),
    _case("time back", row(5, "0.001,1,1"), "row 5", "from 0.02 s to 0.001 s", "sort"),
    _case("time repeated", row(5, "0.02,1,1"), "row 5", "0.02 s is repeated", "remove"),
    _case("time jumps", row(5, "0.035,1,1"), "row 5", "steps by 0.015 s", "resample"),
    _case("time stands", columns(time=_TIME * 0), "row 3", "repeated", "later time"),
    _case("1e306 s", columns(time=_TIME * 1e306), "1e+304 s", "time in seconds"),
    _case("1e-310 s", columns(time=_TIME * 1e-310), "1e-312 s", "time in seconds"),
    _case(
        "constant input", columns(current=_INPUT * 0), "is 0 in all 80 rows", "changes"
    ),
    _case("constant output", columns(output=_OUTPUT * 0 + 3), "is 3 in all", "changes"),
    _case("subnormal", columns(current=_INPUT * 1e-320), "spans 2e-320", "input_scale"),
    _case("1e-300", columns(output=_OUTPUT * 1e-300), "spans 2e-300", "output_scale"),
    _case("1e300", columns(output=_OUTPUT * 1e300), "reaches 1e+300", "output_scale"),
    _case(
        "wrong name", text(csv_text(header="t,i,y")), "no column 'u'", "one of t, i, y"
    ),
    _case("near name", text(csv_text(header="t,U,y")), "no column 'u'", "mean 'U'?"),
    _case("column twice", text(csv_text(header="u,u,y")), "occurs 2 times", "rename"),
    _case("no header", text(csv_text().split("\n", 1)[1]), "row 1", "no column 'u'"),
    _case(
        "UTF-16, cut", text(csv_text().encode("utf-16")[:-5]), "output 'y'", "finite"
    ),
    _case(
        "decimal commas", text(csv_text().replace(".", ",")), "6 cells", "semicolons"
    ),
    _case(
        "mixed decimals",
        text(csv_text().replace(",", ";").replace(".", ",", 3)),
        *("row 3", "the other decimal mark", "throughout"),
    ),
]
PLACES = [
    _case("folder", _instead(lambda path: path.mkdir()), "no file matches"),
    _case("link to itself", _instead(lambda path: path.symlink_to(_FILE)), "no file"),
    _case("dangling link", _instead(lambda path: path.symlink_to("no")), "no file"),
    _case("pipe", _instead(os.mkfifo), "no file matches", "put the files there"),
    _case("/dev/zero", _instead(lambda path: path.symlink_to("/dev/zero")), "no file"),
    Case(
        "ending", named("run.docx", "run.docx"), ("run.docx", "one of .csv", "convert")
    ),
    Case(
        "plan: kind",
        lambda folder: (folder / "plan.csv").write_text("name,kind\nrun,stepp\n"),
        ("plan.csv, row 2", "'stepp'", "did you mean 'step'?"),
    ),
    Case(
        "plan: huge cell",
        lambda folder: (folder / "plan.csv").write_text(
            f"name,kind\nrun,{'x' * 140_000}\n"
        ),
        ("plan.csv", "field limit", "mend the file"),
    ),
    Case(
        "plan: large",
        lambda folder: (folder / "plan.csv").write_text("name,kind\n" * 40_000),
        ("plan.csv", "larger than 256 kB", "mend the file"),
    ),
]
NAMES = [
    _name("escape", named("a\x1b[2Jb.csv"), "'a\\x1b[2Jb'", "control characters"),
    _name("line end", named("a\nb.csv"), "'a\\nb'", "control characters"),
    _name("turned", named("a\u202eb.csv"), "control characters"),
    _name("no UTF-8", named(os.fsdecode(b"a\xff.csv")), "control characters"),
    _name("formula", named("=cmd|'C calc'!A0.csv"), "does not begin with"),
    _name("at sign", named("@SUM(1).csv"), "does not begin with"),
    _name("minus", named("-1+1.csv"), "does not begin with"),
    _name("plus", named("a+b.csv"), "'a+b'", "without '+'"),
    _name("dots", named("..csv", "'.*csv'"), "does not begin with"),
    _name("markup", named("<script>.csv"), "'<script>'", "without"),
    _name("backslash", named("a\\..\\b.csv"), "without"),
    _name("long", named(f"{'x' * 251}.csv"), "at most 200 bytes"),
    _name("blank at an end", named(" run.csv"), "' run'", "without blanks"),
    _name(
        "twice",
        lambda folder: (
            (folder / "b").mkdir(),
            (folder / "b" / _FILE).write_text(csv_text()),
            (folder / "c" / "b").mkdir(parents=True),
            (folder / "c" / "b" / _FILE).write_text(csv_text()),
            config(folder, _FILE, "'**/*.csv'"),
        ),
        *("'b'", "every name once"),
    ),
]
# What looks odd and is good.
GOOD = {
    "UTF-16 with its mark": text(csv_text().encode("utf-16")),
    "byte order mark": text(b"\xef\xbb\xbf" + csv_text().encode()),
    "CRLF": text(csv_text().replace("\n", "\r\n")),
    "CR": text(csv_text().replace("\n", "\r")),
    "semicolons and decimal commas": text(
        csv_text().replace(",", ";").replace(".", ",")
    ),
    "tabs": text(csv_text().replace(",", "\t")),
    "blanks": text(csv_text().replace(",", "  ")),
    "UTF-16, no mark": text(csv_text().encode("utf-16-le")),
    "one NaN": row(5, "0.03,nan,1"),
    "one blank cell": row(5, "0.03,,1"),
    "one cell less": row(5, "0.03,1"),
    "Latin-1": text(csv_text(header="t,u,y,\xb5").encode("latin-1")),
    "brackets in a name": named("[red]x[x].csv"),
    "mathematics in a name": named("a$\\frac{$b.csv".replace("\\", "")),
    "words of the world": named("müßig 测量.csv"),
    "pipe beside it": lambda folder: os.mkfifo(folder / "plan.csv"),
}
CASES = [*CONTENTS, *PLACES, *NAMES]
