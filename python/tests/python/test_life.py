"""A component as a process that is managed: its hooks, states, parameters, and errors of handlers."""

import base64
import itertools
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path

import robocomp
from build import ROOT
from demo import MODULE

LIMIT = 30

WORKER = """
import threading, time
import robocomp
from program import Worker

def said(*words):
    print(*words, flush=True)

class SpecificWorker(Worker):
    def initialize(self, ctx):
        self.runs = 0
        said("initialize", ctx.lifecycle)

    def finalize(self, ctx):
        said("finalize")

    def report(self, ctx, all):
        pass

    def take(self, ctx, text):
        return {"wrong": "seven", "far": 2**40}.get(text, 7)

    def put(self, ctx, text):
        said("put", text)
"""

HOOKS = "".join(
    f"""
    def {name}(self, ctx):
        said("{name}", ctx.lifecycle)
"""
    for name in ("configure", "activate", "deactivate", "cleanup", "shutdown")
)


def machine():
    """The state machine of a component with one, which `rcgen` has made."""
    path = "components/avoider_python/generated/avoider_python/description.json"
    return json.loads((ROOT / path).read_text())["machine"]


class Life(unittest.TestCase):
    numbers = itertools.count()

    process = None

    def start(self, more, **description):
        self.end()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = Path(folder.name)
        (path / "etc").mkdir()
        config = path / "etc/config.toml"
        config.write_text('[parameters]\nspeed = 500.0\npassword = "swordfish"\n')
        config.chmod(0o600)
        (path / "specific_worker.py").write_text(WORKER + more)
        self.network = f"py-life-{os.getpid()}-{next(self.numbers)}"
        self.process = subprocess.Popen(
            [sys.executable, "program.py", "specific_worker:SpecificWorker", str(path)]
            + ["--network", self.network],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PROGRAM": json.dumps(description)},
        )
        self.addCleanup(self.end)
        # A component that does not end when it should ends the test.
        self.limit = threading.Timer(2 * LIMIT, self.process.kill)
        self.limit.start()
        self.errors = []
        self.reader = threading.Thread(target=lambda: self.errors.extend(self.process.stderr))
        self.reader.start()
        self.expect("initialize")
        # Until it runs, it may refuse requests.
        self.until("running", "ended")

    def until(self, *states):
        for _ in range(LIMIT * 100):
            if self.state() in states:
                return
            threading.Event().wait(0.01)
        self.fail(f"it is {self.state()}")

    def state(self):
        """Its state; `ended` if it has ended at once."""
        try:
            return self.ask("status")["result"]["state"]
        except (OSError, ValueError):
            return "ended"

    def end(self):
        if self.process is None:
            return
        self.limit.cancel()
        self.process.kill()
        self.process.wait(timeout=LIMIT)
        self.reader.join()
        self.process.stdout.close()
        self.process.stderr.close()
        self.process = None

    def expect(self, *wanted):
        """Reads lines until each of these was said, in this order."""
        lines = []
        for text in wanted:
            for line in self.process.stdout:
                lines.append(line)
                if line.startswith(text):
                    break
            else:
                self.process.wait(timeout=LIMIT)
                self.reader.join()
                self.fail(f"it never said {text!r}, but {lines} and {self.errors}")
        return lines

    def wait(self):
        """The exit code, and the log."""
        self.process.stdout.read()
        code = self.process.wait(timeout=LIMIT)
        self.reader.join()
        return code, "".join(self.errors)

    def ask(self, method, **params):
        """A request to its management."""
        runtime = os.environ.get("XDG_RUNTIME_DIR", "")
        base = f"{runtime}/robocomp" if runtime.startswith("/") else f"/dev/shm/robocomp-{os.getuid()}"
        call = {"id": 1, "jsonrpc": "2.0", "method": method, "params": params}
        with socket.socket(socket.AF_UNIX) as client:
            client.settimeout(LIMIT)
            client.connect(f"{base}/{self.network}/program.sock")
            client.sendall(json.dumps(call).encode() + b"\n")
            line = client.makefile().readline()
        return json.loads(line)

    def fire(self, event):
        """Fires an event as soon as the machine has started."""
        for _ in range(LIMIT * 100):
            answer = self.ask("fire", event=event)
            if "has not started it yet" not in json.dumps(answer):
                break
            threading.Event().wait(0.01)
        return answer

    def test_a_managed_component_runs_its_hooks(self):
        self.start(HOOKS, managed=True)
        for transition, state in (
            ("configure", "configuring"),
            ("activate", "activating"),
            ("deactivate", "deactivating"),
            ("cleanup", "cleaningup"),
        ):
            answer = self.ask("lifecycle", transition=transition)
            self.assertIn("result", answer)
            (line,) = self.expect(transition)
            self.assertEqual(line.split()[1].replace("_", ""), state)
        self.assertIn("error", self.ask("lifecycle", transition="activate"))
        self.ask("stop")
        lines = self.expect("shutdown", "finalize")
        self.assertEqual(len(lines), 2, lines)
        self.assertEqual(self.wait()[0], 0)

    def test_a_failed_hook_is_told_and_its_error_processing_runs(self):
        self.start(
            """
    def configure(self, ctx):
        raise ValueError("no map")

    def error(self, ctx, transition, reason):
        said("error", transition, reason)
""",
            managed=True,
        )
        answer = self.ask("lifecycle", transition="configure")
        self.assertIn("no map", answer["error"]["message"])
        self.process.terminate()
        code, errors = self.wait()
        self.assertEqual(code, 0, errors)
        self.assertIn('raise ValueError("no map")', errors)

    def test_a_fatal_hook_ends_the_component(self):
        fatal = 'raise robocomp.Fatal("no map")'
        self.start(f"\n    def configure(self, ctx):\n        {fatal}\n", managed=True)
        self.ask("lifecycle", transition="configure")
        code, errors = self.wait()
        self.assertEqual(code, 3, errors)
        self.assertIn("no map", errors)

    def test_states_run_their_functions(self):
        chart = machine()
        functions = "".join(
            f"""
    def {kind}_{state}(self, ctx):
        said("{kind}", "{state}")
"""
            for kind in ("entry", "exit")
            for state in ("idle", "driving", "cruising", "battery")
        )
        functions += """
    def during_cruising(self, ctx):
        said("during", "cruising")
        if self.runs == 0:
            self.runs = 1
            raise ValueError("uphill")
"""
        self.start(functions, machine=chart)
        lines = self.expect("entry idle", "entry battery")
        self.assertEqual(lines, ["entry idle\n", "entry battery\n"])
        # An event that the machine does not let others fire.
        self.assertIn("error", self.fire("obstacle"))
        self.assertIn("result", self.fire("go"))
        lines = self.expect("exit idle", "entry driving", "entry cruising", "during", "during")
        self.assertNotIn("compute\n", lines)
        self.assertIn("result", self.fire("stop"))
        self.expect("exit cruising", "exit driving", "entry idle")
        self.process.terminate()
        code, errors = self.wait()
        self.assertEqual(code, 0, errors)
        self.assertIn("ValueError: uphill", errors)

    def test_a_machine_begins_with_its_first_event(self):
        chart = machine()
        chart["first_event"] = chart["chart"]["events"].index("go")
        entry = "\n    def entry_cruising(self, ctx):\n        said('entry cruising', ctx.is_stopping)\n"
        self.start(entry, machine=chart)
        self.expect("entry cruising")
        self.process.terminate()
        self.assertEqual(self.wait()[0], 0)

    def test_a_fatal_function_of_a_state_ends_the_component(self):
        fatal = 'raise robocomp.Fatal("no wheel")'
        self.start(f"\n    def entry_driving(self, ctx):\n        {fatal}\n", machine=machine())
        self.fire("go")
        code, errors = self.wait()
        self.assertEqual(code, 3, errors)
        self.assertIn("no wheel", errors)

    def test_parameters_change_and_a_worker_refuses(self):
        self.start(
            """
    def params_changed(self, ctx, changes):
        for change in changes:
            shown = "***" if change.secret else f"{change.old} {change.new}"
            said("changed", change.path, shown, ctx.params["speed"])
        if ctx.params["speed"] > 1000:
            raise robocomp.WorkerError("too fast")
"""
        )
        changed = self.ask("parameters_set", changes={"speed": 600.0})
        self.assertIn("result", changed)
        self.assertEqual(self.expect("changed"), ["changed speed 500.0 600.0 600.0\n"])
        refused = self.ask("parameters_set", changes={"speed": 1200.0})
        self.assertIn("too fast", json.dumps(refused["error"]))
        outside = self.ask("parameters_set", changes={"speed": 9000.0})
        self.assertIn("1500", json.dumps(outside["error"]))
        self.assertEqual(self.ask("parameters_set", changes={"speed": 700.0}).keys(), changed.keys())
        # The value before is that of before the refused change.
        self.assertEqual(self.expect("changed", "changed")[-1], "changed speed 600.0 700.0 700.0\n")

    def test_a_secret_is_known_to_the_worker_alone(self):
        self.start(
            """
    def params_changed(self, ctx, changes):
        said("knows", ctx.params["password"] == "herring", [c.secret for c in changes])
        raise ValueError("no")
"""
        )
        shown = json.dumps(self.ask("parameters"))
        self.assertIn("password", shown)
        self.assertNotIn("swordfish", shown)
        answer = json.dumps(self.ask("parameters_set", changes={"password": "herring"}))
        self.assertEqual(self.expect("knows"), ["knows True [True]\n"])
        self.process.terminate()
        code, errors = self.wait()
        self.assertEqual(code, 0, errors)
        for secret in ("swordfish", "herring"):
            self.assertNotIn(secret, errors + answer)

    def test_a_blocking_call_is_seen_as_a_hang(self):
        # The first lets other threads of Python run, the second does not.
        for block in ("time.sleep(600)", "any(iter(int, 1))"):
            with self.subTest(block=block):
                self.start(f"\n    def compute(self, ctx):\n        said('blocks')\n        {block}\n")
                self.expect("blocks")
                ages = []
                for _ in range(LIMIT * 20):
                    ages.append(self.ask("status")["result"]["age_ms"])
                    if ages[-1] > 2000:
                        break
                    threading.Event().wait(0.05)
                self.assertGreater(ages[-1], 2000, ages)

    def test_a_handler_that_returns_the_wrong_type_harms_nobody(self):
        self.start("")
        for text, reason in (
            ("wrong", "take(): its result: expected int32, got 'seven' (str)"),
            ("far", "take(): its result: 1099511627776 is outside of int32"),
        ):
            with self.assertRaises(robocomp.Refused) as caught:
                self.call("take", text)
            self.assertIn(reason, str(caught.exception))
        self.assertEqual(self.call("take", "it"), 7)

    def call(self, operation, text):
        net = robocomp.connect(self.network)
        return getattr(net.program.served, operation)(text)

    def test_a_fatal_handler_ends_the_component_and_answers(self):
        fatal = """
    def take(self, ctx, text):
        raise robocomp.Fatal("no hand")
"""
        self.start(fatal)
        with self.assertRaises(robocomp.CallError) as caught:
            self.call("take", "it")
        self.assertIn("no hand", str(caught.exception))
        code, errors = self.wait()
        self.assertEqual(code, 3, errors)
        self.assertIn("no hand", errors)

    def test_a_fatal_handler_of_a_command_or_a_sample_ends_the_component(self):
        fatal = 'raise robocomp.Fatal("no hand")'
        self.start(f"\n    def put(self, ctx, text):\n        {fatal}\n")
        with self.assertRaises(robocomp.CallError):
            self.call("put", "it")
        self.assertEqual(self.wait()[0], 3)
        self.start(f"\n    def report(self, ctx, all):\n        {fatal}\n")
        text = base64.b64encode(default_body()).decode()
        self.ask("sample", slot="Reports", operation="report", body=text)
        code, errors = self.wait()
        self.assertEqual(code, 3, errors)

    def test_a_fatal_restore_ends_the_component(self):
        self.start('\n    def restore(self, ctx):\n        raise robocomp.Fatal("no way back")\n')
        self.ask("emergency", active=True)
        self.until("emergency")
        self.ask("emergency", active=False)
        code, errors = self.wait()
        self.assertEqual(code, 3, errors)
        self.assertIn("restore(): no way back", errors)

    def test_a_thread_of_the_user_is_told_what_to_do(self):
        self.start(
            """
    def compute(self, ctx):
        self.runs += 1
        if self.runs > 1:
            return
        def use():
            try:
                ctx.now()
            except robocomp.WrongThread as error:
                said("refused", "SimpleQueue" in str(error))
        thread = threading.Thread(target=use)
        thread.start()
        thread.join()
"""
        )
        self.assertEqual(self.expect("refused"), ["refused True\n"])
        self.process.terminate()
        self.assertEqual(self.wait()[0], 0)


def default_body():
    """The bytes of a sample whose members have their defaults, in CDR."""
    described = {t["name"]: t for t in MODULE["types"]}
    sizes = {"bool": 1, "float32": 4, "float64": 8, "Demo::Kind": 4}
    sizes |= {f"{sign}int{bits}": bits // 8 for sign in ("", "u") for bits in (8, 16, 32, 64)}
    body = bytearray()

    def zeros(size, count=1):
        body.extend(bytes(-len(body) % size + size * count))

    def put(members):
        for member in members:
            kind = member["type"]
            if member.get("optional"):
                zeros(1)
            elif kind == "Demo::Point":
                put(described["Point"]["struct"])
            elif kind.startswith("string"):
                zeros(4)
                # The length counts the zero byte at the end.
                body[-4] = 1
                zeros(1)
            elif kind.startswith(("sequence", "dictionary")):
                zeros(4)
            elif kind.endswith("]"):
                element, _, count = kind[:-1].partition("[")
                zeros(sizes[element], int(count))
            else:
                zeros(sizes[kind])

    put(described["Everything"]["struct"])
    return bytes(body)


if __name__ == "__main__":
    unittest.main()
