"""The time of a network, as a component sees it that may be its source."""

import os
import queue
import unittest
from datetime import timedelta

import robocomp
from build import Fixture
from demo import MODULE

LIMIT = 20.0
STEP = timedelta(milliseconds=10)


class Source(unittest.TestCase):
    def compute_once(self, task, *args):
        """What `task` returns of the context of a component that can advance time."""
        result = queue.SimpleQueue()
        fixture = Fixture("source", [MODULE], "iceoryx2", simulates_time=True)

        class Worker(fixture.worker):
            def compute(self, ctx):
                result.put(task(ctx))
                ctx.stop("done")

        args = ["--network", f"py-time-{os.getpid()}", *args]
        running = robocomp.embed(fixture.component(Worker), Worker, args)
        self.addCleanup(running.stop)
        found = result.get(timeout=LIMIT)
        running.join()
        return found

    def test_a_source_advances_time(self):
        def advance(ctx):
            before = ctx.now()
            ticks = [ctx.time.advance(STEP), ctx.time.advance(STEP), ctx.time.set(STEP)]
            return ctx.time.is_active, before, ticks, ctx.time.tick, ctx.now(), ctx.time.followers()

        found = self.compute_once(advance)
        self.assertEqual(found, (True, timedelta(0), [1, 2, 3], 3, STEP, []))

    def test_a_source_waits_for_its_followers(self):
        def wait(ctx):
            ctx.time.wait_for_all(timedelta(seconds=5))
            ctx.time.set_order(robocomp.Order.AT_ONCE)
            ctx.time.set_paced(False)
            try:
                ctx.time.advance(STEP)
            except robocomp.TimeError as error:
                caught = (str(error), error.tick, error.waiting_for)
            released = [ctx.time.release(name) for name in ("ghost", "nobody")]
            return caught, released, ctx.time.advance(STEP)

        caught, released, tick = self.compute_once(wait, "--followers", "ghost")
        self.assertEqual(caught, ("tick 0 waits for ghost", 0, ("ghost",)))
        self.assertEqual((released, tick), ([True, False], 1))

    def test_a_component_beside_another_clock_is_no_source(self):
        def advance(ctx):
            try:
                ctx.time.advance(STEP)
            except robocomp.TimeError as error:
                return ctx.time.is_active, str(error), error.waiting_for

        is_active, reason, waiting_for = self.compute_once(advance, "--clock", "system")
        self.assertEqual((is_active, waiting_for), (False, ()))
        self.assertIn("this component is not the source of its network's time", reason)


if __name__ == "__main__":
    unittest.main()
