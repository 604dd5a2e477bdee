//! NatNet 3 and 4, OptiTrack Motive's stream, read from its packets.
//!
//! Points are the markers of models and sets (`Set:Marker`), rigid bodies by their names and bones (`Skeleton:Bone`).
//! Markers that the server flags as occluded and rigid bodies that it does not track are not seen; unlabelled markers are
//! passed over. Lengths are metres, axes y up and right-handed unless the server is set otherwise. Frames are timed by
//! the middle of the cameras' exposure on the server's clock, which echoes tell, where it answers them.
//!
//! Format: "NatNet: Direct Depacketization Sample" of the SDK's public documentation, as far as it is common to 3.0 – 4.3.

mod frame;
mod message;
mod models;

use std::{
    convert::Infallible,
    net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4},
};

use socket2::{Domain, Protocol, Socket, Type};
use tokio::{
    net::UdpSocket,
    sync::mpsc,
    time::{Duration, Instant, interval, sleep_until},
};

use self::{
    frame::decode,
    message::{Kind, Server, Version, echo, message, open, rate},
    models::Models,
};
use crate::{Axes, BridgeError, Clock, Garbled, Layout, Local, PeerClock, Source, Update};

/// Where servers listen to commands.
pub const COMMAND_PORT: u16 = 1510;
/// How often a server that has not answered is asked.
const ASK: Duration = Duration::from_millis(250);
/// How often a server is told that we are here, and asked for its time.
const KEEP: Duration = Duration::from_millis(500);
/// A server this silent is asked anew.
const SILENCE: Duration = Duration::from_secs(2);
/// For how long echoes and the rate are waited for, before it goes on without.
const PATIENCE: Duration = Duration::from_millis(600);
/// Echoes that make a clock known.
const ECHOES: u32 = 5;
/// A clock that goes back by more was started again, s.
const RESTART: f64 = 1.0;
/// The largest datagram, bytes.
const DATAGRAM: usize = 65_536;

/// Speaks to a server.
///
/// * `local` - the address of this machine that it sends to.
///
/// # Errors
/// [`BridgeError::Listen`].
pub async fn connect(server: SocketAddrV4, local: Ipv4Addr) -> Result<Source, BridgeError> {
    let address = SocketAddr::from((local, 0));
    let socket = UdpSocket::bind(address)
        .await
        .map_err(|source| BridgeError::Listen { address, source })?;
    Ok(Source::spawn(move |updates| async move {
        let mut session = Session {
            server: server.into(),
            local,
            commands: socket,
            updates,
            begun: Local::begin(),
        };
        match session.run().await {
            Ok(never) => match never {},
            Err(error) => error,
        }
    }))
}

struct Session {
    server: SocketAddr,
    local: Ipv4Addr,
    commands: UdpSocket,
    updates: mpsc::Sender<Update>,
    begun: Local,
}

/// What a server has told of itself so far.
struct Peer {
    info: Server,
    data: Option<UdpSocket>,
    models: Option<Models>,
    rate: Option<f64>,
    /// They are said to be others now.
    stale: bool,
    begun: Local,
    clock: PeerClock,
    echoes: u32,
    /// The last frame's, s.
    last: f64,
    garbled: u64,
}

impl Session {
    async fn run(&mut self) -> Result<Infallible, BridgeError> {
        loop {
            let info = self.greet().await?;
            let peer = Peer {
                data: info.multicast.map(|group| self.join(group)).transpose()?,
                info,
                models: None,
                rate: None,
                stale: false,
                begun: self.begun,
                clock: PeerClock::unknown(self.begun),
                echoes: 0,
                last: f64::NEG_INFINITY,
                garbled: 0,
            };
            self.follow(peer).await?;
        }
    }

    async fn say(&self, update: Update) -> Result<(), BridgeError> {
        let said = self.updates.send(update).await;
        said.map_err(|_| BridgeError::Abandoned)
    }

    /// Sends a command. That nobody is there shows in the answers.
    async fn ask(&self, kind: Kind, payload: &[u8]) {
        self.commands
            .send_to(&message(kind, payload), self.server)
            .await
            .ok();
    }

    /// Asks until a server answers who it is.
    async fn greet(&self) -> Result<Server, BridgeError> {
        let mut packet = vec![0; DATAGRAM];
        let mut asked = interval(ASK);
        let mut patience = Some(Instant::now() + SILENCE);
        loop {
            tokio::select! {
                _ = asked.tick() => self.ask(Kind::Connect, b"Ping\0").await,
                () = until(patience) => {
                    patience = None;
                    let text = format!("no NatNet server answers at {}; waiting", self.server);
                    self.say(Update::Note(text)).await?;
                }
                // A port where nobody listens is told as an error: it is asked again.
                Ok((length, _)) = self.commands.recv_from(&mut packet) => {
                    if let Some((Kind::ServerInfo, payload)) = open(&packet[..length]) {
                        let what = "the server's description of itself";
                        let info = Server::decode(payload);
                        let info = info.map_err(|problem| BridgeError::Garbled { what, problem })?;
                        let Version(major, minor) = info.version;
                        return match major {
                            3 | 4 => Ok(info),
                            _ => Err(BridgeError::Version { major, minor }),
                        };
                    }
                }
            }
        }
    }

    fn join(&self, (group, port): (Ipv4Addr, u16)) -> Result<UdpSocket, BridgeError> {
        let joined = || {
            let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
            socket.set_reuse_address(true)?; // other clients on this machine hear the same group
            socket.set_nonblocking(true)?;
            socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, port)).into())?;
            socket.join_multicast_v4(&group, &self.local)?;
            UdpSocket::from_std(socket.into())
        };
        joined().map_err(|source| BridgeError::Join { group, source })
    }

    /// Hears a server until it falls silent.
    async fn follow(&self, mut peer: Peer) -> Result<(), BridgeError> {
        let (mut answer, mut data) = (vec![0; DATAGRAM], vec![0; DATAGRAM]);
        let mut keep = interval(KEEP);
        let mut ask = interval(ASK / 5);
        let (mut heard, mut patience) = (Instant::now(), None);
        let mut told = false;
        loop {
            let received = tokio::select! {
                _ = keep.tick() => {
                    self.ask(Kind::KeepAlive, &[]).await;
                    if peer.stale {
                        self.ask(Kind::RequestModels, &[]).await;
                    }
                    self.echo().await;
                    continue;
                }
                _ = ask.tick(), if !told => {
                    match &peer.models {
                        None => self.ask(Kind::RequestModels, &[]).await,
                        Some(_) => {
                            patience.get_or_insert_with(|| Instant::now() + PATIENCE);
                            self.ask(Kind::Request, b"FrameRate\0").await;
                            self.echo().await;
                        }
                    }
                    let known = peer.echoes >= ECHOES && peer.rate.is_some();
                    if peer.models.is_some() && (known || patience.is_some_and(|end| end < Instant::now())) {
                        told = true;
                        self.say(Update::Layout(peer.layout(self.server))).await?;
                    }
                    continue;
                }
                () = sleep_until(heard + SILENCE) => {
                    let text = format!("{} at {} is silent; waiting", peer.info.name, self.server);
                    return self.say(Update::Note(text)).await;
                }
                Ok((length, from)) = self.commands.recv_from(&mut answer) => {
                    if from.ip() != self.server.ip() {
                        continue;
                    }
                    &answer[..length]
                }
                Ok((length, _)) = hear(peer.data.as_ref(), &mut data) => &data[..length],
            };
            let now = self.begun.now();
            let Some((kind, payload)) = open(received) else {
                continue;
            };
            heard = Instant::now();
            match peer.take(kind, payload, now, told) {
                Ok(Taken::Nothing) => {}
                Ok(Taken::Frame(frame)) => self.say(Update::Frame(frame)).await?,
                Ok(Taken::Changed) => (told, patience) = (false, None),
                Err(problem) => {
                    peer.garbled += 1;
                    if peer.garbled == 1 {
                        let text = format!(
                            "{} sends what cannot be read: {problem}; passed over",
                            self.server
                        );
                        self.say(Update::Note(text)).await?;
                    }
                }
            }
        }
    }

    /// Asks what the server's clock shows.
    async fn echo(&self) {
        self.ask(Kind::EchoRequest, &self.begun.now().to_bits().to_le_bytes())
            .await;
    }
}

async fn until(moment: Option<Instant>) {
    match moment {
        Some(moment) => sleep_until(moment).await,
        None => std::future::pending().await,
    }
}

async fn hear(
    socket: Option<&UdpSocket>,
    packet: &mut [u8],
) -> std::io::Result<(usize, SocketAddr)> {
    match socket {
        Some(socket) => socket.recv_from(packet).await,
        None => std::future::pending().await,
    }
}

/// What became of a message.
enum Taken {
    Nothing,
    Frame(crate::Frame),
    /// The layout is to be told again.
    Changed,
}

impl Peer {
    fn take(&mut self, kind: Kind, payload: &[u8], now: f64, told: bool) -> Result<Taken, Garbled> {
        match kind {
            Kind::Models => {
                let models = Models::decode(payload, self.info.version)?;
                let same = self.models.as_ref() == Some(&models);
                self.stale = false;
                self.models = Some(models);
                return Ok(match same {
                    true => Taken::Nothing,
                    false => Taken::Changed,
                });
            }
            Kind::Response => self.rate = rate(payload).or(self.rate),
            Kind::EchoResponse => {
                let (asked, shown) = echo(payload)?;
                let asked = f64::from_bits(asked);
                #[expect(
                    clippy::cast_precision_loss,
                    reason = "2^53 ticks of 10 MHz are 28 years"
                )]
                let shown = shown as f64 / self.info.clock_hz;
                if asked.is_finite() && asked <= now && shown.is_finite() {
                    self.clock.exchange(asked, shown, shown, now);
                    self.echoes += 1;
                }
            }
            Kind::Frame => return self.frame(payload, told),
            Kind::Connect
            | Kind::ServerInfo
            | Kind::Request
            | Kind::RequestModels
            | Kind::KeepAlive
            | Kind::EchoRequest => {}
        }
        Ok(Taken::Nothing)
    }

    fn frame(&mut self, payload: &[u8], told: bool) -> Result<Taken, Garbled> {
        let (Some(models), true) = (&self.models, told) else {
            return Ok(Taken::Nothing);
        };
        let captured = decode(payload, self.info.version, self.info.clock_hz, models)?;
        let time = captured.frame.time;
        self.stale |= captured.models_changed;
        if time < self.last - RESTART {
            self.models = None;
            self.clock = PeerClock::unknown(self.begun);
            self.echoes = 0;
            self.last = f64::NEG_INFINITY;
            return Ok(Taken::Changed);
        }
        if time <= self.last || !time.is_finite() {
            return Ok(Taken::Nothing); // it came before
        }
        self.last = time;
        Ok(Taken::Frame(captured.frame))
    }

    fn layout(&self, server: SocketAddr) -> Layout {
        let Version(major, minor) = self.info.version;
        Layout {
            labels: self
                .models
                .as_ref()
                .map(|models| models.labels.clone())
                .unwrap_or_default(),
            rate_hz: self.rate,
            unit_metres: 1.0,
            axes: Some(Axes::YUpRight),
            clock: match self.clock.is_known() {
                true => Clock::Readable(self.clock.clone()),
                false => Clock::Foreign,
            },
            source: format!("{} (NatNet {major}.{minor}) at {server}", self.info.name),
        }
    }
}

/// The address of this machine from which a server is reached.
///
/// # Errors
/// Where there is no way to it.
pub fn towards(server: SocketAddrV4) -> std::io::Result<Ipv4Addr> {
    let socket = std::net::UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    socket.connect(server)?;
    match socket.local_addr()?.ip() {
        IpAddr::V4(local) => Ok(local),
        IpAddr::V6(_) => Ok(Ipv4Addr::UNSPECIFIED),
    }
}
