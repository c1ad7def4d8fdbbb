"""Has the herald ask the oracle, once for each line `LIMIT QUESTION` of its input: consult.py NETWORK DOMAIN."""

import sys

from herald import Herald_Call, Herald_Reply, Herald_Request, Herald_consult_In
from network import Client, Network

network, domain = sys.argv[1:]
herald = Client(Network(network, domain), "Herald", Herald_Request, Herald_Reply)
print("ready", flush=True)
for line in sys.stdin:
    limit, question = line.split()
    reply = herald.call(Herald_Call(consult=Herald_consult_In(question, int(limit))))
    print(reply.data.value.value.return_, flush=True)
