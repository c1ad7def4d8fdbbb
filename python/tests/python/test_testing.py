"""Fakes of values in place: what a process refuses, a test refuses, too."""

import sys
import types
import unittest

import robocomp
from build import Fixture
from demo import MODULE
from robocomp.testing import FakeLink, in_place


class InPlace(unittest.TestCase):
    def setUp(self):
        fixture = Fixture("camera", [MODULE], "local", managed=False)
        fixture.slot("Images", "publishes", "Demo::Images")
        component = fixture.component(type("SpecificWorker", (fixture.worker,), {}))
        self.image = fixture.types["Demo::Image"]
        self.kind = fixture.types["Demo::Kind"]
        self.point = fixture.types["Demo::Point"]
        self.link = FakeLink(component)
        self.link.gate_is_open = True
        # The package that a generator would write.
        package = types.ModuleType("fixture_camera")
        package.COMPONENT = component
        sys.modules["fixture_camera"] = package
        self.image.__module__ = "fixture_camera.types.demo"

    def tearDown(self):
        del sys.modules["fixture_camera"]

    def test_a_sample_is_sent_once_and_without_arrays(self):
        loan = self.link.loan(0, 0)
        loan.number = 7
        data = loan.resize("data", 4)
        data[:] = 3
        with self.assertRaises(BufferError):
            loan.send()
        del data
        loan.send()
        with self.assertRaises(BufferError):
            loan.send()
        [(name, image)] = self.link.topic(0).samples
        self.assertEqual((name, image.number, image.data.tolist()), ("image", 7, [3] * 4))

    def test_one_loan_exists_at_a_time(self):
        loan = self.link.loan(0, 0)
        with self.assertRaises(robocomp.NotSent) as caught:
            self.link.loan(0, 0)
        self.assertIn("send or discard the earlier one", str(caught.exception))
        loan.discard()
        with self.assertRaises(ZeroDivisionError), self.link.loan(0, 0):
            1 / 0
        with self.link.loan(0, 0):
            pass
        self.assertEqual(len(self.link.topic(0).samples), 1)

    def test_what_does_not_fit_is_refused(self):
        loan = self.link.loan(0, 0)
        for assign in (
            lambda: setattr(loan, "number", "one"),
            lambda: setattr(loan, "frame", "longer than sixteen bytes"),
            lambda: loan.resize("data", (1 << 20) + 1),
        ):
            with self.assertRaises((robocomp.Error, TypeError, ValueError)):
                assign()

    def test_a_received_sample_is_only_read(self):
        center = self.point(1.0, 2.0)
        value = self.image(5, self.kind.DOOR, "here", center, [], [0.0] * 6, b"abc")
        view = in_place(value)
        self.assertEqual((view.number, view.center.y, view.copy().kind), (5, 2.0, self.kind.DOOR))
        self.assertFalse(view.data.flags.writeable)
        with self.assertRaises(BufferError):
            view.number = 6
        with self.assertRaises(TypeError):
            in_place(7)


if __name__ == "__main__":
    unittest.main()
