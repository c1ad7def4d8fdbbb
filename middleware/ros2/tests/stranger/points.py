"""Prints the points of polygons, as numbers: points.py NETWORK DOMAIN TOPIC COUNT"""

import sys
from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float32, sequence
from node import Node


@dataclass
@final
class Point32(IdlStruct, typename="geometry_msgs::msg::dds_::Point32_"):
    x: float32
    y: float32
    z: float32


@dataclass
@final
class Polygon(IdlStruct, typename="geometry_msgs::msg::dds_::Polygon_"):
    points: sequence[Point32]


here = Node(*sys.argv[1:3])
count = int(sys.argv[4])
for polygon in here.values(here.reader(sys.argv[3], Polygon)):
    print(*(number for point in polygon.points for number in (point.x, point.y, point.z)), flush=True)
    count -= 1
    if not count:
        break
