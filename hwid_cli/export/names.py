"""Names of models in file names, in programs and in comments."""

import re

# Words that MATLAB and C keep for themselves are no danger: every name has a number.
_NO_IDENTIFIER = re.compile(r"\W", re.ASCII)
_NO_FILE_NAME = re.compile(r'[/\\:*?"<>|\x00-\x1f]')
# MATLAB cuts names at 63 characters.
_LONGEST = 63


def file_stem(name: str) -> str:
    """Name of a model's file without its ending.

    Examples
    --------
    >>> file_stem("step_06+step_09/3/7")
    'step_06+step_09_3_7'
    """
    return _NO_FILE_NAME.sub("_", name)


def identifier(name: str) -> str:
    """Name of a model as C and MATLAB accept it.

    Examples
    --------
    >>> identifier("step_06+step_09/3/7"), identifier("7b/1/2")
    ('step_06_step_09_3_7', 'model_7b_1_2')
    """
    plain = _NO_IDENTIFIER.sub("_", name)
    if not plain[:1].isalpha():
        plain = f"model_{plain}"
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
