//! A frame of NatNet.

use nalgebra::Vector3;

use super::{
    message::Version,
    models::{Models, Place},
};
use crate::{FILLED, Frame, Garbled, SOLVED, cursor::Cursor};

/// Bits of a labelled marker's parameters.
const OCCLUDED: u16 = 1 << 0;
const MODEL_FILLED: u16 = 1 << 2;
const UNLABELLED: u16 = 1 << 4;
/// Bit of a rigid body's parameters.
const TRACKED: u16 = 1 << 0;
/// Bit of a frame's parameters: the models are others now.
const MODELS_CHANGED: u16 = 1 << 1;

/// What a frame holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Captured {
    pub(super) frame: Frame,
    pub(super) models_changed: bool,
}

/// Reads a frame.
///
/// * `clock_hz` - of the server's stamps; 0 where it has none, and its own seconds count.
pub(super) fn decode(
    payload: &[u8],
    version: Version,
    clock_hz: f64,
    models: &Models,
) -> Result<Captured, Garbled> {
    let mut reader = Reader {
        cursor: Cursor::new(payload),
        version,
        models,
        frame: Frame::unseen(0.0, models.labels.len()),
    };
    reader.cursor.u32("the frame's number")?;
    reader.section("marker sets", Reader::marker_sets)?;
    reader.section("unlabelled markers", |reader, count| reader.skip(count, 12))?;
    reader.section("rigid bodies", |reader, count| {
        (0..count).try_for_each(|_| reader.body(None))
    })?;
    reader.section("skeletons", |reader, count| {
        for _ in 0..count {
            let model = reader.cursor.u32("a skeleton's number")?;
            let bones = reader.cursor.u32("the number of its bones")?;
            (0..bones).try_for_each(|_| reader.body(Some(model)))?;
        }
        Ok(())
    })?;
    if version >= Version(4, 1) {
        reader.section("assets", Reader::assets)?;
    }
    reader.section("labelled markers", |reader, count| {
        (0..count).try_for_each(|_| reader.marker())
    })?;
    reader.section("force plates", Reader::analog)?;
    reader.section("devices", Reader::analog)?;
    reader.end(clock_hz)
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    version: Version,
    models: &'a Models,
    frame: Frame,
}

impl Reader<'_> {
    /// A count, from 4.1 on the bytes that follow, and what they hold.
    fn section(
        &mut self,
        what: &'static str,
        read: impl FnOnce(&mut Self, u32) -> Result<(), Garbled>,
    ) -> Result<(), Garbled> {
        let count = self.cursor.u32(what)?;
        if self.version < Version(4, 1) {
            return read(self, count);
        }
        let size = self.cursor.u32(what)?;
        let mut after = self.cursor;
        after.bytes(size as usize, what)?;
        read(self, count)?;
        self.cursor = after;
        Ok(())
    }

    fn skip(&mut self, count: u32, bytes: usize) -> Result<(), Garbled> {
        let bytes = (count as usize).saturating_mul(bytes);
        self.cursor.bytes(bytes, "what is passed over").map(drop)
    }

    fn see(&mut self, place: Place, position: Vector3<f64>, flags: u8) {
        if let Some(point) = self.models.places.get(&place) {
            self.frame.see(*point, position, flags);
        }
    }

    /// Of sets that are no models: what is exactly at the origin is not seen.
    fn marker_sets(&mut self, count: u32) -> Result<(), Garbled> {
        for _ in 0..count {
            let name = self.cursor.text("a marker set's name")?;
            let set = self.models.sets.iter().position(|set| *set == name);
            for marker in 0..self.cursor.u32("the number of its markers")? {
                let position = self.cursor.vector("a marker")?;
                if let Some(set) = set.filter(|_| position != Vector3::zeros()) {
                    self.see(Place::InSet { set, marker }, position, 0);
                }
            }
        }
        Ok(())
    }

    /// A rigid body, or a bone of a model.
    fn body(&mut self, model: Option<u32>) -> Result<(), Garbled> {
        let id = self.cursor.u32("a rigid body's number")?;
        let position = self.cursor.vector("a rigid body's place")?;
        self.cursor.bytes(16 + 4, "a rigid body's turn and error")?;
        if self.cursor.u16("a rigid body's parameters")? & TRACKED != 0 {
            let place = match model {
                None => Place::Body { id },
                // A bone's number has that of its skeleton before it.
                Some(model) => Place::Bone {
                    model,
                    bone: id & 0xFFFF,
                },
            };
            self.see(place, position, SOLVED);
        }
        Ok(())
    }

    fn assets(&mut self, count: u32) -> Result<(), Garbled> {
        for _ in 0..count {
            let model = self.cursor.u32("an asset's number")?;
            let bones = self.cursor.u32("the number of its bones")?;
            (0..bones).try_for_each(|_| self.body(Some(model)))?;
            let markers = self.cursor.u32("the number of its markers")?;
            self.skip(markers, 4 + 12 + 4 + 2 + 4)?; // they come again among the labelled ones
        }
        Ok(())
    }

    fn marker(&mut self) -> Result<(), Garbled> {
        let id = self.cursor.u32("a marker's number")?;
        let position = self.cursor.vector("a marker's place")?;
        self.cursor.bytes(4, "a marker's size")?;
        let parameters = self.cursor.u16("a marker's parameters")?;
        self.cursor.bytes(4, "a marker's residual")?;
        if parameters & (OCCLUDED | UNLABELLED) == 0 {
            let place = Place::Marker {
                model: id >> 16,
                marker: id & 0xFFFF,
            };
            let flags = match parameters & MODEL_FILLED {
                0 => 0,
                _ => FILLED,
            };
            self.see(place, position, flags);
        }
        Ok(())
    }

    fn analog(&mut self, count: u32) -> Result<(), Garbled> {
        for _ in 0..count {
            self.cursor.u32("a device's number")?;
            for _ in 0..self.cursor.u32("the number of its channels")? {
                let samples = self.cursor.u32("the number of a channel's samples")?;
                self.skip(samples, 4)?;
            }
        }
        Ok(())
    }

    fn end(mut self, clock_hz: f64) -> Result<Captured, Garbled> {
        self.cursor.bytes(8, "the timecode")?;
        let seconds = self.cursor.f64("the frame's time")?;
        let exposed = self.cursor.u64("when the cameras were exposed")?;
        self.cursor.bytes(16, "when the frame was made")?;
        let parameters = self.cursor.u16("the frame's parameters")?;
        #[expect(
            clippy::cast_precision_loss,
            reason = "2^53 ticks of 10 MHz are 28 years"
        )]
        let exposed = exposed as f64;
        self.frame.time = match clock_hz > 0.0 && exposed > 0.0 {
            true => exposed / clock_hz,
            false => seconds,
        };
        Ok(Captured {
            frame: self.frame,
            models_changed: parameters & MODELS_CHANGED != 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Little-endian bytes, part by part.
    #[derive(Default)]
    struct Packet(Vec<u8>);

    impl Packet {
        fn u16(mut self, value: u16) -> Self {
            self.0.extend(value.to_le_bytes());
            self
        }

        fn u32(mut self, value: u32) -> Self {
            self.0.extend(value.to_le_bytes());
            self
        }

        fn f32(mut self, values: &[f32]) -> Self {
            self.0
                .extend(values.iter().flat_map(|value| value.to_le_bytes()));
            self
        }

        fn text(mut self, value: &str) -> Self {
            self.0.extend(value.bytes().chain([0]));
            self
        }

        fn then(mut self, other: Self) -> Self {
            self.0.extend(other.0);
            self
        }

        /// A count, the size of what follows where the version has that, and what follows.
        fn section(self, version: Version, count: u32, content: Self) -> Self {
            let size = u32::try_from(content.0.len()).unwrap();
            let counted = self.u32(count);
            match version >= Version(4, 1) {
                true => counted.u32(size).then(content),
                false => counted.then(content),
            }
        }
    }

    /// A rigid body "Wand" with the number 3 and markers "Tip" and "End"; a set "Loose" of "A".
    fn models(version: Version) -> Vec<u8> {
        let set = |name: &str, markers: &[&str]| {
            let count = u32::try_from(markers.len()).unwrap();
            let set = Packet::default().text(name).u32(count);
            markers.iter().fold(set, |set, marker| set.text(marker))
        };
        let body = Packet::default()
            .text("Wand")
            .u32(3)
            .u32(u32::MAX)
            .f32(&[0.0; 3]);
        let body = if version >= Version(4, 2) {
            body.f32(&[0.0; 4])
        } else {
            body
        };
        let body = body.u32(0);
        Packet::default()
            .u32(3)
            .section(version, 0, set("Wand", &["Tip", "End"]))
            .section(version, 0, set("Loose", &["A"]))
            .section(version, 1, body)
            .0
    }

    fn frame(version: Version) -> Vec<u8> {
        let marker = |id: u32, x: f32, parameters: u16| {
            Packet::default()
                .u32(id)
                .f32(&[x, 2.0, 3.0, 0.01])
                .u16(parameters)
                .f32(&[0.0])
        };
        let sets = Packet::default().text("Loose").u32(1).f32(&[7.0, 8.0, 9.0]);
        let body = Packet::default()
            .u32(3)
            .f32(&[4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 1.0, 0.0])
            .u16(1);
        let none = || Packet::default();
        let markers = marker(3 << 16 | 1, 1.0, 0x08 | 0x04).then(marker(3 << 16 | 2, 1.5, 0x09));
        let packet = none()
            .u32(42)
            .section(version, 1, sets)
            .section(version, 1, none().f32(&[9.0; 3]))
            .section(version, 1, body)
            .section(version, 0, none());
        let packet = match version >= Version(4, 1) {
            true => packet.section(version, 0, none()),
            false => packet,
        };
        let mut bytes = packet
            .section(version, 2, markers)
            .section(version, 0, none())
            .section(version, 0, none())
            .u32(0)
            .u32(0)
            .0;
        bytes.extend(1.25_f64.to_le_bytes());
        bytes.extend(
            [50_u64, 51, 52]
                .iter()
                .flat_map(|ticks| ticks.to_le_bytes()),
        );
        bytes.extend([2, 0, 0, 0, 0, 0]);
        bytes
    }

    const VERSIONS: [Version; 4] = [Version(3, 0), Version(4, 0), Version(4, 1), Version(4, 3)];

    #[test]
    fn a_frame_is_read_by_its_models_in_all_versions() {
        for version in VERSIONS {
            let models = Models::decode(&models(version), version).unwrap();
            assert_eq!(models.labels, ["Wand:Tip", "Wand:End", "Loose:A", "Wand"]);
            let captured = decode(&frame(version), version, 100.0, &models).unwrap();
            assert!(captured.models_changed);
            assert_eq!(captured.frame.time, 0.5, "by its exposure");
            assert_eq!(captured.frame.flags, [FILLED, crate::OCCLUDED, 0, SOLVED]);
            let xs: Vec<f64> = captured.frame.positions.iter().map(|p| p.x).collect();
            assert_eq!(xs, [1.0, 0.0, 7.0, 4.0]);
            let captured = decode(&frame(version), version, 0.0, &models).unwrap();
            assert_eq!(captured.frame.time, 1.25, "by the server's seconds");
        }
    }

    #[test]
    fn a_count_that_lies_is_told_where_it_stands() {
        let version = Version(3, 1);
        let models = Models::decode(&models(version), version).unwrap();
        let mut bytes = frame(version);
        bytes[4..8].fill(0xFF);
        let garbled = decode(&bytes, version, 0.0, &models).unwrap_err();
        assert!(garbled.at > 4, "{garbled}");
        let mut bytes = vec![0xFF; 4];
        bytes.extend([0; 12]);
        assert!(Models::decode(&bytes, version).is_err());
    }

    proptest! {
        #[test]
        fn no_packet_is_read_beyond_its_end(
            which in 0..VERSIONS.len(),
            cut in 0_usize..300,
            flips in prop::collection::vec((0_usize..300, any::<u8>()), 0..8),
        ) {
            let version = VERSIONS[which];
            let known = Models::decode(&models(version), version).unwrap();
            for (packet, is_frame) in [(frame(version), true), (models(version), false)] {
                let mut packet = packet;
                for (at, value) in &flips {
                    let at = at % packet.len();
                    packet[at] = *value;
                }
                packet.truncate(packet.len().saturating_sub(cut));
                match is_frame {
                    true => if let Ok(captured) = decode(&packet, version, 1e7, &known) {
                        prop_assert!(captured.frame.positions.iter().flatten().all(|x| x.is_finite()));
                    },
                    false => drop(Models::decode(&packet, version)),
                }
            }
        }
    }
}
