"""How a record shows itself to people: in one line, in a notebook, as a figure, as a table.

Records compute and draw nothing. Here stands the line; what needs more is done by the
room ``python``, which is loaded by name when somebody asks.
"""

from importlib import import_module
from typing import Any

_VIEWS = "hwid_cli.python.views"


class Shown:
    """A record that people look at; each names what its line says in ``facts``."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """What it is in a few words, each with its label; the first is its name."""
        raise NotImplementedError

    def __repr__(self) -> str:
        said = ", ".join(
            text if label == "name" else f"{label} {text}"
            for label, text in self.facts()
        )
        return f"<{type(self).__name__} {said}>"

    def _repr_html_(self) -> str:
        """The same as a table, for notebooks."""
        return str(import_module(_VIEWS).as_html(type(self).__name__, self.facts()))

    def plot(self, **options: Any) -> Any:
        """Draw it.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return import_module(_VIEWS).plot(self, **options)

    def to_frame(self) -> Any:
        """Give its numbers as a table.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        HwidError
            If pandas is not installed.
        """
        return import_module(_VIEWS).to_frame(self)
