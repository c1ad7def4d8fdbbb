"""The same with rclpy, in the types of ROS 2 that every installation has: `rclpy_peer.py ping|pong`.
Values are images, and a query is a service with texts. There is no memory to lend. The domain is
that of the environment."""

import array
import contextlib
import sys

import numpy as np
import rclpy
from bench_protocol import Data, Ping, Pong
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
from sensor_msgs.srv import SetCameraInfo

SECOND = 1_000_000_000
# Reliable.
QOS = QoSProfile(depth=10)


def ping(node: Node, executor: SingleThreadedExecutor) -> None:
    samples = node.create_publisher(Image, "sample", QOS)
    requests = node.create_client(SetCameraInfo, "echo")
    while not (samples.get_subscription_count() and requests.service_is_ready()):
        executor.spin_once(timeout_sec=0.1)

    def query(data: Data) -> Data:
        request = SetCameraInfo.Request()
        request.camera_info.distortion_model = "x" * len(data)
        future = requests.call_async(request)
        # `spin_until_future_complete` takes several times as long.
        while not future.done():
            executor.spin_once(timeout_sec=1.0)
        return future.result().status_message

    def publish(sent: int, data: Data) -> None:
        image = Image()
        image.header.stamp.sec, image.header.stamp.nanosec = divmod(sent, SECOND)
        # An array is taken as it is; of other sequences, each element is checked.
        image.data = array.array("B", data.tobytes())
        samples.publish(image)

    order = Ping(publish, lambda sent, data, fill: publish(sent, data), query)
    while order.block():
        pass


def pong(node: Node, executor: SingleThreadedExecutor) -> None:
    times = Pong()

    def sample(image: Image) -> None:
        sent = image.header.stamp.sec * SECOND + image.header.stamp.nanosec
        times.sample(sent, np.frombuffer(image.data, np.uint8))

    def echo(
        request: SetCameraInfo.Request, response: SetCameraInfo.Response
    ) -> SetCameraInfo.Response:
        response.status_message = request.camera_info.distortion_model
        return response

    node.create_subscription(Image, "sample", sample, QOS)
    node.create_service(SetCameraInfo, "echo", echo)
    print("ready", flush=True)
    # A signal ends it.
    with contextlib.suppress(ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    rclpy.init(args=[])
    end = rclpy.create_node(sys.argv[1])
    alone = SingleThreadedExecutor()
    alone.add_node(end)
    {"ping": ping, "pong": pong}[sys.argv[1]](end, alone)
