"""`sinew bridge lsl` against pylsl."""

import math
import time

from pylsl import StreamInfo, StreamOutlet, local_clock
from stage import RATE, SPEED, VALID, check, latencies, paced, wait_for

REST = {"LKNE": [-0.3, 0.0, 0.5], "RKNE": [-0.5, 0.1, 0.5], "HEAD": [-0.4, 0.2, 1.6], "TAIL": [-0.4, 0.6, 0.9]}


class Outlet:
    """Markers in millimetres, by the convention for motion capture, between channels of other things; some with a
    confidence."""

    def __init__(self, name, kind):
        channels = [("trigger", "", "Stim", "")]
        for marker in REST:
            channels += [(f"{marker}{axis}", marker, f"Position{axis}", "millimeters") for axis in "XYZ"]
            channels += [(f"{marker}?", marker, "Confidence", "")] if marker in ("HEAD", "TAIL") else []
        info = StreamInfo(name, "MoCap", len(channels), RATE, kind, "sinew-test")
        node = info.desc().append_child("channels")
        for label, marker, kind, unit in channels:
            channel = node.append_child("channel")
            for field, value in (("label", label), ("marker", marker), ("type", kind), ("unit", unit)):
                if value:
                    channel.append_child_value(field, value)
        self.outlet = StreamOutlet(info)

    def push(self, moved, clock, hidden=()):
        sample = [7.0]
        for marker, (x, y, z) in REST.items():
            gone = marker in hidden
            place = [1000 * (x + moved), 1000 * y, 1000 * z]
            # One kind of marker is gone by NaN, the other by its confidence.
            sample += [math.nan] * 3 if gone and marker == "RKNE" else place
            sample += [0.0 if gone else 0.9] if marker in ("HEAD", "TAIL") else []
        self.outlet.push_sample(sample, clock)


def play(outlet, frames, hidden=lambda i: ()):
    """The wall clock and LSL's at its beginning, and how far it went, m."""
    begun, origin = time.time(), local_clock()
    for i, now in paced(frames):
        outlet.push(SPEED * (now - begun), origin + now - begun, hidden(i))
    return begun, origin, SPEED * (now - begun)


def test(open_stage, _port):
    stage = open_stage(REST)
    labels = list(REST)
    hidden = {"RKNE", "TAIL"}
    for kind, more in (("float32", ["--each"]), ("double64", [])):
        name, watcher = stage.session()
        stream = f"sinew-{kind}-{time.time_ns()}"
        bridge = stage.bridge(name, "lsl", stream, *more)
        bridge.says("no stream of LSL answers")
        outlet = Outlet(stream, kind)
        wait_for("the bridge listens", outlet.outlet.have_consumers)
        begun, origin, end = play(outlet, 5 * RATE, lambda i: hidden if 300 <= i < 330 else ())
        stage.reached(lambda: watcher.frames, end)
        blinking = [labels.index(label) for label in hidden]
        seen = [i for i in range(len(labels)) if i not in blinking]
        frames = stage.followed(watcher.frames[20:], seen)
        late = [abs(stage.displacement(frame) - SPEED * (frame.capture - origin)) for frame in frames]
        check(max(late) < 2e-5, f"lsl {kind}: a step shows the motion of its moment by the stream's clock")
        check(max(stage.error(frame, seen) for frame in frames) < 1e-5, f"lsl {kind}: markers are where they are, in metres")
        for i in blinking:
            check({frame.states[i] for frame in frames} > {VALID}, f"lsl {kind}: {labels[i]} is hidden for a while")
        latencies(f"lsl {kind}" + (", each frame a step" if more else ", live"), stage, frames, begun)
        del outlet
        bridge.says("is lost")
        outlet = Outlet(stream, kind)
        wait_for("the bridge listens again", outlet.outlet.have_consumers)
        bridge.says("looking for it")
        _, origin, end = play(outlet, 3 * RATE)
        of_now = lambda: [frame for frame in watcher.frames if frame.capture > origin]
        stage.reached(of_now, end)
        again = stage.followed(of_now()[60:])
        late = [abs(stage.displacement(frame) - SPEED * (frame.capture - origin)) for frame in again]
        check(max(late) < 2e-5, f"lsl {kind}: a stream that comes back is followed")
        bridge.stop()
    stage.close()
