"""Fakes of values in place: what a process refuses, a test refuses, too."""

import sys
import types
import unittest
from datetime import timedelta

import robocomp
from build import Fixture
from demo import MODULE
from robocomp.testing import FakeServer, FakeSubscriber, Fault, TestContext, TestLink, in_place


class InPlace(unittest.TestCase):
    def setUp(self):
        fixture = Fixture("camera", [MODULE], "local", managed=False)
        fixture.slot("Images", "publishes", "Demo::Images")
        component = fixture.component(type("SpecificWorker", (fixture.worker,), {}))
        self.image = fixture.types["Demo::Image"]
        self.kind = fixture.types["Demo::Kind"]
        self.point = fixture.types["Demo::Point"]
        self.link = TestLink(component)
        self.images = FakeSubscriber(self.link, 0)
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
        [(name, image)] = self.images.samples()
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
        self.assertEqual(len(self.images.samples()), 1)

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


class Peers(unittest.TestCase):
    """The fakes are those of Rust: faults, messages and the life cycle are."""

    def setUp(self):
        fixture = Fixture("caller", [MODULE], "local", managed=True)
        fixture.slot("Echo", "requires", "Demo::Echo")
        self.fixture = fixture
        self.types = fixture.types

    def context(self):
        component = self.fixture.component(type("SpecificWorker", (self.fixture.worker,), {}))
        test = TestContext(component, component.context, object())
        return test, FakeServer(test.link, 0)

    def test_an_operation_without_an_answer_is_refused_with_the_way_out(self):
        test, server = self.context()
        test.ctx.echo.nothing()
        with self.assertRaises(robocomp.Refused) as caught:
            test.ctx.echo.noted()
        said = "the test does not answer `noted` of test/Echo; set an answer with its `on_…`"
        self.assertIn(said, str(caught.exception))
        self.assertEqual(server.take_calls(), [("nothing",), ("noted",)])
        self.assertEqual(server.calls(), [])

    def test_each_fault_is_that_of_a_network(self):
        test, server = self.context()
        for fault, error in (
            (Fault.NO_SERVER, robocomp.NoServer),
            (Fault.TIMEOUT, robocomp.Deadline),
            (Fault.SERVER_DIED, robocomp.ServerDied),
            (Fault.QUEUE_FULL, robocomp.QueueFull),
        ):
            server.fail_once(fault)
            with self.assertRaises(error) as caught:
                test.ctx.echo.nothing()
            self.assertIn("test/Echo", str(caught.exception))
            test.ctx.echo.nothing()
        server.fail(Fault.NO_SERVER)
        self.assertFalse(test.ctx.echo.is_connected)
        server.recover()
        self.assertTrue(test.ctx.echo.is_connected)

    def test_exceptions_of_an_answer_reach_the_test(self):
        test, server = self.context()
        point = self.types["Demo::Point"](1.0, 2.0)
        shift = 2

        def fails(at, by):
            self.assertEqual(by, 7.0)

        server._on(shift, fails)
        with self.assertRaises(AssertionError):
            test.ctx.echo.shift(point, 8.0)
        nonsense = self.types["Demo::Nonsense"]
        server._on(shift, lambda *_: (_ for _ in ()).throw(nonsense("no", 3)))
        with self.assertRaises(nonsense) as caught:
            test.ctx.echo.shift(point, 7.0)
        self.assertEqual(caught.exception.code, 3)
        # An answer of another type is a fault of the test.
        server._on(shift, ("far", 3))
        with self.assertRaises(robocomp.InvalidArgument):
            test.ctx.echo.shift(point, 7.0)
        server._on(shift, (point, 3))
        self.assertEqual(test.ctx.echo.shift(point, 7.0), (point, 3))

    def test_an_answer_finds_no_context_as_in_a_process(self):
        test, server = self.context()
        server._on(4, lambda: [test.ctx.name])
        with self.assertRaises(robocomp.WrongThread):
            test.ctx.echo.noted()
        server._on(4, lambda: [str(len(server.calls()))])
        self.assertEqual(test.ctx.echo.noted(), ["2"])

    def test_two_components_are_tested_side_by_side(self):
        (one, first), (other, second) = self.context(), self.context()
        first._on(4, ["first"])
        second._on(4, ["second"])
        self.assertEqual((one.ctx.echo.noted(), other.ctx.echo.noted()), (["first"], ["second"]))
        one.advance(timedelta(seconds=1))
        self.assertEqual((one.now, other.now), (timedelta(seconds=1), timedelta(0)))
        one.set_state("emergency")
        self.assertEqual((one.ctx.state, other.ctx.state), ("emergency", "running"))
        with self.assertRaises(ValueError):
            one.set_state("asleep")
        one.ctx.stop("enough")
        self.assertEqual((one.ctx.is_stopping, other.ctx.is_stopping), (True, False))

    def test_transitions_are_those_of_a_process(self):
        took = []

        class SpecificWorker(self.fixture.worker):
            fault = None

            def configure(self, ctx):
                took.append(("configure", ctx.lifecycle))
                if self.fault:
                    raise self.fault

            def activate(self, ctx):
                took.append(("activate", ctx.lifecycle))

            def deactivate(self, ctx):
                took.append(("deactivate", ctx.lifecycle))

            def cleanup(self, ctx):
                took.append(("cleanup", ctx.lifecycle))

            def shutdown(self, ctx):
                took.append(("shutdown", ctx.lifecycle))

            def error(self, ctx, transition, reason):
                took.append((transition, reason))

        component = self.fixture.component(SpecificWorker)
        test = TestContext(component, component.context, object())
        worker = SpecificWorker()
        with self.assertRaises(robocomp.Error) as caught:
            test.transition(worker, "activate")
        self.assertIn("not possible", str(caught.exception))
        worker.fault = robocomp.Emergency("hot")
        self.assertEqual(test.transition(worker, "configure"), "unconfigured")
        self.assertEqual(took, [("configure", "configuring"), ("configure", "hot")])
        worker.fault = KeyError("lost")
        with self.assertRaises(KeyError):
            test.transition(worker, "configure")
        self.assertEqual(test.ctx.lifecycle, "unconfigured")
        worker.fault = None
        self.assertEqual(test.transition(worker, "configure"), "inactive")
        self.assertEqual(test.transition(worker, "activate"), "active")
        took.clear()
        self.assertEqual(test.transition(worker, "shutdown"), "finalized")
        self.assertEqual([name for name, _ in took], ["deactivate", "cleanup", "shutdown"])


if __name__ == "__main__":
    unittest.main()
