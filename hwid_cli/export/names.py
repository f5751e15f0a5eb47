"""Names of models in file names, in programs and in comments."""

import re
from hashlib import sha256

from hwid_cli.files.stems import shortened_stem

# Words that MATLAB and C keep for themselves are no danger: every name has a number.
_NO_IDENTIFIER = re.compile(r"\W", re.ASCII)
_NO_FILE_NAME = re.compile(r'[/\\:*?"<>|\x00-\x1f]')
# MATLAB cuts names at 63 characters.
_LONGEST = 63
# Digits of a hash that tell apart what would have the same identifier.
_MARK = 8


def file_stem(name: str) -> str:
    """Name of a model's file without its ending.

    Examples
    --------
    >>> file_stem("step_06+step_09/3/7")
    'step_06+step_09_3_7'
    """
    return shortened_stem(_NO_FILE_NAME.sub("_", name))


def identifier(name: str, *, is_taken: bool = False) -> str:
    """Name of a model as C and MATLAB accept it.

    Parameters
    ----------
    is_taken : bool
        Whether another model has the plain form of the name.

    Examples
    --------
    >>> identifier("step_06+step_09/3/7"), identifier("7b/1/2")
    ('step_06_step_09_3_7', 'model_7b_1_2')
    >>> identifier("a-b/1/2", is_taken=True)
    'a_b_1_2_caa013ec'
    """
    plain = _NO_IDENTIFIER.sub("_", name)
    if not plain[:1].isalpha():
        plain = f"model_{plain}"
    if is_taken:
        # The names differ in what no identifier can hold, or in their middle.
        mark = sha256(name.encode()).hexdigest()[:_MARK]
        return f"{plain[: _LONGEST - _MARK - 1]}_{mark}"
    # The orders at the end tell models of the same recordings apart.
    return plain if len(plain) <= _LONGEST else f"{plain[:40]}_{plain[-22:]}"


def in_comment(text: str) -> str:
    """Text that neither ends a comment nor breaks its line.

    Examples
    --------
    >>> in_comment("a*/b")
    'a* /b'
    """
    printable = "".join(one if one.isprintable() else " " for one in text)
    plain = printable.encode("ascii", "replace").decode()
    # A backslash at a line's end would go on with the comment in the next line, and
    # "??/" is one in old compilers.
    return (
        plain.replace("*/", "* /")
        .replace("/*", "/ *")
        .replace("\\", "/")
        .replace("??", "? ?")
    )
