//! The sender's end of a stream of motion.

use sinew_proto::v1::{
    self, Precision, Reals, motion_service_client::MotionServiceClient,
    stream_motion_request::Item as Asked, stream_motion_response::Item as Told,
};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Streaming, transport::Channel};

use crate::Refusal;

/// The first item of a stream.
pub fn hello(session: &str, labels: &[String]) -> Asked {
    Asked::Hello(v1::Hello {
        session: session.to_owned(),
        source: "the integration tests".to_owned(),
        labels: labels.to_vec(),
        ..v1::Hello::default()
    })
}

/// An open stream of motion.
#[derive(Debug)]
pub struct Source {
    items: mpsc::Sender<v1::StreamMotionRequest>,
    told: Streaming<v1::StreamMotionResponse>,
    /// What the server said to the hello.
    pub accepted: v1::Accepted,
    /// Sequence of the last frame sent.
    pub sequence: u64,
    /// Frames per second by which capture time goes on, Hz.
    pub rate: f64,
}

impl Source {
    /// Opens a stream by its first item.
    pub async fn open(
        mut client: MotionServiceClient<Channel>,
        first: Asked,
    ) -> Result<Self, Refusal> {
        let (items, queue) = mpsc::channel(1);
        let item = Some(first);
        items.send(v1::StreamMotionRequest { item }).await.unwrap();
        let answer = client.stream_motion(ReceiverStream::new(queue)).await;
        let mut told = answer.map_err(Refusal::of)?.into_inner();
        let first = told.message().await.map_err(Refusal::of)?;
        let Some(Told::Accepted(accepted)) = first.and_then(|message| message.item) else {
            panic!("a hello was not answered by Accepted");
        };
        Ok(Self {
            items,
            told,
            accepted,
            sequence: 0,
            rate: 100.0,
        })
    }

    /// Sends an item, unless the stream has ended.
    pub async fn send_item(&self, item: Asked) {
        let item = Some(item);
        self.items.send(v1::StreamMotionRequest { item }).await.ok();
    }

    /// Sends a frame in which every point is seen; returns its sequence.
    pub async fn send(&mut self, positions: &[[f64; 3]]) -> u64 {
        self.send_flagged(positions, &[]).await
    }

    /// Sends a frame with flags; returns its sequence.
    pub async fn send_flagged(&mut self, positions: &[[f64; 3]], flags: &[u8]) -> u64 {
        self.sequence += 1;
        self.send_item(self.frame(self.sequence, positions, flags))
            .await;
        self.sequence
    }

    /// A frame with this sequence, at the time that goes with it.
    pub fn frame(&self, sequence: u64, positions: &[[f64; 3]], flags: &[u8]) -> Asked {
        Asked::Frame(v1::MotionFrame {
            sequence,
            capture_time_seconds: sequence as f64 / self.rate,
            positions: Some(Reals::pack(positions.as_flattened(), Precision::F64)),
            flags: flags.to_vec().into(),
            source_sequence: None,
            drags: Vec::new(),
        })
    }

    /// The next thing that the server says.
    pub async fn told(&mut self) -> Result<Option<Told>, Refusal> {
        let message = self.told.message().await.map_err(Refusal::of)?;
        Ok(message.map(|message| message.item.unwrap()))
    }

    /// Waits until this frame has its place in the session's queue.
    pub async fn acked(&mut self, sequence: u64) -> Result<(), Refusal> {
        self.ack_where(|ack| ack.sequence >= sequence)
            .await
            .map(drop)
    }

    /// Waits for an acknowledgement such as this.
    pub async fn ack_where(&mut self, is: impl Fn(&v1::Ack) -> bool) -> Result<v1::Ack, Refusal> {
        loop {
            match self.told().await?.expect("the stream goes on") {
                Told::Accepted(again) => panic!("{again:?} came twice"),
                Told::Ack(ack) if is(&ack) => return Ok(ack),
                Told::Ack(_) | Told::Pong(_) | Told::Throttle(_) => {}
            }
        }
    }

    /// Waits until the server has all that was sent before; the answer to the ping by which it is known.
    pub async fn reached(&mut self) -> v1::Pong {
        self.send_item(Asked::Ping(v1::Ping::default())).await;
        loop {
            if let Told::Pong(pong) = self.told().await.unwrap().expect("the stream goes on") {
                return pong;
            }
        }
    }

    /// Waits for the error that ends the stream.
    pub async fn ending(&mut self) -> Result<(), Refusal> {
        while self.told.message().await.map_err(Refusal::of)?.is_some() {}
        Ok(())
    }

    /// Sends one frame, waits until it is queued, and ends the stream.
    pub async fn send_and_close(mut self, positions: &[[f64; 3]]) {
        let sequence = self.send(positions).await;
        self.acked(sequence).await.unwrap();
        self.close().await.unwrap();
    }

    /// Says that no frame follows, and waits for the stream's end.
    pub async fn close(self) -> Result<(), Refusal> {
        let Self {
            items, mut told, ..
        } = self;
        drop(items);
        while told.message().await.map_err(Refusal::of)?.is_some() {}
        Ok(())
    }
}
