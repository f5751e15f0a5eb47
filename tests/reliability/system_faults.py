"""A library that lets calls to the system fail in a program under test (system_faults.c)."""

import os
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import pytest

SOURCE = Path(__file__).with_suffix(".c")


@cache
def library() -> str:
    """Build the library once; skip the test where there is no C compiler."""
    compiler = shutil.which("cc")
    if compiler is None or os.uname().sysname != "Linux":
        pytest.skip("needs Linux and a C compiler")
    built = Path(mkdtemp(prefix="hwid_faults_")) / "system_faults.so"
    flags = ["-shared", "-fPIC", "-O1", "-Wall", "-Werror", "-o", built, SOURCE, "-ldl"]
    subprocess.run([compiler, *flags], check=True)
    return str(built)


def settings(**faults: object) -> dict[str, str]:
    """Variables that ask the library for faults, such as ``locks=errno.ENOLCK``."""
    return {f"HWID_FAULT_{name.upper()}": str(one) for name, one in faults.items()}


def environment(**faults: object) -> dict[str, str]:
    """Environment of a program that has the library and faults."""
    return {**os.environ, "LD_PRELOAD": library(), **settings(**faults)}
