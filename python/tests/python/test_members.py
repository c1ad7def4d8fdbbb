"""Slot arrays of a running component: how their members are opened, and samples that it keeps."""

import json
import os
import queue
import unittest
from pathlib import Path

import robocomp
from build import ROOT, Fixture
from demo import MODULE

LIMIT = 20.0
LIMIT_KEPT = 4


def arrays(name, **more):
    """A component with arrays in all four roles."""
    fixture = Fixture(name, [MODULE], "iceoryx2", **more)
    fixture.slot("seen", "subscribesTo", "Demo::Images", in_place=True, is_array=True)
    fixture.slot("shown", "publishes", "Demo::Images", is_array=True)
    fixture.slot("asked", "requires", "Demo::Notes", is_array=True)
    fixture.slot("served", "implements", "Demo::Notes", is_array=True)
    return fixture


class Members(unittest.TestCase):
    def start(self, name, worker, *args, **description):
        """A component in the network of this test, whose base `worker` takes."""
        fixture = arrays(name, **description)
        made = worker(fixture.worker)
        args = ["--network", f"py-members-{os.getpid()}", "--name", name, *args]
        running = robocomp.embed(fixture.component(made), made, args)
        self.addCleanup(running.stop)
        return running

    def test_each_member_keeps_samples_of_its_own(self):
        received, tasks, answers = (queue.SimpleQueue() for _ in range(3))

        class Base:
            def take(self, ctx, member, text):
                return member.index

            def put(self, ctx, member, text):
                pass

            def image(self, ctx, member, image):
                received.put((member, image))

        def monitor(base):
            class Monitor(Base, base):
                def initialize(self, ctx):
                    for name in ("left", "right"):
                        ctx.seen.open(name)

            return Monitor

        def camera(base):
            class Camera(Base, base):
                def initialize(self, ctx):
                    ctx.shown.open_listed()

                def compute(self, ctx):
                    try:
                        task = tasks.get_nowait()
                    except queue.Empty:
                        return
                    answers.put(task(ctx.shown))

            return Camera

        def run(task):
            tasks.put(task)
            return answers.get(timeout=LIMIT)

        bound = [f"shown.{name}=py-members-{os.getpid()}/monitor/seen/{name}" for name in ("left", "right")]
        bound = [word for name in bound for word in ("--bind", name)]
        running = [
            self.start("monitor", monitor),
            self.start("camera", camera, "--members", "shown=left,right", *bound),
        ]
        for _ in range(1000):
            if run(lambda shown: all(images.subscribers for _, images in shown.items())):
                break
        else:
            self.fail("the subscribers were not found")

        def show(name, number):
            def send(shown):
                with shown[shown.get(name)].loan_image() as image:
                    image.number = number

            run(send)

        kept = {"left": [], "right": []}
        for name, views in kept.items():
            for number in range(LIMIT_KEPT):
                show(name, number)
                member, view = received.get(timeout=LIMIT)
                self.assertEqual(member.name, name)
                views.append(view)
        # The fifth of a member waits for no view of the other one.
        show("left", 9)
        kept["right"].clear()
        show("right", 9)
        member, view = received.get(timeout=LIMIT)
        self.assertEqual((member.index, member.name, view.number), (1, "right", 9))
        self.assertEqual([view.number for view in kept["left"]], [0, 1, 2, 3])
        shared = kept["left"][0].pose.__array_interface__["data"][0]
        for line in Path("/proc/self/maps").read_text().splitlines():
            low, high = (int(end, 16) for end in line.split(" ", 1)[0].split("-"))
            if low <= shared < high:
                self.assertIn("/dev/shm/", line)
                break
        else:
            self.fail("no mapping contains the sample")
        del view
        kept.clear()
        for component in running:
            component.stop()
            component.join()

    def test_members_are_opened_in_initialize_with_names_of_their_own(self):
        said = queue.SimpleQueue()

        def attempt(open_member):
            try:
                said.put(open_member())
            except robocomp.MemberError as error:
                said.put(str(error))

        def rack(base):
            class Rack(base):
                def initialize(self, ctx):
                    said.put(ctx.served.listed())
                    said.put(ctx.asked.listed())
                    ctx.served.open("front")
                    attempt(lambda: ctx.served.open("Front"))
                    attempt(lambda: ctx.served.open("no member"))

                def compute(self, ctx):
                    attempt(lambda: ctx.served.open("late"))
                    ctx.stop("done")

                def image(self, ctx, member, image):
                    pass

                def take(self, ctx, member, text):
                    return 0

                def put(self, ctx, member, text):
                    pass

            return Rack

        running = self.start("rack", rack, "--members", "served=front")
        running.join()
        self.assertEqual(said.get(timeout=LIMIT), ["front"])
        self.assertIsNone(said.get(timeout=LIMIT))
        for reason in (
            "`served` already has the member `front`; give `Front` another name",
            "`no member` cannot be a member of `served`: the name of a member has a letter",
            "`served.late` comes too late; open members in `initialize`",
        ):
            self.assertIn(reason, said.get(timeout=LIMIT))
        with self.assertRaises(robocomp.StartError) as caught:
            self.start("rack", rack, "--members", "served=front,back")
        self.assertIn("it lists `back`, which the worker does not open", str(caught.exception))

    def test_no_member_is_opened_in_the_first_state_of_a_machine(self):
        said = queue.SimpleQueue()

        def rack(base):
            class Rack(base):
                def initialize(self, ctx):
                    ctx.served.open_listed()

                def entry_idle(self, ctx):
                    try:
                        said.put(ctx.served.open("late"))
                    except robocomp.MemberError as error:
                        said.put(str(error))
                    ctx.stop("done")

                def image(self, ctx, member, image):
                    pass

                def take(self, ctx, member, text):
                    return 0

                def put(self, ctx, member, text):
                    pass

            return Rack

        path = "components/avoider_python/generated/avoider_python/description.json"
        machine = json.loads((ROOT / path).read_text())["machine"]
        running = self.start("machine", rack, "--members", "served=front", machine=machine)
        running.join()
        self.assertEqual(
            said.get(timeout=LIMIT),
            "`served.late` comes too late; open members in `initialize`",
        )


if __name__ == "__main__":
    unittest.main()
