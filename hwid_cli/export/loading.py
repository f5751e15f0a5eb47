"""Models that carry Python of their own, and reading a model for Python."""

from pathlib import Path

from hwid_cli.errors import ModelFileError
from hwid_cli.export.json_reader import read_exported
from hwid_cli.records.exported import Exported, ExportedModel
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.store.trusted_functions import is_allowed

_LEAVE = "add --run-own-functions (in Python: run_own_functions=True)"


def check_trust(
    exported: Exported, path: Path, *, is_trusted: bool, step: str = _LEAVE
) -> None:
    """Refuse to run Python out of a model's file unless the user trusts it.

    Parameters
    ----------
    path : Path
        For the message.
    step : str
        How to give leave, for the message.

    Raises
    ------
    ModelFileError
    """
    if is_trusted or not isinstance(exported, ExportedModel):
        return
    for key in ("input_map", "output_map"):
        one = getattr(exported.model, key)
        if one.function is not None and not is_allowed(one.function):
            raise ModelFileError(
                f"{path}: {key}: carries the Python function {one.function.name!r}; "
                f"expected leave to run it; read its text in the file, then {step}"
            )


def load_model(
    path: str | Path, *, run_own_functions: bool = False
) -> HammersteinWiener:
    """Model that ``hwid export --format json`` wrote, for ``simulate``.

    Parameters
    ----------
    run_own_functions : bool
        Whether a model with Python functions of its own may be loaded: simulating it
        runs the text that its file carries.

    Raises
    ------
    ModelFileError
        If the file is no such model, is damaged, or carries Python that is not trusted.
    """
    place = Path(path)
    exported = read_exported(place)
    if not isinstance(exported, ExportedModel):
        raise ModelFileError(
            f"{place}: holds a physics simulation; expected a Hammerstein-Wiener model; "
            "use 'hwid predict', or export another model"
        )
    check_trust(exported, place, is_trusted=run_own_functions)
    return exported.model
