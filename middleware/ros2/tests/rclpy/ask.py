"""Calls the component: ask.py NETWORK DOMAIN SERVICE BYTES…

Each request has so many bytes, and so has its reply. Beginning with a first call at once after the server is found."""

import sys
import time

from peer import Peer, say
from sensor_msgs.srv import SetCameraInfo

service, sizes = sys.argv[3], [int(size) for size in sys.argv[4:]]
peer = Peer("ask")
client = peer.client(SetCameraInfo, service)
for size in sizes:
    request = SetCameraInfo.Request()
    request.camera_info.distortion_model = "x" * size
    begin = time.monotonic()
    reply = peer.result(client.call_async(request))
    assert reply.success, reply.status_message
    assert reply.status_message == request.camera_info.distortion_model, size
    if size == sizes[0]:
        # Fast DDS repeats a request that was not received after three seconds.
        say("first", "in time" if time.monotonic() - begin < 2.0 else "late")
say("answered", len(sizes))
