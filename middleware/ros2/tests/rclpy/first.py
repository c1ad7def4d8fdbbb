"""Measures the first calls of new clients: first.py NETWORK DOMAIN COUNT

Each client is a participant of its own and calls as soon as it has found the service. Prints the milliseconds of each call."""

import sys
import time

import rclpy
from peer import LIMIT, say
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.srv import SetCameraInfo

network, count = sys.argv[1], int(sys.argv[3])
for number in range(count):
    context = Context()
    rclpy.init(args=[], context=context)
    node = rclpy.create_node(f"first{number}", namespace=f"/{network}", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    client = node.create_client(SetCameraInfo, f"/{network}/Camera/setCameraInfo")
    end = time.monotonic() + LIMIT
    # Its own thread receives discovery; `wait_for_service` would look only four times a second.
    while not client.service_is_ready():
        if time.monotonic() > end:
            raise TimeoutError(f"client {number} does not find the service")
        time.sleep(0.0005)
    begin = time.monotonic()
    future = client.call_async(SetCameraInfo.Request())
    executor.spin_until_future_complete(future, timeout_sec=LIMIT)
    assert future.result().success
    say("call", round((time.monotonic() - begin) * 1000))
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)
