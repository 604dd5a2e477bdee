//! The VMC protocol: avatars' bones and trackers by OSC over UDP, as VirtualMotionCapture, VSeeFace, Waidayo,
//! MocapForAll and others send it.
//!
//! Points are the root, the bones and the trackers, under the names that they are sent by. A bone's pose is told in its
//! parent's; here it is where that puts it in the world. Lengths are metres, axes y up and left-handed.
//!
//! Specification: <https://protocol.vmc.info/english>.

mod assembly;
mod message;
mod skeleton;

use std::net::SocketAddr;

use tokio::{
    net::UdpSocket,
    sync::mpsc,
    time::{Duration, timeout},
};

use self::assembly::{Assembled, Assembly, Timing};
use crate::{Axes, BridgeError, Clock, Layout, Local, PeerClock, Source, Update};

/// A sender this silent is worth a word.
const SILENCE: Duration = Duration::from_secs(2);
/// The largest datagram, bytes.
const DATAGRAM: usize = 65_536;

/// Listens for senders at an address of this machine.
///
/// # Errors
/// [`BridgeError::Listen`].
pub async fn listen(address: SocketAddr) -> Result<Source, BridgeError> {
    let socket = UdpSocket::bind(address)
        .await
        .map_err(|source| BridgeError::Listen { address, source })?;
    Ok(Source::spawn(move |updates| run(socket, updates)))
}

async fn run(socket: UdpSocket, updates: mpsc::Sender<Update>) -> BridgeError {
    match hear(&socket, &updates).await {
        Ok(never) => match never {},
        Err(error) => error,
    }
}

async fn hear(
    socket: &UdpSocket,
    updates: &mpsc::Sender<Update>,
) -> Result<std::convert::Infallible, BridgeError> {
    let say = async |update| {
        updates
            .send(update)
            .await
            .map_err(|_| BridgeError::Abandoned)
    };
    let local = Local::begin();
    let mut assembly = Assembly::new();
    let mut packet = vec![0; DATAGRAM];
    let (mut silent, mut garbled) = (false, 0_u64);
    loop {
        let (length, peer) = match timeout(SILENCE, socket.recv_from(&mut packet)).await {
            Ok(received) => received?,
            Err(_) => {
                if !std::mem::replace(&mut silent, true) {
                    let address = socket.local_addr()?;
                    say(Update::Note(format!("nothing comes at {address}; waiting"))).await?;
                }
                continue;
            }
        };
        if std::mem::take(&mut silent) {
            say(Update::Note(format!("{peer} sends"))).await?;
        }
        let Some(said) = message::decode(&packet[..length]) else {
            garbled += 1;
            if garbled == 1 {
                say(Update::Note(format!(
                    "{peer} sends what is no message of VMC; passed over"
                )))
                .await?;
            }
            continue;
        };
        for assembled in assembly.take(said, local.now()) {
            say(match assembled {
                Assembled::Frame(frame) => Update::Frame(frame),
                Assembled::Layout(labels, timing) => Update::Layout(Layout {
                    labels,
                    rate_hz: None,
                    unit_metres: 1.0,
                    axes: Some(Axes::YUpLeft),
                    clock: match timing {
                        Timing::Arrival => Clock::Readable(PeerClock::own(local)),
                        Timing::Sender => Clock::Foreign,
                    },
                    source: format!("VMC from {peer}"),
                }),
            })
            .await?;
        }
    }
}
