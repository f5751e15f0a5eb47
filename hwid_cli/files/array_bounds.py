"""How much a file of arrays may unpack to: a few kilobytes can hold terabytes of zeros.

Checked from what the file declares, before an array is made. `mat_structure` does the
same for MAT files, which declare nothing.
"""

from zipfile import ZipFile

import h5py

# 2^26 numbers of 8 bytes: eight times the longest recording that was measured, 8e6
# samples.
MOST_BYTES = 2**29
_MOST_NAMES = 10_000


def check_declared(name: str, size: int) -> None:
    """Refuse an array that is too large.

    Parameters
    ----------
    name : str
        Of the variable.
    size : int, [bytes]
        When it is unpacked.

    Raises
    ------
    ValueError
    """
    if size > MOST_BYTES:
        raise ValueError(f"{name!r} unpacks to more than {MOST_BYTES // 2**20} MB")


def check_dataset(dataset: h5py.Dataset) -> None:
    """Refuse an HDF5 data set that is too large, or lies in another file.

    Parameters
    ----------
    dataset : h5py.Dataset

    Raises
    ------
    ValueError
    """
    if dataset.external or dataset.is_virtual:
        raise ValueError(
            f"{dataset.name!r} takes its values from other files, which is not followed"
        )
    check_declared(dataset.name, (dataset.size or 0) * dataset.dtype.itemsize)


def check_archive(archive: ZipFile) -> None:
    """Refuse an archive whose members are too many, too large or of one name.

    Raises
    ------
    ValueError
    """
    members = archive.infolist()
    if len(members) > _MOST_NAMES:
        raise ValueError(f"holds {len(members)} members, the most is {_MOST_NAMES}")
    names = set()
    for member in members:
        check_declared(member.filename, member.file_size)
        if member.filename in names:
            raise ValueError(f"holds {member.filename!r} twice")
        names.add(member.filename)
