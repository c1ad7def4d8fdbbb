"""Samples that are written in the memory of the middleware, and views of received ones."""

import gc
import os
import queue
import unittest

import numpy as np
import robocomp
from build import Fixture
from demo import MODULE

MIDDLEWARE = os.environ.get("TEST_MIDDLEWARE", "iceoryx2")
ARGS = ["--network", f"py-place-{os.getpid()}"]
LIMIT = 20.0


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

    @classmethod
    def tearDownClass(cls):
        # An array outlives its component.
        cls.outlives = []
        cls.run_there(lambda images: cls.outlives.append(images.loan_image().resize("data", 64)))
        for component in reversed(cls.running):
            component.stop()
            component.join()
        cls.outlives[0][:] = 1
        cls.outlives.clear()

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
            loan.kind = kind.door
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
        self.assertEqual((image.number, image.kind, image.frame), (7, kind.door, "küche"))
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
        for number in range(30):
            self.run_there(lambda images, number=number: self.send_number(images, number))
        np.testing.assert_array_equal(data, np.arange(640 * 480) % 251)
        self.assertEqual([self.received.get(timeout=LIMIT).number for _ in range(30)], list(range(30)))

    @staticmethod
    def send_number(images, number):
        with images.loan_image() as loan:
            loan.number = number
            loan["number"] = number

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
                ("center", kind.wall, "expected `Demo::Point`"),
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
        for number in range(20):
            self.run_there(lambda images, number=number: self.send_number(images, number))
        self.assertEqual([self.received.get(timeout=LIMIT).number for _ in range(20)], list(range(20)))

        def never_sent(images):
            for _ in range(100):
                images.loan_image().resize("data", 10)[:] = 1

        self.run_there(never_sent)


if __name__ == "__main__":
    unittest.main()
