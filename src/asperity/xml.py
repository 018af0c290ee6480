"""Mitsuba's XML as the dictionaries that all else takes: they can be changed, and serve every variant."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from . import loading


def bsdf(source: Path | str) -> dict[str, Any]:
    """The description of the one BSDF in a file, or in a text, at its root or in its ``<scene>``; raises ValueError."""
    import mitsuba as mi

    config = mi.parser.ParserConfig(mi.variant() or "scalar_rgb")
    try:
        if isinstance(source, Path):
            tree = _Tree(mi.parser.parse_file(config, str(source)).nodes, source.parent)
        else:
            tree = _Tree(mi.parser.parse_string(config, source).nodes, Path())
    except RuntimeError as error:
        raise ValueError(loading.one_line(str(error))) from error
    root = tree.nodes[0]
    candidates = [root] if root.type == mi.ObjectType.BSDF else tree.children(root)
    bsdfs = [node for node in candidates if node.type == mi.ObjectType.BSDF]
    if len(bsdfs) != 1:
        raise ValueError(f"it has {len(bsdfs)} BSDFs, at its root or in its <scene>; expected one")
    return tree.described(bsdfs[0])


class _Tree:
    """What Mitsuba's parser found: nodes that refer to each other by number, or by id."""

    def __init__(self, nodes: Any, folder: Path):
        self.nodes, self.folder = list(nodes), folder.resolve()
        self.by_id = {node.props.id(): node for node in self.nodes}

    def children(self, node: Any) -> Iterator[Any]:
        """The nodes right below one."""
        return filter(None, (self.child(value) for _, value in node.props.items()))

    def child(self, value: Any) -> Any:
        """The node that a value refers to; None if it is no reference."""
        import mitsuba as mi

        if isinstance(value, mi.Properties.ResolvedReference):
            return self.nodes[value.index()]
        if isinstance(value, mi.Properties.Reference):
            if value.id() not in self.by_id:
                raise ValueError(f"nothing has the id {value.id()!r}")
            return self.by_id[value.id()]
        return None

    def described(self, node: Any) -> dict[str, Any]:
        """As ``mi.load_dict`` takes it."""
        values = {key: self.plain(key, value) for key, value in node.props.items()}
        return {"type": node.props.plugin_name()} | values

    def plain(self, key: str, value: Any) -> Any:
        """One value of it. The files lie beside the XML."""
        if (node := self.child(value)) is not None:
            return self.described(node)
        if hasattr(value, "is_uniform"):  # a spectrum, of the parser's own class
            pairs = list(zip(value.wavelengths, value.values))
            return {"type": "spectrum", "value": value.values[0] if value.is_uniform() else pairs}
        kind = type(value).__name__
        if "Color3" in kind:
            return {"type": "rgb", "value": list(value)}
        if "Array3" in kind:
            return list(value)
        return str(self.folder / value) if key == "filename" else value
