"""Records with every kind of field, and a way to compare them bit by bit."""

from dataclasses import dataclass, fields, is_dataclass, replace

import h5py
import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hwid_cli.files.checksums import with_checksum
from hwid_cli.records.maps import OwnFunction
from hwid_cli.records.model import (
    Fit,
    FitOptions,
    HammersteinWiener,
    Information,
    Orders,
    StaticMap,
    Uncertainty,
)

# HDF5 text ends at a null character, and lone surrogates are no text at all.
TEXTS = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]))
INTEGERS = st.integers(-(2**63), 2**63 - 1)
VECTORS = hnp.arrays(np.float64, st.integers(0, 9), elements=st.floats())


@dataclass(frozen=True, eq=False)
class Inner:
    """A record inside another one."""

    word: str
    vector: np.ndarray


@dataclass(frozen=True, eq=False)
class Everything:
    """One field of every kind that has a place in HDF5."""

    word: str
    count: int
    size: float
    is_true: bool
    words: tuple[str, ...]
    counts: tuple[int, ...]
    sizes: tuple[float, ...]
    truths: tuple[bool, ...]
    vector: np.ndarray
    inner: Inner
    perhaps_inner: Inner | None


@dataclass(frozen=True, eq=False)
class WithGaps(Everything):
    """Fields that may be missing."""

    perhaps_word: str | None
    perhaps_count: int | None
    perhaps_counts: tuple[int, ...] | None
    perhaps_vector: np.ndarray | None


@dataclass(frozen=True, eq=False)
class WithMore(WithGaps):
    """Fields that a group can hold and a table cannot."""

    inners: tuple[Inner, ...]


INNERS = st.builds(Inner, TEXTS, VECTORS)
_EVERYTHING = {
    "word": TEXTS,
    "count": INTEGERS,
    "size": st.floats(),
    "is_true": st.booleans(),
    "words": st.lists(TEXTS, max_size=4).map(tuple),
    "counts": st.lists(INTEGERS, max_size=4).map(tuple),
    "sizes": st.lists(st.floats(), max_size=4).map(tuple),
    "truths": st.lists(st.booleans(), max_size=4).map(tuple),
    "vector": VECTORS,
    "inner": INNERS,
    "perhaps_inner": st.none() | INNERS,
}
EVERYTHING = st.builds(Everything, **_EVERYTHING)
ARRAYS = hnp.arrays(
    hnp.boolean_dtypes()
    | hnp.integer_dtypes(endianness="<")
    | hnp.floating_dtypes(endianness="<", sizes=(32, 64))
    | hnp.complex_number_dtypes(endianness="<"),
    hnp.array_shapes(min_dims=0, min_side=0, max_dims=3),
)
_GAPS = {
    "perhaps_word": st.none() | TEXTS,
    "perhaps_count": st.none() | INTEGERS,
    "perhaps_counts": st.none() | st.lists(INTEGERS, max_size=4).map(tuple),
}
WITH_GAPS = st.builds(
    WithGaps, **_EVERYTHING, **_GAPS, perhaps_vector=st.none() | VECTORS
)
WITH_MORE = st.builds(
    WithMore,
    **_EVERYTHING,
    **_GAPS,
    perhaps_vector=st.none() | ARRAYS,
    inners=st.lists(INNERS, max_size=3).map(tuple),
)


def example_fit(name="step_01", nb=2, nf=2, seed=1):
    """A fit that succeeded, with numbers that are no round ones."""
    rng = np.random.default_rng(seed)
    maps = [
        StaticMap(
            "piecewise_linear",
            # Break-points rise.
            np.append(np.sort(rng.normal(size=3)), rng.normal(size=3)),
            (-1.5, 2.5),
        )
        for _ in range(2)
    ]
    denominator = np.append(1.0, rng.normal(size=nf))
    model = HammersteinWiener(
        maps[0], rng.normal(size=nb), denominator, 1, maps[1], 1e-3
    )
    return Fit(
        (name,),
        Orders(nb, nf, 1),
        FitOptions(units=3),
        model,
        "converged",
        "step below tolerance",
        iterations=17,
        rmsd=float(rng.normal() ** 2),
        fit_percent=98.7,
        linear_rmsd=0.3,
        poles=rng.normal(size=nf) + 1j * rng.normal(size=nf),
        is_stable=True,
        uncertainty=Uncertainty(
            ("b[0]", "µ"), np.array([0.1, np.nan]), "one is flat", ("b[0], because µ",)
        ),
        information=Information(300, 17, -12.5, -12.25, 0.1, 1e-9),
        output_folds=(-1.25, 1 / 3),
    )


def fit_with_own_function(name="step_01", nb=2):
    """A fit whose input map is the user's own and whose output map has 7 units."""
    fit = example_fit(name, nb)
    function = OwnFunction("curve", "curve = 'µ'\n", unit=0.1)
    own = StaticMap("own_function", np.array([0.1, 1 / 3]), (-1.0, 2.0), function)
    options = FitOptions(
        input_map="own_function",
        output_map="sigmoid_network",
        output_units=7,
        input_function=function,
    )
    network = StaticMap("sigmoid_network", np.arange(23.0) / 7.0, (-1.0, 2.0))
    model = replace(fit.model, input_map=own, output_map=network)
    return replace(fit, options=options, model=model)


def failed_fit(name="step_01", nb=3, nf=1):
    """A fit without a model."""
    return Fit((name,), Orders(nb, nf, 1), FitOptions(), None, "failed", "no start")


def assert_same(found, expected):
    """Compare two records field by field, floats bit by bit."""
    assert type(found) is type(expected)
    if is_dataclass(expected):
        for field in fields(expected):
            assert_same(getattr(found, field.name), getattr(expected, field.name))
    elif isinstance(expected, np.ndarray):
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape)
        assert found.tobytes() == expected.tobytes()
    elif isinstance(expected, tuple):
        assert len(found) == len(expected)
        for one, other in zip(found, expected, strict=True):
            assert_same(one, other)
    elif isinstance(expected, float):
        assert np.float64(found).tobytes() == np.float64(expected).tobytes()
    else:
        assert found == expected


def plant(path, place, values):
    """Put other values in the place of some in a file of results, checksum and all."""
    with h5py.File(path, "a") as file:
        del file[place]
        file[place] = values
    path.write_bytes(with_checksum(path.read_bytes()))
