"""A window whose buttons fail, stop and hang."""

import os
import time
from datetime import timedelta

from PySide6.QtCore import QEventLoop, QTimer
from window_script import Context, Emergency, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.ui.fail.clicked.connect(self.fail)
        self.ui.stop.clicked.connect(self.stop)
        self.ui.hang.clicked.connect(self.hang)

    def compute(self, ctx: Context) -> None:
        self.ui.runs.setValue(min(self.ui.runs.value() + 1, 10))
        if self.ui.runs.value() == 1:
            self.waits_end_at_once(ctx)
            print("the waits have ended", flush=True)

    def waits_end_at_once(self, ctx: Context) -> None:
        """Waits for an hour, unless an event ends the wait."""
        wait = self._robocomp_wait
        silent, write = os.pipe()

        def set_period() -> None:
            ctx.period = timedelta(milliseconds=40)

        QTimer.singleShot(0, set_period)
        wait.run(silent, timedelta(hours=1))

        # A loop inside an event, during which the component has something to do.
        def run_a_loop() -> None:
            os.write(write, b".")
            loop = QEventLoop()
            look = QTimer()
            look.timeout.connect(lambda: wait._is_late and loop.quit())
            look.start(1)
            loop.exec()
            wait._timer.stop()

        QTimer.singleShot(0, run_a_loop)
        wait.run(silent, timedelta(hours=1))
        os.close(silent)
        os.close(write)

    def fail(self) -> None:
        raise ValueError("the button fails")

    def stop(self) -> None:
        raise Emergency("the button was pressed")

    def hang(self) -> None:
        time.sleep(8)

    def finalize(self, ctx: Context) -> None:
        print("finalized", flush=True)
