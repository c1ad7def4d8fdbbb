"""Property graphs of files: queries as text, and traversals with Gremlin's words."""

from __future__ import annotations

import logging
from collections import namedtuple
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from robocomp._load import load

load("robocomp._graph", "ROBOCOMP_GRAPH", "rc-python-graph", "librobocomp_graph.so")

from robocomp import _graph  # noqa: E402
from robocomp._graph import Edge, Node  # noqa: E402

__all__ = ["Edge", "Graph", "Node", "Snapshot", "Traversal", "Traverser"]

Total = TypeVar("Total")

STEPS = 10_000_000
"""How many steps a query or a traversal takes at most, if nothing else is said."""

ROWS = 100_000
"""How many rows a query or a traversal makes at most, if nothing else is said."""

MARKS = 4
"""How many marks a traversal has at most."""


class Graph:
    """A graph of a file."""

    __slots__ = ("_graph",)

    def __init__(self, graph: _graph.Graph) -> None:
        self._graph = graph

    @classmethod
    def read(cls, file: str | Path, include: Iterable[str | Path] = ()) -> Graph:
        """Reads a `.graph` file, the JSON of DSR, or the robot of a `.urdf` file. The schema that it names is
        looked for next to it and in the folders `include`. Warnings go to the log `robocomp`.

        Raises `ValueError` with line and column if the text is wrong, and `OSError` if the file cannot
        be read.
        """
        if isinstance(include, str):
            raise TypeError(f"`include` is a list of folders, for instance [{include!r}]")
        graph, warnings = _graph.Graph.read(Path(file), [Path(folder) for folder in include])
        for line in warnings:
            logging.getLogger("robocomp").warning(line)
        return cls(graph)

    def snapshot(self) -> Snapshot:
        """The present version, which never changes."""
        return Snapshot(self._graph.snapshot())


class Snapshot:
    """A version of a graph, which never changes."""

    __slots__ = ("_now",)

    def __init__(self, now: _graph.Snapshot) -> None:
        self._now = now

    @property
    def version(self) -> int:
        """The number of this version."""
        return self._now.version

    def __len__(self) -> int:
        """How many nodes there are."""
        return len(self._now)

    def nodes(self, kind: str | None = None) -> list[Node]:
        """All nodes, or those of a type and of all that inherit from it."""
        return self._now.nodes(kind)

    def node(self, name: str) -> Node:
        """The only node with a name. Raises `KeyError` if there is none, or if there are several."""
        return self._now.node(name)

    def find(self, id: str) -> Node | None:
        """The node with an id, as of `Node.id`. `None` if there is none."""
        return self._now.find(id)

    def edges(
        self, kind: str | None = None, start: Node | None = None, end: Node | None = None
    ) -> list[Edge]:
        """All edges, or those of a relation, from a node, to a node."""
        return self._now.edges(kind, start, end)

    @property
    def queries(self) -> list[str]:
        """The names of the queries of the schema."""
        return self._now.queries()

    def query(
        self,
        text: str,
        parameters: Mapping[str, Any] | None = None,
        *,
        steps: int = STEPS,
        rows: int = ROWS,
    ) -> list[Any]:
        """The rows of a query in openCypher, as named tuples. `$name` in the text is a parameter.
        `_units` of a row has the unit of each column, or `None`.

        Raises `ValueError` with the place if the text is wrong, and if the query takes more steps or
        makes more rows.
        """
        return _rows(*self._now.query(text, dict(parameters or {}), steps, rows))

    def run(
        self,
        name: str,
        parameters: Mapping[str, Any] | None = None,
        *,
        steps: int = STEPS,
        rows: int = ROWS,
    ) -> list[Any]:
        """The rows of a query that the schema names, as named tuples. Raises `ValueError` if the schema has
        no such query, if a parameter does not fit, and if the query takes more steps or makes more rows."""
        return _rows(*self._now.run(name, dict(parameters or {}), steps, rows))

    def pose(self, frame: Node, node: Node) -> tuple[float, float, float, float, float, float]:
        """The pose of `node` in `frame`, as `pose(frame, node)` of a query: x, y, z in the unit of the
        schema, and the angles about x, y, z. Raises `ValueError` if no poses connect them."""
        return self._now.pose(frame, node)

    def traverse(self, *starts: Node | Iterable[Node]) -> Traversal:
        """Starts a traversal at nodes."""
        nodes: list[Node] = []
        for start in starts:
            nodes += [start] if isinstance(start, Node) else start
        return Traversal(self, nodes)


@lru_cache(maxsize=64)
def _row(columns: tuple[str, ...], units: tuple[str | None, ...]) -> Any:
    # A column that is not a word of Python has its number as its name.
    make: Any = namedtuple
    row = make("Row", columns, rename=True)
    row._units = dict(zip(row._fields, units, strict=True))
    return row


def _rows(columns: list[str], units: list[str | None], rows: list[list[Any]]) -> list[Any]:
    row = _row(tuple(columns), tuple(units))
    return [row._make(cells) for cells in rows]


class Traverser:
    """The result of all steps: the node where it ended, and the marked nodes."""

    __slots__ = ("_marks", "node")

    node: Node

    def __init__(self, node: Node, marks: dict[str, Node]) -> None:
        self.node = node
        self._marks = marks

    def __getitem__(self, mark: str) -> Node:
        """The node with a mark."""
        return self._marks[mark]


class Traversal:
    """Steps from nodes to nodes. Each step returns a traversal of its own; nothing is walked until it is
    asked for nodes."""

    __slots__ = ("_graph", "_marks", "_starts", "_steps")

    def __init__(
        self,
        graph: Snapshot,
        starts: list[Node],
        steps: tuple[tuple[str, str, Any], ...] = (),
        marks: tuple[str, ...] = (),
    ) -> None:
        self._graph = graph
        self._starts = starts
        self._steps = steps
        self._marks = marks

    def _then(self, word: str, name: str = "", value: Any = None) -> Traversal:
        steps = (*self._steps, (word, name, value))
        return Traversal(self._graph, self._starts, steps, self._marks)

    def out(self, relation: str) -> Traversal:
        """Along edges of a relation."""
        return self._then("out", relation)

    def in_(self, relation: str) -> Traversal:
        """Against edges of a relation."""
        return self._then("in_", relation)

    def has(self, attribute: str, value: Any) -> Traversal:
        """Only nodes with a value of an attribute."""
        return self._then("has", attribute, value)

    def has_type(self, kind: str) -> Traversal:
        """Only nodes of a type, or of one that inherits from it."""
        return self._then("has_type", kind)

    def as_(self, mark: str) -> Traversal:
        """Marks the present node. Raises `ValueError` beyond four marks."""
        marks = self._marks if mark in self._marks else (*self._marks, mark)
        if len(marks) > MARKS:
            raise ValueError(f"a traversal has at most {MARKS} marks: {', '.join(marks)}")
        made = self._then("as_", value=marks.index(mark))
        made._marks = marks
        return made

    def _mark(self, mark: str) -> int:
        if mark not in self._marks:
            known = ", ".join(self._marks) or "none"
            raise ValueError(f"there is no mark {mark!r}; there are: {known}")
        return self._marks.index(mark)

    def where_eq(self, mark: str) -> Traversal:
        """Only traversers that have come back to a marked node."""
        return self._then("where_eq", value=self._mark(mark))

    def select(self, mark: str) -> Traversal:
        """Goes back to a marked node."""
        return self._then("select", value=self._mark(mark))

    def repeat_until(self, relation: str, until: Callable[[Node], bool]) -> Traversal:
        """Along the first edge of a relation until `until` holds. A traverser that ends before is left
        out. Each call of `until` is a step."""
        return self._then("repeat_until", relation, until)

    def _walk(self, marks: tuple[str, ...], steps: int, rows: int) -> list[Traverser]:
        found = self._graph._now.walk(self._starts, list(self._steps), len(marks), steps, rows)
        return [
            Traverser(node, {name: at for name, at in zip(marks, marked, strict=True) if at is not None})
            for node, marked in found
        ]

    def traversers(self, *, steps: int = STEPS, rows: int = ROWS) -> list[Traverser]:
        """The traversers that have taken all steps. Raises `ValueError` if these are more than `rows`, and
        if all traversers together take more than `steps`."""
        return self._walk(self._marks, steps, rows)

    def nodes(self, *, steps: int = STEPS, rows: int = ROWS) -> list[Node]:
        """Where the traversers are."""
        return [traverser.node for traverser in self._walk((), steps, rows)]

    def __iter__(self) -> Iterator[Node]:
        return iter(self.nodes())

    def values(self, attribute: str, *, steps: int = STEPS, rows: int = ROWS) -> list[Any]:
        """The values of an attribute; nodes without it are left out."""
        nodes = self.nodes(steps=steps, rows=rows)
        return [node[attribute] for node in nodes if attribute in node]

    def fold(
        self,
        start: Total,
        next: Callable[[Total, Traverser], Total],
        *,
        steps: int = STEPS,
        rows: int = ROWS,
    ) -> Total:
        """Computes over all traversers."""
        total = start
        for traverser in self.traversers(steps=steps, rows=rows):
            total = next(total, traverser)
        return total

    def count(self, *, steps: int = STEPS) -> int:
        """How many traversers there are."""
        return self._graph._now.count(self._starts, list(self._steps), steps)
