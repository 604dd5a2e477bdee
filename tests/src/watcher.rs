//! The reader's end of a subscription.

use bytes::Bytes;
use prost::Message as _;
use sinew_proto::v1::{Frame, Goodbye, Keyframe, SubscribeResponse, subscribe_response::Item};
use tonic::Streaming;

use crate::Refusal;

/// Reads a subscription; joins chunks.
pub struct Watcher {
    stream: Streaming<SubscribeResponse>,
    last: Option<Frame>,
}

impl Watcher {
    pub(crate) fn new(stream: Streaming<SubscribeResponse>) -> Self {
        Self { stream, last: None }
    }

    /// The next message as it came.
    pub async fn message(&mut self) -> Result<Option<SubscribeResponse>, Refusal> {
        self.stream.message().await.map_err(Refusal::of)
    }

    /// The newest positions read.
    pub fn last(&self) -> &Frame {
        self.last.as_ref().expect("nothing was read yet")
    }

    /// The next item, or nothing at the stream's end.
    pub async fn item(&mut self) -> Result<Option<Item>, Refusal> {
        let item = self.joined().await?;
        match &item {
            Some(Item::Keyframe(keyframe)) => self.last.clone_from(&keyframe.frame),
            Some(Item::Frame(frame)) => self.last = Some(frame.clone()),
            Some(Item::Patch(patch)) => self.last.clone_from(&patch.frame),
            Some(Item::Events(_) | Item::Goodbye(_) | Item::Chunk(_)) | None => {}
        }
        Ok(item)
    }

    async fn joined(&mut self) -> Result<Option<Item>, Refusal> {
        let mut parts: Vec<Bytes> = Vec::new();
        loop {
            let Some(message) = self.message().await? else {
                assert!(parts.is_empty(), "the stream ends within a group of chunks");
                return Ok(None);
            };
            let chunk = match message.item.expect("every message has an item") {
                Item::Chunk(chunk) => chunk,
                item @ (Item::Keyframe(_)
                | Item::Frame(_)
                | Item::Patch(_)
                | Item::Events(_)
                | Item::Goodbye(_)) => {
                    assert!(parts.is_empty(), "{item:?} stands between chunks");
                    return Ok(Some(item));
                }
            };
            assert_eq!(chunk.index as usize, parts.len());
            parts.push(chunk.data);
            if parts.len() == chunk.count as usize {
                let whole = SubscribeResponse::decode(Bytes::from(parts.concat()));
                return Ok(whole.unwrap().item);
            }
        }
    }

    /// The next item, which is a keyframe.
    pub async fn keyframe(&mut self) -> Keyframe {
        match self.item().await.unwrap() {
            Some(Item::Keyframe(keyframe)) => keyframe,
            other => panic!("a keyframe was expected, {other:?} came"),
        }
    }

    /// The next item, which is a frame.
    pub async fn frame(&mut self) -> Frame {
        match self.item().await.unwrap() {
            Some(Item::Frame(frame)) => frame,
            other => panic!("a frame was expected, {other:?} came"),
        }
    }

    /// The next positions, be they in a frame, a keyframe or a patch; nothing at a goodbye.
    pub async fn positions(&mut self) -> Result<Option<Frame>, Refusal> {
        loop {
            let frame = match self.item().await? {
                Some(Item::Frame(frame)) => Some(frame),
                Some(Item::Keyframe(keyframe)) => keyframe.frame,
                Some(Item::Patch(patch)) => patch.frame,
                Some(Item::Events(_)) => continue,
                Some(Item::Goodbye(_)) | None => return Ok(None),
                Some(Item::Chunk(_)) => panic!("chunks join to a chunk"),
            };
            if frame
                .as_ref()
                .is_some_and(|f| f.vertices.is_some() || f.points.is_some())
            {
                return Ok(frame);
            }
        }
    }

    /// Reads until the positions of this step or a later one came.
    pub async fn until(&mut self, step: u64) -> Frame {
        loop {
            let frame = self
                .positions()
                .await
                .unwrap()
                .expect("the session goes on");
            if frame.step >= step {
                return frame;
            }
        }
    }

    /// Reads to the goodbye and the end after it.
    pub async fn goodbye(&mut self) -> Goodbye {
        loop {
            match self.item().await.unwrap() {
                Some(Item::Goodbye(goodbye)) => {
                    assert_eq!(self.item().await, Ok(None), "something follows the goodbye");
                    return goodbye;
                }
                Some(_) => {}
                None => panic!("the stream ends without a goodbye"),
            }
        }
    }
}

/// A frame's vertices, 3 numbers each, m.
pub fn vertices(frame: &Frame) -> Vec<[f64; 3]> {
    let numbers = frame.vertices.as_ref().unwrap().unpack().unwrap();
    assert_eq!(numbers.len(), 3 * frame.vertex_count as usize);
    numbers.as_chunks::<3>().0.to_vec()
}
