"""The tree of a component with `options InnerModelViewer;`."""

import math
import unittest
from pathlib import Path
from unittest import mock

from robocomp import innermodel
from robocomp.innermodel import InnerModel, InnerModelContext, Tree

ARM = Path(__file__).resolve().parents[3] / "innermodel/scenes/arm.xml"


class Clock:
    """The part of a link that a tree needs."""

    def __init__(self) -> None:
        self.time = 0

    def now_ns(self) -> int:
        self.time += 1
        return self.time


class Trees(unittest.TestCase):
    def setUp(self) -> None:
        tree, warnings = Tree.read(ARM)
        self.assertEqual(warnings, [])
        self.tree = InnerModel(Clock(), tree)

    def test_a_change_is_one_version_and_a_snapshot_stays(self):
        before = self.tree.snapshot()
        pose = (10.0, 20.0, 30.0, 0.0, math.pi / 2, 0.0)
        positions = self.tree.change(joints={"joint_1": 0.5, "joint_2": -9.0}, poses={"arm": pose})
        self.assertEqual(positions, {"joint_1": 0.5, "joint_2": -2.0})
        after = self.tree.snapshot()
        self.assertEqual(after.version, before.version + 1)
        self.assertEqual((before.joint("joint_1"), after.joint("joint_1")), (0.0, 0.5))
        for value, wanted in zip(after.pose("table", "arm"), pose, strict=True):
            self.assertAlmostEqual(value, wanted)

    def test_frames(self):
        now = self.tree.snapshot()
        self.assertEqual(now.transform("world", (1.0, 2.0, 3.0), "table"), (1.0, 702.0, 3.0))
        matrix = self.tree.matrix("world", "table")
        self.assertEqual(matrix.shape, (4, 4))
        self.assertEqual((matrix @ [1.0, 2.0, 3.0, 1.0]).tolist(), [1.0, 702.0, 3.0, 1.0])

    def test_nodes(self):
        now = self.tree.snapshot()
        self.assertEqual(len(now.nodes()), len(now))
        self.assertIn("joint_1", now)
        self.assertNotIn("nowhere", now)
        self.assertEqual(now.parent("table"), "world")
        self.assertIn("arm", now.children("table"))
        self.assertIsNone(now.parent(now.nodes()[0]))
        self.assertIsNone(now.joint("table"))

    def test_what_cannot_be_changes_nothing(self):
        version = self.tree.snapshot().version
        for joints, poses in [
            ({"joint_1": 0.5, "nowhere": 0.0}, {}),
            ({"table": 0.5}, {}),
            ({"joint_1": 0.5}, {"nowhere": (0.0,) * 6}),
            ({"joint_1": math.nan}, {}),
        ]:
            with self.assertRaises(ValueError):
                self.tree.change(joints=joints, poses=poses)
        self.assertEqual(self.tree.snapshot().version, version)
        with self.assertRaises(ValueError):
            self.tree.snapshot().pose("world", "nowhere")
        with self.assertRaises(ValueError):
            Tree.read(Path("nowhere.xml"))


class Run(Clock):
    """The part of a link that a window needs."""

    def __init__(self, is_replay: bool) -> None:
        super().__init__()
        self.replay = is_replay

    def name(self) -> str:
        return "arm"

    def is_replay(self) -> bool:
        return self.replay


class Glass:
    """A window on no display, which notes what it is told."""

    told: list[bool] = []
    reached = 0

    def __init__(self, _name: str, _tree: Tree) -> None:
        type(self).told = []

    @classmethod
    def reach(cls) -> None:
        cls.reached += 1

    def show(self, wanted: bool) -> None:
        self.told.append(wanted)


class Windows(unittest.TestCase):
    def told(self, is_replay: bool, wanted: list[bool]) -> list[bool]:
        """What a window is told by these values of the parameter `viewer`."""
        with mock.patch.object(innermodel, "Window", Glass):
            context = InnerModelContext(Run(is_replay))
            for value in wanted:
                context._show(value, ARM)
        return Glass.told

    def test_another_parameter_does_not_open_a_window_again(self):
        self.assertEqual(self.told(False, [True, True, False, True]), [True, False, True])
        self.assertEqual(self.told(False, [False, False, True]), [False, True])

    def test_a_replay_opens_no_window(self):
        before = Glass.reached
        self.assertEqual(self.told(True, [True, True, False, True]), [False])
        self.assertEqual(Glass.reached, before)


if __name__ == "__main__":
    unittest.main()
