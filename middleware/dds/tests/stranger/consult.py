"""Makes the component call the oracle, once for each line `LIMIT QUESTION` of its input: consult.py NETWORK DOMAIN."""

import sys

from interop import Interop_Call, Interop_Reply, Interop_Request, Interop_consult_In
from network import Client, Network

network, domain = sys.argv[1:]
interop = Client(Network(network, domain), "Interop", Interop_Request, Interop_Reply)
print("ready", flush=True)
for line in sys.stdin:
    limit, question = line.split()
    reply = interop.call(Interop_Call(consult=Interop_consult_In(question, int(limit))))
    print(reply.data.value.value.return_, flush=True)
