"""Prints the points of the polygons of a recording, which rosbags reads, as numbers: points.py FILE TOPIC"""

import sys
from pathlib import Path

from rosbags.highlevel import AnyReader

with AnyReader([Path(sys.argv[1])]) as bag:
    for connection, _, raw in bag.messages():
        if connection.topic == sys.argv[2]:
            polygon = bag.deserialize(raw, connection.msgtype)
            print(*(float(number) for point in polygon.points for number in (point.x, point.y, point.z)))
