"""A component as a process: its start, its log, its signals and its exit codes."""

import os
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

LIMIT = 30

GOOD = """
import logging
from program import Worker
import robocomp

class SpecificWorker(Worker):
    def initialize(self, ctx):
        self.runs = 0
        logging.getLogger("tests").info("speed is %s, pause %r", ctx.params["speed"], ctx.params["pause"])
        print(f"{ctx.name} of {ctx.network} is {ctx.state}", flush=True)

    def compute(self, ctx):
        self.runs += 1
        COMPUTE

    def finalize(self, ctx):
        print("finalized after", self.runs, flush=True)

    def report(self, ctx, all):
        pass

    def take(self, ctx, text):
        return 1

    def put(self, ctx, text):
        pass
"""


class Program(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)
        (self.path / "etc").mkdir()
        (self.path / "etc/config.toml").write_text("[parameters]\nspeed = 500.0\n")

    def start(self, worker, *args):
        (self.path / "specific_worker.py").write_text(worker)
        command = [sys.executable, "program.py", "specific_worker:SpecificWorker", str(self.path)]
        network = f"py-program-{os.getpid()}"
        return subprocess.Popen(
            [*command, "--network", network, *args],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def wait_for_turn(self, process):
        for line in process.stdout:
            if line == "turn\n":
                return
        _, err = process.communicate(timeout=LIMIT)
        self.fail(f"it ended early: {err}")

    def run_to_end(self, worker, *args):
        process = self.start(worker, *args)
        out, err = process.communicate(timeout=LIMIT)
        return process.returncode, out, err

    def test_it_runs_until_it_stops_itself(self):
        code, out, err = self.run_to_end(
            GOOD.replace("COMPUTE", 'if self.runs == 3: ctx.stop("three runs")')
        )
        self.assertEqual(code, 0, err)
        self.assertIn("program of py-program-", out)
        self.assertIn("finalized after 3", out)
        self.assertIn("INFO speed is 500.0, pause datetime.timedelta(microseconds=250000)", err)
        self.assertIn("stopping: three runs", err)

    def test_a_worker_changes_its_own_parameters(self):
        compute = """if self.runs == 1:
            ctx.set_parameter("speed", 600)
            ctx.set_parameter("speed", 2000.5)
            ctx.set_parameter("pause", datetime.timedelta(seconds=1))
            ctx.set_parameter("password", pathlib.Path("a/b"))
            ctx.set_parameter("speed", 700.0)
            within = []
            within.append(within)
            for wrong in (None, [1, within], datetime.timedelta(seconds=-1)):
                try:
                    ctx.set_parameter("speed", wrong)
                except TypeError as error:
                    print(error, flush=True)
        if ctx.params["speed"] == 700.0: ctx.stop(ctx.params["password"])"""
        worker = "import datetime, pathlib\n" + GOOD.replace("COMPUTE", compute)
        worker += '\n    def params_changed(self, ctx, changes):\n        print(changes[0].path, flush=True)\n'
        code, out, err = self.run_to_end(worker)
        self.assertEqual(code, 0, err)
        for wrong in ("None", "[[...]] (list)", "timedelta"):
            self.assertIn(f"no parameter has the value {wrong}: expected", out)
        self.assertIn("\nspeed\npassword\nspeed\n", out)
        self.assertIn("parameter speed: 500.0 -> 600.0", err)
        self.assertIn("the worker cannot change its parameter `speed`: ", err)
        self.assertIn("parameter speed: 600.0 -> 700.0", err)
        self.assertIn("stopping: a/b", err)

    def test_the_log_level_holds_for_python(self):
        worker = GOOD.replace("COMPUTE", 'ctx.stop("done")')
        _, _, err = self.run_to_end(worker, "--log", "error")
        self.assertNotIn("speed is", err)

    def test_a_signal_ends_it_in_order(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            process = self.start(GOOD.replace("COMPUTE", "print('turn', flush=True)"))
            self.wait_for_turn(process)
            process.send_signal(number)
            out, err = process.communicate(timeout=LIMIT)
            self.assertEqual(process.returncode, 0, err)
            self.assertIn("finalized after", out)
            self.assertNotIn("KeyboardInterrupt", err)

    def test_a_second_signal_ends_a_worker_that_hangs(self):
        process = self.start(GOOD.replace("COMPUTE", "print('turn', flush=True)\n        while True: pass"))
        self.wait_for_turn(process)
        process.send_signal(signal.SIGINT)
        for _ in range(LIMIT):
            try:
                process.wait(timeout=1)
                break
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=LIMIT)
        self.assertNotEqual(process.returncode, 0, err)

    def test_a_signal_ends_a_component_whose_thread_goes_on(self):
        worker = GOOD.replace("COMPUTE", 'ctx.stop("done")').replace(
            "self.runs = 0",
            "self.runs = 0\n        threading.Thread(target=time.sleep, args=(600,)).start()",
        )
        process = self.start("import threading, time\n" + worker)
        for line in process.stdout:
            if line.startswith("finalized"):
                break
        for _ in range(LIMIT):
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(timeout=1)
                break
            except subprocess.TimeoutExpired:
                pass
        code = process.poll()
        process.kill()
        process.communicate(timeout=LIMIT)
        self.assertEqual(code, -signal.SIGTERM)

    def test_tracebacks_of_one_place_are_limited_whatever_they_say(self):
        worker = GOOD.replace(
            "COMPUTE",
            'if self.runs == 20: ctx.stop("done")\n        raise ValueError(f"too far: {self.runs}")',
        )
        code, _, err = self.run_to_end(worker)
        self.assertEqual(code, 0, err)
        self.assertLess(err.count("Traceback"), 5, err)

    def test_a_failure_is_logged_with_its_traceback_and_the_period_goes_on(self):
        code, out, err = self.run_to_end(
            GOOD.replace(
                "COMPUTE", 'if self.runs == 4: ctx.stop("done")\n        raise ValueError("too far")'
            )
        )
        self.assertEqual(code, 0, err)
        self.assertIn("finalized after 4", out)
        self.assertIn("Traceback (most recent call last)", err)
        self.assertIn('raise ValueError("too far")', err)
        self.assertIn("compute(): ValueError: too far", err)
        self.assertEqual(err.count("Traceback"), 1, err)

    def test_a_fatal_error_ends_it(self):
        code, _, err = self.run_to_end(GOOD.replace("COMPUTE", 'raise robocomp.Fatal("no motor")'))
        self.assertEqual(code, 3, err)
        self.assertIn("no motor", err)
        code, _, err = self.run_to_end(GOOD.replace("COMPUTE", "raise SystemExit(5)"))
        self.assertEqual(code, 3, err)

    def test_a_fatal_error_ends_it_wherever_it_is_raised(self):
        fatal = 'raise robocomp.Fatal("no motor")'
        emergency = GOOD.replace("COMPUTE", 'raise robocomp.Emergency("hot")')
        stop = GOOD.replace("COMPUTE", 'ctx.stop("done")')
        workers = {
            "emergency": f"{emergency}\n    def emergency(self, ctx):\n        {fatal}\n",
            "finalize": stop.replace('print("finalized after", self.runs, flush=True)', fatal),
            "exit": stop.replace('print("finalized after", self.runs, flush=True)', "raise SystemExit"),
        }
        for name, worker in workers.items():
            with self.subTest(name=name):
                code, _, err = self.run_to_end(worker)
                self.assertEqual(code, 3, err)
                self.assertIn("SystemExit" if name == "exit" else "no motor", err)

    def test_an_emergency_runs_its_function(self):
        worker = GOOD.replace("COMPUTE", 'raise robocomp.Emergency("hot")')
        worker += '\n    def emergency(self, ctx):\n        ctx.stop(f"in {ctx.state}")\n'
        code, _, err = self.run_to_end(worker)
        self.assertEqual(code, 0, err)
        self.assertIn("stopping: in emergency", err)

    def test_a_failed_initialization_says_why(self):
        worker = GOOD.replace("self.runs = 0", 'open("/nowhere/at/all")')
        code, _, err = self.run_to_end(worker)
        self.assertEqual(code, 3, err)
        self.assertIn("initialize(): FileNotFoundError", err)
        self.assertIn('open("/nowhere/at/all")', err)

    def test_a_worker_that_cannot_run_is_refused_at_start_and_by_check(self):
        good = GOOD.replace("COMPUTE", "pass")
        cases = [
            (good.replace("def compute(self, ctx):", "def compute(self, ctx)"), "specific_worker.py:12:27: expected"),
            (good.replace("import robocomp", "import no_such_package"), "No module named 'no_such_package'"),
            (good.replace("class Specific", "class Other"), "has no class `SpecificWorker`"),
            (good.replace("def report(self, ctx, all):", "def other(self):"), "SpecificWorker.report() is missing; add def report(self, ctx, a0)"),
            (good.replace("def report(self, ctx, all):", "def report(self, ctx):"), "specific_worker.py:19: SpecificWorker.report() takes (self, ctx); it is called with (self, ctx, a0)"),
            (good.replace("def compute(self, ctx):", "def compute(self):"), "SpecificWorker.compute() takes"),
            (good.replace("(Worker)", "(object)"), "is not a subclass of the generated class `Worker`"),
        ]
        for worker, text in cases:
            for args in ((), ("--check",)):
                with self.subTest(text=text, args=args):
                    code, _, err = self.run_to_end(worker, *args)
                    self.assertEqual(code, 3, err)
                    self.assertIn(text, err)

    def test_the_command_line_is_that_of_a_component(self):
        good = GOOD.replace("COMPUTE", "pass")
        code, out, err = self.run_to_end(good, "--check")
        self.assertEqual((code, out), (0, "program: ok\n"), err)
        code, out, _ = self.run_to_end("raise SystemExit", "--help")
        self.assertEqual(code, 0)
        self.assertIn("--network", out)
        code, _, err = self.run_to_end(good, "--check", "--set", "speed=9000")
        self.assertEqual(code, 1, err)
        self.assertIn("1500", err)
        code, _, err = self.run_to_end(good, "--nonsense")
        self.assertEqual(code, 2, err)

    def test_a_missing_extension_module_is_told(self):
        environment = {k: v for k, v in os.environ.items() if k != "ROBOCOMP_NATIVE"}
        command = [sys.executable, "-c", "import robocomp"]
        ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=LIMIT)
        last = ended.stderr.splitlines()[-1]
        self.assertIn("ImportError: robocomp has no extension module `robocomp._native`; build it with", last)
        self.assertIn("ROBOCOMP_NATIVE", last)

    def test_a_missing_numpy_is_told(self):
        script = "import sys; sys.modules['numpy'] = None; import robocomp"
        ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
        self.assertIn("needs NumPy", ended.stderr)
        self.assertIn("-m pip install numpy", ended.stderr)


if __name__ == "__main__":
    unittest.main()
