"""MAT, NPZ and HDF5 files that cannot be used, and what must be said of each."""

import io
import pickle
import struct
import warnings
import zipfile
import zlib

import h5py
import numpy as np
import scipy.io
import scipy.sparse
from scipy.io.matlab import MatlabObject

from tests.bad_input.csv_cases import config
from tests.bad_input.trial import Case, signals

_ARRAYS = dict(zip("tuy", signals(), strict=True))
_OUTPUT = _ARRAYS["y"]
# 0.6 GB when it is unpacked.
_HUGE = 75_000_000
_OBJECTS = np.array([1, None, "x", {}] * 20, dtype=object)


def _file(ending, write):
    """Measure into another kind of file."""

    def spoil(folder):
        (folder / "run.csv").unlink()
        config(folder, "run.csv", f"run{ending}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            write(folder / f"run{ending}")

    return spoil


def _case(kind, name, write, *says):
    return Case(f"{kind}: {name}", _file(f".{kind}", write), (f"run.{kind}", *says))


def _npz(name, output, *says):
    return _case("npz", name, lambda path: np.savez(path, **_with(output)), *says)


def _mat(name, output, *says, **options):
    def write(path):
        scipy.io.savemat(path, _with(output), **options)

    return _case("mat", name, write, *says)


def _h5(name, make, *says):
    def write(path):
        with h5py.File(path, "w") as file:
            for one in "tu":
                file[one] = _ARRAYS[one]
            make(file)

    return _case("h5", name, write, *says)


def _mat73(name, make, *says):
    def write(path):
        with h5py.File(path, "w", userblock_size=512) as file:
            for one in "tuy":
                file[one] = _ARRAYS[one][None]
                file[one].attrs["MATLAB_class"] = np.bytes_("double")
            make(file)

    return Case(f"mat 7.3: {name}", _file(".mat", write), ("run.mat", *says))


def _with(output):
    return {**_ARRAYS, "y": output} if output is not None else {**_inputs()}


def _inputs():
    return {name: _ARRAYS[name] for name in "tu"}


def _array(values):
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


def _archive(path, *members):
    with warnings.catch_warnings(), zipfile.ZipFile(path, "w") as archive:
        warnings.simplefilter("ignore")
        for name, content in members:
            archive.writestr(name, content, zipfile.ZIP_DEFLATED)


def _zip_of(*names, output=None):
    """Archive of arrays under names; ``output`` stands in for the last one."""
    arrays = [(name, _array(_OUTPUT)) for name in names]
    if output is not None:
        arrays[-1] = (names[-1], output)
    return lambda path: _archive(path, *arrays)


def _header(samples):
    file = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": (samples,)}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue()


def _mat_bomb(path):
    """A level 5 file of 3 MB that unpacks to 0.6 GB."""
    head = b"".join(
        struct.pack("<II", kind, len(body)) + body
        for kind, body in (
            (6, struct.pack("<II", 6, 0)),
            (5, struct.pack("<ii", 1, _HUGE)),
            (1, b"y" + b"\0" * 7),
        )
    )
    packer = zlib.compressobj(1)
    tags = struct.pack("<II", 14, len(head) + 8 + 8 * _HUGE) + head
    packed = packer.compress(tags + struct.pack("<II", 9, 8 * _HUGE))
    zeros = b"\0" * 2**24
    packed += b"".join(packer.compress(zeros) for _ in range(8 * _HUGE // 2**24))
    packed += packer.compress(zeros[: 8 * _HUGE % 2**24]) + packer.flush()
    first = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    path.write_bytes(first + struct.pack("<II", 15, len(packed)) + packed)


def _mat_complex_flag(path):
    """A file that was seen to crash scipy: complex by its flags, without such data."""
    scipy.io.savemat(path, _ARRAYS)
    content = bytearray(path.read_bytes())
    content[145] |= 0x08
    path.write_bytes(content)


def _cut(write, share):
    def cut(path):
        write(path)
        content = path.read_bytes()
        path.write_bytes(content[: int(len(content) * share)])

    return cut


def _put(**values):
    def make(file):
        for name, value in values.items():
            file[name] = value

    return make


def _made(**options):
    return lambda file: file.create_dataset("y", **options)


def _whole(path):
    with h5py.File(path, "w") as file:
        _put(**_ARRAYS)(file)


def _virtual(file):
    layout = h5py.VirtualLayout(shape=(80,), dtype="f8")
    layout[:] = h5py.VirtualSource("/etc/passwd", "y", shape=(80,))
    file.create_virtual_dataset("y", layout)


def _marked(**marks):
    """MATLAB's marks on the output of a 7.3 file."""
    return lambda file: file["y"].attrs.update(marks)


def _sparse(file):
    del file["y"]
    file["y/data"], file["y/ir"], file["y/jc"] = _OUTPUT, np.arange(80), [0, 80]


_PLAIN = ("holds no plain numbers", "an array of real numbers", "name another")
_BOMB = ("unpacks to more than 512 MB", "export it again")
_OTHER = ("takes its values from other files", "export it again")
NPZ = [
    _npz("pickled objects", _OBJECTS, "allow_pickle=False", "export it again"),
    _npz("complex", _OUTPUT + 1j, "complex numbers", "real numbers", "name another"),
    _npz("text", np.array(["a"] * 80), "holds text", "real numbers"),
    _npz("dates", np.arange(80).astype("M8[s]"), *_PLAIN),
    _npz("records", np.zeros(80, dtype=[("a", "f8")]), *_PLAIN),
    _npz("table", np.zeros((80, 3)), "shape (80, 3)", "one row or one column"),
    _npz("missing", None, "no variable 'y'", "one of t, u"),
    _npz("no values", np.zeros(0), "output 'y' has no values"),
    _npz("a number", np.float64(3), "has 1", "equal lengths", "mend the file"),
    _npz("all the same", np.full(80, 2**64 - 1, "u8"), "1.84467441e+19 in all 80 rows"),
    _npz("NaN", np.where(_ARRAYS["t"] > 0.3, np.nan, 1), "row 31 (counted from 0)"),
    _npz(
        "beyond 64 bits", _OUTPUT * np.longdouble("1e400"), "infinite", "finite number"
    ),
    _case("npz", "bomb", _zip_of("t", "u", output=b"\0" * (2**29 + 1)), *_BOMB),
    _case(
        "npz", "lies", _zip_of("t", "u", "y", output=_header(10**15)), "cannot be read"
    ),
    _case("npz", "names that climb", _zip_of("../t", "/u", "y"), "did you mean '/u'?"),
    _case("npz", "twice", _zip_of("t", "u", "y", "y"), "holds 'y' twice"),
    _case("npz", "zip in a zip", _zip_of("t", "u", "y", output=b"PK\3\4"), *_PLAIN),
    _case("npz", "cut off", _cut(_zip_of("t", "u", "y"), 0.5), "not a zip file"),
    _case("npz", "one array", lambda p: p.write_bytes(_array(_OUTPUT)), "numpy.savez"),
    _case(
        "npz", "pickle", lambda p: p.write_bytes(pickle.dumps([1])), "cannot be read"
    ),
]
MAT = [
    _mat("cells", _OBJECTS[::4], *_PLAIN),
    _mat("struct", {"a": _OUTPUT}, *_PLAIN),
    _mat("object", MatlabObject(np.zeros((1, 1), dtype=[("a", object)]), "x"), *_PLAIN),
    _mat("sparse", scipy.sparse.csc_matrix(_OUTPUT), *_PLAIN),
    _mat("sparse, level 4", scipy.sparse.csc_matrix(_OUTPUT), *_PLAIN, format="4"),
    _mat("complex", _OUTPUT + 1j, "complex numbers", "name another"),
    _mat("text", "hello", "holds text", "name another"),
    _mat("empty", np.zeros((0, 0)), "shape (0, 0)", "one row or one column"),
    _mat("three axes", np.zeros((4, 5, 4)), "shape (4, 5, 4)", "one row"),
    _mat("missing", None, "no variable 'y'", "one of t, u"),
    _case(
        "mat",
        "cut off",
        _cut(lambda p: scipy.io.savemat(p, _ARRAYS), 0.5),
        "could not read bytes",
    ),
    _case(
        "mat", "text file", lambda p: p.write_text("hello " * 99), "Unknown mat file"
    ),
    _case("mat", "complex by its flags", _mat_complex_flag, "crashes on it"),
    _case("mat", "bomb", _mat_bomb, *_BOMB),
    _mat73("text", _marked(MATLAB_class=np.bytes_("char")), "holds text"),
    _mat73("cell", _marked(MATLAB_class=np.bytes_("cell")), *_PLAIN),
    _mat73("object", _marked(MATLAB_object_decode=3), *_PLAIN),
    _mat73("function", _marked(MATLAB_class=np.bytes_("function_handle")), *_PLAIN),
    _mat73("empty", _marked(MATLAB_empty=1), "output 'y' has no values"),
    _mat73("sparse", _sparse, "no variable 'y'", "y.data"),
]
HDF5 = [
    _h5("missing", lambda file: None, "no variable 'y'", "one of t, u"),
    _h5("group", lambda file: file.create_group("y"), "no variable 'y'"),
    _h5("table", _put(y=np.zeros((80, 3))), "shape (80, 3)", "one row or one column"),
    _h5("text", _put(y=["a"] * 80), *_PLAIN),
    _h5("no value", _put(y=h5py.Empty("f8")), *_PLAIN),
    _h5("complex", _put(y=_OUTPUT + 1j), "complex numbers", "name another"),
    _h5("bytes", _put(y=np.zeros(80, "V8")), *_PLAIN),
    _h5("ragged", _made(shape=(80,), dtype=h5py.vlen_dtype("f8")), *_PLAIN),
    _h5("references", _made(shape=(80,), dtype=h5py.ref_dtype), *_PLAIN),
    _h5("link out", _put(y=h5py.ExternalLink("/etc/passwd", "y")), "no variable 'y'"),
    _h5("soft link", _put(y=h5py.SoftLink("/none")), "no variable 'y'"),
    _h5(
        "raw from /etc", _made(shape=(8,), dtype="f8", external="/etc/passwd"), *_OTHER
    ),
    _h5("virtual", _virtual, *_OTHER),
    _h5(
        "bomb",
        _made(shape=(_HUGE,), dtype="f8", chunks=(2**20,), compression="gzip"),
        *_BOMB,
    ),
    _h5("10^15", _made(shape=(10**15,), dtype="f8", chunks=(2**20,)), *_BOMB),
    _case("h5", "random", lambda p: p.write_bytes(bytes(range(256)) * 9), "signature"),
    _case("h5", "cut off", _cut(_whole, 0.5), "truncated file", "export it again"),
]
# What looks odd and is good.
GOOD = {
    "big-endian": _file(".npz", lambda p: np.savez(p, **_with(_OUTPUT.astype(">f8")))),
    "half precision": _file(
        ".npz", lambda p: np.savez(p, **_with(_OUTPUT.astype("f2")))
    ),
    "bytes as numbers": _file(
        ".mat", lambda p: scipy.io.savemat(p, _with((100 * _OUTPUT).astype("i1")))
    ),
    "level 4": _file(".mat", lambda p: scipy.io.savemat(p, _ARRAYS, format="4")),
    "packed": _file(
        ".mat", lambda p: scipy.io.savemat(p, _ARRAYS, do_compression=True)
    ),
}
CASES = [*NPZ, *MAT, *HDF5]
