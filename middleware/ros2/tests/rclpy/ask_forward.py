"""Has the component call a server of another program: ask_forward.py NETWORK DOMAIN BYTES…"""

import sys

from peer import Peer, say
from sensor_msgs.srv import SetCameraInfo

peer = Peer("ask_forward")
client = peer.client(SetCameraInfo, "Camera/setCameraInfo")
for size in sys.argv[3:]:
    request = SetCameraInfo.Request()
    request.camera_info.header.frame_id = "forward"
    request.camera_info.distortion_model = "x" * int(size)
    reply = peer.result(client.call_async(request))
    assert reply.success, reply.status_message
    assert reply.status_message == request.camera_info.distortion_model, size
say("forwarded", len(sys.argv) - 3)
