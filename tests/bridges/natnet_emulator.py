"""A NatNet server as small as can be, to test clients against.

It answers on one UDP port of loopback (Motive: 1510) as Motive does in unicast: CONNECT by SERVERINFO, REQUEST_MODELDEF
by MODELDEF, the request "FrameRate" by a binary32, ECHOREQUEST by its own clock; whoever has sent CONNECT or KEEPALIVE
within two seconds is sent frames. All numbers are little-endian; a message is its number (u16), its payload's length
(u16) and its payload. What each payload holds is written down in the methods below, from the public description of
NatNet's bit streams 3.1 and 4.1; test_against_client() reads them by PyPI's `natnet`, another's implementation.
"""

import struct
import threading
import time

CONNECT, SERVERINFO, REQUEST, RESPONSE, REQUEST_MODELDEF, MODELDEF, FRAME = 0, 1, 2, 3, 4, 5, 7
KEEPALIVE, ECHOREQUEST, ECHORESPONSE = 10, 12, 13
OCCLUDED, FILLED = 0x01, 0x04
CLOCK_HZ = 10_000_000


def text(value):
    return value.encode() + b"\0"


class Emulator:
    """One rigid body, one skeleton of two bones, both with markers, and a marker set that is no model.

    version: (3, 1) or (4, 1), and others of those ages.
    clock: what its clock shows at first, s.
    rate: frames per second, which `FrameRate` tells.
    """

    BODY, SKELETON = (3, "Wand"), (7, "Walker")
    MARKERS = {"Wand": ["Tip", "Left", "Right"], "Walker": ["LKNE", "RKNE"], "Loose": ["A", "B"]}
    BONES = ["Hips", "Head"]

    def __init__(self, socket, version=(4, 1), clock=1000.0, rate=100.0):
        self.socket, self.version, self.rate = socket, version, rate
        self.clients, self.number, self.origin = {}, 0, time.monotonic() - clock
        self.open = True
        threading.Thread(target=self.answer, daemon=True).start()

    def ticks(self):
        """The server's clock."""
        return int((time.monotonic() - self.origin) * CLOCK_HZ)

    def send(self, kind, payload, address):
        self.socket.sendto(struct.pack("<HH", kind, len(payload)) + payload, address)

    def answer(self):
        try:
            while self.open:
                self.answer_one(*self.socket.recvfrom(65536))
        except OSError:
            pass  # closed

    def answer_one(self, packet, address):
        kind = struct.unpack_from("<H", packet)[0]
        if kind in (CONNECT, KEEPALIVE):
            self.clients[address] = time.monotonic()
        if kind == CONNECT:
            self.send(SERVERINFO, self.server_info(), address)
        elif kind == REQUEST_MODELDEF:
            self.send(MODELDEF, self.models(), address)
        elif kind == REQUEST and packet[4:].startswith(b"FrameRate"):
            self.send(RESPONSE, struct.pack("<f", self.rate), address)
        elif kind == ECHOREQUEST:
            self.send(ECHORESPONSE, packet[4:12] + struct.pack("<Q", self.ticks()), address)

    def close(self):
        self.open = False
        self.socket.close()

    # Payloads

    def server_info(self):
        """Name (256 bytes), server's version, protocol's version; from 3.0 on the clock's ticks per second (u64), the
        data port (u16), whether frames are multicast (u8) and to which group (4 bytes)."""
        name = b"Emulator".ljust(256, b"\0")
        return name + bytes([9, 9, 0, 0, *self.version, 0, 0]) + struct.pack("<QHB4B", CLOCK_HZ, 1511, 0, 239, 255, 42, 99)

    def models(self):
        """A count, then each model: its kind (u32), from 4.1 on its size (u32), and what it is."""
        sets = [(0, self.marker_set(name, markers)) for name, markers in ({"all": ["x"]} | self.MARKERS).items()]
        bodies = [(1, self.body(self.BODY[1], self.BODY[0], self.MARKERS["Wand"]))]
        bones = b"".join(self.body(name, i + 1, []) for i, name in enumerate(self.BONES))
        skeleton = text(self.SKELETON[1]) + struct.pack("<II", self.SKELETON[0], len(self.BONES)) + bones
        camera = [(5, text("Camera 1") + struct.pack("<7f", 1, 2, 3, 0, 0, 0, 1))]
        out = struct.pack("<I", len(sets) + 3)
        for kind, model in sets + bodies + [(2, skeleton)] + camera:
            size = struct.pack("<I", len(model)) if self.version >= (4, 1) else b""
            out += struct.pack("<I", kind) + size + model
        return out

    def marker_set(self, name, markers):
        """Name, count (u32), the markers' names."""
        return text(name) + struct.pack("<I", len(markers)) + b"".join(map(text, markers))

    def body(self, name, number, markers):
        """Name, number, parent (i32), offset (3 f32), from 4.2 on a turn (4 f32); the count of its markers, all their
        places (3 f32), all their active labels (u32), from 4.0 on all their names."""
        out = text(name) + struct.pack("<Ii3f", number, -1, 0, 0, 0)
        if self.version >= (4, 2):
            out += struct.pack("<4f", 0, 0, 0, 1)
        out += struct.pack("<I", len(markers)) + bytes(16 * len(markers))
        return out + (b"".join(map(text, markers)) if self.version >= (4, 0) else b"")

    def section(self, items):
        """A count (u32), from 4.1 on the size of what follows (u32), the items."""
        size = struct.pack("<I", sum(map(len, items))) if self.version >= (4, 1) else b""
        return struct.pack("<I", len(items)) + size + b"".join(items)

    def pose(self, number, place, tracked=True):
        """Number, place (3 f32), turn (4 f32), mean error (f32), parameters (u16; bit 0: tracked)."""
        return struct.pack("<I3f4ffH", number, *place, 0, 0, 0, 1, 0.001, int(tracked))

    def frame(self, places, ticks, occluded=(), filled=()):
        """Places by label, as a bridge calls them."""
        self.number += 1
        sets = [
            text(name) + struct.pack("<I", len(markers)) + b"".join(
                struct.pack("<3f", *((0, 0, 0) if f"{name}:{m}" in occluded else places[f"{name}:{m}"])) for m in markers)
            for name, markers in self.MARKERS.items()
        ]  # fmt: skip
        # The sets of a frame are those of the models, in their order, and "all" is the first.
        sets.insert(0, text("all") + struct.pack("<I3f", 1, 9, 9, 9))
        unlabelled = [struct.pack("<3f", 5, 5, 5)]
        bodies = [self.pose(self.BODY[0], places["Wand"], "Wand" not in occluded)]
        bones = [
            self.pose(self.SKELETON[0] << 16 | i + 1, places[f"Walker:{name}"], f"Walker:{name}" not in occluded)
            for i, name in enumerate(self.BONES)
        ]
        skeleton = struct.pack("<II", self.SKELETON[0], len(bones)) + b"".join(bones)
        markers = [struct.pack("<I3ffHf", 77, 4, 4, 4, 0.01, 0x10, 0.0)]  # unlabelled
        for number, name in (self.BODY, self.SKELETON):
            for i, marker in enumerate(self.MARKERS[name]):
                label = f"{name}:{marker}"
                flags = 0x08 | OCCLUDED * (label in occluded) | FILLED * (label in filled)
                markers.append(struct.pack("<I3ffHf", number << 16 | i + 1, *places[label], 0.01, flags, 0.0002))
        plate = struct.pack("<II", 1, 2) + struct.pack("<I2f", 2, 0.5, 0.6) * 2
        out = struct.pack("<I", self.number)
        out += self.section(sets) + self.section(unlabelled) + self.section(bodies) + self.section([skeleton])
        if self.version >= (4, 1):
            out += self.section([])  # assets
        out += self.section(markers) + self.section([plate]) + self.section([])
        # Timecode (2 u32), seconds (f64), exposure, reception and sending in ticks (u64), parameters (u16), an end (u32).
        return out + struct.pack("<IIdQQQHI", 0, 0, ticks / CLOCK_HZ, ticks, ticks, ticks, 0, 0)

    def play(self, places, ticks, **flags):
        payload = self.frame(places, ticks, **flags)
        for address, heard in list(self.clients.items()):
            if time.monotonic() - heard < 2.0:
                self.send(FRAME, payload, address)


def test_against_client(make_socket, check):
    """What PyPI's natnet reads of this emulator's messages."""
    from natnet import NatNetClient

    for version in ((3, 1), (4, 1)):
        socket, port = make_socket()
        emulator = Emulator(socket, version)
        labels = [f"{name}:{m}" for name, markers in emulator.MARKERS.items() for m in markers]
        labels += ["Wand", "Walker:Hips", "Walker:Head"]
        places = {label: (i + 0.5, 2.0 * i, -0.25 * i) for i, label in enumerate(labels)}
        client = NatNetClient("127.0.0.1", "127.0.0.1", command_port=port, use_multicast=False)
        models, frames = [], []
        client.on_data_description_received_event.handlers.append(models.append)
        client.on_data_frame_received_event.handlers.append(frames.append)
        with client:
            client.request_modeldef()
            for _ in range(200):
                if models and frames:
                    break
                emulator.play(places, 12_345_678, occluded={"Wand:Left"}, filled={"Walker:RKNE"})
                time.sleep(0.01)
                client.update_sync()
        emulator.close()
        (model, *_), (frame, *_) = models, frames
        check({s.name: list(s.marker_names) for s in model.marker_sets if s.name != "all"} == emulator.MARKERS, f"natnet {version}: another client reads the sets")
        check([(b.id_num, b.name) for b in model.rigid_bodies] == [emulator.BODY], f"natnet {version}: the rigid bodies")
        check([b.name for b in model.skeletons[0].rigid_body_descriptions] == emulator.BONES, f"natnet {version}: the bones")
        read = {(m.model_id, m.marker_id): m for m in frame.labeled_markers}
        tip, left, knee = read[3, 1], read[3, 2], read[7, 2]
        check(tip.pos == places["Wand:Tip"] and not tip.occluded and left.occluded, f"natnet {version}: the markers")
        check(knee.model_solved and read[0, 77].unlabeled, f"natnet {version}: their flags")
        check(frame.rigid_bodies[0].pos == places["Wand"], f"natnet {version}: a rigid body's place")
        check(frame.suffix.stamp_camera_mid_exposure == 12_345_678, f"natnet {version}: the exposure")
