"""A program that keeps more samples than it may, and ends with all of them: `holder.py ARGUMENTS`."""

import sys
import threading

import robocomp
from build import Fixture
from demo import MODULE

KEPT = []
FIXTURE = Fixture("holder", [MODULE], "iceoryx2")
FIXTURE.slot("Images", "subscribesTo", "Demo::Images", in_place=True)


class SpecificWorker(FIXTURE.worker):
    def initialize(self, ctx):
        self.own = self
        print("ready", flush=True)

    def image(self, ctx, image):
        KEPT.append((image, image.pose, self))
        print("kept", len(KEPT), flush=True)
        if len(KEPT) == 4:
            # Ends after the component.
            thread = threading.Thread(target=lambda: threading.main_thread().join() or image.copy())
            thread.start()


sys.exit(robocomp.main(FIXTURE.component(SpecificWorker), SpecificWorker, sys.argv[1:]))
