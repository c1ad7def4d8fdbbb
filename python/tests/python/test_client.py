"""A running network without a component of one's own."""

import copy
import inspect
import os
import pydoc
import signal
import subprocess
import sys
import threading
import time
import unittest
from datetime import timedelta

import numpy as np
import robocomp
from build import Fixture
from demo import MODULE
from robocomp._classes import classes, distinct

MIDDLEWARE = os.environ.get("TEST_MIDDLEWARE", "iceoryx2")
NETWORK = os.environ.get("TEST_NETWORK", f"py-client-{os.getpid()}")
LIMIT = timedelta(seconds=20)


PARAMETERS = {
    "name": "server",
    "parameters": [
        {
            "name": "speed",
            "kind": {"scalar": {"type": "float"}},
            "default": {"float": 500.0},
            "range": {"min": {"float": 0.0}, "max": {"float": 1500.0}},
            "editable": True,
        },
        {
            "name": "pause",
            "kind": {"scalar": {"type": "duration"}},
            "default": {"duration": 1000000000},
            "editable": True,
        },
    ],
}


def counted(function, *arguments):
    """The result of a function, and the number of lines that ran in it."""
    lines = 0

    def trace(frame, event, _):
        nonlocal lines
        lines += event == "line"
        return trace if frame.f_code is function.__code__ else None

    sys.settrace(trace)
    try:
        return function(*arguments), lines
    finally:
        sys.settrace(None)


class Client(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        fixture = Fixture("server", [MODULE], MIDDLEWARE)
        fixture.slot("Echo", "implements", "Demo::Echo").slot("Images", "publishes", "Demo::Images")
        fixture.slot("Seen", "subscribesTo", "Demo::Images")
        fixture.description["parameters"] = PARAMETERS
        types = fixture.types

        cls.gate = threading.Event()
        cls.entered = threading.Event()
        cls.left = threading.Event()

        class SpecificWorker(fixture.worker):
            def initialize(self, ctx):
                self.number = 0
                self.notes = []

            def image(self, ctx, image):
                self.notes.append(f"seen {image.frame}")

            def compute(self, ctx):
                self.number += 1
                with ctx.images.loan_image() as image:
                    image.number = self.number
                    image.resize("data", 8)[:] = 5

            def echo(self, ctx, all):
                return all

            def nothing(self, ctx):
                return None

            def shift(self, ctx, at, by):
                if by == 0:
                    raise types["Demo::Nonsense"]("by is zero", 7)
                return types["Demo::Point"](at.x + by, at.y), 3

            def note(self, ctx, text):
                if text == "wait":
                    cls.entered.set()
                    cls.gate.wait(LIMIT.total_seconds())
                    cls.left.set()
                else:
                    self.notes.append(text)

            def noted(self, ctx):
                return self.notes

            def numbers(self, ctx, data):
                return data / 2

        class Async(SpecificWorker):
            async def note(self, ctx, text):
                pass

            @staticmethod
            def noted(ctx):
                return []

            @staticmethod
            def nothing(self, ctx):
                return None

        component = fixture.component(SpecificWorker)
        cls.refused = lambda: robocomp.embed(component, Async)
        args = []
        if MIDDLEWARE in ("dds", "ros2"):
            args += ["--set-middleware", f"{MIDDLEWARE}.domain={os.environ['TEST_DOMAIN']}"]

        cls.args = args

        def start(network):
            own = ["--network", network, "--bind", f"Seen={network}/server/Seen"]
            return robocomp.embed(component, SpecificWorker, [*own, *args])

        cls.start = staticmethod(start)
        cls.running = start(NETWORK)
        cls.net = robocomp.connect(NETWORK, timeout=LIMIT)

    @classmethod
    def tearDownClass(cls):
        cls.running.stop()
        cls.running.join()

    def test_operations_are_called(self):
        net = self.net
        self.assertEqual(net.components, ["server"])
        self.assertEqual(dir(net.server), ["echo", "params"])
        np.testing.assert_array_equal(net.server.echo.numbers([2, 4]), [1.0, 2.0])
        np.testing.assert_array_equal(net["server"].Echo.numbers(data=[6]), [3.0])
        point = net.types["Demo::Point"](1.0, 2.0)
        answer = net.server.echo.shift(at=point, by=2.0)
        self.assertEqual((answer.count_, answer.result.x), (3, 3.0))
        result, count = answer
        self.assertEqual((count, result.x), (3, 3.0))
        self.assertIsNone(net.server.echo.nothing())
        net.server.echo.note("a note")
        self.assertEqual(net.server.echo.noted(), ["a note"])

    def test_operations_have_signatures_and_documentation(self):
        shift = self.net.server.echo.shift
        signature = inspect.signature(shift)
        self.assertEqual(list(signature.parameters), ["at", "by"])
        point = self.net.types["Demo::Point"]
        self.assertIs(signature.parameters["at"].annotation, point)
        self.assertIs(signature.return_annotation, self.net.types["Demo::Echo.shift"])
        text = pydoc.plain(pydoc.render_doc(shift))
        self.assertIn("shift(at: Demo.Point, by: float) -> Demo.ShiftAnswer", text)
        for line in (
            "`server.Echo.shift`",
            "by: float64",
            "result: Demo::Point",
            "count: int32",
            "Raises",
            "Demo::Nonsense",
        ):
            self.assertIn(line, text)
        numbers = self.net.server.echo.numbers
        self.assertEqual(str(inspect.signature(numbers)), "(data: numpy.ndarray) -> numpy.ndarray")
        with self.assertRaises(TypeError) as error:
            shift(at=point(0.0, 0.0), by=1.0, to=2)
        self.assertIn("server.Echo.shift(at: Demo.Point, by: float)", str(error.exception))
        self.assertIn("'to'", str(error.exception))

    def test_what_is_printed_says_what_it_is(self):
        net = self.net
        self.assertEqual(repr(net), f"<network {NETWORK}: components server; topics 2>")
        self.assertEqual(repr(net.server), "<component server: slots echo>")
        said = repr(net.server.echo)
        self.assertTrue(said.startswith("<slot server.Echo: echo, nothing, shift"), said)

    def test_samples_are_published(self):
        types = self.net.types
        frame = f"{time.monotonic_ns() % 10**9}"
        center = types["Demo::Point"](1.0, 2.0)
        values = {"number": 7, "kind": types["Demo::Kind"].DOOR, "frame": frame, "center": center}
        values |= {"corners": [], "pose": [0.0] * 6, "data": b"abc"}
        image = types["Demo::Image"](**values)
        with self.net.publisher("server.Seen.image") as seen:
            self.assertEqual(seen.subscribers, 1)
            self.assertEqual(repr(seen), "<publisher server.Seen.image(image: Demo.Image) -> None>")
            with self.assertRaises(TypeError):
                seen.publish()
            with self.assertRaises(robocomp.InvalidSample):
                seen.publish(5)
            # Neither loses its imaginary part, nor has what a mask hides.
            for pose, reason in (
                (np.full(6, 1 + 2j), "complex"),
                (np.ma.array([1.0] * 6, mask=[True] + [False] * 5), "filled"),
            ):
                lossy = types["Demo::Image"](**values | {"pose": pose})
                with self.assertRaises(TypeError) as caught:
                    seen.publish(lossy)
                self.assertIn("pose", str(caught.exception))
                self.assertIn(reason, str(caught.exception))
            seen.publish(image=image)
        with self.assertRaises(robocomp.SendError):
            seen.publish(image)
        end = time.monotonic() + LIMIT.total_seconds()
        while f"seen {frame}" not in self.net.server.echo.noted():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.01)
        with self.assertRaises(robocomp.Error):
            self.net.publisher("nothing")

    def test_parameters_are_read_and_changed(self):
        params = self.net.server.params
        self.assertEqual(dict(params), {"speed": 500.0, "pause": "1s"})
        params["speed"] = np.float64(600.0)
        params.update(pause=timedelta(milliseconds=250))
        self.assertEqual((params["speed"], params["pause"]), (600.0, "250ms"))
        with self.assertRaises(robocomp.Error) as error:
            params.update({"speed": 700.0, "pause": "soon"})
        self.assertIn("pause", str(error.exception))
        self.assertEqual(params["speed"], 600.0)
        with self.assertRaises(robocomp.Error) as error:
            params["sped"] = 1.0
        self.assertIn("speed", str(error.exception))
        with self.assertRaises(KeyError):
            params["sped"]
        self.assertIn("speed = 600.0  (float", repr(params))
        params.update(speed=500.0, pause="1s")

    def test_errors_are_exceptions(self):
        net = self.net
        point = net.types["Demo::Point"](1.0, 2.0)
        with self.assertRaises(net.types["Demo::Nonsense"]) as caught:
            net.server.echo.shift(point, 0.0)
        self.assertEqual(caught.exception.code, 7)
        with self.assertRaises(robocomp.InvalidArgument):
            net.server.echo.note(5)
        with self.assertRaises(TypeError):
            net.server.echo.note()
        with self.assertRaises(AttributeError) as error:
            net.server.echo.no_such()
        self.assertIn("there are echo, nothing, shift", str(error.exception))
        with self.assertRaises(AttributeError):
            net.nobody  # noqa: B018
        with self.assertRaises(KeyError):
            net["nobody"]
        with self.assertRaises(robocomp.Error):
            robocomp.connect("py-no-such-network")
        with self.assertRaises(robocomp.Error):
            net.topic("no.such.topic")

    def test_a_handler_that_does_not_return_is_a_deadline(self):
        net = robocomp.connect(NETWORK, timeout=timedelta(milliseconds=100))
        try:
            with self.assertRaises(robocomp.Deadline) as caught:
                net.server.echo.note("wait")
            self.assertIsInstance(caught.exception, robocomp.CallError)
        finally:
            self.gate.set()

    def test_ctrl_c_ends_a_call_that_waits(self):
        self.entered.clear()
        self.gate.clear()
        self.left.clear()

        def interrupt():
            self.entered.wait(LIMIT.total_seconds())
            os.kill(os.getpid(), signal.SIGINT)

        # A test run in the background ignores Ctrl-C, and Python then leaves it so.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        interrupts = threading.Thread(target=interrupt)
        interrupts.start()
        try:
            with self.assertRaises(KeyboardInterrupt):
                self.net.server.echo.note("wait")
            self.assertFalse(self.left.is_set(), "the server still works at the call")
        finally:
            self.gate.set()
            interrupts.join()
            signal.signal(signal.SIGINT, before)

    def test_a_component_that_has_ended_is_no_server(self):
        network = f"{NETWORK}-ended"
        running = self.start(network)
        net = robocomp.connect(network, timeout=LIMIT)
        running.stop()
        running.join()
        with self.assertRaises(robocomp.NoServer):
            net.server.echo.nothing()

    def test_a_component_can_be_stopped_while_another_thread_waits_for_it(self):
        running = self.start(f"{NETWORK}-joined")
        waits = threading.Thread(target=running.join)
        waits.start()
        self.assertFalse(running.has_ended())
        running.stop()
        waits.join(LIMIT.total_seconds())
        self.assertFalse(waits.is_alive())
        self.assertTrue(running.has_ended())

    def test_parts_of_a_network_can_be_copied(self):
        server = self.net.server
        self.assertEqual(dir(copy.copy(server)), ["echo", "params"])
        self.assertEqual(dir(copy.copy(server.echo)), dir(server.echo))

    @unittest.skipUnless(MIDDLEWARE == "iceoryx2", "it is the same over each")
    def test_a_component_that_starts_too_late_ends_before_the_interpreter(self):
        script = f"""
import time, robocomp
from build import Fixture
from demo import MODULE
fixture = Fixture("late", [MODULE], "{MIDDLEWARE}")
class SpecificWorker(fixture.worker):
    def initialize(self, ctx):
        time.sleep(11)
        print("initialized", flush=True)
    def compute(self, ctx):
        pass
component = fixture.component(SpecificWorker)
try:
    robocomp.embed(component, SpecificWorker, ["--network", "{NETWORK}-late", *{self.args}])
except robocomp.StartError as error:
    print(error, flush=True)
"""
        ended = subprocess.run(
            [sys.executable, "-c", script],
            capture_output=True,
            text=True,
            timeout=60,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )
        self.assertEqual(ended.returncode, 0, ended.stderr)
        lines = ended.stdout.splitlines()
        self.assertIn("does not run within 10s", lines[0])
        self.assertEqual(lines[-1], "initialized", ended.stdout + ended.stderr)

    def test_a_negative_timeout_is_an_error(self):
        negative = timedelta(seconds=-1)
        with self.assertRaises(ValueError):
            robocomp.connect(NETWORK, timeout=negative)
        with self.assertRaises(ValueError):
            self.net.topic("image", timeout=negative)

    def test_a_worker_is_checked_before_it_starts(self):
        with self.assertRaises(robocomp.StartError) as caught:
            type(self).refused()
        message = str(caught.exception)
        self.assertIn("Async.note() is async or a generator", message)
        self.assertIn("Async.nothing() takes (self, ctx)", message)
        self.assertNotIn("noted", message)

    def test_a_topic_is_a_stream(self):
        self.assertEqual(self.net.topics, ["server.Images.image", "server.Seen.image"])
        images = self.net.topic("Images.image", timeout=LIMIT)
        numbers = []
        for image in images:
            self.assertEqual(image.data.tolist(), [5] * 8)
            numbers.append(image.number)
            if len(numbers) == 3:
                break
        self.assertEqual(numbers, sorted(set(numbers)))


class Versions(unittest.TestCase):
    def test_components_of_two_versions_are_reached(self):
        network = f"{NETWORK}-versions"
        newer = copy.deepcopy(MODULE)
        point = next(t for t in newer["types"] if t["name"] == "Point")
        point["struct"].append({"name": "maxRange", "type": "float64"})

        def component(name, module):
            fixture = Fixture(name, [module], MIDDLEWARE).slot("Echo", "implements", "Demo::Echo")

            class SpecificWorker(fixture.worker):
                def echo(self, ctx, all):
                    return all

                def nothing(self, ctx):
                    return None

                def shift(self, ctx, at, by):
                    return at, 1

                def note(self, ctx, text):
                    pass

                def noted(self, ctx):
                    return []

                def numbers(self, ctx, data):
                    return data

            args = ["--network", network, "--name", name, "--bind", f"Echo={name}/Echo"]
            if MIDDLEWARE in ("dds", "ros2"):
                args += ["--set-middleware", f"{MIDDLEWARE}.domain={os.environ['TEST_DOMAIN']}"]
            return robocomp.embed(fixture.component(SpecificWorker), SpecificWorker, args)

        running = [component("older", MODULE), component("newer", newer)]
        try:
            net = robocomp.connect(network, timeout=LIMIT)
            old, new = (net.types_of(name) for name in ("older", "newer"))
            self.assertIs(old["Demo::Kind"], new["Demo::Kind"])
            self.assertIs(net.types["Demo::Point"], new["Demo::Point"])
            at = net.older.echo.shift(old["Demo::Point"](1.0, 2.0), 0.0).result
            self.assertEqual((at.x, hasattr(at, "max_range")), (1.0, False))
            at = net.newer.echo.shift(new["Demo::Point"](1.0, 2.0, 3.0), 0.0).result
            self.assertEqual((at.x, at.max_range), (1.0, 3.0))
            with self.assertRaises(KeyError):
                net.types_of("nobody")
        finally:
            for one in running:
                one.stop()
                one.join()


class Slow(unittest.TestCase):
    def test_a_slow_loop_loses_the_oldest_samples(self):
        network = f"{NETWORK}-slow"
        fixture = Fixture("camera", [MODULE], MIDDLEWARE)
        fixture.slot("Images", "publishes", "Demo::Images")
        size, count = 1 << 20, 100
        sent = threading.Event()
        listens = threading.Event()

        class SpecificWorker(fixture.worker):
            number = 0

            def compute(self, ctx):
                if not listens.is_set():
                    return
                self.number += 1
                with ctx.images.loan_image() as image:
                    image.number = self.number
                    image.resize("data", size)
                if self.number % count == 0:
                    sent.set()

        args = ["--network", network]
        if MIDDLEWARE in ("dds", "ros2"):
            args += ["--set-middleware", f"{MIDDLEWARE}.domain={os.environ['TEST_DOMAIN']}"]
        running = robocomp.embed(fixture.component(SpecificWorker), SpecificWorker, args)
        try:
            images = robocomp.connect(network, timeout=LIMIT).topic("image", timeout=LIMIT)
            listens.set()
            for _ in range(20):
                self.assertTrue(sent.wait(LIMIT.total_seconds()))
                sent.clear()
                if images.dropped:
                    break
            self.assertGreater(images.dropped, 0)
            number = next(images).number
            self.assertGreater(number, 1)
        finally:
            running.stop()
            running.join()


class Classes(unittest.TestCase):
    def test_every_name_of_a_description_gives_a_class(self):
        field = "float64"
        module = {
            "module": "Odd",
            "types": [
                {"name": "Kind", "enum": [["mro", 0], ["class", 1], ["_x_", 2]]},
                {
                    "name": "Pair",
                    "struct": [
                        {"name": name, "type": field}
                        for name in ("_a", "a", "maxRange", "max_range", "²")
                    ],
                },
                {"name": "a b\0", "struct": [{"name": "x", "type": field}]},
                {"name": "Broken", "exception": [{"name": "args", "type": field}]},
            ],
            "interfaces": [
                {
                    "name": "Calls",
                    "operations": [
                        {
                            "name": "ask",
                            "outputs": [{"name": "result", "type": field}, {"name": "_b", "type": field}],
                            "result": field,
                        }
                    ],
                }
            ],
        }
        made = classes([module])
        self.assertEqual([kind.name for kind in made["Odd::Kind"]], ["MRO", "CLASS", "X"])
        pair = made["Odd::Pair"](1.0, 2.0, 3.0, 4.0, 5.0)
        self.assertEqual((pair.a, pair.a_, pair.max_range, pair.max_range_, pair.n4), (1.0, 2.0, 3.0, 4.0, 5.0))
        self.assertEqual(made["Odd::Broken"](5.0).args_, 5.0)
        self.assertEqual(made["Odd::Calls.ask"]._fields, ("result_", "result", "b"))
        self.assertEqual(made["Odd::a b\0"](1.0).x, 1.0)

    def test_hostile_names_do_not_occupy_a_client(self):
        many = 4000
        members = lambda name: [{"name": name(at), "type": "float64"} for at in range(many)]  # noqa: E731
        shapes = {
            "equal": lambda at: "a",
            "numbered": lambda at: "a" if at % 2 else f"a_{at}",
            "odd": lambda at: "\0",
            "words": lambda at: "class",
        }
        for shape, name in shapes.items():
            # The work is counted, not timed.
            names, lines = counted(distinct, "member", [name(at) for at in range(many)])
            self.assertLess(lines, 20 * many, shape)
            self.assertEqual(len(set(names)), many, shape)
        module = {
            "module": "Odd",
            "types": [
                {"name": "Struct", "struct": members(shapes["equal"])},
                {"name": "Enum", "enum": [["a", at] for at in range(many)]},
                {"name": "Exception", "exception": members(shapes["equal"])},
            ],
        }
        made = classes([module])
        self.assertEqual(len(made["Odd::Struct"].__match_args__), many)
        self.assertEqual(len(made["Odd::Enum"]), many)



if __name__ == "__main__":
    unittest.main()
