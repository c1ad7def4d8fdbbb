"""A window whose buttons fail, stop and hang."""

import time

from window_script import Context, Emergency, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.ui.fail.clicked.connect(self.fail)
        self.ui.stop.clicked.connect(self.stop)
        self.ui.hang.clicked.connect(self.hang)

    def compute(self, ctx: Context) -> None:
        self.ui.runs.setValue(min(self.ui.runs.value() + 1, 10))

    def fail(self) -> None:
        raise ValueError("the button fails")

    def stop(self) -> None:
        raise Emergency("the button was pressed")

    def hang(self) -> None:
        time.sleep(8)

    def finalize(self, ctx: Context) -> None:
        print("finalized", flush=True)
