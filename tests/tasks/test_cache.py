from dataclasses import dataclass

import numpy as np
import pytest

from hwid_cli.errors import CacheError
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.tasks.cache import MemoryStore, Store, remembered, task_key
from tests.store.record_examples import assert_same, example_fit, failed_fit

KEYS = [task_key("identify", 1, {"number": number}, []) for number in range(3)]


@pytest.fixture(params=["memory", "hdf5"])
def store(request, tmp_path) -> Store:
    return MemoryStore() if request.param == "memory" else Hdf5Store(tmp_path)


def test_empty_store_has_nothing(store):
    assert store.get(KEYS[0], Fit) is None


@pytest.mark.parametrize("fit", [example_fit(), failed_fit()], ids=["fit", "failure"])
def test_what_was_put_comes_back_bit_by_bit(store, fit):
    store.put(KEYS[0], fit)
    assert_same(store.get(KEYS[0], Fit), fit)


def test_keys_are_kept_apart(store):
    for number, key in enumerate(KEYS):
        store.put(key, example_fit(seed=number))
    for number, key in enumerate(KEYS):
        assert_same(store.get(key, Fit), example_fit(seed=number))


def test_last_put_wins(store):
    store.put(KEYS[0], example_fit(seed=1))
    store.put(KEYS[0], example_fit(seed=2))
    assert_same(store.get(KEYS[0], Fit), example_fit(seed=2))


def test_records_of_several_types_are_kept(store):
    recording = Recording("r", np.arange(3.0), np.ones(3), 1e-3, "step", "ff")
    store.put(KEYS[0], recording)
    store.put(KEYS[1], Orders(1, 2, 3))
    assert_same(store.get(KEYS[0], Recording), recording)
    assert store.get(KEYS[1], Orders) == Orders(1, 2, 3)


def test_record_of_another_type_is_not_given_out(store):
    store.put(KEYS[0], Orders(1, 2, 3))
    assert store.get(KEYS[0], Fit) is None


@dataclass(frozen=True)
class Nested:
    options: FitOptions
    names: tuple[str, ...]


SETTINGS = {"orders": Orders(1, 2, 3), "nested": Nested(FitOptions(), ("a",)), "x": 0.1}
ARRAYS = (np.arange(6.0), np.ones(3))
REFERENCE = task_key("identify", 1, SETTINGS, ARRAYS)


def with_bit_flipped(array):
    content = bytearray(array.tobytes())
    content[0] ^= 1
    return np.frombuffer(bytes(content), array.dtype)


@pytest.mark.parametrize(
    "arguments",
    {
        "stage": ("crossval", 1, SETTINGS, ARRAYS),
        "stage version": ("identify", 2, SETTINGS, ARRAYS),
        "setting": ("identify", 1, SETTINGS | {"x": np.nextafter(0.1, 1)}, ARRAYS),
        "nested setting": (
            "identify",
            1,
            SETTINGS | {"nested": Nested(FitOptions(units=11), ("a",))},
            ARRAYS,
        ),
        "nested name": (
            "identify",
            1,
            SETTINGS | {"nested": Nested(FitOptions(), ("b",))},
            ARRAYS,
        ),
        "setting added": ("identify", 1, SETTINGS | {"z": None}, ARRAYS),
        "type of a setting": ("identify", 1, SETTINGS | {"x": "0.1"}, ARRAYS),
        "bit of an array": (
            "identify",
            1,
            SETTINGS,
            (with_bit_flipped(ARRAYS[0]), ARRAYS[1]),
        ),
        "dtype": ("identify", 1, SETTINGS, (ARRAYS[0].view(np.int64), ARRAYS[1])),
        "byte order": (
            "identify",
            1,
            SETTINGS,
            (ARRAYS[0].view(ARRAYS[0].dtype.newbyteorder()), ARRAYS[1]),
        ),
        "shape": ("identify", 1, SETTINGS, (ARRAYS[0].reshape(2, 3), ARRAYS[1])),
        "order of arrays": ("identify", 1, SETTINGS, ARRAYS[::-1]),
        "array added": ("identify", 1, SETTINGS, (*ARRAYS, np.zeros(0))),
        "border between arrays": (
            "identify",
            1,
            SETTINGS,
            (np.append(ARRAYS[0], 1.0), np.ones(2)),
        ),
    }.items(),
    ids=lambda item: item[0],
)
def test_each_input_alters_the_key(arguments):
    assert task_key(*arguments[1]) != REFERENCE


@pytest.mark.parametrize(
    "arguments",
    [
        ("identify", 1, dict(reversed(SETTINGS.items())), ARRAYS),
        ("identify", 1, SETTINGS | {"x": np.float64(0.1)}, list(ARRAYS)),
        ("identify", 1, SETTINGS, (np.repeat(ARRAYS[0], 2)[::2], ARRAYS[1])),
        (
            "identify",
            np.int64(1),
            SETTINGS
            | {
                "orders": {"nb": 1, "nf": 2, "nk": 3},
                "nested": {"options": FitOptions(), "names": ["a"]},
            },
            ARRAYS,
        ),
    ],
    ids=["order of keys", "numpy scalar", "strides", "plain data"],
)
def test_equal_content_has_an_equal_key(arguments):
    assert task_key(*arguments) == REFERENCE


def test_key_is_the_same_in_every_run():
    # The value itself is fixed: another one would empty every user's cache.
    assert task_key("identify", 1, {"units": 10}, [np.zeros(3)]) == (
        "5ee4a332549bbe4eecbc2fc0b8b813022e0328ac675bfdac0ac40158ab8c63c7"
    )


@pytest.mark.parametrize("bad", [np.zeros(3), object(), {1: 2}, {1, 2}, 1j, b"x"])
def test_setting_without_definite_bytes_is_refused(bad):
    with pytest.raises(TypeError, match="setting"):
        task_key("identify", 1, {"x": bad}, [])


def test_setting_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="not JSON compliant"):
        task_key("identify", 1, {"x": float("nan")}, [])


def test_array_of_objects_is_refused():
    with pytest.raises(TypeError, match="no definite bytes"):
        task_key("identify", 1, {}, [np.array([{}], dtype=object)])


def test_what_is_remembered_is_computed_once_and_again_where_nothing_can_be_kept(
    store, tmp_path
):
    calls = []

    def compute():
        calls.append(1)
        return example_fit()

    for _ in range(2):
        assert_same(remembered(store, KEYS[0], Fit, compute), example_fit())
    assert len(calls) == 1

    class Full(MemoryStore):
        def put(self, *_):
            raise CacheError("the disk is full")

    for _ in range(2):
        assert_same(remembered(Full(), KEYS[0], Fit, compute), example_fit())
    assert len(calls) == 3
