"""Runs sequences through the filters of ROS 1: a line of JSON each on standard input and output.

A sequence has a policy, how near samples have to be, the length of the queues, the number of topics,
and pairs of a topic and a time.
"""

import json
import sys
import types


class Times:
    """The clock of `rospy`, which plays no part: times are numbers."""

    def __new__(cls, time=0):
        return time

    now = staticmethod(lambda: 0)
    from_sec = staticmethod(lambda seconds: seconds)


sys.modules["rospy"] = types.SimpleNamespace(
    Time=Times, Duration=Times, rostime=types.SimpleNamespace(is_wallclock=lambda: True)
)
# The folder of this file is the first one: it would find itself.
del sys.path[0]
import message_filters

for line in sys.stdin:
    policy, within, depth, topics, samples = json.loads(line)
    inputs = [message_filters.SimpleFilter() for _ in range(topics)]
    if policy == "exact":
        filters = message_filters.TimeSynchronizer(inputs, depth)
    else:
        # It compares with `<` in one place and with `<=` in the other one.
        filters = message_filters.ApproximateTimeSynchronizer(inputs, depth, within + 0.5)
    found = []
    filters.registerCallback(lambda *all: found.append([one.header.stamp for one in all]))
    for topic, time in samples:
        header = types.SimpleNamespace(stamp=time)
        inputs[topic].signalMessage(types.SimpleNamespace(header=header))
    print(json.dumps(found))
