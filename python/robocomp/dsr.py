"""DSR's names for the shared world, for moving code of agents: `DSRGraph`, `Node`, `Edge`, `Attribute`, `rt_api`, `inner_api`
and `signals`, as `pydsr` has them.

New code uses `ctx.g` and the types of its schema. The differences: no agent id is chosen, ids are integers of 128 bits, and a
change that the schema does not allow raises `ValueError`.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from robocomp import graph as _graphs
from robocomp._graph import Edge as GraphEdge
from robocomp._graph import Node as GraphNode
from robocomp.world import _OF_THREAD, Call, World

__all__ = ["Attribute", "DSRGraph", "Edge", "Node", "inner_api", "rt_api", "signals"]

_RT = "RT"
_TRANSLATION = "rt_translation"
_ROTATION = "rt_rotation_euler_xyz"


# The half of an id that counts the elements of a writer.
_COUNT = (1 << 64) - 1


def _id(text: str) -> int:
    writer, count = text.split(":")
    return int(writer) << 64 | int(count)


class Attribute:
    """The value of an attribute: `Attribute(value)`, `Attribute(value, agent_id)` or `Attribute(value, timestamp, agent_id)`.

    Attributes of the world have no time. Its schema gives those a history whose past matters.
    """

    __slots__ = ("agent_id", "timestamp", "value")

    def __init__(self, value: Any, *of: int, timestamp: int | None = None, agent_id: int = 0) -> None:
        if len(of) > 2:
            raise TypeError("an Attribute has a value, a timestamp and an agent_id")
        self.value = value
        self.timestamp = of[0] if len(of) == 2 else timestamp
        self.agent_id = of[-1] if of else agent_id

    def __repr__(self) -> str:
        return f"Attribute({self.value!r})"


def _attributes(element: Any) -> dict[str, Attribute]:
    return {name: Attribute(value) for name, value in element.attributes().items() if name != "name"}


class Node:
    """A node: a copy, which `DSRGraph.update_node` writes back."""

    __slots__ = ("_edges", "_graph", "_read", "agent_id", "attrs", "id", "name", "type")

    def __init__(self, agent_id: int, type: str, name: str = "") -> None:
        self.id = 0
        self.agent_id = agent_id
        self.type = type
        self.name = name
        self.attrs: dict[str, Attribute] = {}
        self._graph: DSRGraph | None = None
        # The version from which it was read.
        self._read: tuple[_graphs.Snapshot, GraphNode] | None = None
        self._edges: dict[tuple[int, str], Edge] | None = None

    @classmethod
    def _of(cls, graph: DSRGraph, now: _graphs.Snapshot, node: GraphNode) -> Node:
        own = cls(0, node.type, node.name)
        own.id = _id(node.id)
        own.attrs = _attributes(node)
        own._graph = graph
        own._read = (now, node)
        return own

    @property
    def edges(self) -> dict[tuple[int, str], Edge]:
        """Copies of the edges from it when it was read, by the ids of the nodes where they end, and their types.
        `DSRGraph.insert_or_assign_edge` writes one back. A node that the agent has made has none."""
        if self._edges is None:
            edges = [] if self._read is None else self._read[0].edges(None, self._read[1])
            copies = [Edge._of(edge) for edge in edges]
            self._edges = {(edge.destination, edge.type): edge for edge in copies}
        return self._edges

    def get_edges(self) -> list[Edge]:
        """The values of `edges`."""
        return list(self.edges.values())

    def __repr__(self) -> str:
        return f"Node({self.name!r}, {self.type!r})"


class Edge:
    """An edge: a copy, which `DSRGraph.insert_or_assign_edge` writes back."""

    __slots__ = ("agent_id", "attrs", "destination", "origin", "type")

    def __init__(self, to: int, from_: int, type: str, agent_id: int = 0) -> None:
        self.origin = from_
        self.destination = to
        self.type = type
        self.agent_id = agent_id
        self.attrs: dict[str, Attribute] = {}

    @classmethod
    def _of(cls, edge: GraphEdge) -> Edge:
        own = cls(_id(edge.end.id), _id(edge.start.id), edge.type)
        own.attrs = _attributes(edge)
        return own

    def __repr__(self) -> str:
        return f"Edge({self.origin}, {self.destination}, {self.type!r})"


class DSRGraph:
    """The world of a component under DSR's names: `DSRGraph(ctx.g)`, or as agents make it,
    `DSRGraph(0, "agent", agent_id)`.

    The second form takes the world of the component whose worker runs on this thread. Its other parameters mean
    nothing here: the network has one world, and says over which middleware and domain its replicas meet, and no
    agent has an id to choose. A file is none of them: `start "FILE";` of the network's `World` reads it.
    """

    __slots__ = ("_world",)

    def __init__(
        self,
        root: World[Any, Any] | int,
        name: str = "",
        id: int = 0,
        dsr_input_file: str = "",
        all_same_host: bool = True,
        domain_id: int = 0,
        sync_mode: Any = None,
    ) -> None:
        if dsr_input_file:
            raise ValueError(f'the network has the file: `World g {{ …; start "{dsr_input_file}"; }};`')
        world = root if isinstance(root, World) else getattr(_OF_THREAD, "world", None)
        if world is None:
            raise RuntimeError("this thread runs no component with a world (`options dsr;` in its .cdsl): use `DSRGraph(ctx.g)`")
        self._world: World[Any, Any] = world

    def get_agent_id(self) -> int:
        """0: replicas have numbers of their own, which are not chosen."""
        return 0

    def get_agent_name(self) -> str:
        """The name of the component in its network."""
        return self._world._link.name()

    def _now(self) -> _graphs.Snapshot:
        now: _graphs.Snapshot = self._world.snapshot().graph
        return now

    def _node(self, of: int | str, now: _graphs.Snapshot | None = None) -> GraphNode | None:
        now = self._now() if now is None else now
        if isinstance(of, str):
            try:
                return now.node(of)
            except KeyError as error:
                if "several" not in str(error):
                    return None
            return next(node for node in now.nodes() if node.name == of)
        return now.find(f"{of >> 64}:{of & _COUNT}")

    def _edge(self, start: int | str, end: int | str, type: str) -> GraphEdge | None:
        first, last = self._node(start), self._node(end)
        if first is None or last is None:
            return None
        edges = self._world.snapshot().graph.edges(type, first, last)
        return edges[0] if edges else None

    def _set(self, of: Any, before: Any, attrs: dict[str, Attribute]) -> list[tuple[Any, ...]]:
        """The steps that give an element these attributes, and no others."""
        steps: list[tuple[Any, ...]] = []
        old = {} if before is None else before.attributes()
        for name, attribute in attrs.items():
            value = attribute.value
            if isinstance(value, np.ndarray):
                value = value.tolist()
            if name not in old or old[name] != value:
                steps.append(("set", of, name, value))
        gone = (name for name in old if name not in attrs and name != "name")
        steps.extend(("unset", of, name) for name in gone)
        return steps

    def _make(self, steps: list[tuple[Any, ...]]) -> bool:
        if steps:
            self._world._make(steps)
        return True

    def get_node(self, of: int | str) -> Node | None:
        """The node with an id or a name. `None` if there is none."""
        now = self._now()
        node = self._node(of, now)
        return None if node is None else Node._of(self, now, node)

    def get_node_root(self) -> Node | None:
        """The node of the type `root`."""
        found = self.get_nodes_by_type("root")
        return found[0] if found else None

    def get_nodes(self) -> list[Node]:
        """All nodes."""
        now = self._now()
        return [Node._of(self, now, node) for node in now.nodes()]

    def get_nodes_by_type(self, type: str) -> list[Node]:
        """The nodes of a type."""
        now = self._now()
        return [Node._of(self, now, node) for node in now.nodes() if node.type == type]

    def get_nodes_by_types(self, types: Iterable[str]) -> list[Node]:
        """The nodes of several types."""
        return [node for type in types for node in self.get_nodes_by_type(type)]

    def get_id_from_name(self, name: str) -> int | None:
        """The id of the node with a name."""
        node = self._node(name)
        return None if node is None else _id(node.id)

    def get_name_from_id(self, id: int) -> str | None:
        """The name of the node with an id."""
        node = self._node(id)
        return None if node is None else node.name

    def get_node_level(self, node: Node) -> int | None:
        """The attribute `level`."""
        level: int | None = self.get_attrib_by_name(node, "level")
        return level

    def get_parent_id(self, node: Node) -> int | None:
        """The id of the node above it in the tree."""
        own = self._node(node.id)
        edges = [] if own is None else self._world.snapshot().graph.edges(_RT, None, own)
        return _id(edges[0].start.id) if edges else None

    def get_attrib_by_name(self, of: Node | Edge, name: str) -> Any:
        """The value of an attribute of a copy. `None` if it has none."""
        attribute = of.attrs.get(name)
        return None if attribute is None else attribute.value

    def add_or_modify_attrib_local(self, of: Node | Edge, name: str, value: Any) -> None:
        """Sets an attribute of a copy. `update_node` or `insert_or_assign_edge` writes it."""
        of.attrs[name] = Attribute(value)

    def remove_attrib_local(self, of: Node | Edge, name: str) -> bool:
        """Takes an attribute from a copy."""
        return of.attrs.pop(name, None) is not None

    def insert_node(self, node: Node) -> int | None:
        """Adds a node with the attributes of a copy. `None` if one of its name is there."""
        if node.name and self._node(node.name) is not None:
            return None
        steps: list[tuple[Any, ...]] = [("node", node.type)]
        if node.name:
            steps.append(("set", 0, "name", node.name))
        steps += self._set(0, None, node.attrs)
        _, made = self._world._replica.change(self._world._link.now_ns(), steps)
        self._world._send()
        node.id = _id(made[0].id)
        node._graph = self
        return node.id

    def update_node(self, node: Node) -> bool:
        """Gives a node the attributes of a copy, in one change. False if there is no such node."""
        before = self._node(node.id or node.name)
        if before is None:
            return False
        return self._make(self._set(before, before, node.attrs))

    def delete_node(self, of: int | str) -> bool:
        """Removes a node with its edges. False if there is no such node."""
        node = self._node(of)
        return False if node is None else self._make([("remove", node)])

    def get_edge(self, start: int | str, end: int | str, type: str) -> Edge | None:
        """The edge of a type between two nodes. `None` if there is none."""
        edge = self._edge(start, end, type)
        return None if edge is None else Edge._of(edge)

    def get_edges_by_type(self, type: str) -> list[Edge]:
        """The edges of a type."""
        return [Edge._of(edge) for edge in self._world.snapshot().graph.edges(type)]

    def get_edges_to_id(self, id: int) -> list[Edge]:
        """The edges to a node."""
        node = self._node(id)
        edges = [] if node is None else self._world.snapshot().graph.edges(None, None, node)
        return [Edge._of(edge) for edge in edges]

    def get_edges(self, id: int) -> list[Edge]:
        """The edges from a node."""
        node = self._node(id)
        edges = [] if node is None else self._world.snapshot().graph.edges(None, node)
        return [Edge._of(edge) for edge in edges]

    def insert_or_assign_edge(self, edge: Edge) -> bool:
        """Adds an edge, or gives it the attributes of a copy. False if one of its nodes is not there."""
        first, last = self._node(edge.origin), self._node(edge.destination)
        if first is None or last is None:
            return False
        before = self._edge(edge.origin, edge.destination, edge.type)
        if before is not None:
            return self._make(self._set(before, before, edge.attrs))
        steps: list[tuple[Any, ...]] = [("edge", edge.type, first, last)]
        return self._make(steps + self._set(0, None, edge.attrs))

    def delete_edge(self, start: int | str, end: int | str, type: str) -> bool:
        """Removes an edge. False if there is no such edge."""
        edge = self._edge(start, end, type)
        return False if edge is None else self._make([("remove", edge)])

    def insert_or_assign_edge_RT(  # noqa: N802
        self, parent: Node, child: int | str, trans: Sequence[float], rot: Sequence[float]
    ) -> bool:
        """Puts a node into the frame of another one, which it has as its only parent then."""
        first, last = self._node(parent.id), self._node(child)
        if first is None or last is None:
            return False
        pose = [(_TRANSLATION, [float(x) for x in trans]), (_ROTATION, [float(x) for x in rot])]
        steps: list[tuple[Any, ...]] = []
        of: Any = None
        for edge in self._world.snapshot().graph.edges(_RT, None, last):
            if edge.start == first:
                of = edge
            else:
                steps.append(("remove", edge))
        if of is None:
            of = len(steps)
            steps.append(("edge", _RT, first, last))
        steps += [("set", of, name, value) for name, value in pose]
        return self._make(steps)

    def write_to_json_file(self, file: str | Path, skip_atts: Iterable[str] = ()) -> None:
        """Writes the present version as a file of DSR, without these attributes. The log says what such a file does
        not have. Raises `OSError` if it cannot be written."""
        for lost in self._now()._now.write_dsr(Path(file), list(skip_atts)):
            logging.getLogger("robocomp").warning(f"{file}: {lost}")


class rt_api:  # noqa: N801
    """Poses of edges."""

    __slots__ = ("_graph",)

    def __init__(self, graph: DSRGraph) -> None:
        self._graph = graph

    def insert_or_assign_edge_RT(  # noqa: N802
        self, parent: Node, child: int, trans: Sequence[float], rot: Sequence[float]
    ) -> bool:
        """As `DSRGraph.insert_or_assign_edge_RT`."""
        return self._graph.insert_or_assign_edge_RT(parent, child, trans, rot)

    @staticmethod
    def get_edge_RT(node: Node, to: int, type_edge: str = _RT) -> Edge | None:  # noqa: N802
        """The edge `RT` to a node, as it is now. `None` if there is none, or if the first node was never in a graph."""
        return None if node._graph is None else node._graph.get_edge(node.id, to, type_edge)

    def get_edge_RT_as_rtmat(  # noqa: N802
        self, edge: Edge, timestamp: int = 0
    ) -> npt.NDArray[np.float64] | None:
        """The homogeneous matrix from the end of an edge `RT` to its start."""
        start = self._graph.get_name_from_id(edge.origin)
        end = self._graph.get_name_from_id(edge.destination)
        if start is None or end is None:
            return None
        return inner_api(self._graph).get_transformation_matrix(start, end, timestamp)

    def get_translation(self, parent: int, child: int) -> list[float] | None:
        """The translation of an edge `RT`."""
        edge = self._graph.get_edge(parent, child, _RT)
        return None if edge is None else self._graph.get_attrib_by_name(edge, _TRANSLATION)

    def get_RT_pose_from_parent(  # noqa: N802
        self, node: Node
    ) -> npt.NDArray[np.float64] | None:
        """The homogeneous matrix from a node to the one above it."""
        parent = self._graph.get_parent_id(node)
        name = None if parent is None else self._graph.get_name_from_id(parent)
        return None if name is None else self._graph._world.matrix(name, node.name)


class inner_api:  # noqa: N801
    """Transforms over the tree. A time is in nanoseconds of the network's clock; 0 is the present."""

    __slots__ = ("_world",)

    def __init__(self, graph: DSRGraph) -> None:
        self._world = graph._world

    def get_transformation_matrix(
        self, to: str, frame: str, timestamp: int = 0
    ) -> npt.NDArray[np.float64] | None:
        """The homogeneous matrix from a frame to another one. `None` if they are not connected."""
        try:
            return self._world.matrix(to, frame, timestamp or None)
        except (KeyError, ValueError):
            return None

    def transform(
        self, to: str, point: Sequence[float] | str, frame: str | None = None, timestamp: int = 0
    ) -> npt.NDArray[np.float64] | None:
        """The coordinates in a frame of a point with these coordinates in another one; `transform(to, frame)` is
        that of the origin."""
        own = point if isinstance(point, str) else str(frame)
        point = (0.0, 0.0, 0.0) if isinstance(point, str) else point
        matrix = self.get_transformation_matrix(to, own, timestamp)
        if matrix is None:
            return None
        moved: npt.NDArray[np.float64] = (matrix @ np.array([*point[:3], 1.0]))[:3]
        return moved

    def transform_axis(
        self, to: str, pose: Sequence[float] | str, frame: str | None = None, timestamp: int = 0
    ) -> npt.NDArray[np.float64] | None:
        """As `transform`, with the angles about x, y, z after the point."""
        own = pose if isinstance(pose, str) else str(frame)
        pose = (0.0,) * 6 if isinstance(pose, str) else pose
        matrix = self.get_transformation_matrix(to, own, timestamp)
        if matrix is None:
            return None
        both = matrix @ _matrix(pose)
        return np.array([*both[:3, 3], *_angles(both)])

    def get_translation_vector(
        self, to: str, frame: str, timestamp: int = 0
    ) -> npt.NDArray[np.float64] | None:
        """Where the origin of a frame is in another one."""
        matrix = self.get_transformation_matrix(to, frame, timestamp)
        return None if matrix is None else matrix[:3, 3]

    def get_rotation_matrix(
        self, to: str, frame: str, timestamp: int = 0
    ) -> npt.NDArray[np.float64] | None:
        """The rotation from a frame to another one."""
        matrix = self.get_transformation_matrix(to, frame, timestamp)
        return None if matrix is None else matrix[:3, :3]

    def get_euler_xyz_angles(
        self, to: str, frame: str, timestamp: int = 0
    ) -> npt.NDArray[np.float64] | None:
        """The angles about x, y, z of this rotation: Rx·Ry·Rz."""
        matrix = self.get_transformation_matrix(to, frame, timestamp)
        return None if matrix is None else np.array(_angles(matrix))


def _matrix(pose: Sequence[float]) -> npt.NDArray[np.float64]:
    """The homogeneous matrix of a pose: Rx·Ry·Rz."""
    x, y, z, rx, ry, rz = (float(number) for number in pose)
    (sx, cx), (sy, cy), (sz, cz) = ((math.sin(a), math.cos(a)) for a in (rx, ry, rz))
    return np.array(
        [
            [cy * cz, -cy * sz, sy, x],
            [cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy, y],
            [sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy, z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _angles(matrix: npt.NDArray[np.float64]) -> tuple[float, float, float]:
    return (
        math.atan2(-matrix[1, 2], matrix[2, 2]),
        math.atan2(matrix[0, 2], math.hypot(matrix[0, 0], matrix[0, 1])),
        math.atan2(-matrix[0, 1], matrix[0, 0]),
    )


class signals:  # noqa: N801
    """Functions that run when the world changes, on the thread of the worker: `signals.connect(g,
    signals.UPDATE_NODE_ATTR, function)`."""

    UPDATE_NODE = "UPDATE_NODE"
    """A node is new: `function(id, type)`."""
    UPDATE_NODE_ATTR = "UPDATE_NODE_ATTR"
    """A node has other attributes: `function(id, names)`."""
    UPDATE_EDGE = "UPDATE_EDGE"
    """An edge is new: `function(from_, to, type)`."""
    UPDATE_EDGE_ATTR = "UPDATE_EDGE_ATTR"
    """An edge has other attributes: `function(from_, to, type, names)`."""
    DELETE_NODE = "DELETE_NODE"
    """A node was removed: `function(id)`."""
    DELETE_EDGE = "DELETE_EDGE"
    """An edge was removed: `function(from_, to, type)`."""

    @classmethod
    def connect(cls, graph: DSRGraph, signal: str, function: Callable[..., Any]) -> None:
        """Runs a function for each change of a kind. An error of it goes to the log of the component."""
        if signal not in cls.__dict__ or not signal.isupper():
            raise ValueError(f"{signal!r} is not a signal")
        graph._world._listen(_Listener(signal, function))


class _Listener:
    """Passes the changes of one kind to a function."""

    __slots__ = ("_function", "_signal")

    def __init__(self, signal: str, function: Callable[..., Any]) -> None:
        self._signal = signal
        self._function = function

    def __call__(self, changes: Sequence[tuple[str, GraphNode | GraphEdge, list[str]]]) -> Iterator[Call]:
        for what, element, names in changes:
            kind = "EDGE" if isinstance(element, GraphEdge) else "NODE"
            signal = {
                "added": f"UPDATE_{kind}",
                "changed": f"UPDATE_{kind}_ATTR",
                "removed": f"DELETE_{kind}",
            }[what]
            if signal != self._signal:
                continue
            more = (names,) if what == "changed" else ()
            if isinstance(element, GraphEdge):
                yield self._function, (_id(element.start.id), _id(element.end.id), element.type, *more)
            elif what == "added":
                yield self._function, (_id(element.id), element.type)
            else:
                yield self._function, (_id(element.id), *more)
