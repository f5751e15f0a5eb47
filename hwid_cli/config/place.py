"""Where in a configuration file a value stands, as messages name it."""

from dataclasses import dataclass

from hwid_cli.files.messages import escaped

_LONGEST_KEY = 100


@dataclass(frozen=True)
class Place:
    """Where in a configuration file a value stands.

    Parameters
    ----------
    key : str
        Dotted path of the key; empty at the top.
    """

    file: str
    key: str = ""

    def below(self, key: object) -> "Place":
        """Give the place of a key inside this one."""
        name = escaped(str(key)[:_LONGEST_KEY])
        return Place(self.file, f"{self.key}.{name}" if self.key else name)

    def __str__(self) -> str:
        return f"{self.file}: {self.key}" if self.key else self.file
