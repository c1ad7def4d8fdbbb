"""Queries and traversals of a graph."""

import ast
import itertools
import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import unittest
from datetime import timedelta
from pathlib import Path

import numpy as np
import robocomp
from robocomp import dsr, world
from robocomp.graph import Graph

SCHEMA = """
Domain house
{
    entity Thing { name string; };
    entity Person :Thing { age int optional; };
    entity Place :Thing { area float optional; };
    relation in { what Thing; where Place; };
    query people_in(room Place) "MATCH (p:Person)-[:in]->(r) WHERE r = $room RETURN p.name";
};
"""

GRAPH = """{
"schema": "house.gdsl",
"nodes": [
{"id": "1:1", "type": "Person", "attributes": {"name": "Ada", "age": 36}},
{"id": "1:2", "type": "Person", "attributes": {"name": "Bob"}},
{"id": "1:3", "type": "Place", "attributes": {"name": "kitchen", "area": 12.5}},
{"id": "1:4", "type": "Place", "attributes": {"name": "house", "area": 80.0}},
{"id": "1:5", "type": "Place", "attributes": {"name": "town"}}
],
"edges": [
{"id": "1:6", "type": "in", "from": "1:1", "to": "1:3"},
{"id": "1:7", "type": "in", "from": "1:2", "to": "1:4"},
{"id": "1:8", "type": "in", "from": "1:3", "to": "1:4"},
{"id": "1:9", "type": "in", "from": "1:4", "to": "1:5"}
]}
"""

RING = """{
"nodes": [
{"id": "1:1", "type": "Place", "attributes": {"name": "a"}},
{"id": "1:2", "type": "Place", "attributes": {"name": "b"}},
{"id": "1:3", "type": "Place", "attributes": {"name": "c"}}
],
"edges": [
{"id": "1:4", "type": "next", "from": "1:1", "to": "1:2"},
{"id": "1:5", "type": "next", "from": "1:2", "to": "1:3"},
{"id": "1:6", "type": "next", "from": "1:3", "to": "1:1"}
]}
"""

ROOM = """{
"schema": "geometry.gdsl",
"nodes": [
{"id": "1:1", "type": "Frame", "attributes": {"name": "world"}},
{"id": "1:2", "type": "Frame", "attributes": {"name": "table"}},
{"id": "1:3", "type": "Frame", "attributes": {"name": "cup"}}
],
"edges": [
{"id": "1:4", "type": "RT", "from": "1:1", "to": "1:2", "attributes": {"pose": [1.0, 0.5, 0.0, 0.0, 0.0, 1.5707963267948966]}},
{"id": "1:5", "type": "RT", "from": "1:2", "to": "1:3", "attributes": {"pose": [2.0, 0.0, 0.25, 0.0, 0.0, 0.0]}}
]}
"""

POSE = "MATCH (c {name: 'cup'}), (t {name: 'table'}) RETURN pose(c, t) AS p"


class Graphs(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        (cls.folder / "house.gdsl").write_text(SCHEMA)
        (cls.folder / "house.graph").write_text(GRAPH)
        cls.now = Graph.read(cls.folder / "house.graph").snapshot()

    def names(self, nodes) -> list[str]:
        return sorted(node.name for node in nodes)

    def test_nodes_have_attributes(self):
        ada = self.now.node("Ada")
        self.assertEqual((ada.type, ada.id, ada["age"]), ("Person", "1:1", 36))
        self.assertEqual(ada.attributes(), {"name": "Ada", "age": 36})
        self.assertEqual(repr(ada), "(Ada:Person)")
        self.assertIn("age", ada)
        self.assertNotIn("area", ada)
        with self.assertRaises(KeyError):
            ada["area"]
        with self.assertRaises(KeyError):
            self.now.node("nobody")
        self.assertEqual(len(self.now), 5)
        self.assertEqual(self.names(self.now.nodes("Person")), ["Ada", "Bob"])
        self.assertEqual(len(self.now.nodes("Thing")), 5)
        self.assertEqual({ada, self.now.nodes("Person")[0], self.now.nodes("Person")[1]}, set(self.now.nodes("Person")))

    def test_texts_are_asked(self):
        text = "MATCH (p:Person)-[e:in]->(r) WHERE r.name = $room RETURN p, e, p.age AS age, [1, 2.5, null] AS all"
        [row] = self.now.query(text, {"room": "kitchen"})
        self.assertEqual((row.p, row.age, row.all), (self.now.node("Ada"), 36, [1, 2.5, None]))
        self.assertEqual((row.e.type, row.e.start.name, row.e.end.name), ("in", "Ada", "kitchen"))
        both = self.now.query("MATCH (p:Person) WHERE p.name IN $names RETURN count(*) AS n", {"names": ["Ada", "Bob"]})
        self.assertEqual(both[0].n, 2)
        [row] = self.now.query('RETURN 500 unit "g" + 1 unit "kg" AS mass, 1 AS n')
        self.assertEqual((row.mass, row._units), (1500.0, {"mass": "g", "n": None}))
        for text, message in [
            ('RETURN 1 unit "kg" + 1 unit "m" AS x', "query:1:29: error[unit-mismatch]"),
            ("MATCH (p:Persn) RETURN p", "query:1:10: error[unknown-type]"),
            ("MATCH (p) RETURN $what", "error[unknown-parameter]"),
        ]:
            with self.assertRaises(ValueError) as raised:
                self.now.query(text)
            self.assertIn(message, str(raised.exception))
        with self.assertRaises(ValueError):
            self.now.query("MATCH (a), (b), (c) RETURN a", rows=10)
        with self.assertRaises(TypeError):
            self.now.query("RETURN $x", {"x": object()})

    def test_queries_of_the_schema_are_run(self):
        self.assertEqual(self.now.queries, ["people_in"])
        self.assertEqual(self.now.run("people_in", {"room": self.now.node("kitchen")}), [("Ada",)])
        with self.assertRaises(ValueError):
            self.now.run("people_in", {"room": self.now.node("Ada")})
        with self.assertRaises(ValueError):
            self.now.run("people_out")

    def test_steps_lead_from_nodes_to_nodes(self):
        people = self.now.traverse(self.now.nodes("Person"))
        in_kitchen = people.as_("who").out("in").has("name", "kitchen").select("who")
        self.assertEqual(in_kitchen.values("name"), ["Ada"])
        self.assertEqual(self.names(people), ["Ada", "Bob"])
        house = self.now.traverse(self.now.node("house"))
        self.assertEqual(self.names(house.in_("in")), ["Bob", "kitchen"])
        self.assertEqual(self.names(house.in_("in").has_type("Person")), ["Bob"])
        self.assertEqual(self.names(house.as_("h").in_("in").out("in").where_eq("h")), ["house", "house"])
        self.assertEqual(self.now.traverse(self.now.node("town")).out("in").count(), 0)
        # A whole number is the same in both kinds.
        self.assertEqual(self.now.traverse(self.now.nodes()).has("area", 80).count(), 1)

    def test_a_path_is_repeated_and_folded(self):
        people = self.now.traverse(self.now.nodes("Person")).as_("who")
        ends = people.repeat_until("in", lambda node: node.name == "town")
        ways = sorted((there["who"].name, there.node.name) for there in ends.traversers())
        self.assertEqual(ways, [("Ada", "town"), ("Bob", "town")])
        self.assertEqual(people.repeat_until("in", lambda node: False).count(), 0)
        places = self.now.traverse(self.now.nodes("Place"))
        area = places.fold(0.0, lambda total, there: total + there.node.attributes().get("area", 0.0))
        self.assertEqual(area, 92.5)

    def test_what_fails_is_raised(self):
        people = self.now.traverse(self.now.nodes("Person"))

        called = []

        def wrong(node):
            called.append(node)
            raise LookupError(node.name)

        with self.assertRaises(LookupError):
            people.repeat_until("in", wrong).nodes()
        self.assertEqual(len(called), 1)
        with self.assertRaises(ValueError):
            people.select("nobody")
        with self.assertRaises(ValueError):
            people.as_("a").as_("b").as_("c").as_("d").as_("e")
        with self.assertRaises(ValueError):
            people.out("in").traversers(steps=1)
        (self.folder / "wrong.graph").write_text('{"nodes": [}')
        with self.assertRaises(ValueError) as raised:
            Graph.read(self.folder / "wrong.graph")
        self.assertIn("wrong.graph:1:12: error[malformed-json]", str(raised.exception))

    def test_a_budget_ends_a_traversal(self):
        (self.folder / "ring.graph").write_text(RING)
        ring = Graph.read(self.folder / "ring.graph").snapshot()
        called = []
        around = ring.traverse(ring.nodes()).repeat_until("next", lambda node: called.append(node))
        with self.assertRaisesRegex(ValueError, "more than 10 steps"):
            around.count(steps=10)
        self.assertEqual(len(called), 10)
        called.clear()
        self.assertEqual(around.nodes(), [])
        self.assertEqual(len(called), 3 * 4)
        nodes = ring.traverse(ring.nodes())
        self.assertEqual(len(nodes.nodes(rows=3)), 3)
        for call in (nodes.nodes, nodes.traversers, lambda rows: nodes.values("name", rows=rows)):
            with self.assertRaisesRegex(ValueError, "more than 2 rows"):
                call(rows=2)
        self.assertEqual(nodes.out("next").count(steps=3), 3)
        for steps in (-1, 2**64):
            with self.assertRaisesRegex(ValueError, "a budget is from 0"):
                nodes.count(steps=steps)
            with self.assertRaisesRegex(ValueError, "a budget is from 0"):
                ring.query("RETURN 1", steps=steps)
        # A graph without a schema may have any relation.
        self.assertEqual(nodes.out("nothing").count(), 0)

    def test_nodes_are_those_of_their_graph(self):
        other = Graph.read(self.folder / "house.graph")
        ada = other.snapshot().node("Ada")
        self.assertEqual(ada, other.snapshot().node("Ada"))
        self.assertEqual(len({ada, other.snapshot().node("Ada"), self.now.node("Ada")}), 2)
        self.assertNotEqual(ada, self.now.node("Ada"))
        self.assertEqual(other.snapshot().traverse(ada).values("name"), ["Ada"])
        edge = other.snapshot().query("MATCH ()-[e]->() RETURN e LIMIT 1")[0].e
        for call in (
            lambda: self.now.traverse(ada).nodes(),
            lambda: self.now.pose(ada, self.now.node("Ada")),
            lambda: self.now.query("RETURN $n", {"n": ada}),
            lambda: self.now.query("RETURN $n", {"n": edge}),
        ):
            with self.assertRaisesRegex(ValueError, "of another graph"):
                call()

    def test_a_pose_is_that_of_a_node_in_a_frame(self):
        (self.folder / "room.graph").write_text(ROOM)
        room = Graph.read(self.folder / "room.graph").snapshot()
        world, table, cup = (room.node(name) for name in ("world", "table", "cup"))
        for found, expected in [
            (room.pose(world, table), (1.0, 0.5, 0.0, 0.0, 0.0, math.pi / 2)),
            # The axis x of the table is the axis y of the world.
            (room.pose(world, cup), (1.0, 2.5, 0.25, 0.0, 0.0, math.pi / 2)),
            (room.pose(cup, table), (-2.0, 0.0, -0.25, 0.0, 0.0, 0.0)),
            (room.pose(cup, table), tuple(room.query(POSE)[0].p)),
        ]:
            for one, other in zip(found, expected, strict=True):
                self.assertAlmostEqual(one, other)
        with self.assertRaises(ValueError):
            self.now.pose(self.now.node("Ada"), self.now.node("Bob"))

    def test_wrong_names_and_values_are_told(self):
        people = self.now.traverse(self.now.nodes("Person"))
        for traversal, message in [
            (people.out("inn"), "the schema has no relation `inn`; did you mean `in`"),
            (people.repeat_until("inn", bool), "the schema has no relation `inn`"),
            (people.has_type("Persn"), "the schema has no type `Persn`; did you mean `Person`"),
            (people.has("aeg", 36), "the schema has no attribute `aeg`; did you mean `age`"),
        ]:
            with self.assertRaisesRegex(ValueError, message):
                traversal.nodes()
        deep = []
        for _ in range(20):
            deep = [deep]
        for value, kind, message in [
            (2**63, ValueError, "64 bits"),
            (deep, ValueError, "16 deep"),
            ([[0] * 40_000, (0,) * 40_000], ValueError, "65536 values"),
            (itertools.count(), TypeError, "found count"),
        ]:
            with self.assertRaisesRegex(kind, message):
                self.now.query("RETURN $x", {"x": value})
        self.assertEqual(self.now.query("RETURN $x AS x", {"x": (1, [2.5])})[0].x, [1, [2.5]])
        with self.assertRaisesRegex(TypeError, "'schemas'"):
            Graph.read(self.folder / "house.graph", include="schemas")
        with self.assertRaisesRegex(FileNotFoundError, "missing.graph: "):
            Graph.read(self.folder / "missing.graph")

    def test_a_missing_module_is_told(self):
        environment = {name: value for name, value in os.environ.items() if name != "ROBOCOMP_GRAPH"}
        command = [sys.executable, "-c", "import robocomp.graph"]
        ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
        self.assertIn("build it with `cargo build --release -p rc-python-graph`", ended.stderr)

    def test_the_stub_has_what_the_module_has(self):
        stub = ast.parse(Path(robocomp.__file__).with_name("_graph.pyi").read_text())
        for declared in stub.body:
            if isinstance(declared, ast.ClassDef):
                names = {part.name for part in declared.body if isinstance(part, ast.FunctionDef)}
                has = set(vars(getattr(robocomp.graph._graph, declared.name)))
                has -= {*dir(object), "__module__"}
                # A constructor is `__new__` in the module.
                self.assertEqual(names - {"__init__"}, has, declared.name)


WORLD = """
Domain home
{
    entity thing { name string; width float optional; level int optional; open bool optional; at int[] optional;
        picture topic "Camera::Image" optional; };
    relation near { what thing; other thing; note string optional; };
};
"""


class Link:
    """What a component has of the runtime."""

    def __init__(self) -> None:
        self.samples = []
        self.arriving = []
        self.longest = 0
        self.time = 0
        self.schema = []

    def name(self) -> str:
        return "one"

    def unique(self) -> int:
        return 17

    def now_ns(self) -> int:
        self.time += 10_000_000
        return self.time

    def know_frames(self, function) -> None:
        self.frames = function

    def world_schema(self):
        return self.schema

    def set_world_schema(self, files) -> None:
        pass

    def set_world_status(self, told) -> None:
        pass

    def publish_encoded(self, slot: int, operation: int, sample: bytes) -> None:
        self.samples.append((slot, operation, sample))

    def await_world(self, limit: int):
        """What arrives next; nothing once it is over."""
        self.longest = max(self.longest, limit)
        if limit == 0 or not self.arriving:
            return None
        return self.now_ns(), self.arriving.pop(0)


class Thing(world.Node):
    __slots__ = ()
    KIND = "thing"


class Near(world.Edge):
    __slots__ = ()
    KIND = "near"


class WithWorld(world.WorldContext):
    _world_reads = ((Thing, "thing_changed"), (Near, "near_changed"))


class Worker:
    def __init__(self) -> None:
        self.near = []

    def thing_changed(self, ctx, change) -> None:
        raise RuntimeError("wrong")

    def near_changed(self, ctx, change) -> None:
        self.near += change.added


class Worlds(unittest.TestCase):
    def setUp(self) -> None:
        self.link = Link()
        self.g = world.World(self.link, world.View, world.Edit, [("home.gdsl", WORLD)], None)
        self.ctx = WithWorld(self.link)
        self.ctx._open_world(self.g)

    def add(self, *names: str) -> None:
        with self.g.change() as edit:
            for name in names:
                edit.add_node("thing", name)

    def test_numbers_have_the_types_of_the_schema(self):
        self.add("a")
        for name, value, expected in [
            ("width", 1, 1.0),
            ("width", np.float32(0.5), 0.5),
            ("level", np.int64(3), 3),
            ("open", np.bool_(True), True),
            ("at", np.array([1, 2]), [1, 2]),
        ]:
            with self.g.change() as edit:
                edit.node("a").set(name, value)
            found = self.g.snapshot().node("a").get(name)
            self.assertEqual((found, type(found)), (expected, type(expected)))
        with self.assertRaisesRegex(ValueError, "`level` of `thing` is int, found float"), self.g.change() as edit:
            edit.node("a").set("level", 0.5)

    def test_a_reference_to_a_sample_is_set_as_it_is_read(self):
        self.add("a", "b")
        for number, found in [(42, 42), (2**64 - 1, str(2**64 - 1))]:
            with self.g.change() as edit:
                edit.node("a").set("picture", ("camera.image", "Camera::Image", number))
            picture = self.g.snapshot().node("a").get("picture")
            self.assertEqual(picture, ["camera.image", "Camera::Image", found])
            with self.g.change() as edit:
                edit.node("b").set("picture", picture)
            self.assertEqual(self.g.snapshot().node("b").get("picture"), picture)
        for wrong in ["camera.image", ("camera.image", "Camera::Image"), ("camera.image", "Camera::Image", -1), 42]:
            with self.assertRaisesRegex(TypeError, "expected a topic, its type"), self.g.change() as edit:
                edit.node("a").set("picture", wrong)
        other = ("camera.image", "Lidar::Scan", 1)
        with self.assertRaisesRegex(ValueError, "Lidar::Scan"), self.g.change() as edit:
            edit.node("a").set("picture", other)

    def test_a_version_has_the_change_of_a_token(self):
        other = Link()
        other.unique = lambda: 18
        writer = world.World(other, world.View, world.Edit, [("home.gdsl", WORLD)], None)
        context = WithWorld(other)
        context._open_world(writer)
        with writer.change() as edit:
            edit.add_node("thing", "a")
        token = edit.token
        with self.assertRaisesRegex(world.Behind, f"does not have the change {token} yet"):
            self.g.snapshot(after=token, limit=timedelta(seconds=1))
        # Time passes, something arrives that is no message, then the change.
        (_, operation, sample) = next(one for one in other.samples if one[1] == 0)
        self.link.arriving = [None, (False, operation, b"nothing"), (False, operation, sample), None]
        self.assertFalse(self.g.wait_for(token, timedelta(0)))
        self.assertFalse(self.g.wait_for(token, timedelta(days=-1)))
        self.assertEqual(len(self.link.arriving), 4)
        self.assertEqual(self.g.snapshot(after=token, limit=timedelta(seconds=1)).node("a").type, "thing")
        self.assertEqual(self.link.arriving, [None])
        # No wait is longer than an hour.
        self.assertFalse(self.g.wait_for("ff:1", timedelta.max))
        self.assertLessEqual(self.link.longest, 3600 * 10**9)

    def test_a_change_adds_an_edge_once(self):
        self.add("a", "b")
        with self.g.change() as edit:
            for note in ("first", "second"):
                edit._between(world.EdgeEdit, Near, "a", "b", True).set("note", note)
        (edge,) = self.g.snapshot().all(Near)
        self.assertEqual(edge.get("note"), "second")

    def test_values_may_run_code_that_changes_the_world(self):
        self.add("a")

        def numbers():
            yield 1
            self.add("b")
            yield 2

        with self.g.change() as edit:
            edit.node("a").set("at", numbers())
        self.assertEqual(self.g.snapshot().node("a").get("at"), [1, 2])
        self.assertEqual(self.g.snapshot().node("b").type, "thing")

    def test_a_handler_that_fails_keeps_no_other_one_from_changes(self):
        worker = Worker()
        calls = []
        graph = dsr.DSRGraph(self.g)
        dsr.signals.connect(graph, dsr.signals.UPDATE_NODE, lambda id, type: calls.append(1 / 0))
        dsr.signals.connect(graph, dsr.signals.UPDATE_EDGE, lambda start, to, type: calls.append(graph.get_node(to).name))
        self.add("a", "b")
        with self.g.change() as edit:
            edit.add_edge("near", "a", "b")
        with self.assertRaises(ZeroDivisionError):
            self.ctx._turn_world(worker)
        self.assertEqual((len(worker.near), calls), (1, ["b"]))
        self.assertFalse(self.ctx._turn_world(worker))
        self.assertIsNone(graph.get_node(1 << 64))

    def test_the_network_may_have_more_than_the_component_declares(self):
        more = WORLD.replace("entity thing", "entity other { name string; }; entity thing")
        self.assertNotEqual(more, WORLD)
        link = Link()
        link.unique = lambda: 18
        link.schema = [("house.gdsl", more.replace("Domain home", "Domain house"))]
        g = world.World(link, world.View, world.Edit, [("home.gdsl", WORLD)], None)
        with g.change() as edit:
            edit.add_node("other", "a")
            edit.add_node("thing", "b")
        self.assertEqual([thing.get("name") for thing in g.snapshot().all(Thing)], ["b"])
        with self.assertRaisesRegex(ValueError, "no type|no entity|not.*other"), self.g.change() as edit:
            edit.add_node("other", "a")
        link.schema = [("house.gdsl", "Domain house { entity thing { name string; }; };")]
        with self.assertRaisesRegex(ValueError, "the component declares `.*`, and the network does not"):
            world.World(link, world.View, world.Edit, [("home.gdsl", WORLD)], None)


class Agents(unittest.TestCase):
    def test_calls_of_pydsr_are_those_of_a_world(self):
        g = world.World(Link(), world.View, world.Edit, [("agents.gdsl", 'import "dsr.gdsl"; Domain agents open { };')], None)
        WithWorld(g._link)._open_world(g)
        graph = dsr.DSRGraph(g)
        self.assertEqual(graph.get_agent_name(), "one")
        for made, expected in [
            (dsr.Attribute(5), (5, None, 0)),
            (dsr.Attribute(5, 7), (5, None, 7)),
            (dsr.Attribute(5, 1_000, 7), (5, 1_000, 7)),
            (dsr.Attribute(value=5, timestamp=1_000, agent_id=7), (5, 1_000, 7)),
        ]:
            self.assertEqual((made.value, made.timestamp, made.agent_id), expected)
        with self.assertRaises(TypeError):
            dsr.Attribute(5, 1, 2, 3)
        poses = dsr.rt_api(graph)
        nodes = [dsr.Node(0, "room", name) for name in ("room", "table")]
        room, table = (graph.insert_node(node) for node in nodes)
        self.assertTrue(poses.insert_or_assign_edge_RT(nodes[0], table, [1, 2, 0], [0, 0, math.pi / 2]))
        matrix = poses.get_edge_RT_as_rtmat(poses.get_edge_RT(nodes[0], table))
        expected = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 0], [0, 0, 0, 1]]
        self.assertTrue(np.allclose(matrix, expected), matrix)
        self.assertIsNone(poses.get_edge_RT_as_rtmat(dsr.Edge(room, 1 << 64, "RT")))

    def test_an_agent_makes_its_graph_and_reads_edges_as_with_pydsr(self):
        made = world.World(Link(), world.View, world.Edit, [("agents.gdsl", 'import "dsr.gdsl"; Domain agents open { };')], None)
        WithWorld(made._link)._open_world(made)
        graph = dsr.DSRGraph(0, "pythonAgent", 42)
        self.assertIs(dsr.DSRGraph(root=0, name="a", id=1, all_same_host=False, domain_id=3)._world, made)
        with self.assertRaisesRegex(ValueError, 'start "apartment.json";'):
            dsr.DSRGraph(0, "a", 1, "apartment.json")
        elsewhere = []

        def without_world() -> None:
            with self.assertRaisesRegex(RuntimeError, "no component with a world"):
                dsr.DSRGraph(0, "a", 1)
            elsewhere.append(True)

        thread = threading.Thread(target=without_world)
        thread.start()
        thread.join()
        self.assertEqual(elsewhere, [True])

        room = dsr.Node(42, "room", "room")
        self.assertIsNone(dsr.rt_api.get_edge_RT(room, 1))
        self.assertEqual((room.edges, room.get_edges()), ({}, []))
        table = dsr.Node(42, "table", "table")
        table.attrs["level"] = dsr.Attribute(3)
        table.attrs["color"] = dsr.Attribute("red")
        for node in (room, table):
            graph.insert_node(node)
        poses = dsr.rt_api(graph)
        poses.insert_or_assign_edge_RT(room, table.id, [1, 2, 0], [0, 0, 0])
        read = graph.get_node("room")
        poses.insert_or_assign_edge_RT(room, table.id, [3, 2, 0], [0, 0, 0])
        # Those of the version that was read, and that of now.
        self.assertEqual(list(read.edges), [(table.id, "RT")])
        (edge,) = read.get_edges()
        self.assertIs(edge, read.edges[table.id, "RT"])
        self.assertEqual((edge.origin, edge.attrs["rt_translation"].value), (room.id, [1, 2, 0]))
        edge = dsr.rt_api.get_edge_RT(read, table.id)
        self.assertEqual(edge.attrs["rt_translation"].value, [3, 2, 0])
        self.assertIsNone(dsr.rt_api.get_edge_RT(read, table.id, "has"))

        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "world.json"
            with self.assertLogs("robocomp", "WARNING") as log:
                graph.write_to_json_file(file, ["color", "name"])
            self.assertIn("ids of 64 bits", log.output[0])
            symbols = json.loads(file.read_text())["DSRModel"]["symbols"]
            again = Graph.read(file).snapshot()
            with self.assertRaises(OSError):
                graph.write_to_json_file(Path(folder) / "none" / "world.json")
        of_table = next(symbol for symbol in symbols.values() if symbol["name"] == "table")
        self.assertEqual(list(of_table["attribute"]), ["level"])
        (edge,) = again.edges("RT")
        self.assertEqual((edge.start.name, edge.end.name, edge["rt_translation"]), ("room", "table", [3, 2, 0]))


if __name__ == "__main__":
    unittest.main()
