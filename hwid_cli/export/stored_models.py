"""Models out of a folder of results, or out of a file, by their names.

A model is named ``<identified_on>/<nb>/<nk>``; a group joins its recordings with ``+``.
"""

from pathlib import Path

from hwid_cli.errors import ConfigError
from hwid_cli.export.loading import load_model
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.comparison import NamedModel
from hwid_cli.records.model import Fit
from hwid_cli.store.group_results import read_group
from hwid_cli.store.result_files import has_left_results, read_provenance
from hwid_cli.store.results import read_fits

_RESULTS = "results.h5"


def read_stored_model(folder: Path, name: str) -> NamedModel:
    """Read a model of ``identify`` or ``group`` out of a folder of results.

    Parameters
    ----------
    name : str
        Such as ``step_06/3/7`` or ``step_06+step_09/3/7``.

    Raises
    ------
    ConfigError
        If there is no such folder, or no such model in it.
    CacheError
        If its results cannot be read.
    """
    path = Path(folder) / _RESULTS
    if not path.is_file():
        raise ConfigError(
            f"{path}: no such file; expected the results of hwid; correct the folder in "
            f"{f'{folder}:{name}'!r}"
        )
    nk_role: str = "poles"
    fits: tuple[Fit, ...] = ()
    if has_left_results(path, "identify"):
        nk_role = read_provenance(path, "identify").config["orders"]["nk_role"]
        fits = read_fits(path)
    found = {fit_name(fit, nk_role): fit for fit in fits}
    if has_left_results(path, "group"):
        groups = read_group(path).fits
        found |= {fit_name(fit, nk_role): fit for fit in groups if fit is not None}
    return chosen_model(found, name, f"{folder}:{name}")


def chosen_model(fits: dict[str, Fit], name: str, place: str) -> NamedModel:
    """Choose a model by its name.

    Parameters
    ----------
    place : str
        As the user wrote it, for messages.

    Raises
    ------
    ConfigError
        If there is none of that name, or its fit failed.
    """
    if name not in fits:
        raise ConfigError(f"{place}: no model {name!r}; {did_you_mean(name, fits)}")
    one = fits[name]
    if one.model is None:
        raise ConfigError(
            f"{place}: its fit failed ({one.message}); expected a usable model; name "
            "another one"
        )
    return NamedModel(place, one.model, one.identified_on)


def fit_name(fit: Fit, nk_role: str) -> str:
    """Name of the model of a fit.

    Parameters
    ----------
    nk_role : str
        What the second axis of its grid counts.
    """
    nk = fit.orders.nf if nk_role == "poles" else fit.orders.nk
    return f"{fit.name}/{fit.orders.nb}/{nk}"


def read_exported_model(path: Path) -> NamedModel:
    """Read a model that ``hwid export`` wrote as JSON.

    Raises
    ------
    ModelFileError
        If it cannot be read, or carries Python of its own.
    """
    return NamedModel(str(path), load_model(path), ())
