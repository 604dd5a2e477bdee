"""`sinew bridge osc` against python-osc, sending as VirtualMotionCapture does."""

import math
import time

from pythonosc import udp_client
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from stage import RATE, SPEED, VALID, check, latencies, paced

# Bones in their parents, in Unity's frame (y up, left-handed): position, and a turn about z in degrees.
BONES = [
    ("root", None, (0, 0, 0), 0),
    ("Hips", "root", (0, 1.0, 0), 0),
    ("Spine", "Hips", (0, 0.2, 0.05), 30),
    ("Neck", "Spine", (0, 0.4, 0), -30),  # this avatar has no chest
    ("Head", "Neck", (0, 0.1, 0), 0),
    ("LeftUpperLeg", "Hips", (-0.1, -0.1, 0), 0),
    ("RightUpperLeg", "Hips", (0.1, -0.1, 0), 0),
    ("LeftFoot", "LeftUpperLeg", (0, -0.8, 0.02), 0),
]
TRACKERS = {"LHR-1": (0.4, 0.9, 0.3), "LHR-2": (-0.4, 1.1, 0.2)}


def rest():
    """Where all are in the scene, which is z up and right-handed: x, z, y of Unity."""
    poses = {}
    for name, parent, (x, y, z), turn in BONES:
        (px, py, pz), angle = poses.get(parent, ((0, 0, 0), 0.0))
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        poses[name] = ((px + c * x - s * y, py + s * x + c * y, pz + z), angle + turn)
    places = {name: place for name, (place, _) in poses.items()} | TRACKERS
    return {name: [x, z, y] for name, (x, y, z) in places.items()}


def message(address, *values):
    builder = OscMessageBuilder(address)
    for value in values:
        builder.add_arg(value)
    return builder.build()


class Performer:
    def __init__(self, port):
        self.client = udp_client.UDPClient("127.0.0.1", port)

    def bundle(self, messages):
        builder = OscBundleBuilder(IMMEDIATELY)
        for content in messages:
            builder.add_content(content)
        self.client.send(builder.build())

    def send(self, moved, clock=None, hidden=()):
        """One frame in two bundles, as they would come from an avatar of many bones."""
        head = [message("/VMC/Ext/OK", 1)] + ([message("/VMC/Ext/T", float(clock))] if clock is not None else [])
        for name, parent, (x, y, z), turn in BONES:
            half = math.radians(turn) / 2
            place = (moved, 0.0, 0.0) if parent is None else (float(x), float(y), float(z))
            address = "/VMC/Ext/Root/Pos" if parent is None else "/VMC/Ext/Bone/Pos"
            head.append(message(address, name, *place, 0.0, 0.0, math.sin(half), math.cos(half)))
        head.append(message("/VMC/Ext/Blend/Val", "Joy", 0.5))
        self.bundle(head)
        trackers = [
            message("/VMC/Ext/Tra/Pos", name, x + moved, y, z, 0.0, 0.0, 0.0, 1.0)
            for name, (x, y, z) in TRACKERS.items()
            if name not in hidden
        ]
        self.bundle(trackers or [message("/VMC/Ext/Blend/Apply")])


def play(performer, frames, begun, clock_from=None, hidden=lambda i: ()):
    for i, now in paced(frames):
        moved = SPEED * (now - begun)
        performer.send(moved, None if clock_from is None else clock_from + now - begun, hidden(i))


def test(open_stage, port):
    stage = open_stage(rest())
    labels = list(stage.rest)
    performer = Performer(port)

    # By arrival; each frame a step.
    name, watcher = stage.session()
    bridge = stage.bridge(name, "osc", "--listen", f"127.0.0.1:{port}", "--each")
    bridge.says("nothing comes")
    performer.client.send(message("/VMC/Ext/Bone/Pos", "Hips"))
    bridge.says("no message of VMC")
    begun = time.time()
    play(performer, 3 * RATE, begun)
    stage.reached(lambda: watcher.frames, SPEED * (time.time() - begun))
    frames = stage.followed(watcher.frames)
    check(max(stage.error(seen) for seen in frames) < 1e-5, "osc: bones and trackers are where the peer's hierarchy puts them")
    latencies("osc, each frame a step", stage, frames[20:], begun)
    check("frames sent" in bridge.stop(), "osc: the bridge says how it went")

    # By the sender's clock, resampled; a tracker blinks, and the sender starts again.
    name, watcher = stage.session()
    bridge = stage.bridge(name, "osc", "--listen", f"127.0.0.1:{port}")
    bridge.says("nothing comes")
    begun = time.time()
    blinking = labels.index("LHR-2")
    play(performer, 4 * RATE, begun, 100.0, lambda i: ("LHR-2",) if 200 <= i < 230 else ())
    stage.reached(lambda: watcher.frames, SPEED * (time.time() - begun))
    seen = [i for i in range(len(labels)) if i != blinking]
    frames = stage.followed(watcher.frames[20:], seen)
    late = [abs(stage.displacement(frame) - SPEED * (frame.capture - 100.0)) for frame in frames]
    check(max(late) < 2e-5, "osc: a step shows the motion of its moment by the sender's clock")
    check(max(stage.error(frame, seen) for frame in frames) < 1e-5, "osc: what is seen is where it is")
    check({frame.states[blinking] for frame in frames} > {VALID}, "osc: what is not sent is not valid")
    check(max(stage.error(frame) for frame in frames) < 1e-4, "osc: what is hidden goes with the others")
    latencies("osc, live", stage, frames[len(frames) // 4 :], begun)
    bridge.says("nothing comes", 2)
    begun = time.time()
    play(performer, 2 * RATE, begun, 5.0)
    of_now = lambda: [frame for frame in watcher.frames if frame.capture < 50.0]
    stage.reached(of_now, SPEED * (time.time() - begun))
    check(sum("Hz into" in line for line in bridge.said) == 2, "osc: a sender that starts again is followed in a new stream")
    again = stage.followed(of_now()[60:])
    late = [abs(stage.displacement(frame) - SPEED * (frame.capture - 5.0)) for frame in again]
    check(max(late) < 2e-5, "osc: and shows its own motion")
    bridge.stop()
    stage.close()
