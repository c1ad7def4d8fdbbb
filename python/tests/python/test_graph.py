"""Queries and traversals of a graph."""

import tempfile
import unittest
from pathlib import Path

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
        for text, message in [
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
        self.assertEqual(self.now.run("people_in", room=self.now.node("kitchen")), [("Ada",)])
        with self.assertRaises(ValueError):
            self.now.run("people_in", room=self.now.node("Ada"))
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
        self.assertEqual(house.out("nothing").count(), 0)
        # A whole number is the same in both kinds.
        self.assertEqual(self.now.traverse(self.now.nodes()).has("area", 80).count(), 1)

    def test_a_path_is_repeated_and_folded(self):
        people = self.now.traverse(self.now.nodes("Person")).as_("who")
        ends = people.repeat_until("in", lambda node: node.name == "town")
        ways = sorted((way["who"].name, way.node.name) for way in ends.ways())
        self.assertEqual(ways, [("Ada", "town"), ("Bob", "town")])
        self.assertEqual(people.repeat_until("in", lambda node: False).count(), 0)
        places = self.now.traverse(self.now.nodes("Place"))
        area = places.fold(0.0, lambda total, way: total + way.node.attributes().get("area", 0.0))
        self.assertEqual(area, 92.5)

    def test_what_fails_is_raised(self):
        people = self.now.traverse(self.now.nodes("Person"))

        def wrong(node):
            raise LookupError(node.name)

        with self.assertRaises(LookupError):
            people.repeat_until("in", wrong).nodes()
        with self.assertRaises(ValueError):
            people.select("nobody")
        with self.assertRaises(ValueError):
            people.as_("a").as_("b").as_("c").as_("d").as_("e")
        with self.assertRaises(ValueError):
            people.out("in").ways(steps=1)
        (self.folder / "wrong.graph").write_text('{"nodes": [}')
        with self.assertRaises(ValueError) as raised:
            Graph.read(self.folder / "wrong.graph")
        self.assertIn("wrong.graph:1:12: error[malformed-json]", str(raised.exception))
        with self.assertRaises(OSError):
            Graph.read(self.folder / "missing.graph")


if __name__ == "__main__":
    unittest.main()
