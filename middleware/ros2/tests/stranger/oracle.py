"""Serves the calls of the component until its input ends: oracle.py NETWORK DOMAIN."""

import sys
import threading

from node import Node, Server, met

from interop import (
    NONSENSE, Nonsense, OK, OracleAsk_Request, OracleAsk_Response, OracleTell_Request, OracleTell_Response, Point,
)


def say(text):
    # In one piece: two threads print.
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def ask(request):
    say(f"asked {request.question}")
    match request.question:
        case "hold":
            return None
        case "nonsense":
            return NONSENSE, Nonsense("so it is", 9), Point(), 0
        case _:
            return OK, Nonsense(), Point(1.5, -2.5), 1 << 40


def tell(request):
    say(f"told {request.text}")
    return ()


network, domain = sys.argv[1:]
here = Node(network, domain)
asks = Server(here, "Oracle/ask", OracleAsk_Request, OracleAsk_Response)
tells = Server(here, "Oracle/tell", OracleTell_Request, OracleTell_Response)
for server, answer in ((asks, ask), (tells, tell)):
    threading.Thread(target=server.serve, args=(answer,), daemon=True).start()
met(asks.responses, asks.requests, tells.responses, tells.requests)
print("ready", flush=True)
sys.stdin.read()
