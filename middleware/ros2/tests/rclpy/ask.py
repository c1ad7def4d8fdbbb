"""Calls the component: ask.py NETWORK DOMAIN SERVICE BYTES…

Each request has so many bytes, and so has its reply."""

import sys

from peer import Peer, say
from sensor_msgs.srv import SetCameraInfo

service, sizes = sys.argv[3], [int(size) for size in sys.argv[4:]]
peer = Peer("ask")
client = peer.client(SetCameraInfo, service)
for size in sizes:
    request = SetCameraInfo.Request()
    request.camera_info.distortion_model = "x" * size
    reply = peer.result(client.call_async(request))
    assert reply.success, reply.status_message
    assert reply.status_message == request.camera_info.distortion_model, size
say("answered", len(sizes))
