"""Samples that are written in the memory of the middleware, and views of received ones."""

import gc
import itertools
import os
import queue
import subprocess
import sys
import threading
import unittest
from pathlib import Path

import numpy as np
import robocomp
from build import Fixture
from demo import MODULE

MIDDLEWARE = os.environ.get("TEST_MIDDLEWARE", "iceoryx2")
ARGS = ["--network", os.environ.get("TEST_NETWORK", f"py-place-{os.getpid()}")]
if MIDDLEWARE == "dds":
    ARGS += ["--set-middleware", f"dds.domain={os.environ['TEST_DOMAIN']}"]
LIMIT = 20.0
SHARED = MIDDLEWARE == "iceoryx2"
LIMIT_KEPT = 4


class InPlace(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        received = cls.received = queue.SimpleQueue()
        tasks = cls.tasks = queue.SimpleQueue()
        monitor = Fixture("monitor", [MODULE], MIDDLEWARE)
        monitor.slot("Images", "subscribesTo", "Demo::Images", in_place=True)
        camera = Fixture("camera", [MODULE], MIDDLEWARE)
        camera.slot("Images", "publishes", "Demo::Images")
        cls.types = camera.types

        class Monitor(monitor.worker):
            def image(self, ctx, image):
                received.put(image)

        class Camera(camera.worker):
            def compute(self, ctx):
                try:
                    task, done = tasks.get_nowait()
                except queue.Empty:
                    return
                try:
                    done.put((task(ctx.images), None))
                except BaseException as error:
                    done.put((None, error))

        cls.running = [
            robocomp.embed(monitor.component(Monitor), Monitor, ARGS),
            robocomp.embed(camera.component(Camera), Camera, ARGS),
        ]
        for _ in range(1000):
            if cls.run_there(lambda images: images.subscribers):
                return
        raise AssertionError("the subscriber was not found")

    def test_a_second_loan_says_what_to_do(self):
        def twice(images):
            first = images.loan_image()
            if MIDDLEWARE == "iceoryx2":
                with self.assertRaises(robocomp.NotSent) as caught:
                    images.loan_image()
                self.assertIn("Images/image", str(caught.exception))
                self.assertIn("send or discard the earlier one", str(caught.exception))
            first.discard()
            images.loan_image().discard()

        self.run_there(twice)

    def test_a_loan_of_a_failed_block_is_discarded(self):
        def fail(images):
            with self.assertRaises(ZeroDivisionError), images.loan_image() as image:
                1 / 0
            with self.assertRaises(BufferError) as caught:
                image.send()
            self.assertIn("sent or discarded", str(caught.exception))
            images.loan_image().discard()

        self.run_there(fail)

    def test_arrays_that_would_lose_a_part_are_not_lent(self):
        def lose(images):
            image = images.loan_image()
            for pose, reason in (
                (np.full(6, 1 + 2j), "complex"),
                (np.ma.array([1.0] * 6, mask=[True] + [False] * 5), "filled"),
            ):
                with self.assertRaises(TypeError) as caught:
                    image.pose = pose
                self.assertIn(reason, str(caught.exception))
            image.discard()

        self.run_there(lose)

    def test_a_failed_block_gives_its_memory_back_after_its_arrays(self):
        def fail(images):
            with self.assertRaises(ZeroDivisionError), images.loan_image() as image:
                data = image.resize("data", 16)
                1 / 0
            for use in (image.send, image.discard, image.copy, lambda: image.data):
                with self.assertRaises(BufferError) as caught:
                    use()
                self.assertIn("sent or discarded", str(caught.exception))
            data[:] = 7
            if SHARED:
                with self.assertRaises(robocomp.NotSent) as caught:
                    images.loan_image()
                self.assertIn("delete its arrays", str(caught.exception))
            self.assertEqual(data.sum(), 7 * 16)
            del data, use
            images.loan_image().discard()

        self.run_there(fail)

    @classmethod
    def tearDownClass(cls):
        # An array and a view outlive their components.
        cls.outlives = []
        cls.run_there(lambda images: cls.send_pose(images, 5))
        view = cls.received.get(timeout=LIMIT)
        pose = view.pose
        cls.run_there(lambda images: cls.outlives.append(images.loan_image().resize("data", 64)))
        for component in reversed(cls.running):
            component.stop()
            component.join()
        cls.outlives[0][:] = 1
        cls.outlives.clear()
        assert (view.number, pose.tolist()) == (5, [5.0] * 6)
        threading.Thread(target=view.copy).start()
        # Nothing stays behind, although the process ends with a view in a thread that never ends.
        threading.Thread(target=lambda: threading.Event().wait() or view, daemon=True).start()

    @classmethod
    def run_there(cls, task):
        done = queue.SimpleQueue()
        cls.tasks.put((task, done))
        result, error = done.get(timeout=LIMIT)
        if error is not None:
            raise error
        return result

    def test_an_image_is_written_and_read(self):
        point, kind = self.types["Demo::Point"], self.types["Demo::Kind"]

        def send(images):
            loan = images.loan_image()
            self.assertEqual((loan.number, loan.frame, len(loan.data)), (0, "", 0))
            loan.number = 7
            loan.kind = kind.DOOR
            loan.frame = "küche"
            loan.center.x = 1.5
            loan.center = point(2.5, -1.0)
            loan.resize("corners", 2)[1].y = 9.0
            loan.pose[:] = np.arange(6)
            data = loan.resize("data", 640 * 480)
            self.assertEqual((data.dtype, data.flags.writeable), (np.uint8, True))
            data[:] = np.arange(640 * 480) % 251
            del data
            loan.send()

        self.run_there(send)
        image = self.received.get(timeout=LIMIT)
        self.assertEqual((image.number, image.kind, image.frame), (7, kind.DOOR, "küche"))
        self.assertEqual((image.center.x, image.center.y), (2.5, -1.0))
        self.assertEqual([corner.y for corner in image.corners], [0.0, 9.0])
        np.testing.assert_array_equal(image.pose, np.arange(6))
        data = image.data
        np.testing.assert_array_equal(data, np.arange(640 * 480) % 251)
        self.assertFalse(data.flags.writeable)
        with self.assertRaises(ValueError):
            data[0] = 1
        with self.assertRaises(BufferError):
            image.number = 8
        kept = image.copy()
        self.assertEqual(type(kept).__name__, "Image")
        self.assertEqual(kept.number, 7)
        # The array keeps the memory of its sample.
        del image
        gc.collect()
        self.exchange(30)
        np.testing.assert_array_equal(data, np.arange(640 * 480) % 251)

    @staticmethod
    def send_number(images, number):
        with images.loan_image() as loan:
            loan.number = number
            loan["number"] = number

    def exchange(self, count):
        for number in range(count):
            self.run_there(lambda images: self.send_number(images, number))
            self.assertEqual(self.received.get(timeout=LIMIT).number, number)

    def drain(self):
        """Takes what was sent until now."""
        self.run_there(lambda images: self.send_number(images, -1))
        while self.received.get(timeout=LIMIT).number != -1:
            pass

    def receive(self, count):
        """Views of new samples."""
        views = []
        for number in range(count):
            self.run_there(lambda images: self.send_number(images, number))
            views.append(self.received.get(timeout=LIMIT))
        return views

    def test_a_view_lies_in_shared_memory(self):
        (view,) = self.receive(1)
        address = view.pose.__array_interface__["data"][0]
        shared = False
        for line in Path("/proc/self/maps").read_text().splitlines():
            low, high = (int(end, 16) for end in line.split(" ", 1)[0].split("-"))
            if low <= address < high:
                shared = "/dev/shm/" in line
        self.assertEqual(shared, SHARED)

    def test_no_more_than_the_limit_is_kept(self):
        views = self.receive(LIMIT_KEPT)
        for number in range(100, 103):
            self.run_there(lambda images: self.send_number(images, number))
        if SHARED:
            # The worker gets none of the three, and a later one as soon as it keeps less.
            views.pop(1)
            number = None
            for _ in range(200):
                self.run_there(lambda images: self.send_number(images, 7))
                try:
                    number = self.received.get(timeout=0.1).number
                except queue.Empty:
                    continue
                break
            self.assertIn(number, (7, 100, 101, 102))
        else:
            for number in range(100, 103):
                self.assertEqual(self.received.get(timeout=LIMIT).number, number)
        # Kept values are unchanged.
        numbers = [view.number for view in views]
        self.assertEqual(numbers, [0, 2, 3] if SHARED else [0, 1, 2, 3])
        views.clear()
        self.drain()
        self.exchange(3)

    def test_views_are_dropped_in_any_order_and_on_any_thread(self):
        def use(view, array):
            for _ in range(50):
                self.assertEqual(view.number, int(array[0]))
                del array
                array = view.pose
                view.copy()

        for order in itertools.permutations(range(LIMIT_KEPT)):
            kept = []
            for number in range(LIMIT_KEPT):
                self.run_there(lambda images: self.send_pose(images, number))
                view = self.received.get(timeout=LIMIT)
                array = view.pose
                # A cycle, which only the garbage collector ends.
                cycle = [view]
                cycle.append(cycle)
                kept.append((view, array))
                del view, array, cycle
            threads = [threading.Thread(target=use, args=kept[at]) for at in order]
            for thread in threads:
                thread.start()
            for at in order:
                kept[at] = None
            for thread in threads:
                thread.join()
            del thread, threads
            gc.collect()
        self.exchange(3)

    @staticmethod
    def send_pose(images, number):
        with images.loan_image() as loan:
            loan.number = number
            loan.pose = np.full(6, number)

    def test_send_is_refused_while_an_array_exists(self):
        def send(images):
            loan = images.loan_image()
            data = loan.resize("data", 16)
            part = data[3:5]
            del data
            with self.assertRaises(BufferError) as caught:
                loan.send()
            self.assertIn("a writable view of the sample exists", str(caught.exception))
            with self.assertRaises(BufferError):
                loan.discard()
            part[:] = 5
            del part
            loan.send()
            for use in (loan.send, loan.discard, lambda: loan.number, lambda: loan.data):
                with self.assertRaises(BufferError):
                    use()
            with self.assertRaises(BufferError):
                loan.number = 1

        self.run_there(send)
        self.assertEqual(len(self.received.get(timeout=LIMIT).data), 16)

    def test_what_does_not_fit_is_refused(self):
        kind = self.types["Demo::Kind"]

        def fill(images):
            loan = images.loan_image()
            for name, value, text in (
                ("number", 2**63, "`number`: 9223372036854775808 is outside of int64"),
                ("kind", 1, "expected `Demo::Kind`"),
                ("frame", "x" * 17, "17 bytes, its type allows 16"),
                ("pose", np.zeros(5), "it has 5 elements, its type has 6"),
                ("data", np.zeros(1048577, np.uint8), "its type allows 1048576"),
                ("center", kind.WALL, "expected `Demo::Point`"),
            ):
                with self.assertRaises(robocomp.InvalidSample) as caught:
                    setattr(loan, name, value)
                self.assertIn(text, str(caught.exception))
            with self.assertRaises(robocomp.InvalidSample):
                loan.center.x = 5000.0
            with self.assertRaises(robocomp.InvalidSample):
                loan.resize("data", 1048577)
            with self.assertRaises(TypeError):
                loan.resize("number", 2)
            with self.assertRaises(AttributeError) as caught:
                loan.nothing  # noqa: B018
            self.assertIn("there are number, kind, frame", str(caught.exception))
            loan.discard()

        self.run_there(fill)

    def test_nothing_crashes(self):
        kept = []

        def abuse(images):
            loan = images.loan_image()
            kept.append(loan.resize("data", 1000))
            kept.append(loan)
            loan = None
            gc.collect()

        self.run_there(abuse)
        # The arrays and the loan are used and dropped on another thread.
        kept[0][:] = 3
        with self.assertRaises(BufferError):
            kept[1].send()
        first = kept.pop(0)
        self.assertEqual(int(first.sum()), 3000)
        del first
        with self.assertRaises(robocomp.WrongThread):
            kept[0].send()
        kept.clear()
        gc.collect()
        self.exchange(20)

        def never_sent(images):
            for _ in range(100):
                images.loan_image().resize("data", 10)[:] = 1

        self.run_there(never_sent)

    @unittest.skipUnless(SHARED, "without shared memory, a view has a copy")
    def test_a_worker_that_keeps_too_much_is_told_its_slot(self):
        holder = subprocess.Popen(
            [sys.executable, "holder.py", *ARGS],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        said = threading.Event()
        lines = []

        def read():
            for line in holder.stderr:
                lines.append(line)
                if "slot Images" in line:
                    said.set()

        reader = threading.Thread(target=read)
        reader.start()
        self.assertEqual(holder.stdout.readline(), "ready\n")
        for _ in range(1000):
            self.run_there(lambda images: self.send_number(images, 1))
            self.received.get(timeout=LIMIT)
            if said.wait(0.02):
                break
        holder.terminate()
        self.assertEqual(holder.stdout.read().split()[-1], "4")
        reader.join()
        self.assertEqual(holder.wait(timeout=LIMIT), 0, lines)
        text = "".join(lines)
        self.assertIn("the worker keeps 4 samples of `image`, the most that it may, so image()", text)
        holder.stdout.close()
        holder.stderr.close()


if __name__ == "__main__":
    unittest.main()
