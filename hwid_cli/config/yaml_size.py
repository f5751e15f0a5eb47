"""How much a YAML text stands for, found before anything is built from it.

A few lines of anchors can stand for billions of values ("billion laughs"), and an
anchor may hold itself.
"""

import yaml

# A list of 38 recordings in every section of a large example makes 800.
MOST_VALUES = 100_000


def count_values(root: yaml.Node) -> int:
    """Count the values that a tree of nodes stands for, aliases written out.

    Returns
    -------
    int, [-]

    Raises
    ------
    yaml.constructor.ConstructorError
        If an anchor holds itself, or there are more than ``MOST_VALUES``.
    """
    counts: dict[int, int] = {}
    open_nodes: set[int] = set()

    def count(node: yaml.Node) -> int:
        place = id(node)
        if place in open_nodes:
            _refuse(node, "an anchor holds itself; write the values out")
        if place not in counts:
            open_nodes.add(place)
            counts[place] = 1 + sum(count(inner) for inner in _inner(node))
            open_nodes.remove(place)
        if counts[place] > MOST_VALUES:
            _refuse(node, f"stands for more than {MOST_VALUES} values; write fewer")
        return counts[place]

    return count(root)


def _inner(node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        return [part for pair in node.value for part in pair]
    return node.value if isinstance(node, yaml.SequenceNode) else []


def _refuse(node: yaml.Node, problem: str) -> None:
    raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
