"""`sinew bridge natnet` against the emulator, which PyPI's natnet vouches for."""

import socket
import time

from natnet_emulator import CLOCK_HZ, Emulator, test_against_client
from stage import RATE, SPEED, VALID, check, latencies, paced

# In the scene, z up; OptiTrack's y is up, so that what is (x, y, z) there is (x, -z, y) here.
REST = {
    "Wand:Tip": [0.1, 0.2, 1.0],
    "Wand:Left": [0.0, 0.3, 1.1],
    "Wand:Right": [0.2, 0.3, 1.1],
    "LKNE": [-0.3, 0.0, 0.5],  # without its set
    "RKNE": [-0.5, 0.1, 0.5],
    "Loose:A": [0.6, 0.6, 0.2],
    "Loose:B": [0.6, 0.4, 0.3],
    "Wand": [0.1, 0.25, 1.05],
    "Walker:Hips": [-0.4, 0.0, 0.9],
    "Walker:Head": [-0.4, 0.0, 1.6],
}


def make_socket(port=0):
    server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    server.bind(("127.0.0.1", port))
    return server, server.getsockname()[1]


def places(moved):
    full = lambda label: "Walker:" + label if label in ("LKNE", "RKNE") else label
    return {full(label): (x + moved, z, -y) for label, (x, y, z) in REST.items()}


def play(emulator, frames, begun, hidden=lambda i: ()):
    origin = emulator.ticks() - int((time.time() - begun) * CLOCK_HZ)
    for i, now in paced(frames):
        ticks = origin + int((now - begun) * CLOCK_HZ)
        emulator.play(places(SPEED * (now - begun)), ticks, occluded=hidden(i))
    return origin / CLOCK_HZ


def test(open_stage, port):
    test_against_client(make_socket, check)
    stage = open_stage(REST)
    labels = list(REST)
    for version, more in (((3, 1), ["--each"]), ((4, 1), [])):
        name, watcher = stage.session()
        bridge = stage.bridge(name, "natnet", f"127.0.0.1:{port}", *more)
        bridge.says("no NatNet server answers")
        emulator = Emulator(make_socket(port)[0], version)
        bridge.says("points drive the session")
        begun = time.time()
        hidden = {"Wand:Left", "Loose:B", "Wand", "Walker:Head"}
        origin = play(emulator, 4 * RATE, begun, lambda i: hidden if 200 <= i < 230 else ())
        stage.reached(lambda: watcher.frames, SPEED * (time.time() - begun))
        blinking = [i for i, label in enumerate(labels) if label in hidden]
        seen = [i for i in range(len(labels)) if i not in blinking]
        frames = stage.followed(watcher.frames[20:], seen)
        late = [abs(stage.displacement(frame) - SPEED * (frame.capture - origin)) for frame in frames]
        check(max(late) < 2e-5, f"natnet {version}: a step shows the motion of its moment by the server's clock")
        check(max(stage.error(frame, seen) for frame in frames) < 1e-5, f"natnet {version}: markers, bodies and bones are where they are")
        for i in blinking:
            check({frame.states[i] for frame in frames} > {VALID}, f"natnet {version}: {labels[i]} is hidden for a while")
        check(max(stage.error(frame) for frame in frames) < 1e-4, f"natnet {version}: what is hidden goes with the others")
        latencies(f"natnet {version}" + (", each frame a step" if more else ", live"), stage, frames, begun)
        emulator.close()
        bridge.says("is silent")
        emulator = Emulator(make_socket(port)[0], version, clock=10.0)
        bridge.says("points drive the session", 2)
        begun = time.time()
        origin = play(emulator, 2 * RATE, begun)
        of_now = lambda: [frame for frame in watcher.frames if frame.capture < 1000.0]
        stage.reached(of_now, SPEED * (time.time() - begun))
        again = of_now()[60:]
        late = [abs(stage.displacement(frame) - SPEED * (frame.capture - origin)) for frame in stage.followed(again)]
        check(max(late) < 2e-5, f"natnet {version}: a server that starts again is followed")
        emulator.close()
        bridge.stop()
    stage.close()
