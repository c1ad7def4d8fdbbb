"""Two components in Python exchange every type, over each middleware."""

import copy
import itertools
import os
import queue
import threading
import unittest
from datetime import timedelta

import numpy as np
import robocomp
from build import Fixture
from demo import MODULE, NUMBERS

MIDDLEWARE = os.environ.get("TEST_MIDDLEWARE", "local")
NETWORK = os.environ.get("TEST_NETWORK", f"py-exchange-{os.getpid()}")
ARGS = ["--network", NETWORK]
if MIDDLEWARE in ("dds", "ros2"):
    ARGS += ["--set-middleware", f"{MIDDLEWARE}.domain={os.environ['TEST_DOMAIN']}"]
LIMIT = 20.0


class Server:
    """Serves `Echo`, and publishes what it is told."""

    def __init__(self):
        self.fixture = Fixture("server", [MODULE], MIDDLEWARE).slot("Echo", "implements", "Demo::Echo")
        types = self.fixture.types
        base = self.fixture.worker

        class SpecificWorker(base):
            def initialize(self, ctx):
                self.notes = []

            def echo(self, ctx, all):
                return all

            def nothing(self, ctx):
                return None

            def shift(self, ctx, at, by):
                if by == 0:
                    raise types["Demo::Nonsense"]("by is zero", 7)
                if by < 0:
                    raise types["Demo::Empty"]()
                if by > 1e6:
                    return 1, types["Demo::Point"](1e30, 0.0)
                if by > 1e5:
                    return "two", 1
                if by > 1e4:
                    raise KeyError("lost")
                return types["Demo::Point"](at.x + by, at.y), 3

            def note(self, ctx, text):
                self.notes.append(text)

            def noted(self, ctx):
                return self.notes

            def numbers(self, ctx, data):
                if len(data) == 1:
                    return np.array([1.0, float("nan"), 1e300])
                if len(data) == 2:
                    return "12"
                return data / 2

        self.component = self.fixture.component(SpecificWorker)
        self.running = robocomp.embed(self.component, SpecificWorker, ARGS)

    def stop(self):
        self.running.stop()
        self.running.join()


class Client:
    """Runs functions of the tests on the thread of a worker."""

    def __init__(self):
        self.fixture = Fixture("client", [MODULE], MIDDLEWARE).slot("Echo", "requires", "Demo::Echo")
        tasks = self.tasks = queue.SimpleQueue()
        base = self.fixture.worker

        class SpecificWorker(base):
            def compute(self, ctx):
                try:
                    task, done = tasks.get_nowait()
                except queue.Empty:
                    return
                try:
                    done.put((task(ctx), None))
                except BaseException as error:
                    done.put((None, error))

        component = self.fixture.component(SpecificWorker)
        self.running = robocomp.embed(component, SpecificWorker, ARGS)

    def run(self, task):
        done = queue.SimpleQueue()
        self.tasks.put((task, done))
        result, error = done.get(timeout=LIMIT)
        if error is not None:
            raise error
        return result

    def stop(self):
        self.running.stop()
        self.running.join()


class Exchange(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server()
        cls.client = Client()
        cls.types = cls.client.fixture.types
        connected = threading.Event()
        for _ in range(1000):
            if cls.client.run(lambda ctx: ctx.echo.is_connected):
                connected.set()
                break
        assert connected.is_set(), "the server was not found"
        cls.client.run(lambda ctx: setattr(ctx.echo, "timeout", timedelta(seconds=10)))

    @classmethod
    def tearDownClass(cls):
        cls.client.stop()
        cls.server.stop()

    def everything(self):
        types = self.types
        point = types["Demo::Point"]
        values = {
            "flag": True,
            "f32": 0.5,
            "f64": 1e300,
            "text": "Grüße, 世界 \U0001f916",
            "short": "äb",
            "kind": types["Demo::Kind"].DOOR,
            "point": point(1.5, -2.5),
            "points": [point(1.0, 2.0), point(3.0, 4.0)],
            "all_f32": np.array([1.5, -2.5], np.float32),
            "all_f64": np.linspace(0.0, 1.0, 5),
            "all_flags": np.array([True, False, True]),
            "few": np.array([1, 2, 3, 4], np.uint8),
            "matrix": np.arange(9.0),
            "names": ["a", "", "ccc"],
            "scores": {"one": 1.0, "zwei": -2.0},
            "kinds": {types["Demo::Kind"].WALL: point(0.0, 0.0)},
            "maybe": None,
            "class_": 5,
        }
        for name, low, high in NUMBERS:
            values[name] = low
            values[f"all_{name}"] = np.array([low, 0, high], name)
        return types["Demo::Everything"](**values)

    def assert_same(self, ours, theirs):
        for name in ours.__match_args__:
            one, other = getattr(ours, name), getattr(theirs, name)
            if isinstance(one, np.ndarray):
                self.assertEqual(one.dtype, other.dtype, name)
                np.testing.assert_array_equal(one, other, name)
                self.assertTrue(other.flags.writeable, name)
            else:
                self.assertEqual(one, other, name)
                self.assertIs(type(one), type(other), name)

    def echo(self, value):
        return self.client.run(lambda ctx: ctx.echo.echo(value))

    def test_every_type_comes_back(self):
        sent = self.everything()
        self.assert_same(sent, self.echo(sent))
        sent.maybe = self.types["Demo::Point"](-1.0, 2.0)
        for name, _, high in NUMBERS:
            setattr(sent, name, high)
        self.assert_same(sent, self.echo(sent))
        for name, _, _ in NUMBERS:
            setattr(sent, f"all_{name}", np.zeros(0, name))
        self.assert_same(sent, self.echo(sent))

    def test_arguments_may_be_any_fitting_numbers(self):
        sent = self.everything()
        sent.all_int32 = [1, np.int64(2), True + 1]
        sent.all_f32 = np.array([1, 2, 3])
        sent.all_f64 = (1, 2.5)
        sent.matrix = np.eye(3)
        sent.few = b"abc"
        sent.all_flags = [True, np.bool_(False)]
        sent.f64 = 3
        sent.int16 = np.int8(-5)
        back = self.echo(sent)
        np.testing.assert_array_equal(back.all_int32, [1, 2, 2])
        np.testing.assert_array_equal(back.all_f32, [1.0, 2.0, 3.0])
        np.testing.assert_array_equal(back.matrix, np.eye(3).ravel())
        np.testing.assert_array_equal(back.few, [97, 98, 99])
        self.assertEqual((back.f64, back.int16), (3.0, -5))
        strided = np.arange(10, dtype=np.int32)[::3]
        sent = self.everything()
        sent.all_int32 = strided
        np.testing.assert_array_equal(self.echo(sent).all_int32, strided)
        for order in ("<i4", ">i4"):
            sent.all_int32 = np.array([1, 2, 70000], dtype=order)
            np.testing.assert_array_equal(self.echo(sent).all_int32, [1, 2, 70000])
        sent.all_f32 = np.array([1.5, -2.0, 3.0], dtype=">f4")
        np.testing.assert_array_equal(self.echo(sent).all_f32, [1.5, -2.0, 3.0])

    def test_what_does_not_fit_names_its_field(self):
        point = self.types["Demo::Point"]
        wrong = [
            ("flag", 1, "`all.flag`: expected bool, got 1 (int)"),
            ("uint8", 256, "`all.uint8`: 256 is outside of uint8, 0 to 255"),
            ("int8", -129, "`all.int8`: -129 is outside of int8, -128 to 127"),
            ("uint64", -1, "`all.uint64`: -1 is outside of uint64, 0 to 18446744073709551615"),
            ("int64", 10**50, "`all.int64`: the number is outside of int64"),
            ("int32", 1.0, "`all.int32`: expected int32, got 1.0 (float)"),
            ("int32", True, "`all.int32`: expected int32, got True (bool)"),
            ("int32", None, "`all.int32`: expected int32, got None"),
            ("f32", 1e39, "`all.f32`: 1" ),
            ("f64", "1", "`all.f64`: expected float64, got '1' (str)"),
            ("f64", 10**400, "`all.f64`: "),
            ("text", b"no", "`all.text`: expected str, got b'no' (bytes)"),
            ("text", "\ud800", "`all.text`: the text has a surrogate"),
            ("text", "a\0b", "`all.text`: a string holds a zero byte"),
            ("short", "äbc€", "`all.short`: it has 7 bytes, its type allows 4"),
            ("kind", 7, "`all.kind`: expected `Demo::Kind` (wall, door, person), got 7 (int)"),
            ("point", (1, 2), "`all.point`: expected `Demo::Point`, got (1, 2) (tuple)"),
            ("point", point(2000.0, 0.0), "`all.point.x`: 2000 is outside its range -1000 to 1000 mm"),
            ("points", [point(0.0, 0.0)] * 4, "`all.points`: it has 4 elements, its type allows 3"),
            ("points", [point(0.0, 0.0), point("a", 0.0)], "`all.points[1].x`: expected float32"),
            ("points", 5, "`all.points`: expected sequence<Demo::Point,3>, got 5 (int)"),
            ("all_uint8", [1, 300], "`all.all_uint8[1]`: 300 is outside of uint8"),
            ("all_uint8", np.array([1, -1]), "`all.all_uint8[1]`: -1 is outside of uint8"),
            ("all_int32", np.array([1.5]), "`all.all_int32[0]`: expected int32"),
            ("all_f32", np.array([1.0, 1e39]), "`all.all_f32[1]`: 1"),
            ("all_int32", "12", "`all.all_int32`: expected sequence<int32>, got '12' (str)"),
            ("few", np.zeros(5, np.uint8), "`all.few`: it has 5 elements, its type allows 4"),
            ("all_int8", range(10**12), "`all.all_int8`: it has more than 16777216 elements"),
            ("few", itertools.count(), "`all.few`: it has more than 4 elements"),
            ("points", itertools.repeat(point(0.0, 0.0)), "`all.points`: it has more than 3 elements"),
            ("matrix", np.zeros(8), "`all.matrix`: it has 8 elements, its type has 9"),
            ("names", "abc", "`all.names`: expected sequence<string>, got 'abc' (str)"),
            ("names", ["a", 2], "`all.names[1]`: expected str, got 2 (int)"),
            ("scores", [1], "`all.scores`: expected a dict, got [1] (list)"),
            ("scores", {"a": "b"}, "`all.scores[a]`: expected float64, got 'b' (str)"),
            ("scores", {1: 2.0}, "`all.scores[1 (int)]`: expected str, got 1 (int)"),
            ("maybe", 1, "`all.maybe`: expected `Demo::Point`, got 1 (int)"),
            ("class_", 2**31, "`all.class`: 2147483648 is outside of int32"),
        ]
        for name, value, text in wrong:
            with self.subTest(name=name, value=value):
                sent = self.everything()
                setattr(sent, name, value)
                with self.assertRaises(robocomp.InvalidArgument) as caught:
                    self.echo(sent)
                self.assertIn(f"echo(): {text}", str(caught.exception))
                self.assertIsInstance(caught.exception, ValueError)
        with self.assertRaises(robocomp.InvalidArgument) as caught:
            self.client.run(lambda ctx: ctx.echo.echo())
        self.assertIn("it takes 1 arguments, 0 were given", str(caught.exception))
        self.assertIsNone(self.client.run(lambda ctx: ctx.echo.nothing()))

    def shift(self, by):
        at = self.types["Demo::Point"](1.0, 2.0)
        return self.client.run(lambda ctx: ctx.echo.shift(at, by))

    def test_several_parts_are_a_named_tuple(self):
        answer = self.shift(1.0)
        self.assertEqual(answer.count_, 3)
        self.assertEqual(answer.result, self.types["Demo::Point"](2.0, 2.0))
        self.assertEqual(answer, (self.types["Demo::Point"](2.0, 2.0), 3))

    def test_arrays_that_would_lose_a_part_are_refused(self):
        masked = np.ma.array([1, 2], mask=[False, True])
        hidden = np.ma.array(5, mask=True)
        sends = lambda data: self.client.run(lambda ctx: ctx.echo.numbers(data))  # noqa: E731
        for data, reason in (
            (np.array([1 + 2j, 3]), "complex"),
            (np.array([1 + 0j], np.complex64), "complex"),
            (masked, "filled"),
            (masked.astype(np.float64), "filled"),
            ([np.ma.masked], "expected int32"),
            ([hidden], "expected int32"),
        ):
            with self.assertRaises(TypeError) as caught:
                sends(data)
            self.assertIn(reason, str(caught.exception))
        point = self.types["Demo::Point"]
        for number in (np.complex128(1 + 2j), 1j, np.ma.masked, np.ma.array(5.0, mask=True)):
            with self.assertRaises(TypeError):
                self.client.run(lambda ctx: ctx.echo.shift(point(1.0, 2.0), number))  # noqa: B023
        np.testing.assert_array_equal(sends(np.ma.array([1, 2, 3])), [0.5, 1.0, 1.5])

    def test_exceptions_of_the_interface_arrive(self):
        with self.assertRaises(self.types["Demo::Nonsense"]) as caught:
            self.shift(0.0)
        self.assertEqual((caught.exception.what, caught.exception.code), ("by is zero", 7))
        with self.assertRaises(self.types["Demo::Empty"]):
            self.shift(-1.0)

    def refused(self, call):
        with self.assertRaises(robocomp.Refused) as caught:
            call()
        self.assertEqual(self.shift(1.0).count_, 3)
        return str(caught.exception)

    def test_a_handler_that_fails_refuses_and_lives(self):
        self.assertIn("shift(): KeyError: 'lost'", self.refused(lambda: self.shift(2e4)))
        text = self.refused(lambda: self.shift(2e5))
        self.assertIn("shift(): the tuple that it returned: `return`: expected `Demo::Point`, got 'two' (str)", text)
        text = self.refused(lambda: self.shift(2e6))
        self.assertIn("`count`: expected int32", text)
        numbers = lambda count: self.client.run(lambda ctx: ctx.echo.numbers([0] * count))  # noqa: E731
        text = self.refused(lambda: numbers(1))
        self.assertIn("numbers(): its result: `[2]`: 1", text)
        text = self.refused(lambda: numbers(2))
        self.assertIn("its result: expected sequence<float32>, got '12' (str)", text)
        np.testing.assert_array_equal(numbers(3), np.zeros(3, np.float32))

    def test_commands_arrive_in_order(self):
        for number in range(20):
            self.client.run(lambda ctx, number=number: ctx.echo.note(f"note {number}"))
        noted = self.client.run(lambda ctx: ctx.echo.noted())
        self.assertEqual(noted[-20:], [f"note {number}" for number in range(20)])

    def test_other_threads_are_refused(self):
        kept = []
        self.client.run(lambda ctx: kept.append(ctx))
        for use in (
            lambda: kept[0].now(),
            lambda: kept[0].echo.nothing(),
            lambda: kept[0].stop("no"),
            lambda: kept[0].echo.is_connected,
        ):
            with self.assertRaises(robocomp.WrongThread) as caught:
                use()
            self.assertIn("queue.SimpleQueue", str(caught.exception))

    def test_a_waiting_call_lets_other_threads_run(self):
        turns = []
        stop = threading.Event()

        def count():
            while not stop.is_set():
                turns.append(1)
                stop.wait(0.001)

        thread = threading.Thread(target=count)
        thread.start()
        self.client.run(lambda ctx: [ctx.echo.nothing() for _ in range(100)])
        stop.set()
        thread.join()
        self.assertGreater(len(turns), 1)

    def test_values_are_not_changed(self):
        sent = self.everything()
        before = copy.deepcopy(sent)
        self.echo(sent)
        self.assert_same(before, sent)


if __name__ == "__main__":
    unittest.main()
