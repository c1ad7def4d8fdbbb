"""Prints the points of clouds, as bytes in hexadecimal: clouds.py NETWORK TOPIC COUNT"""

import sys

import rclpy
from peer import Peer, qos, say
from sensor_msgs.msg import PointCloud2

topic, count = sys.argv[2], int(sys.argv[3])
received = 0


def on_cloud(cloud):
    global received
    received += 1
    names = [(field.name, field.offset, field.datatype) for field in cloud.fields]
    assert names == [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7)], names
    assert len(cloud.data) == cloud.width * cloud.point_step, cloud.width
    if received <= count:
        say(bytes(cloud.data).hex())


peer = Peer("clouds")
subscription = peer.node.create_subscription(PointCloud2, peer.full(topic), on_cloud, qos())
peer.until("the mapper is found", subscription.get_publisher_count)
say("met")
peer.until("clouds come", lambda: received >= count)
say("end")
