"""Serves the calls of the component until its input ends: oracle.py NETWORK DOMAIN."""

import sys
import threading

from interop import (
    Nonsense, Nothing, Oracle_Reply, Oracle_Request, Oracle_Return, Oracle_ask_Out, Oracle_ask_Result, Oracle_tell_Result,
    Point,
)
from network import Network, met
from rpc import RemoteExceptionCode_t, ReplyHeader

TELL = 1022105598

network, domain = sys.argv[1:]
here = Network(network, domain)
replies = here.writer("Oracle_Reply", Oracle_Reply)
requests = here.reader("Oracle_Request", Oracle_Request)


def answer():
    for request in here.values(requests, seconds=60):
        code, call = RemoteExceptionCode_t.REMOTE_EX_OK, request.data
        if call.discriminator == TELL:
            print("told", call.value.text, flush=True)
            data = Oracle_Return(tell=Oracle_tell_Result(result=Nothing()))
        else:
            print("asked", call.value.question, flush=True)
            match call.value.question:
                case "hold":
                    continue
                case "nonsense":
                    data = Oracle_Return(ask=Oracle_ask_Result(nonsense_ex=Nonsense("so it is", 9)))
                case "refuse":
                    code = RemoteExceptionCode_t.REMOTE_EX_OUT_OF_RESOURCES
                    # No client reads the value. The package does not write the default branch of a union.
                    data = Oracle_Return(tell=Oracle_tell_Result(result=Nothing()))
                case _:
                    data = Oracle_Return(ask=Oracle_ask_Result(result=Oracle_ask_Out(Point(1.5, -2.5), 1 << 40)))
        replies.write(Oracle_Reply(ReplyHeader(request.header.requestId, code), data))


threading.Thread(target=answer, daemon=True).start()
met(replies, requests)
print("ready", flush=True)
sys.stdin.read()
