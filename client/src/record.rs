//! Records of what a session was given, and their files.

use bytes::{Buf as _, Bytes};
use prost::Message as _;
use sinew_proto::v1::{RecordMotionResponse, RecordStart, record_motion_response::Item};
use tonic::Streaming;

use crate::ClientError;

/// What a file of a record begins with; then follow the items of RecordMotion, each after its length as a varint.
pub const RECORD_MAGIC: &[u8] = b"SINEW-MOTION-1\n";

/// A record being made; by [`crate::Client::record_motion`].
#[derive(Debug)]
pub struct Recording {
    start: RecordStart,
    items: Streaming<RecordMotionResponse>,
}

impl Recording {
    pub(crate) async fn open(
        mut items: Streaming<RecordMotionResponse>,
    ) -> Result<Self, ClientError> {
        match items.message().await?.and_then(|message| message.item) {
            Some(Item::Start(start)) => Ok(Self { start, items }),
            Some(Item::Frame(_) | Item::Mapping(_) | Item::Edits(_)) | None => Err(
                ClientError::Protocol("a record did not begin with its start".to_owned()),
            ),
        }
    }

    /// Where it begins.
    pub fn start(&self) -> &RecordStart {
        &self.start
    }

    /// What it was given next; `None` when the session has ended.
    ///
    /// # Errors
    /// `RESOURCE_EXHAUSTED` where this reader is too slow.
    pub async fn next(&mut self) -> Result<Option<Item>, ClientError> {
        while let Some(message) = self.items.message().await? {
            match message.item {
                Some(Item::Start(_)) | None => {}
                item @ Some(Item::Frame(_) | Item::Mapping(_) | Item::Edits(_)) => return Ok(item),
            }
        }
        Ok(None)
    }
}

/// Why a file is no record.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RecordError {
    /// It begins otherwise.
    #[error("this is no record of motion; make one by `sinew record`")]
    Magic,
    /// An item cannot be read.
    #[error("item {item}, at byte {at}, cannot be read: {problem}; the file is cut or damaged")]
    Garbled {
        /// From 0.
        item: usize,
        /// Where it begins.
        at: usize,
        /// What is wrong.
        problem: String,
    },
    /// Its first item is no start.
    #[error("the record has no start; the file is cut or damaged")]
    Start,
}

/// A record as it was made.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionRecord {
    /// Where it begins.
    pub start: RecordStart,
    /// What the session was given, in its order; no start is among them.
    pub items: Vec<Item>,
}

impl MotionRecord {
    /// The bytes of one item of a file.
    pub fn item(item: Item) -> Vec<u8> {
        RecordMotionResponse { item: Some(item) }.encode_length_delimited_to_vec()
    }

    /// Reads a file's bytes.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn read(file: Bytes) -> Result<Self, RecordError> {
        let mut rest = file.clone();
        if !rest.starts_with(RECORD_MAGIC) {
            return Err(RecordError::Magic);
        }
        rest.advance(RECORD_MAGIC.len());
        let mut start = None;
        let mut items = Vec::new();
        for item in 0.. {
            if rest.is_empty() {
                break;
            }
            let at = file.len() - rest.len();
            let message = RecordMotionResponse::decode_length_delimited(&mut rest);
            let garbled = |problem: &dyn ToString| RecordError::Garbled {
                item,
                at,
                problem: problem.to_string(),
            };
            match (message.map_err(|error| garbled(&error))?.item, item) {
                (Some(Item::Start(first)), 0) => start = Some(first),
                (Some(given @ (Item::Frame(_) | Item::Mapping(_) | Item::Edits(_))), 1..) => {
                    items.push(given);
                }
                (
                    Some(Item::Start(_) | Item::Frame(_) | Item::Mapping(_) | Item::Edits(_))
                    | None,
                    _,
                ) => {
                    return Err(garbled(&"it is not what belongs there"));
                }
            }
        }
        let start = start.ok_or(RecordError::Start)?;
        Ok(Self { start, items })
    }
}

#[cfg(test)]
mod tests {
    use sinew_proto::v1::{MotionFrame, RecordedEdits, RecordedMapping};

    use super::*;

    fn file() -> (MotionRecord, Vec<u8>) {
        let frame = |sequence| {
            Item::Frame(MotionFrame {
                sequence,
                capture_time_seconds: 0.1 + sequence as f64 / 3.0,
                ..MotionFrame::default()
            })
        };
        let mapping = RecordedMapping {
            blend_seconds: 0.5,
            ..RecordedMapping::default()
        };
        let record = MotionRecord {
            start: RecordStart {
                labels: vec!["a".to_owned()],
                ..RecordStart::default()
            },
            items: vec![
                frame(1),
                Item::Mapping(mapping),
                frame(2),
                Item::Edits(RecordedEdits::default()),
            ],
        };
        let mut bytes = RECORD_MAGIC.to_vec();
        bytes.extend(MotionRecord::item(Item::Start(record.start.clone())));
        for item in &record.items {
            bytes.extend(MotionRecord::item(item.clone()));
        }
        (record, bytes)
    }

    #[test]
    fn what_was_written_is_read() {
        let (record, bytes) = file();
        assert_eq!(MotionRecord::read(bytes.into()), Ok(record));
    }

    #[test]
    fn a_file_cut_anywhere_is_shorter_or_refused() {
        let (record, bytes) = file();
        for length in 0..bytes.len() {
            match MotionRecord::read(Bytes::copy_from_slice(&bytes[..length])) {
                Ok(cut) => assert!(record.items.starts_with(&cut.items)),
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }

    #[test]
    fn a_length_that_lies_is_refused() {
        let mut bytes = RECORD_MAGIC.to_vec();
        bytes.extend([0xFF, 0xFF, 0xFF, 0xFF, 0x7F, 0]);
        let refused = MotionRecord::read(bytes.into());
        assert!(matches!(refused, Err(RecordError::Garbled { item: 0, .. })));
    }
}
