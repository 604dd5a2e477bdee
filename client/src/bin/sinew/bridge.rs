//! `sinew bridge`: live motion capture of other programs to a session.

use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};

use clap::{Args, Subcommand, ValueEnum};
use sinew_client::{
    Relay, RelaySettings,
    bridges::{Source, lsl, natnet, vmc},
};
use sinew_proto::v1;

use crate::out::put;
use crate::{
    Failure,
    connection::{Connection, session_name},
    stream,
};

/// Hands on live motion capture of other programs to a session, until Ctrl-C.
///
/// The session's points are found among the source's by their labels; those that it does not send are occluded. A source
/// or a server that goes away and comes back is followed again.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew bridge osc --session stage                      VMC protocol, at UDP port 39539
  sinew bridge natnet 10.0.0.5 --session stage          OptiTrack Motive
  sinew bridge lsl Stage --session stage                a stream of the Lab Streaming Layer

`sinew bridge KIND --help` shows examples of each kind.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Subcommand)]
enum Kind {
    /// Bones and trackers of an avatar by the VMC protocol (OSC over UDP): VirtualMotionCapture, VSeeFace, Waidayo, …
    ///
    /// Labels: `root`, the bones' names in Unity (Hips, LeftHand, …), the trackers' serial numbers. Positions are in the
    /// world, in metres, y up and left-handed. Frames are timed by the sender's clock (/VMC/Ext/T) where it tells one.
    #[command(after_help = "Examples:
  sinew bridge osc --session stage
  sinew bridge osc --session stage --listen 0.0.0.0:39540
  sinew bridge osc --session stage --unit-metres 1.7      an avatar of unit height")]
    Osc {
        /// Where senders send to.
        #[arg(long, value_name = "ADDRESS:PORT", default_value = "0.0.0.0:39539")]
        listen: SocketAddr,
        #[command(flatten)]
        common: Common,
    },
    /// Markers, rigid bodies and bones of OptiTrack Motive by NatNet 3 and 4.
    ///
    /// Labels: `Set:Marker`, the rigid bodies' names, `Skeleton:Bone`; a scene may name markers without their set where
    /// that is unambiguous. Positions are in metres, y up and right-handed, as Motive streams by default. Frames are
    /// timed by the cameras' exposure.
    #[command(after_help = "Examples:
  sinew bridge natnet 10.0.0.5 --session stage
  sinew bridge natnet 10.0.0.5 --local 10.0.0.7 --session stage   of several networks, this one
  sinew bridge natnet 127.0.0.1 --session stage --axes z-up       Motive set to stream z up")]
    Natnet {
        /// Motive's machine, and where it listens to commands if not at 1510.
        #[arg(value_name = "ADDRESS[:PORT]", value_parser = natnet_server)]
        server_address: SocketAddrV4,
        /// The address of this machine on the same network. Without it: the one from which the server is reached.
        #[arg(long, value_name = "ADDRESS")]
        local: Option<Ipv4Addr>,
        #[command(flatten)]
        common: Common,
    },
    /// Markers of a stream of the Lab Streaming Layer.
    ///
    /// Labels: the `marker` of the channels whose `type` is PositionX, PositionY or PositionZ, or what comes before the
    /// end of their labels (LKNE_X, LKNE_Y, LKNE_Z); of a stream that describes no channels point_1, point_2, …. NaN and a
    /// `Confidence` of 0 are occlusion. Units are those of the channels, axes those of the scene unless --axes says
    /// otherwise. Frames are timed by the stream's clock.
    #[command(after_help = "Examples:
  sinew bridge lsl Stage --session stage
  sinew bridge lsl --query \"type='MoCap' and hostname='vicon'\" --session stage --axes z-up
  sinew bridge lsl Stage --peer 10.0.0.5 --session stage   a machine that multicast does not reach")]
    Lsl {
        /// The stream's name.
        #[arg(value_name = "NAME", required_unless_present = "query")]
        stream: Option<String>,
        /// What the stream is found by instead: an XPath predicate over its description.
        #[arg(long, value_name = "XPATH", conflicts_with = "stream")]
        query: Option<String>,
        /// A machine to ask beside this one and the local network.
        #[arg(long, value_name = "ADDRESS")]
        peer: Option<Ipv4Addr>,
        #[command(flatten)]
        common: Common,
    },
}

fn natnet_server(text: &str) -> Result<SocketAddrV4, String> {
    let address = text
        .parse()
        .map(|ip| SocketAddrV4::new(ip, natnet::COMMAND_PORT));
    address
        .or_else(|_| text.parse())
        .map_err(|_| "write an IPv4 address, such as 10.0.0.5 or 10.0.0.5:1510".to_owned())
}

/// Of every kind.
#[derive(Args)]
struct Common {
    /// The session. Whoever streams to it is taken over from.
    #[arg(long, value_name = "ID")]
    session: String,
    /// One frame, one step, as they come; without it steps follow the capture time.
    #[arg(long)]
    each: bool,
    /// The source's rate. Without it: as the source says, or as its first frames come.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Metres per unit of length. Without it: as the source says.
    #[arg(long, value_name = "METRES")]
    unit_metres: Option<f64>,
    /// The source's axes. Without it: as the source says, or the scene's.
    #[arg(long)]
    axes: Option<Axes>,
    #[command(flatten)]
    connection: Connection,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Axes {
    /// Those of the scene.
    Scene,
    /// z up, right-handed: Vicon, Qualisys, ROS.
    ZUp,
    /// y up, right-handed: Motive, OpenSim.
    YUp,
    /// z up, left-handed: Unreal.
    ZUpLeft,
    /// y up, left-handed: Unity.
    YUpLeft,
}

impl From<Axes> for v1::Axes {
    fn from(axes: Axes) -> Self {
        match axes {
            Axes::Scene => Self::Unspecified,
            Axes::ZUp => Self::ZUpRightHanded,
            Axes::YUp => Self::YUpRightHanded,
            Axes::ZUpLeft => Self::ZUpLeftHanded,
            Axes::YUpLeft => Self::YUpLeftHanded,
        }
    }
}

pub(crate) async fn bridge(arguments: Arguments) -> Result<(), Failure> {
    match arguments.kind {
        Kind::Osc { listen, common } => common.relay(vmc::listen(listen).await?).await,
        Kind::Natnet {
            server_address,
            local,
            common,
        } => {
            let local = local.map_or_else(|| natnet::towards(server_address), Ok)?;
            common
                .relay(natnet::connect(server_address, local).await?)
                .await
        }
        Kind::Lsl {
            stream,
            query,
            peer,
            common,
        } => {
            let quote = |name: String| match name.contains('\'') {
                true => format!("name=\"{name}\""),
                false => format!("name='{name}'"),
            };
            let predicate = query.or(stream.map(quote)).unwrap_or_default();
            common
                .relay(lsl::find(lsl::Query { predicate, peer }).await?)
                .await
        }
    }
}

impl Common {
    async fn relay(self, mut source: Source) -> Result<(), Failure> {
        let settings = RelaySettings {
            rate_hz: self.rate,
            unit_metres: self.unit_metres,
            axes: self.axes.map(Into::into),
            delivery: match self.each {
                true => v1::Delivery::Each,
                false => v1::Delivery::Live,
            },
        };
        let client = self.connection.open().await?;
        let relay = Relay::to(client, &session_name(&self.session), settings).await?;
        let stop = async {
            tokio::signal::ctrl_c().await.ok(); // where it cannot be heard, nothing stops
        };
        let note = |text: String| eprintln!("sinew: {text}");
        let relayed = relay.run(&mut source, stop, note).await?;
        let mut table = stream::played(relayed.sent, &relayed.ack, relayed.throttled);
        table.row(["dropped here", &relayed.dropped.to_string()]);
        table.row(["streams", &relayed.streams.to_string()]);
        put!("{table}");
        Ok(())
    }
}
