"""Values of one data prototype as those of another one."""

import math
import tempfile
import types
import unittest
from pathlib import Path

import numpy
import robocomp
from robocomp._classes import classes

IDSL = """module RoboCompCloud
{
    struct Point { float X; float Y; float Z; int light; };
    struct Turn { double q[4]; };
    struct Count { int x; int y; int z; };
    struct Sure { double X; double Y; double Z; double spread[9]; };
    struct SurePose { Sure place; Turn turn; };
    sequence<Point> Points;
    struct Scan { string frame; Points points; };
};
"""

PROTOTYPES = """import "Cloud.idsl";
axes lidar :: right, ahead, up
axes ros :: ahead, left, up
algebraic named :: Scalar{x, y, z}
algebraic four :: Vector{4}
units millimetres :: qudt, named { x = mm, y = mm, z = mm }
dproto scan :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: IDSL{RoboCompCloud::Point} dr = { X = x, Y = y, Z = z } units = millimetres axes = lidar }
dproto point :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: IDSL{RoboCompCloud::Point} dr = { X = x, Y = y, Z = z } axes = ros }
dproto ros_point :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: ROS{geometry_msgs/Point} dr = { x = x, y = y, z = z } axes = ros }
dproto marker :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: ROS{visualization_msgs/Marker} dr = { pose.place.x = x, pose.place.y = y, pose.place.z = z } axes = ros }
dproto three :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: c99{double[3]} dr = { 0 = x, 1 = y, 2 = z } axes = ros }
dproto steps :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: IDSL{RoboCompCloud::Count} dr = { x = x, y = y, z = z } units = millimetres axes = ros }
dproto scans :: geometry { semantic = Position coord = cartesian algebraic = named sequence = member points
    ddr = :: IDSL{RoboCompCloud::Scan} dr = { X = x, Y = y, Z = z } units = millimetres axes = lidar }
dproto cloud :: geometry { semantic = Position coord = cartesian algebraic = named sequence = member points
    ddr = :: IDSL{RoboCompCloud::Scan} dr = { X = x, Y = y, Z = z } axes = ros }
dproto turn :: geometry { semantic = Orientation coord = quaternion algebraic = four
    ddr = :: IDSL{RoboCompCloud::Turn} dr = { q.0 = 0, q.1 = 1, q.2 = 2, q.3 = 3 } axes = ros }
dproto angles :: geometry { semantic = Orientation coord = rotation_vector algebraic = named
    ddr = :: c99{double[3]} dr = { v.0 = x, v.1 = y, v.2 = z } axes = ros }
dproto backwards :: geometry { semantic = Orientation coord = rotation_vector algebraic = named
    ddr = :: c99{double[3]} dr = { v.2 = x, v.1 = y, v.0 = z } axes = ros }
dproto gap :: geometry { semantic = Orientation coord = rotation_vector algebraic = named
    ddr = :: c99{double[4]} dr = { v.1 = x, v.2 = y, v.3 = z } axes = ros }
dproto shuffled :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: c99{double[3]} dr = { 2 = x, 0 = y, 1 = z } axes = ros }
dproto sure :: geometry { semantic = Position coord = cartesian algebraic = named covariance = { member spread }
    ddr = :: IDSL{RoboCompCloud::Sure} dr = { X = x, Y = y, Z = z } units = millimetres axes = lidar }
dproto surely :: geometry { semantic = Position coord = cartesian algebraic = named covariance = { member spread }
    ddr = :: c99{double[3]} dr = { x = x, y = y, z = z } }
dproto sure_pose :: geometry { semantic = Pose composes = { Position = sure, Orientation = turn }
    ddr = :: IDSL{RoboCompCloud::SurePose} dr = { place = Position, turn = Orientation } axes = lidar }
dproto surely_pose :: geometry { semantic = Pose composes = { Position = surely, Orientation = turn }
    ddr = :: IDSL{RoboCompCloud::SurePose} dr = { place = Position, turn = Orientation } axes = ros }
dproto stored :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: c99{float[3]} dr = { v.0 = x, v.1 = y, v.2 = z } units = millimetres axes = ros }
"""


def _struct(name, **members):
    described = [{"name": key, "type": kind} for key, kind in members.items()]
    return {"name": name, "struct": described}


MODULE = {
    "module": "RoboCompCloud",
    "types": [
        _struct("Point", X="float32", Y="float32", Z="float32", light="int32"),
        _struct("Turn", q="float64[4]"),
        _struct("Count", x="int32", y="int32", z="int32"),
        _struct("Scan", frame="string", points="sequence<RoboCompCloud::Point>"),
    ],
    "interfaces": [],
}


class RosPoint:
    """As a message of rclpy: members are properties over slots, which take their type only."""

    __slots__ = ("_x", "_y", "_z")

    def __init__(self):
        self.x = self.y = self.z = 0.0

    def _property(slot):
        def put(self, value):
            assert isinstance(value, float)
            setattr(self, slot, value)

        return property(lambda self: getattr(self, slot), put)

    x, y, z = _property("_x"), _property("_y"), _property("_z")


RosPoint.__module__, RosPoint.__name__ = "geometry_msgs.msg._point", "Point"


def moved(points):
    """Millimetres (right, ahead, up) as metres (ahead, left, up)."""
    points = numpy.asarray(points, dtype=numpy.float64)
    return numpy.stack([points[..., 1], -points[..., 0], points[..., 2]], axis=-1) / 1000


class Convert(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        place = Path(cls.folder.name)
        (place / "Cloud.idsl").write_text(IDSL)
        (place / "both.dproto").write_text(PROTOTYPES)
        robocomp.use_prototypes(place / "both.dproto")
        cls.types = classes([MODULE])

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def refused(self, *arguments, kind=robocomp.ConversionError, **named):
        with self.assertRaises(kind) as caught:
            robocomp.convert(*arguments, **named)
        return caught.exception

    def test_a_structure_keeps_its_other_members(self):
        point = self.types["RoboCompCloud::Point"](1000.0, 2000.0, 500.0, 7)
        found = robocomp.convert(point, "point", of="scan")
        self.assertIsNot(found, point)
        self.assertEqual((found.x, found.y, found.z, found.light), (2.0, -1.0, 0.5, 7))
        self.assertEqual((point.x, point.y), (1000.0, 2000.0))
        self.assertIs(robocomp.convert(point, "point", of="scan", out=point), point)
        self.assertEqual((point.x, point.y, point.z), (2.0, -1.0, 0.5))

    def test_a_message_of_ros_gets_the_numbers(self):
        message = RosPoint()
        point = self.types["RoboCompCloud::Point"](1000.0, 2000.0, 500.0, 7)
        robocomp.convert(point, "ros_point", of="scan", out=message)
        self.assertEqual((message.x, message.y, message.z), (2.0, -1.0, 0.5))
        # Its class says which prototype it has.
        back = robocomp.convert(message, "scan")
        self.assertEqual((back.x, back.y, back.z), (1000.0, 2000.0, 500.0))
        self.assertEqual((type(back), message.x), (RosPoint, 2.0))

    def test_members_that_the_value_lacks_are_made(self):
        found = robocomp.convert({"X": 1000, "Y": 0, "Z": 0}, "marker", of="scan")
        self.assertIsInstance(found, types.SimpleNamespace)
        self.assertEqual(vars(found.pose.place), {"x": 0.0, "y": -1.0, "z": 0.0})

    def test_lists_and_members_with_elements(self):
        point = self.types["RoboCompCloud::Point"]
        points = [point(1000.0 * at, at, 0.0, at) for at in range(5000)]
        found = robocomp.convert(points, "point", of="scan")
        self.assertEqual([(one.y, one.light) for one in found], [(-at, at) for at in range(5000)])
        scan = self.types["RoboCompCloud::Scan"]("laser", points)
        found = robocomp.convert(scan, "cloud")
        self.assertEqual((found.frame, found.points[3].y, scan.points[3].y), ("laser", -3.0, 3.0))
        robocomp.convert(scan, "cloud", of="scans", out=scan)
        self.assertEqual(scan.points[3].y, -3.0)
        self.assertEqual(robocomp.convert([], "point"), [])
        self.assertEqual(robocomp.convert(numpy.zeros((0, 3)), "point", of="scan").shape, (0, 3))

    def test_a_million_points_in_place(self):
        for kind in (numpy.float32, numpy.float64):
            points = numpy.random.default_rng(1).uniform(-1e5, 1e5, (1_000_000, 3)).astype(kind)
            expected = moved(points).astype(numpy.float32).astype(kind)
            found = robocomp.convert(points, "point", of="scan", out=points)
            self.assertIs(found, points)
            self.assertTrue(numpy.array_equal(points, expected))

    def test_other_arrays(self):
        points = numpy.arange(24, dtype=numpy.int16).reshape(2, 4, 3)
        found = robocomp.convert(points, "ros_point", of="scan")
        self.assertEqual(found.dtype, numpy.float64)
        self.assertTrue(numpy.array_equal(found, moved(points)))
        backwards = points.astype(">f8")[:, ::-1]
        self.assertTrue(numpy.array_equal(robocomp.convert(backwards, "ros_point", of="scan"), moved(backwards)))
        self.assertEqual(robocomp.convert([1000, 2000, 500], "ros_point", of="scan").tolist(), [2, -1, 0.5])
        nothing = numpy.full((3, 3), math.nan)
        self.assertTrue(numpy.isnan(robocomp.convert(nothing, "point", of="scan")).all())
        counts = numpy.zeros((1, 3), numpy.int32)
        robocomp.convert(numpy.array([[0.0, 1.0004, 2.0]]), "steps", of="ros_point", out=counts)
        self.assertEqual(counts.tolist(), [[0, 1000, 2000]])

    def test_structured_arrays(self):
        fields = [("X", "f4"), ("Y", "f4"), ("Z", "f4"), ("light", "u1")]
        points = numpy.zeros(5000, dtype=fields)
        points["X"], points["light"] = numpy.arange(5000) * 1000, 9
        kept = points.copy()
        found = robocomp.convert(points, "ros_point", of="scan")
        self.assertEqual(found.dtype.names, ("x", "y", "z", "light"))
        self.assertTrue(numpy.array_equal(found["y"], -numpy.arange(5000.0)))
        self.assertTrue((found["light"] == 9).all() and (points == kept).all())
        robocomp.convert(points, "point", of="scan", out=points)
        self.assertTrue(numpy.array_equal(points["Y"], -numpy.arange(5000.0)))
        nested = robocomp.convert(points, "marker", of="point")
        self.assertTrue(numpy.array_equal(nested["pose"]["place"]["y"], points["Y"]))
        turns = numpy.array([([0.0, 0.0, 0.0, 1.0],)], dtype=[("q", "f8", 4)])
        self.assertEqual(robocomp.convert(turns, "angles", of="turn")["v"].tolist(), [[0.0, 0.0, 0.0]])

    def test_a_value_that_is_refused_changes_nothing(self):
        turns = numpy.zeros((9000, 4))
        turns[:, 3] = 1.0
        turns[8190] = [0.0, 0.0, 0.0, 1.2]
        kept = turns.copy()
        error = self.refused(turns, "angles", of="turn", out=numpy.zeros((9000, 3)))
        self.assertEqual((error.code, error.index), ("bad-value", 8190))
        self.assertIn("value 8190 is refused: 1.2 is not from 0.999", str(error))
        self.assertTrue((turns == kept).all())
        points = numpy.full((5000, 3), 1.0)
        points[4999] = 1e39
        error = self.refused(points, "scan", of="ros_point", out=points)
        self.assertEqual((error.code, error.index), ("bad-value", 4999))
        self.assertTrue((points[:4999] == 1.0).all())
        error = self.refused(numpy.array([[0.0, 1e7, 0.0]]), "steps", of="ros_point")
        self.assertEqual(error.code, "bad-value")
        narrow = numpy.zeros((1, 3), numpy.float16)
        error = self.refused(numpy.array([[1.0, 1e6, 0.0]]), "marker", of="ros_point", out=narrow)
        self.assertEqual((error.code, narrow.tolist()), ("bad-value", [[0.0] * 3]))
        point = self.types["RoboCompCloud::Turn"](numpy.zeros(4))
        error = self.refused(point, "angles")
        self.assertEqual((error.code, error.index), ("bad-value", 0))

    def test_elements_of_arrays_are_at_the_places_of_their_names(self):
        turn = {"v": [1.0, 0.0, 0.5]}
        found = robocomp.convert(turn, "backwards", of="angles", out={"v": [0.0] * 3})
        self.assertEqual(found, {"v": [0.5, 0.0, 1.0]})
        turn = self.types["RoboCompCloud::Turn"](numpy.array([0.0, 0.0, 1.0, 0.0]))
        made = [robocomp.convert(turn, name).v.tolist() for name in ("angles", "backwards")]
        self.assertEqual(made[1], made[0][::-1])
        self.assertAlmostEqual(made[0][2], math.pi)
        said = "the prototype has no member for the element 0 of an array"
        self.assertEqual(str(self.refused(turn, "gap")), said)
        turns = numpy.array([([0.0, 0.0, 0.0, 1.0],)], dtype=[("q", "f8", 4)])
        self.assertEqual(str(self.refused(turns, "gap", of="turn")), said)
        # Of plain arrays, too.
        points = numpy.array([[1.0, 2.0, 3.0]])
        found = robocomp.convert(points, "shuffled", of="ros_point")
        self.assertEqual(found.tolist(), [[2.0, 3.0, 1.0]])
        found = robocomp.convert(found, "three", of="shuffled")
        self.assertEqual(found.tolist(), points.tolist())

    def test_a_covariance_in_old_units_does_not_stay(self):
        value = {"X": 1000.0, "Y": 0.0, "Z": 0.0, "spread": [0.0] * 9}
        kept = dict(value)
        said = "the covariance `spread` is not converted; give an `out` without it"
        self.assertEqual(str(self.refused(value, "point", of="sure")), said)
        self.assertEqual(str(self.refused(value, "point", of="sure", out=value)), said)
        self.assertEqual(value, kept)
        found = robocomp.convert(value, "point", of="sure", out={"X": 0, "Y": 0, "Z": 0})
        self.assertEqual(found, {"X": 0.0, "Y": -1.0, "Z": 0.0})
        self.assertEqual(vars(robocomp.convert(value, "ros_point", of="sure"))["y"], -1.0)
        array = numpy.zeros(2, dtype=[("X", "f8"), ("Y", "f8"), ("Z", "f8"), ("spread", "f8", 9), ("light", "u1")])
        self.assertEqual(str(self.refused(array, "point", of="sure")), said)
        self.assertEqual(str(self.refused(array, "point", of="sure", out=array)), said)
        found = robocomp.convert(array, "ros_point", of="sure")
        self.assertEqual(found.dtype.names, ("x", "y", "z", "light"))

    def test_a_covariance_of_a_part_is_converted(self):
        spread = [4.0, 1.0, 0.0, 1.0, 9.0, 0.0, 0.0, 0.0, 16.0]
        place = {"X": 1000.0, "Y": 2000.0, "Z": 500.0, "spread": spread}
        value = {"place": place, "turn": {"q": [0.0, 0.0, 0.0, 1.0]}}
        found = robocomp.convert(value, "surely_pose", of="sure_pose")
        self.assertEqual((found.place.x, found.place.y, found.place.z), (2.0, -1.0, 0.5))
        # Ahead, left, up are Y, -X, Z, in metres.
        expected = [9e-6, -1e-6, 0.0, -1e-6, 4e-6, 0.0, 0.0, 0.0, 16e-6]
        numpy.testing.assert_allclose(found.place.spread, expected, rtol=1e-12, atol=0)
        spread[0] = -4.0
        self.refused(value, "surely_pose", of="sure_pose")

    def test_a_member_that_refuses_its_value_changes_nothing(self):
        class Picky:
            def __init__(self):
                self.x = self.y = self.limited = 0.0

            @property
            def z(self):
                return self.limited

            @z.setter
            def z(self, value):
                if value > 5:
                    raise OverflowError(value)
                self.limited = value

        outs = [Picky(), Picky()]
        points = [{"X": 1000, "Y": 2000, "Z": 500}, {"X": 1000, "Y": 2000, "Z": 9000}]
        self.refused(points, "ros_point", of="scan", out=outs, kind=OverflowError)
        self.assertEqual([(one.x, one.y, one.z) for one in outs], [(0.0, 0.0, 0.0)] * 2)

    def test_members_that_are_arrays_take_what_fits(self):
        point = {"x": 1.7, "y": 0.25, "z": 1e30}
        error = self.refused(point, "angles", of="turn")
        self.assertIn("no member `q`", str(error))
        whole = {"v": numpy.zeros(3, numpy.int32)}
        self.refused(point, "stored", of="ros_point", out=whole, kind=TypeError)
        narrow = {"v": numpy.zeros(3, numpy.float16)}
        error = self.refused([point], "stored", of="ros_point", out=[narrow])
        self.assertEqual((error.code, error.index), ("bad-value", 0))
        self.assertEqual((whole["v"].tolist(), narrow["v"].tolist()), ([0] * 3, [0.0] * 3))
        # A structure has no elements.
        said = str(self.refused({"v": object()}, "turn", of="angles"))
        self.assertIn("a value of `object` has no member `0`", said)

    def test_elements_and_values_convert_alike(self):
        point = self.types["RoboCompCloud::Point"]
        scans = [
            self.types["RoboCompCloud::Scan"](name, [point(1000.0, 2000.0, 500.0, 7)] * at)
            for at, name in enumerate(["none", "one", "two"])
        ]
        found = robocomp.convert(scans, "point", of="scans")
        self.assertEqual([len(one.points) for one in found], [0, 1, 2])
        self.assertEqual((found[2].frame, found[2].points[1].y), ("two", -1.0))
        self.assertEqual(scans[2].points[1].y, 2000.0)
        self.assertEqual(robocomp.convert(scans[1], "point", of="scans").points[0].x, 2.0)
        self.refused(scans, "point", of="scans", out=scans[:2])

    def test_names_are_told_with_the_nearest_one(self):
        point = self.types["RoboCompCloud::Point"](0.0, 0.0, 0.0, 0)
        error = self.refused(point, "ros_poimt", of="scan")
        self.assertEqual(error.code, "unknown-prototype")
        self.assertIn("`ros_poimt`; did you mean `ros_point`?", str(error))
        self.assertIn("did you mean `scan`?", str(self.refused(point, "point", of="scam")))
        # Two prototypes are about its type.
        said = str(self.refused(point, "ros_point"))
        self.assertEqual(said, "`scan` and `point` are about `Point`; choose one with of=")
        self.assertIn("with of=: `scan`, `point`", str(self.refused(numpy.zeros((1, 3)), "ros_point")))
        self.assertIn("no prototype is about", str(self.refused(object(), "point")))
        error = self.refused(point, "turn", of="scan")
        self.assertEqual(error.code, "semantic-mismatch")
        self.assertIn("`scan` does not convert into `turn`: the meanings differ", str(error))
        said = str(self.refused({"pose": {"plase": {}}}, "point", of="marker"))
        self.assertEqual(said, "a value of `dict` has no member `place`; did you mean `plase`?")
        said = str(self.refused(numpy.zeros((2, 4)), "point", of="scan"))
        self.assertIn("`scan` has 3 numbers (X, Y, Z); the array has the shape (2, 4)", said)
        fields = numpy.zeros(2, dtype=[("x", "f8"), ("y", "f8"), ("z", "f8")])
        self.assertIn("no names for its numbers", str(self.refused(fields, "three", of="ros_point")))
        self.assertIn("no field `X`", str(self.refused(fields[["y", "z"]], "point", of="scan")))
        counts = numpy.zeros((1, 3), numpy.int32)
        self.refused(numpy.zeros((1, 3)), "point", of="scan", out=counts, kind=TypeError)
        self.refused(numpy.zeros((1, 3), complex), "point", of="scan", kind=TypeError)

    def test_files_with_errors_change_nothing(self):
        place = Path(self.folder.name)
        (place / "bad.dproto").write_text(
            "dproto more :: geometry { semantic = Position coord = cartesien algebraic = named\n"
            "ddr = :: IDSL{RoboCompCloud::Point} dr = { X = x, Y = y, Z = z } axes = ros }\n"
        )
        with self.assertRaises(robocomp.ConversionError) as caught:
            robocomp.use_prototypes(place / "bad.dproto")
        self.assertEqual(caught.exception.code, "unknown-coordinate")
        self.assertIn("bad.dproto:1:55", str(caught.exception))
        self.assertIn("cartesian", str(caught.exception))
        with self.assertRaises(OSError):
            robocomp.use_prototypes(place / "none.dproto")
        found = robocomp.convert(numpy.ones((1, 3)), "point", of="scan")
        self.assertEqual(found.shape, (1, 3))


if __name__ == "__main__":
    unittest.main()
