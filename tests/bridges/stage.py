"""A server, a session on it, a bridge into it and what comes out: what the tests of all bridges share.

The peers move all of their points along x, at SPEED by their own clocks, so that a position says when it was sent, and
a frame that the session publishes says how long that took.
"""

import atexit
import math
import signal
import statistics
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import grpc
from google.protobuf.descriptor_pool import DescriptorPool
from grpc_reflection.v1alpha.proto_reflection_descriptor_database import ProtoReflectionDescriptorDatabase

sys.path.append(str(Path(__file__).resolve().parent.parent / "generic_client"))
from session import Service, check

SPEED = 0.5  # m/s
RATE = 100  # Hz
VALID = 1  # PointState
ENOUGH = 20  # frames that tell how points move


def start(command, **options):
    """A program that does not outlive the test."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options)
    atexit.register(process.kill)
    return process


def wait_for(what, truth, seconds=20):
    """Waits until something holds; the deadline is for what never does."""
    end = time.monotonic() + seconds
    while not truth():
        if time.monotonic() > end:
            check(False, what)
        time.sleep(0.01)


def paced(frames, rate=RATE):
    """0, 1, … at a rate; yields the number and the wall clock, s."""
    begun = time.monotonic()
    for i in range(frames):
        time.sleep(max(0.0, begun + i / rate - time.monotonic()))
        yield i, time.time()


class Seen:
    """A frame of the session."""

    def __init__(self, frame):
        numbers = struct.unpack(f"<{len(frame.points.f64) // 8}d", frame.points.f64)
        self.points = [numbers[i : i + 3] for i in range(0, len(numbers), 3)]
        self.states = list(frame.point_states)
        self.capture = frame.capture_time_seconds
        self.published = frame.timing.published * 1e-9


class Stage:
    """A server with one session, whose points are at `rest` {label: [x, y, z]}, z up; steps of 10 ms."""

    def __init__(self, server, sinew, rest):
        self.sinew, self.rest = sinew, rest
        self.process = start([server, "--listen", "127.0.0.1:0"])
        self.address = self.process.stdout.readline().split("http://")[1].split("/")[0]
        self.channel = grpc.insecure_channel(self.address)
        pool = DescriptorPool(ProtoReflectionDescriptorDatabase(self.channel))
        self.sessions = Service(self.channel, pool, "sinew.v1.SessionService")
        self.meshes = Service(self.channel, pool, "sinew.v1.MeshService")
        self.count = 0

    def session(self):
        """A new session that runs, and the frames that it will publish."""
        self.count += 1
        name = f"stage{self.count}"
        labels = list(self.rest)
        scene = {
            "title": "bridges",
            "up": "UP_AXIS_Z",
            "motion": {
                "external": {
                    "labels": labels,
                    "restPositions": {"values": [x for label in labels for x in self.rest[label]]},
                    "rateHz": RATE,
                }
            },
            "mesh": {"lattice": {"spacing": 0.1, "radius": 0.2, "bones": [{"from": labels[0], "to": labels[1]}]}},
        }
        self.sessions.call("CreateSession", {"sessionId": name, "scene": scene, "run": True})
        return name, Watcher(self.meshes, name)

    def bridge(self, name, *arguments):
        kind, *rest = arguments
        command = [self.sinew, "bridge", kind, "--session", name, "--server", self.address, *rest]
        return Bridge(start(command, stderr=subprocess.PIPE))

    def displacement(self, seen, point=0):
        return seen.points[point][0] - list(self.rest.values())[point][0]

    def error(self, seen, points=None):
        """How far points are from where the first one's displacement puts them, m."""
        moved = self.displacement(seen)
        rest = list(self.rest.values())
        far = 0.0
        for i in points if points is not None else range(len(rest)):
            off = [a - b for a, b in zip(seen.points[i], rest[i])]
            far = max(far, abs(off[0] - moved), abs(off[1]), abs(off[2]))
        return far

    def followed(self, frames, points=None):
        """Those frames in which these points are seen, and not on their way back from where they were carried: a busy
        machine lets steps go without motion, and skips others. How many is no matter, as long as there are some."""
        points = range(len(self.rest)) if points is None else points
        followed = [frame for frame in frames if all(frame.states[i] == VALID for i in points)]
        check(len(followed) >= ENOUGH, f"{len(followed)} of {len(frames)} steps have their motion")
        return followed

    def reached(self, frames, end):
        """Waits until frames of the session show how far the peer had gone when it ended, m, but for a fifth of a second.

        * `frames` - a function that gives those that came.
        """
        last = lambda: self.displacement(frames()[-1]) if frames() else -math.inf
        wait_for("the last frames come", lambda: last() > end - 0.2 * SPEED, 60)

    def close(self):
        self.channel.close()
        self.process.terminate()
        check(self.process.wait(timeout=20) == 0, "the server stops in order")


class Watcher:
    """Keeps all frames of a session, in a thread of its own."""

    def __init__(self, meshes, name):
        self.frames = []
        request = {"session": f"sessions/{name}", "content": "CONTENT_POINTS", "precision": "PRECISION_F64"}
        self.stream = meshes.call("Subscribe", request, stream=True, timeout=None)
        self.frames_of(next(iter(self.stream)))
        threading.Thread(target=self.run, daemon=True).start()

    def frames_of(self, message):
        kind = message.WhichOneof("item")
        frame = message.keyframe.frame if kind == "keyframe" else message.frame if kind == "frame" else None
        if frame is not None and frame.step > 0:
            self.frames.append(Seen(frame))

    def run(self):
        try:
            for message in self.stream:
                self.frames_of(message)
        except grpc.RpcError:
            pass  # the test is over


class Bridge:
    """`sinew bridge`, and what it says."""

    def __init__(self, process):
        self.process, self.said = process, []
        threading.Thread(target=self.listen, daemon=True).start()

    def listen(self):
        for line in self.process.stderr:
            print("     " + line.rstrip(), flush=True)
            self.said.append(line)

    def says(self, words, times=1):
        wait_for(f"the bridge says “{words}”", lambda: sum(words in line for line in self.said) >= times)

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        out, _ = self.process.communicate(timeout=20)
        check(self.process.returncode == 0, "the bridge ends at Ctrl-C")
        return out


def latencies(name, stage, frames, begun):
    """Prints how long frames took from the peer to the session; a displacement says when its motion was sent."""
    took = sorted(seen.published - (begun + stage.displacement(seen) / SPEED) for seen in frames)
    median, high = statistics.median(took), took[min(len(took) - 1, int(0.99 * len(took)))]
    print(f"     {name}: peer's send to session's frame: median {median * 1e3:.2f} ms, p99 {high * 1e3:.2f} ms", flush=True)
    return median
