"""The shared world of a component: a graph of which each component of a network has a replica."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from datetime import timedelta
from time import monotonic_ns
from types import TracebackType
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from robocomp import graph as _graphs
from robocomp._context import Context
from robocomp._errors import WorkerError
from robocomp._graph import Edge as GraphEdge
from robocomp._graph import Node as GraphNode
from robocomp._graph import World as Replica
from robocomp._link import Link

__all__ = [
    "Behind",
    "Change",
    "Edge",
    "EdgeEdit",
    "Edit",
    "Element",
    "Node",
    "NodeEdit",
    "Overruled",
    "Point",
    "Pose",
    "TooEarly",
    "TooLate",
    "View",
    "World",
    "WorldContext",
]

Point = tuple[float, float, float]
"""x, y, z in the unit of the schema's translations."""

Pose = tuple[float, float, float, float, float, float]
"""x, y, z in the unit of the schema's translations, and the angles about x, y, z."""

_LONGEST_WAIT = timedelta(hours=1)

Call = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function of a user that is due, and its arguments."""

Listener = Callable[[list[tuple[str, Any, list[str]]]], Iterable[Call]]
"""Tells which functions are due after changes: what, the element, and its attributes that are others."""

V = TypeVar("V", bound="View")
E = TypeVar("E", bound="Edit")
K = TypeVar("K", bound="Element")


class TooEarly(ValueError):
    """The history of the world begins after the time that was asked for."""


class TooLate(ValueError):
    """The newest change of the world is older than the time that was asked for."""

    def __init__(self, newest: timedelta) -> None:
        super().__init__(f"the newest change is of {newest}")
        self.newest = newest


class Behind(TimeoutError):
    """The replica did not get a change within the time that was given to it."""

    def __init__(self, token: str) -> None:
        super().__init__(f"the replica does not have the change {token} yet")
        self.token = token


class Element:
    """A node or an edge of one version. It never changes."""

    __slots__ = ("element",)

    KIND: ClassVar[str] = ""
    IS_EDGE: ClassVar[bool] = False

    def __init__(self, element: Any) -> None:
        self.element = element
        """The element without types, as of `robocomp.graph`."""

    @property
    def id(self) -> str:
        """The id, `WRITER:COUNT`."""
        return str(self.element.id)

    @property
    def type(self) -> str:
        """The type, which may be one that inherits from the class's."""
        return str(self.element.type)

    def get(self, attribute: str) -> Any:
        """The value of an attribute. `None` if it has none."""
        return self.element[attribute] if attribute in self.element else None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Element) and self.element == other.element

    def __hash__(self) -> int:
        return hash(self.element)

    def __repr__(self) -> str:
        return repr(self.element)


class Node(Element):
    """A node of one version."""

    __slots__ = ()

    element: GraphNode


class Edge(Element):
    """An edge of one version."""

    __slots__ = ()

    IS_EDGE: ClassVar[bool] = True

    element: GraphEdge

    @property
    def start(self) -> Node:
        """The node where the edge starts."""
        return Node(self.element.start)

    @property
    def end(self) -> Node:
        """The node where the edge ends."""
        return Node(self.element.end)


class View:
    """One version of the world. It never changes, and readers block no writer."""

    __slots__ = ("_snapshot",)

    def __init__(self, snapshot: Any) -> None:
        self._snapshot = _graphs.Snapshot(snapshot)

    @property
    def graph(self) -> _graphs.Snapshot:
        """The version without types: nodes, queries, traversals."""
        return self._snapshot

    def all(self, kind: type[K]) -> list[K]:
        """All elements of a type, and of those that inherit from it."""
        if not kind.IS_EDGE:
            return [kind(node) for node in self._snapshot.nodes(kind.KIND)]
        return [kind(edge) for edge in self._snapshot.edges(kind.KIND)]

    def node(self, name: str) -> Node:
        """The only node with a name. Raises `KeyError` if there is none, or several."""
        return Node(self._snapshot.node(name))

    def _one(self, kind: type[K], name: str) -> K:
        found = [node for node in self._snapshot.nodes(kind.KIND) if node.name == name]
        if len(found) == 1:
            return kind(found[0])
        what = "no" if not found else "more than one"
        raise KeyError(f"{what} `{kind.KIND}` has the name {name!r}")

    def _edge(self, kind: type[K], start: str | Node, end: str | Node) -> K | None:
        edges = self._snapshot.edges(kind.KIND, self._end(start), self._end(end))
        return kind(edges[0]) if edges else None

    def _query(self, name: str, *parameters: tuple[str, Any]) -> list[Any]:
        return self._snapshot.run(name, dict(parameters))

    def _end(self, end: str | Node) -> GraphNode:
        return self._snapshot.node(end) if isinstance(end, str) else end.element


class _ElementEdit:
    """An element as a change sets it."""

    __slots__ = ("_edit", "_of")

    KIND: ClassVar[str] = ""

    _edit: Edit
    _of: Any

    def __init__(self, edit: Edit, of: Any) -> None:
        object.__setattr__(self, "_edit", edit)
        object.__setattr__(self, "_of", of)

    def get(self, attribute: str) -> Any:
        """The value before the change. `None` if there was none."""
        of = self._of
        return None if isinstance(of, int) or attribute not in of else of[attribute]

    def set(self, attribute: str, value: Any) -> None:
        """Gives an attribute a value; `None` takes it away."""
        if value is None:
            self._edit._add("unset", self._of, attribute)
        else:
            self._edit._add("set", self._of, attribute, value)

    def remove(self) -> None:
        """Removes the element; a node with its edges."""
        self._edit._add("remove", self._of)

    def __setattr__(self, name: str, value: Any) -> None:
        # A mistyped attribute would be lost.
        if not isinstance(getattr(type(self), name, None), property):
            raise AttributeError(f"a change of `{self.KIND or 'an element'}` does not set {name!r}")
        object.__setattr__(self, name, value)


class NodeEdit(_ElementEdit):
    """A node as a change sets it."""

    __slots__ = ()


class EdgeEdit(_ElementEdit):
    """An edge as a change sets it."""

    __slots__ = ()


class Edit:
    """A change that is being made: `with ctx.g.change() as edit:`. Its steps are done together at the end
    of the block. If the block raises, nothing has changed."""

    __slots__ = ("_edges", "_now", "_steps", "_world", "token")

    def __init__(self, world: World[Any, Any]) -> None:
        self._world = world
        self._steps: list[tuple[Any, ...]] = []
        # The edges that the change adds, by their types and ends.
        self._edges: dict[tuple[str, Any, Any], int] = {}
        self._now: View = world.snapshot()
        self.token: str | None = None
        """Names the change once it is made, for `World.has` of any replica."""

    def __enter__(self: E) -> E:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        place: TracebackType | None,
    ) -> None:
        if kind is None:
            self.token = self._world._make(self._steps)

    def add_node(self, kind: str, name: str | None = None) -> NodeEdit:
        """Adds a node of a type."""
        node: NodeEdit = self._new(NodeEdit, kind, name)
        return node

    def node(self, node: str | Node) -> NodeEdit:
        """Changes a node."""
        return NodeEdit(self, self._end(node))

    def add_edge(self, kind: str, start: str | Node | NodeEdit, end: str | Node | NodeEdit) -> EdgeEdit:
        """Adds an edge of a type."""
        return EdgeEdit(self, self._add_edge(kind, self._end(start), self._end(end)))

    def edge(self, edge: Edge) -> EdgeEdit:
        """Changes an edge."""
        return EdgeEdit(self, edge.element)

    def _add(self, *step: Any) -> int:
        self._steps.append(step)
        return len(self._steps) - 1

    def _add_edge(self, kind: str, first: Any, last: Any) -> int:
        at = self._add("edge", kind, first, last)
        self._edges[kind, first, last] = at
        return at

    def _end(self, end: str | Node | NodeEdit) -> Any:
        if isinstance(end, NodeEdit):
            return end._of
        return self._now._end(end)

    def _new(self, edit: Callable[[Edit, Any], Any], kind: str, name: str | None) -> Any:
        at = self._add("node", kind)
        if name is not None:
            self._add("set", at, "name", name)
        return edit(self, at)

    def _one(self, edit: Callable[[Edit, Any], Any], kind: type[Element], name: str | Node) -> Any:
        element = self._now._one(kind, name).element if isinstance(name, str) else name.element
        return edit(self, element)

    def _between(
        self,
        edit: Callable[[Edit, Any], Any],
        kind: type[Element],
        start: str | Node | NodeEdit,
        end: str | Node | NodeEdit,
        adds: bool,
    ) -> Any:
        """The edge between two nodes; where there is none, a new one if the component adds such edges."""
        first, last = self._end(start), self._end(end)
        if not isinstance(first, int) and not isinstance(last, int):
            for edge in self._now.graph.edges(kind.KIND, first, last):
                return edit(self, edge)
        new = self._edges.get((kind.KIND, first, last))
        if new is not None:
            return edit(self, new)
        if not adds:
            raise KeyError(f"there is no `{kind.KIND}` between these nodes, and the component adds none")
        return edit(self, self._add_edge(kind.KIND, first, last))


class Change(Generic[K]):
    """The changes of one type, and of those that inherit from it, since its handler ran last."""

    __slots__ = ("_attributes", "added", "after", "before", "changed", "removed")

    def __init__(self, before: View, after: View, kind: type[K], of: tuple[Any, Any, Any]) -> None:
        added, changed, removed = of
        self.before = before
        """The version before."""
        self.after = after
        """The version now."""
        self.added = [kind(element) for element in added]
        """New elements."""
        self.changed = [kind(element) for element, _ in changed]
        """Elements with other attributes, as they are now. New ones are none of them."""
        self.removed = [kind(element) for element in removed]
        """Removed elements, as they were."""
        self._attributes = {kind(element): names for element, names in changed}

    def attributes(self, element: K) -> list[str]:
        """The attributes of an element that are others."""
        names: list[str] = self._attributes.get(element, [])
        return names

    def __bool__(self) -> bool:
        return bool(self.added or self.changed or self.removed)


class Overruled:
    """Another component gave an attribute a value at the same time as this one, whose value is shown."""

    __slots__ = ("attribute", "element", "other", "shown")

    def __init__(self, element: Any, attribute: str, shown: Any, other: Any) -> None:
        self.element: Node | Edge = Edge(element) if isinstance(element, GraphEdge) else Node(element)
        """The element."""
        self.attribute: str = attribute
        """The attribute."""
        self.shown = shown
        """The value of this component, which all show."""
        self.other = other
        """The value of the other one, which none shows."""


# The world of the component whose worker runs on a thread.
_OF_THREAD = threading.local()


class World(Generic[V, E]):
    """A replica of the world of a network."""

    def __init__(
        self,
        link: Link,
        view: type[V],
        edit: type[E],
        files: Sequence[tuple[str, str]],
        rights: Sequence[tuple[str, str | None, int | None]] | None,
    ) -> None:
        self._link = link
        self._view = view
        self._edit = edit
        given = link.world_schema()
        if not given:
            link.set_world_schema(list(files))
        rights = None if rights is None else list(rights)
        self._replica = Replica(link.name(), link.unique(), link.now_ns(), list(files), given, rights)
        link.know_frames(self._replica.metres)
        self._send: Callable[[], None] = lambda: None
        _OF_THREAD.world = self
        self._listeners: list[Listener] = []

    def snapshot(self, after: str | None = None, limit: timedelta = timedelta(0)) -> V:
        """The present version. It never changes.

        With `after`, it has the change that this token names, and all earlier ones of its writer: what is
        asked of it knows what another component has just done. `Behind` is raised if the change does not
        arrive within `limit`.
        """
        if after is not None and not self.wait_for(after, limit):
            raise Behind(after)
        return self._view(self._replica.snapshot())

    def change(self) -> E:
        """A change of several steps, which others see as one: `with ctx.g.change() as edit:`.

        At the end of the block, `ValueError` is raised if the schema does not allow the change, or if the
        component does not write what is changed. Nothing has changed then.
        """
        return self._edit(self)

    def has(self, token: str) -> bool:
        """Whether this replica has the change that a token names."""
        return self._replica.has(token)

    def has_joined(self) -> bool:
        """Whether this replica has what the others had when it joined, or is alone, which it knows after 2.5 s.

        Until then, what it does not find may be on its way.
        """
        return self._replica.has_joined()

    def wait_for(self, token: str, limit: timedelta) -> bool:
        """Waits until this replica has a change, at most for `limit` of the system's time, and for an hour. Returns
        whether it has it.

        Meanwhile the replica gets what others send, and no handler runs. In simulated time it does not wait,
        for nothing arrives within a turn.
        """
        until = monotonic_ns() + min(limit, _LONGEST_WAIT) // timedelta(microseconds=1) * 1000
        while not self._replica.has(token):
            came = self._link.await_world(max(0, until - monotonic_ns()))
            if came is None:
                break
            now, sample = came
            if sample is not None:
                # What is no message, the event loop says later.
                with contextlib.suppress(ValueError):
                    self._replica.receive(*sample)
            self._replica.turn(now)
            self._send()
        return self._replica.has(token)

    @property
    def conflicts(self) -> list[str]:
        """The hidden elements, each with the element that hides it."""
        return self._replica.conflicts()

    def matrix(
        self, to: str, frame: str, time: timedelta | int | None = None
    ) -> npt.NDArray[np.float64]:
        """The homogeneous matrix from the frame of a node to that of another one. With a time of the
        network's clock, also as nanoseconds, it is interpolated between two changes.

        Raises `KeyError` for a name of no node, `ValueError` if no edges with poses connect the nodes,
        `TooEarly` before the history, and `TooLate` after the newest change.
        """
        if isinstance(time, timedelta):
            nanoseconds: int | None = (time // timedelta(microseconds=1)) * 1000
        else:
            nanoseconds = time
        newest = self._replica.newest_ns()
        if nanoseconds is not None and nanoseconds > newest:
            raise TooLate(timedelta(microseconds=newest / 1000))
        rows = self._replica.matrix(to, frame, nanoseconds)
        if rows is None:
            raise TooEarly("the history of the world begins later")
        return np.array(rows)

    def transform(
        self, to: str, point: Sequence[float], frame: str, time: timedelta | int | None = None
    ) -> Point:
        """The coordinates in `to` of a point with these coordinates in `frame`. Raises as `matrix` does."""
        x, y, z, _ = self.matrix(to, frame, time) @ np.array([*point, 1.0])
        return float(x), float(y), float(z)

    def pose(self, to: str, frame: str) -> Pose:
        """The pose of `frame` in `to`, of the present version."""
        now = self.snapshot().graph
        return now.pose(now.node(to), now.node(frame))

    def _listen(self, listener: Listener) -> None:
        """Hands all changes from now on to a listener."""
        self._listeners.append(listener)

    def _make(self, steps: list[tuple[Any, ...]]) -> str:
        token, _ = self._replica.change(self._link.now_ns(), steps)
        self._send()
        return token


class WorldContext(Context):
    """The context of a component with a world."""

    # The slots that publish `World` and `WorldStream`.
    _world_publishers: ClassVar[tuple[int, int]] = (0, 0)
    # The types that the worker reads, and their handlers.
    _world_reads: ClassVar[Sequence[tuple[type[Element], str]]] = ()

    def _open_world(self, world: World[Any, Any]) -> None:
        self._world = world
        world._send = self._send_world

    def _receive_world(self, is_stream: bool, topic: int, body: bytes) -> None:
        self._world._replica.receive(is_stream, topic, body)

    def _send_world(self) -> None:
        state, stream = self._world_publishers
        for is_stream, topic, sample in self._world._replica.take():
            try:
                self._link.publish_encoded(stream if is_stream else state, topic, sample)
            except WorkerError:
                raise
            except Exception as error:
                # Losses are repaired later.
                logging.getLogger("robocomp").warning(f"the world cannot tell what has changed: {error}")

    def _turn_world(self, worker: Any) -> bool:
        replica = self._world._replica
        replica.turn(self._link.now_ns())
        self._send_world()
        told = replica.look()
        if told is not None:
            self._link.set_world_status(told)
        # All run, also after one that fails, because a change comes only once. The component may
        # have to end by its error.
        errors: list[Exception] = []
        did = False
        for function, arguments in self._due(worker):
            did = True
            try:
                function(*arguments)
            except Exception as error:
                errors.append(error)
        errors.sort(key=lambda error: not isinstance(error, WorkerError))
        for other in errors[1:]:
            logging.getLogger("robocomp").error(f"the world: {type(other).__name__}: {other}")
        if errors:
            raise errors[0]
        return did

    def _due(self, worker: Any) -> Iterator[Call]:
        """The functions of the user that are due, in their order."""
        replica = self._world._replica
        overruled = getattr(worker, "overruled", None)
        if overruled is not None:
            for value in self._overruled():
                yield overruled, (self, value)
        kinds = [kind.KIND for kind, _ in self._world_reads]
        news = replica.news(kinds, bool(self._world._listeners))
        if news is None:
            return
        for listener in self._world._listeners:
            yield from listener(news[3])
        before, after = self._world._view(news[0]), self._world._view(news[1])
        for (kind, handler), of in zip(self._world_reads, news[2], strict=True):
            change = Change(before, after, kind, of)
            function = getattr(worker, handler)
            if change and not hasattr(function, "_robocomp_default"):
                yield function, (self, change)

    def _overruled(self) -> Iterator[Overruled]:
        while (value := self._world._replica.overruled()) is not None:
            yield Overruled(*value)

    def _leave_world(self) -> None:
        self._world._replica.leave()
        self._send_world()
