"""Prints the frames of the first transform on /tf, of any network: transforms.py NETWORK DOMAIN"""

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


here = Node(*sys.argv[1:])
reader = DataReader(here.member, Topic(here.member, "rt/tf", TFMessage), qos(depth=100))
for message in here.values(reader):
    [one] = message.transforms
    rotation = one.transform.rotation
    length = rotation.x**2 + rotation.y**2 + rotation.z**2 + rotation.w**2
    assert abs(length - 1.0) < 1e-9, one
    # The time of this network is the system's.
    assert abs(time.time() - one.header.stamp.sec) < 60, one
    print(one.header.frame_id, one.child_frame_id)
    break
