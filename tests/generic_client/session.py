"""Drives a Sinew server with nothing but what its reflection tells: no generated code.

usage: session.py PATH-OF-sinew-server
"""

import struct
import subprocess
import sys

import grpc
import xxhash
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.json_format import MessageToDict, ParseDict
from google.protobuf.message_factory import GetMessageClass
from grpc_reflection.v1alpha.proto_reflection_descriptor_database import ProtoReflectionDescriptorDatabase

# Two masses on a spring, one of them fixed, and a lattice around them.
SCENE = {
    "title": "generic client",
    "motion": {
        "massSpring": {
            "positions": {"values": [0, 0, 0, 0, 0, -1]},
            "fixed": {"values": [0]},
            "springs": {"values": [0, 1]},
            "stiffness": {"values": [100]},
            "gravity": {"z": -9.81},
        }
    },
    "mesh": {"lattice": {"spacing": 0.1, "radius": 0.2, "bones": [{"from": "0", "to": "1"}]}},
}


class Service:
    """A service's methods, found by reflection; requests and answers are JSON-like dicts."""

    def __init__(self, channel, pool, name):
        self.channel, self.service, self.pool = channel, pool.FindServiceByName(name), pool

    def call(self, method, request, stream=False, timeout=20):
        found = self.service.methods_by_name[method]
        ask, answer = (GetMessageClass(kind) for kind in (found.input_type, found.output_type))
        make = self.channel.unary_stream if stream else self.channel.unary_unary
        rpc = make(
            f"/{self.service.full_name}/{method}",
            request_serializer=ask.SerializeToString,
            response_deserializer=answer.FromString,
        )
        return rpc(ParseDict(request, ask(), descriptor_pool=self.pool), timeout=timeout)


def check(truth, what):
    print(("ok   " if truth else "FAIL ") + what, flush=True)
    if not truth:
        raise SystemExit(1)


def layout_hash(grid):
    """As Frame.layout_hash says; this grid has no polyhedra."""
    numbers = lambda column: column.values or struct.unpack(f"<{len(column.u32) // 4}I", column.u32)
    vertices, offsets = numbers(grid.connectivity), numbers(grid.offsets)
    total = 0
    for cell, kind in enumerate(grid.cell_types):
        own = vertices[offsets[cell] : offsets[cell + 1]]
        words = [cell, kind, len(own), *own]
        total += xxhash.xxh3_64_intdigest(struct.pack(f"<{len(words)}I", *words))
    return total % 2**64


def drive(address):
    with grpc.insecure_channel(address) as channel:
        database = ProtoReflectionDescriptorDatabase(channel)
        names = set(database.get_services())
        check({"sinew.v1.SessionService", "sinew.v1.MeshService", "grpc.health.v1.Health"} <= names, "services are listed")
        pool = DescriptorPool(database)
        sessions = Service(channel, pool, "sinew.v1.SessionService")
        meshes = Service(channel, pool, "sinew.v1.MeshService")

        made = MessageToDict(sessions.call("CreateSession", {"sessionId": "generic", "scene": SCENE}))
        check(made["name"] == "sessions/generic" and made["vertexCount"] > 0, "a session is created from JSON")
        stepped = MessageToDict(sessions.call("Step", {"name": "sessions/generic", "steps": 12, "expectedStep": 0}))
        check(stepped["step"] == "12" and len(stepped["digest"]) == 32, "it steps and answers with its digest")

        stream = meshes.call("Subscribe", {"session": "sessions/generic", "precision": "PRECISION_F64"}, stream=True)
        keyframe = next(iter(stream)).keyframe
        vertices = struct.unpack(f"<{3 * keyframe.frame.vertex_count}d", keyframe.frame.vertices.f64)
        stream.cancel()
        check(layout_hash(keyframe.grid) == keyframe.frame.layout_hash, "the layout hash is that of the cells")
        check(keyframe.frame.step == 12 and min(vertices[2::3]) < -1.2, "the mesh hangs lower than it was")

        try:
            sessions.call("GetSession", {"name": "sessions/nobody"})
            check(False, "an unknown session is refused")
        except grpc.RpcError as error:
            check(error.code() == grpc.StatusCode.NOT_FOUND, "an unknown session is refused")
        sessions.call("DeleteSession", {"name": "sessions/generic"})


def main():
    server = subprocess.Popen([sys.argv[1], "--listen", "127.0.0.1:0"], stdout=subprocess.PIPE, text=True)
    try:
        greeting = server.stdout.readline()  # Sinew serves http://ADDRESS/ (…
        drive(greeting.split("http://")[1].split("/")[0])
    finally:
        server.terminate()
        code = server.wait(timeout=20)
    check(code == 0, "the server stops in order")


if __name__ == "__main__":
    main()
