"""Components of robots: workers in Python over the runtime of RoboComp."""

import sys

if sys.version_info < (3, 11):
    raise ImportError(
        f"robocomp needs Python 3.11 or newer; this is {sys.version.split()[0]} ({sys.executable})"
    )

try:
    import numpy as _numpy  # noqa: F401
except ImportError as error:
    raise ImportError(
        f"robocomp needs NumPy, which {sys.executable} cannot import ({' '.join(str(error).split())}); "
        f"install it with: {sys.executable} -m pip install numpy"
    ) from error


from robocomp._load import load as _load  # noqa: E402

_load("robocomp._native", "ROBOCOMP_NATIVE", "rc-python", "librobocomp_python.so")

from robocomp._client import Network, connect  # noqa: E402
from robocomp._component import (  # noqa: E402
    Component,
    check_worker,
    embed,
    main,
)
from robocomp._context import (  # noqa: E402
    Client,
    Context,
    Machine,
    Order,
    Publisher,
    Results,
    Samples,
    SlotArray,
    TimeSource,
)
from robocomp._convert import convert, use_prototypes  # noqa: E402
from robocomp._errors import (  # noqa: E402
    CallError,
    ConversionError,
    Deadline,
    Emergency,
    Error,
    Fatal,
    InvalidArgument,
    InvalidSample,
    MalformedReply,
    MemberError,
    MiddlewareError,
    NoServer,
    NotSent,
    NoValue,
    QueueFull,
    Refused,
    RemoteError,
    SendError,
    ServerDied,
    Stale,
    StartError,
    Stopping,
    TimeError,
    Unavailable,
    WorkerError,
    WrongThread,
)
from robocomp._freshness import Fresh, Freshness, Made  # noqa: E402
from robocomp._native import Loan, Member, View  # noqa: E402
from robocomp._link import Link  # noqa: E402
from robocomp._struct import Struct  # noqa: E402
from robocomp._worker import (  # noqa: E402
    ManagedWorker,
    ParamChange,
    Worker,
    default,
    required,
)

__all__ = [
    "CallError",
    "Client",
    "Component",
    "Context",
    "ConversionError",
    "Deadline",
    "Emergency",
    "Error",
    "Fatal",
    "Fresh",
    "Freshness",
    "InvalidArgument",
    "InvalidSample",
    "Link",
    "Loan",
    "Machine",
    "Made",
    "MalformedReply",
    "ManagedWorker",
    "Member",
    "MemberError",
    "MiddlewareError",
    "Network",
    "NoServer",
    "NoValue",
    "NotSent",
    "Order",
    "ParamChange",
    "Publisher",
    "QueueFull",
    "Refused",
    "RemoteError",
    "Results",
    "Samples",
    "SendError",
    "ServerDied",
    "SlotArray",
    "Stale",
    "StartError",
    "Stopping",
    "Struct",
    "TimeError",
    "TimeSource",
    "Unavailable",
    "View",
    "Worker",
    "WorkerError",
    "WrongThread",
    "check_worker",
    "connect",
    "convert",
    "default",
    "embed",
    "main",
    "required",
    "use_prototypes",
]
