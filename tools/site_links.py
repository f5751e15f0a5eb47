"""Hook of mkdocs: links to files of the project outside docs/ lead there from the site."""

import re
from typing import Any

# The site stands in results/site, two folders below the project.
_FROM_SITE = "../../"
_OUTSIDE = re.compile(r"\[([^\]]+)\]\(\.\./([^)]+)\)")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Write such links as HTML, which mkdocs leaves alone.

    Examples
    --------
    >>> on_page_markdown("see [keys](../configs/README.md)")
    'see <a href="../../configs/README.md">keys</a>'
    """
    return _OUTSIDE.sub(rf'<a href="{_FROM_SITE}\2">\1</a>', markdown)
