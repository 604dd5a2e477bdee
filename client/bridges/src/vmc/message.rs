//! Messages of the VMC protocol.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use rosc::{OscMessage, OscPacket, OscType};

/// What a message says of motion.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Said {
    /// The pose of a bone in its parent's, or of the root or a tracker in the world.
    Pose { label: String, pose: Isometry3<f64> },
    /// The sender's clock, s.
    Time(f64),
    /// Whether it tracks anything.
    Tracking(bool),
}

/// What a packet says, in its order; faces, cameras, lights and keys are passed over. `None` where it is no OSC, or a
/// message has not the arguments of its address.
pub(super) fn decode(packet: &[u8]) -> Option<Vec<Said>> {
    let (rest, packet) = rosc::decoder::decode_udp(packet).ok()?;
    let mut said = Vec::new();
    let whole = rest.is_empty() && collect(packet, &mut said).is_some();
    whole.then_some(said)
}

fn collect(packet: OscPacket, said: &mut Vec<Said>) -> Option<()> {
    match packet {
        OscPacket::Bundle(bundle) => bundle
            .content
            .into_iter()
            .try_for_each(|packet| collect(packet, said)),
        OscPacket::Message(message) => {
            said.extend(read(message)?);
            Some(())
        }
    }
}

fn read(OscMessage { addr, args }: OscMessage) -> Option<Option<Said>> {
    let said = match addr.as_str() {
        "/VMC/Ext/Root/Pos" | "/VMC/Ext/Bone/Pos" | "/VMC/Ext/Hmd/Pos" | "/VMC/Ext/Con/Pos"
        | "/VMC/Ext/Tra/Pos" => Said::Pose {
            label: args.first()?.clone().string()?,
            pose: pose(args.get(1..8)?)?,
        },
        "/VMC/Ext/T" => Said::Time(number(args.first()?)?),
        // loaded, calibration state, calibration mode, tracking status; older senders send less.
        "/VMC/Ext/OK" => {
            let is_one = |index: usize| {
                args.get(index)
                    .is_none_or(|value| number(value) != Some(0.0))
            };
            Said::Tracking(is_one(0) && is_one(3))
        }
        _ => return Some(None),
    };
    Some(Some(said))
}

fn number(value: &OscType) -> Option<f64> {
    match value {
        OscType::Float(value) => Some(f64::from(*value)),
        OscType::Double(value) => Some(*value),
        OscType::Int(value) => Some(f64::from(*value)),
        OscType::Bool(value) => Some(f64::from(u8::from(*value))),
        OscType::String(_)
        | OscType::Blob(_)
        | OscType::Time(_)
        | OscType::Long(_)
        | OscType::Char(_)
        | OscType::Color(_)
        | OscType::Midi(_)
        | OscType::Array(_)
        | OscType::Nil
        | OscType::Inf => None,
    }
}

/// Position x y z, rotation x y z w.
fn pose(args: &[OscType]) -> Option<Isometry3<f64>> {
    let mut values = [0.0; 7];
    for (value, arg) in values.iter_mut().zip(args) {
        *value = number(arg)?;
    }
    let [x, y, z, i, j, k, w] = values;
    // A rotation of zeros is none: the pose is then not finite, and what hangs on it is not seen.
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k));
    Some(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rosc::{OscBundle, OscTime, encoder::encode};

    use super::*;

    fn message(addr: &str, args: Vec<OscType>) -> OscPacket {
        let addr = addr.to_owned();
        OscPacket::Message(OscMessage { addr, args })
    }

    fn pose_args(name: &str) -> Vec<OscType> {
        let numbers = [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 2.0].map(OscType::Float);
        [OscType::String(name.to_owned())]
            .into_iter()
            .chain(numbers)
            .collect()
    }

    /// A bundle in a bundle, with what is of no matter here.
    fn packet() -> Vec<u8> {
        let bundle = |content| {
            let timetag = OscTime::from((0, 1));
            OscPacket::Bundle(OscBundle { timetag, content })
        };
        encode(&bundle(vec![
            message(
                "/VMC/Ext/OK",
                vec![
                    OscType::Int(1),
                    OscType::Int(3),
                    OscType::Int(0),
                    OscType::Int(0),
                ],
            ),
            bundle(vec![
                message("/VMC/Ext/T", vec![OscType::Float(1.5)]),
                message("/VMC/Ext/Blend/Apply", vec![]),
            ]),
            message("/VMC/Ext/Root/Pos", pose_args("root")),
        ]))
        .unwrap()
    }

    #[test]
    fn a_packet_is_read_in_its_order() {
        let pose = Isometry3::translation(1.0, 2.0, 3.0);
        let label = "root".to_owned();
        let expected = [
            Said::Tracking(false),
            Said::Time(1.5),
            Said::Pose { label, pose },
        ];
        assert_eq!(decode(&packet()).unwrap(), expected);
    }

    #[test]
    fn a_message_without_its_arguments_spoils_its_packet() {
        for args in [
            vec![],
            pose_args("Hips")[..7].to_vec(),
            pose_args("Hips")[1..].to_vec(),
        ] {
            let packet = encode(&message("/VMC/Ext/Bone/Pos", args)).unwrap();
            assert_eq!(decode(&packet), None);
        }
    }

    proptest! {
        #[test]
        fn no_packet_is_read_beyond_its_end(
            cut in 0_usize..200,
            flips in prop::collection::vec((0_usize..200, any::<u8>()), 0..8),
        ) {
            let mut packet = packet();
            for (at, value) in flips {
                let at = at % packet.len();
                packet[at] = value;
            }
            packet.truncate(packet.len().saturating_sub(cut));
            decode(&packet); // any answer will do
        }
    }
}
