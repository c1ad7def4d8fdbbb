"""A node of rclpy beside a component. Its domain, discovery and middleware are those of the environment."""

import sys
import threading
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy

# For everything that a program waits for.
LIMIT = 30.0


class Peer:
    """The node of this program, in the namespace of the network."""

    def __init__(self, name):
        self.network = sys.argv[1]
        rclpy.init(args=[])
        self.node = rclpy.create_node(name, namespace=f"/{self.network}")

    def full(self, name):
        """The name of a topic or a service of the component."""
        return f"/{self.network}/{name}"

    def until(self, what, so, limit=LIMIT):
        """Spins until something is so."""
        end = time.monotonic() + limit
        while not so():
            if time.monotonic() > end:
                raise TimeoutError(f"waited {limit} s until {what}")
            rclpy.spin_once(self.node, timeout_sec=0.1)

    def result(self, future, limit=LIMIT):
        """The result of a call."""
        self.until("there is a reply", future.done, limit)
        return future.result()

    def client(self, kind, name):
        """A client whose server is there."""
        client = self.node.create_client(kind, self.full(name))
        self.until(f"{name} is served", client.service_is_ready)
        return client


def qos(reliability="reliable", depth=10):
    """Quality of service in the words of ROS 2."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy[reliability.upper()])


def say(*words):
    """Prints a line for the test."""
    print(*words, flush=True)


def spin_until_input_ends(node):
    """Serves a node until the input of this program ends."""
    ended = threading.Event()

    def read():
        while wait_for_line():
            pass
        ended.set()

    threading.Thread(target=read, daemon=True).start()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not ended.is_set():
        executor.spin_once(timeout_sec=0.05)


def wait_for_line():
    """Waits for the test; false at the end of the input."""
    return bool(sys.stdin.readline())
