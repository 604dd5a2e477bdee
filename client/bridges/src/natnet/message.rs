//! Messages between a NatNet client and its server.

use std::net::Ipv4Addr;

use crate::{Garbled, cursor::Cursor};

/// What a message is; its number comes first, then its payload's length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub(super) enum Kind {
    Connect = 0,
    ServerInfo = 1,
    Request = 2,
    Response = 3,
    RequestModels = 4,
    Models = 5,
    Frame = 7,
    KeepAlive = 10,
    EchoRequest = 12,
    EchoResponse = 13,
}

const HEARD: [Kind; 5] = [
    Kind::ServerInfo,
    Kind::Response,
    Kind::Models,
    Kind::Frame,
    Kind::EchoResponse,
];

/// A message of a client.
pub(super) fn message(kind: Kind, payload: &[u8]) -> Vec<u8> {
    let length = u16::try_from(payload.len()).expect("a client's messages are short");
    let mut message = (kind as u16).to_le_bytes().to_vec();
    message.extend(length.to_le_bytes());
    message.extend(payload);
    message
}

/// What kind of message a packet is, and its payload; `None` where it is of no matter here.
pub(super) fn open(packet: &[u8]) -> Option<(Kind, &[u8])> {
    let mut cursor = Cursor::new(packet);
    let number = cursor.u16("the message's number").ok()?;
    cursor.u16("the payload's length").ok()?; // the datagram's own is right also where this one overflows
    let kind = HEARD.into_iter().find(|kind| *kind as u16 == number)?;
    Some((kind, &packet[4..]))
}

/// The version of the protocol: major, minor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Version(pub(super) u8, pub(super) u8);

/// Who serves.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Server {
    pub(super) name: String,
    pub(super) version: Version,
    /// Ticks per second of the clock that stamps frames, Hz.
    pub(super) clock_hz: f64,
    /// Where frames go, unless to each client.
    pub(super) multicast: Option<(Ipv4Addr, u16)>,
}

impl Server {
    pub(super) fn decode(payload: &[u8]) -> Result<Self, Garbled> {
        let mut cursor = Cursor::new(payload);
        let name = cursor.bytes(256, "the server's name")?;
        let name = name.split(|byte| *byte == 0).next().unwrap_or_default();
        cursor.u32("the server's version")?;
        let version = cursor.bytes(4, "the protocol's version")?;
        let version = Version(version[0], version[1]);
        let mut server = Self {
            name: String::from_utf8_lossy(name).into_owned(),
            version,
            clock_hz: 0.0,
            multicast: None,
        };
        if version.0 >= 3 {
            let hz = cursor.u64("the clock's frequency")?;
            #[expect(
                clippy::cast_precision_loss,
                reason = "clocks tick far less than 2^53 times a second"
            )]
            let hz = hz as f64;
            let port = cursor.u16("the data port")?;
            let multicast = cursor.bytes(1, "whether it is multicast")? != [0];
            let [a, b, c, d] = *cursor.bytes(4, "the multicast group")? else {
                unreachable!("4 bytes were taken");
            };
            let group = Ipv4Addr::new(a, b, c, d);
            server.clock_hz = hz;
            server.multicast = (multicast && group.is_multicast()).then_some((group, port));
        }
        Ok(server)
    }
}

/// The answer to an echo: what was asked, in our units, and what the server's clock showed, in its ticks.
pub(super) fn echo(payload: &[u8]) -> Result<(u64, u64), Garbled> {
    let mut cursor = Cursor::new(payload);
    Ok((
        cursor.u64("the echoed time")?,
        cursor.u64("the server's time")?,
    ))
}

/// The answer to `FrameRate`, Hz. Answers to commands are text or binary32.
pub(super) fn rate(payload: &[u8]) -> Option<f64> {
    let rate = f64::from(Cursor::new(payload).f32("the rate").ok()?);
    (payload.len() == 4 && rate.is_normal() && rate > 0.0).then_some(rate)
}
