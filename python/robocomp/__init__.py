"""Components of robots: workers in Python over the runtime of RoboComp."""

import importlib.machinery
import importlib.util
import os
import sys

if sys.version_info < (3, 11):
    raise ImportError(
        f"robocomp needs Python 3.11 or newer; this is {sys.version.split()[0]} ({sys.executable})"
    )

try:
    import numpy as _numpy  # noqa: F401
except ImportError as error:
    raise ImportError(
        f"robocomp needs NumPy, which {sys.executable} does not find; "
        f"install it with: {sys.executable} -m pip install numpy"
    ) from error


def _load_native() -> None:
    """Loads the extension module that cargo built, if ROBOCOMP_NATIVE names one. A wheel has its own."""
    name = "robocomp._native"
    path = os.environ.get("ROBOCOMP_NATIVE")
    if name in sys.modules:
        return
    if not path:
        if importlib.util.find_spec(name) is None:
            raise ImportError(
                "robocomp has no extension module; build it with `rcdeploy up --build NETWORK.ddsl`, "
                "and let ROBOCOMP_NATIVE name target/release/librobocomp_python.so"
            )
        return
    loader = importlib.machinery.ExtensionFileLoader(name, path)
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    if spec is None or not os.path.exists(path):
        raise ImportError(
            f"ROBOCOMP_NATIVE names {path}, which does not exist; "
            "build it with: cargo build --release -p rc-python"
        )
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    loader.exec_module(module)


_load_native()

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
    SlotArray,
    TimeSource,
)
from robocomp._errors import (  # noqa: E402
    CallError,
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
    QueueFull,
    Refused,
    RemoteError,
    SendError,
    ServerDied,
    StartError,
    Stopping,
    TimeError,
    Unavailable,
    WorkerError,
    WrongThread,
)
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
    "Deadline",
    "Emergency",
    "Error",
    "Fatal",
    "InvalidArgument",
    "InvalidSample",
    "Link",
    "Loan",
    "Machine",
    "MalformedReply",
    "ManagedWorker",
    "Member",
    "MemberError",
    "MiddlewareError",
    "Network",
    "NoServer",
    "NotSent",
    "Order",
    "ParamChange",
    "Publisher",
    "QueueFull",
    "Refused",
    "RemoteError",
    "SendError",
    "ServerDied",
    "SlotArray",
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
    "default",
    "embed",
    "main",
    "required",
]
