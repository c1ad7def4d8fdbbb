"""Does everything wrong that a stranger can: wrong.py NETWORK calls|values."""

import random
import sys

import robocomp

network, what = sys.argv[1:]
node = robocomp.Network(network)
rng = random.Random(7)
garbage = [b"", b"\0", b"\xff" * 64] + [rng.randbytes(rng.randrange(1, 300)) for _ in range(30)]

if what == "calls":
    speech = robocomp.Client(node, f"{network}/Speech")

    def call(body, type_hash=0):
        try:
            print("answered", speech.call(body, seconds=20, type_hash=type_hash).data)
        except (robocomp.Refused, TimeoutError) as error:
            print(error)

    say = speech.request("say").put_text("never said").put("?", False).data
    call(speech.request("shout").put_text("never said").put("?", False).data)
    call(say, type_hash=0x4D)
    call(speech.request("say").put("I", 1 << 30).data)
    # Cut off within the arguments it is refused, within the envelope nobody knows whom to answer.
    for length in range(len(say)):
        call(say[:length])
    for body in garbage:
        call(body)
else:
    poses = robocomp.Publisher(node, f"{network}/FullPoseEstimationPub/newFullPose")
    pose = robocomp.Cdr().put_text("Python").put(12 * "f", *12 * [0]).put("i", 100).data
    for length in range(len(pose)):
        poses.publish(pose[:length], robocomp.header(0))
    poses.publish(pose, robocomp.header(0, type_hash=0x4D))
    for version, encoding in [(0, 0), (2, 1), (1, 2)]:
        poses.publish(pose, robocomp.Message(version, encoding, 0, 0, 0, 0))
    for body in garbage[:20]:
        poses.publish(body, robocomp.header(0))
    poses.linger()
print("done")
