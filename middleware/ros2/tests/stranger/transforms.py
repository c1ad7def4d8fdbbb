"""Prints the frames of the transforms on /tf, of any network: transforms.py NETWORK DOMAIN [STEP]

The stamps are of the system's clock, or, with a step in milliseconds, of a simulated one that begins at 0."""

import sys
import time
from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from node import Node, qos


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
@final
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
@final
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
@final
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
@final
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


here = Node(*sys.argv[1:3])
step = int(sys.argv[3]) if len(sys.argv) > 3 else None
last = None
reader = DataReader(here.member, Topic(here.member, "rt/tf", TFMessage), qos(depth=100))
for message in here.values(reader):
    [one] = message.transforms
    rotation = one.transform.rotation
    length = rotation.x**2 + rotation.y**2 + rotation.z**2 + rotation.w**2
    assert abs(length - 1.0) < 1e-9, one
    stamp = one.header.stamp.sec * 1000 + one.header.stamp.nanosec / 1e6
    if step is None:
        assert abs(time.time() - stamp / 1000) < 60, one
        break
    # No run of a test lasts for a day of simulated time.
    assert 0 < stamp < 86_400_000 and stamp % step == 0, one
    assert last is None or last < stamp, one
    if last is not None and last + 3 * step < stamp:
        break
    last = last or stamp
print(one.header.frame_id, one.child_frame_id)
