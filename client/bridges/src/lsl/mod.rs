//! The Lab Streaming Layer: streams of numbers that announce themselves on the network.
//!
//! Its wire protocol (1.10, spoken by liblsl since 2012) is small: a stream is found by a query in XPath over UDP,
//! describes itself in XML, tells its clock by UDP, and sends its samples over TCP. It is spoken here by hand: the crate
//! of that name builds the whole C++ library. Only numbers are read, in little-endian order.
//!
//! Points are what the channels name, by the convention for motion capture (`marker` and `type` of a channel) or by the
//! ends of their labels (`LKNE_X`). NaN, and a confidence of 0, are not seen.

mod info;
mod sample;

use std::{
    convert::Infallible,
    io,
    net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4},
};

use tokio::{
    io::{AsyncBufReadExt as _, AsyncReadExt as _, AsyncWriteExt as _, BufReader},
    net::{TcpStream, UdpSocket},
    sync::mpsc,
    time::{Duration, Instant, interval, timeout},
};

use self::{
    info::{Info, Markers},
    sample::{PATTERNS, Unread},
};
use crate::{BridgeError, Clock, Layout, Local, PeerClock, Source, Update};

/// Where streams of a network listen to queries.
const MULTICAST: u16 = 16_571;
const GROUPS: [Ipv4Addr; 3] = [
    Ipv4Addr::new(224, 0, 0, 183),
    Ipv4Addr::new(239, 255, 172, 215),
    Ipv4Addr::BROADCAST,
];
/// Where streams of one machine listen.
const PORTS: std::ops::Range<u16> = 16_572..16_604;
/// How often a stream that was not found is asked for.
const ASK: Duration = Duration::from_millis(500);
/// A search this long is worth a word.
const SILENCE: Duration = Duration::from_secs(2);
/// How long a connection, or an answer on it, may take.
const PATIENCE: Duration = Duration::from_secs(5);
/// Pings that make a clock known: quick ones first.
const QUICK: u32 = 8;
const QUICK_PERIOD: Duration = Duration::from_millis(20);
const PERIOD: Duration = Duration::from_millis(500);
/// The largest description and header that are read, bytes.
const DESCRIPTION: u64 = 4 << 20;
const HEADER: u64 = 16 << 10;

/// Which stream.
#[derive(Clone, Debug)]
pub struct Query {
    /// What LSL calls it by: an XPath predicate over its description, such as `name='Stage'` or `type='MoCap'`.
    pub predicate: String,
    /// A machine to ask beside this one and the local network.
    pub peer: Option<Ipv4Addr>,
}

/// Looks for a stream and follows it.
///
/// # Errors
/// [`BridgeError::Network`] where there is no socket.
pub async fn find(query: Query) -> Result<Source, BridgeError> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).await?;
    socket.set_broadcast(true)?;
    Ok(Source::spawn(move |updates| async move {
        let inlet = Inlet {
            query,
            socket,
            updates,
            begun: Local::begin(),
        };
        match inlet.run().await {
            Ok(never) => match never {},
            Err(error) => error,
        }
    }))
}

struct Inlet {
    query: Query,
    socket: UdpSocket,
    updates: mpsc::Sender<Update>,
    begun: Local,
}

/// What ends a stream.
enum Ended {
    /// It may come back.
    Lost(io::Error),
    /// It is of no use.
    Useless(BridgeError),
}

impl From<io::Error> for Ended {
    fn from(error: io::Error) -> Self {
        Self::Lost(error)
    }
}

impl From<BridgeError> for Ended {
    fn from(error: BridgeError) -> Self {
        Self::Useless(error)
    }
}

fn broken(problem: &str) -> Ended {
    Ended::Lost(io::Error::new(io::ErrorKind::InvalidData, problem))
}

/// The outcome of something that may take no longer than is bearable.
async fn soon<T>(work: impl Future<Output = io::Result<T>>) -> io::Result<T> {
    timeout(PATIENCE, work)
        .await
        .unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()))
}

impl Inlet {
    async fn run(&self) -> Result<Infallible, BridgeError> {
        for search in 0_u64.. {
            let (info, address) = self.resolve(search).await?;
            match self.follow(&info, address).await {
                Ok(never) => match never {},
                Err(Ended::Useless(error)) => return Err(error),
                Err(Ended::Lost(error)) => {
                    let text = format!("stream `{}` is lost ({error}); looking for it", info.name);
                    self.say(Update::Note(text)).await?;
                    tokio::time::sleep(ASK).await;
                }
            }
        }
        Err(BridgeError::Abandoned)
    }

    async fn say(&self, update: Update) -> Result<(), BridgeError> {
        let said = self.updates.send(update).await;
        said.map_err(|_| BridgeError::Abandoned)
    }

    /// Asks until a stream answers. A network that cannot be asked is passed over.
    ///
    /// * `search` - tells its answers from those that come late to the one before.
    async fn resolve(&self, search: u64) -> Result<(Info, IpAddr), BridgeError> {
        let Query { predicate, peer } = &self.query;
        let port = self.socket.local_addr()?.port();
        let search = search.to_string();
        let question = format!("LSL:shortinfo\r\n{predicate}\r\n{port} {search}\r\n");
        let mut asked = interval(ASK);
        let patience = tokio::time::sleep(SILENCE);
        tokio::pin!(patience);
        let mut told = false;
        let mut packet = vec![0; 65_536];
        loop {
            tokio::select! {
                _ = asked.tick() => {
                    let machines = [Some(Ipv4Addr::LOCALHOST), *peer].into_iter().flatten();
                    let of_machines = machines.flat_map(|machine| PORTS.map(move |port| (machine, port)));
                    for address in of_machines.chain(GROUPS.map(|group| (group, MULTICAST))) {
                        self.socket.send_to(question.as_bytes(), address).await.ok();
                    }
                }
                () = &mut patience, if !told => {
                    told = true;
                    let text = format!("no stream of LSL answers to {predicate}; waiting");
                    self.say(Update::Note(text)).await?;
                }
                Ok((length, from)) = self.socket.recv_from(&mut packet) => {
                    let answer = String::from_utf8_lossy(&packet[..length]);
                    let found = answer.split_once('\n').filter(|(id, _)| id.trim() == search);
                    if let Some(info) = found.and_then(|(_, xml)| Info::read(xml.trim())) {
                        return Ok((info, from.ip()));
                    }
                }
            }
        }
    }

    async fn follow(&self, info: &Info, address: IpAddr) -> Result<Infallible, Ended> {
        let data = SocketAddr::new(address, info.data_port);
        let markers = describe(data, info.channels).await?;
        let IpAddr::V4(host) = address else {
            return Err(broken("it has no IPv4 address"));
        };
        let pings = Pings::open(self.begun, SocketAddrV4::new(host, info.service_port)).await?;
        let pinging = async {
            let failure: Result<Infallible, io::Error> = pings.run().await;
            Ended::from(match failure {
                Ok(never) => match never {},
                Err(error) => error,
            })
        };
        tokio::select! {
            ended = pinging => Err(ended),
            ended = self.feed(info, data, &markers, &pings.clock) => ended,
        }
    }

    /// Reads samples until the stream ends.
    async fn feed(
        &self,
        info: &Info,
        address: SocketAddr,
        markers: &Markers,
        clock: &PeerClock,
    ) -> Result<Infallible, Ended> {
        let until = Instant::now() + QUICK * 2 * QUICK_PERIOD;
        tokio::time::sleep_until(until).await; // so that the clock is known as well as it can be at once
        // Only then: what is sent meanwhile would all come late, at once.
        let mut stream = soon(subscribe(info, address)).await?;
        let mut layout = Some(Layout {
            labels: markers.labels.clone(),
            rate_hz: info.rate_hz,
            unit_metres: markers.unit_metres,
            axes: None,
            clock: match clock.is_known() {
                true => Clock::Readable(clock.clone()),
                false => Clock::Foreign,
            },
            source: format!("LSL stream `{}` of {}", info.name, info.hostname),
        });
        let (mut bytes, mut patterns) = (Vec::new(), PATTERNS.into_iter());
        let mut last = f64::NEG_INFINITY;
        loop {
            let mut read = 0;
            loop {
                let (sample, length) =
                    match sample::read(&bytes[read..], info.format, info.channels) {
                        Ok(sample) => sample,
                        Err(Unread::Partial) => break,
                        Err(Unread::Tag(tag)) => {
                            return Err(broken(&format!("a sample begins with {tag}")));
                        }
                    };
                read += length;
                if let Some(pattern) = patterns.next() {
                    if !sample.is_pattern(pattern) {
                        return Err(broken("its first samples are not the test patterns"));
                    }
                    continue;
                }
                if let Some(layout) = layout.take() {
                    self.say(Update::Layout(layout)).await?;
                }
                let period = info.rate_hz.map_or(0.0, f64::recip);
                let time = sample.time.unwrap_or(last + period);
                if time.is_finite() && time > last {
                    last = time;
                    self.say(Update::Frame(sample.frame(time, markers))).await?;
                }
            }
            bytes.drain(..read);
            if stream.read_buf(&mut bytes).await? == 0 {
                return Err(broken("it closed the connection"));
            }
        }
    }
}

/// Asks a stream for its full description.
async fn describe(address: SocketAddr, channels: usize) -> Result<Markers, Ended> {
    let text = soon(async {
        let mut stream = TcpStream::connect(address).await?;
        stream.write_all(b"LSL:fullinfo\r\n").await?;
        let mut text = String::new();
        stream.take(DESCRIPTION).read_to_string(&mut text).await?;
        Ok(text)
    });
    Ok(Markers::read(text.await?.trim(), channels)?)
}

/// Asks for samples, and reads what comes before them.
async fn subscribe(info: &Info, address: SocketAddr) -> io::Result<BufReader<TcpStream>> {
    let mut stream = TcpStream::connect(address).await?;
    stream.set_nodelay(true)?;
    let wanted = format!(
        "LSL:streamfeed/110 {}\r\nNative-Byte-Order: 1234\r\nEndian-Performance: 0\r\nHas-IEEE754-Floats: 1\r\n\
         Supports-Subnormals: 1\r\nValue-Size: {}\r\nData-Protocol-Version: 110\r\nMax-Buffer-Length: 360\r\n\
         Max-Chunk-Length: 1\r\n\r\n",
        info.uid,
        info.format.bytes(),
    );
    stream.write_all(wanted.as_bytes()).await?;
    let mut stream = BufReader::new(stream);
    let invalid = |problem: String| io::Error::new(io::ErrorKind::InvalidData, problem);
    let status = line(&mut stream).await?;
    if status.split_whitespace().nth(1) != Some("200") {
        return Err(invalid(format!("it answers `{}`", status.trim())));
    }
    loop {
        let header = line(&mut stream).await?;
        let header = header.trim().to_ascii_lowercase();
        if header.is_empty() {
            return Ok(stream);
        }
        match header
            .split_once(':')
            .map(|(name, value)| (name.trim(), value.trim()))
        {
            Some(("byte-order", order)) if order != "1234" && info.format.bytes() > 1 => {
                return Err(invalid(format!("it sends in byte order {order}")));
            }
            Some(("data-protocol-version", version)) if version != "110" => {
                return Err(invalid(format!(
                    "it speaks version {version} of the protocol"
                )));
            }
            Some(_) | None => {}
        }
    }
}

async fn line(stream: &mut BufReader<TcpStream>) -> io::Result<String> {
    let mut line = String::new();
    stream.take(HEADER).read_line(&mut line).await?;
    match line.ends_with('\n') {
        true => Ok(line),
        false => Err(io::ErrorKind::UnexpectedEof.into()),
    }
}

/// Asks for a stream's clock.
struct Pings {
    socket: UdpSocket,
    local: Local,
    clock: PeerClock,
}

impl Pings {
    async fn open(local: Local, service: SocketAddrV4) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).await?;
        socket.connect(service).await?;
        Ok(Self {
            socket,
            local,
            clock: PeerClock::unknown(local),
        })
    }

    async fn run(&self) -> io::Result<Infallible> {
        let mut next = Instant::now();
        let mut sent = 0_u32;
        let mut packet = [0; 512];
        loop {
            tokio::select! {
                () = tokio::time::sleep_until(next) => {
                    sent = sent.saturating_add(1);
                    next += if sent <= QUICK { QUICK_PERIOD } else { PERIOD };
                    let ping = format!("LSL:timedata\r\n{sent} {:.9}\r\n", self.local.now());
                    self.socket.send(ping.as_bytes()).await.ok(); // the samples tell whether it is gone
                }
                Ok(length) = self.socket.recv(&mut packet) => {
                    let returned = self.local.now();
                    let answer = String::from_utf8_lossy(&packet[..length]);
                    let numbers: Vec<f64> = answer.split_whitespace().filter_map(|word| word.parse().ok()).collect();
                    if let [_, asked, received, answered] = numbers[..]
                        && numbers.iter().all(|number| number.is_finite())
                        && asked <= returned
                    {
                        self.clock.exchange(asked, received, answered, returned);
                    }
                }
            }
        }
    }
}
