"""Bridges from live protocols, each against a real peer on loopback; prints their latencies.

usage: bridges.py SINEW-SERVER SINEW [KIND…]
"""

import socket
import sys

import lsl
import motive
import osc
from stage import Stage

KINDS = {"osc": osc.test, "natnet": motive.test, "lsl": lsl.test}


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def main():
    server, sinew, *kinds = sys.argv[1:]
    for kind in kinds or KINDS:
        KINDS[kind](lambda rest: Stage(server, sinew, rest), free_port())


main()
