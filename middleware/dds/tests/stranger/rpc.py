"""The types of dds_rpc.idl (OMG DDS-RPC 1.0, basic service mapping), by hand."""

from dataclasses import dataclass

from cyclonedds.idl import IdlEnum, IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, bounded_str, int32, uint8, uint32


@dataclass
@final
class EntityId_t(IdlStruct, typename="dds.EntityId_t"):
    entityKey: array[uint8, 3]
    entityKind: uint8


@dataclass
@final
class GUID_t(IdlStruct, typename="dds.GUID_t"):
    guidPrefix: array[uint8, 12]
    entityId: EntityId_t


@dataclass
@final
class SequenceNumber_t(IdlStruct, typename="dds.SequenceNumber_t"):
    high: int32
    low: uint32


@dataclass
@final
class SampleIdentity(IdlStruct, typename="dds.SampleIdentity"):
    writer_guid: GUID_t
    sequence_number: SequenceNumber_t


class RemoteExceptionCode_t(IdlEnum, typename="dds.rpc.RemoteExceptionCode_t", default="REMOTE_EX_OK"):
    REMOTE_EX_OK = 0
    REMOTE_EX_UNSUPPORTED = 1
    REMOTE_EX_INVALID_ARGUMENT = 2
    REMOTE_EX_OUT_OF_RESOURCES = 3
    REMOTE_EX_UNKNOWN_OPERATION = 4
    REMOTE_EX_UNKNOWN_EXCEPTION = 5


@dataclass
@final
class RequestHeader(IdlStruct, typename="dds.rpc.RequestHeader"):
    requestId: SampleIdentity
    instanceName: bounded_str[255]


@dataclass
@final
class ReplyHeader(IdlStruct, typename="dds.rpc.ReplyHeader"):
    relatedRequestId: SampleIdentity
    remoteEx: RemoteExceptionCode_t
