//! Items too large for one message, joined again.

use bytes::Bytes;
use prost::Message as _;
use sinew_proto::v1::{Chunk, SubscribeResponse, subscribe_response::Item};

use crate::ClientError;

/// Joins chunks to the items that they are parts of.
#[derive(Debug, Default)]
pub(crate) struct Joiner {
    parts: Vec<Bytes>,
}

impl Joiner {
    /// Takes the next message of the stream; returns an item when one is whole.
    pub(crate) fn push(&mut self, message: SubscribeResponse) -> Result<Option<Item>, ClientError> {
        match message.item {
            None => Err(protocol("an item of a kind unknown here")),
            Some(Item::Chunk(chunk)) => self.join(chunk),
            Some(
                item @ (Item::Keyframe(_)
                | Item::Frame(_)
                | Item::Patch(_)
                | Item::Events(_)
                | Item::Goodbye(_)),
            ) => {
                if !self.parts.is_empty() {
                    return Err(protocol("an item between the chunks of another"));
                }
                Ok(Some(item))
            }
        }
    }

    fn join(&mut self, chunk: Chunk) -> Result<Option<Item>, ClientError> {
        if chunk.index as usize != self.parts.len() || chunk.index >= chunk.count {
            return Err(protocol(&format!(
                "chunk {} of {} where {} was due",
                chunk.index,
                chunk.count,
                self.parts.len()
            )));
        }
        self.parts.push(chunk.data);
        if chunk.index + 1 < chunk.count {
            return Ok(None);
        }
        let whole: Bytes = std::mem::take(&mut self.parts).concat().into();
        let message = SubscribeResponse::decode(whole)
            .map_err(|error| protocol(&format!("chunks that join to no item ({error})")))?;
        match message.item {
            None | Some(Item::Chunk(_)) => Err(protocol("chunks that join to no item")),
            item @ Some(
                Item::Keyframe(_)
                | Item::Frame(_)
                | Item::Patch(_)
                | Item::Events(_)
                | Item::Goodbye(_),
            ) => Ok(item),
        }
    }
}

fn protocol(what: &str) -> ClientError {
    ClientError::Protocol(what.to_owned())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sinew_proto::v1::Frame;

    use super::*;

    fn item(bytes: Vec<u8>) -> SubscribeResponse {
        SubscribeResponse {
            item: Some(Item::Frame(Frame {
                sequence: 7,
                point_states: bytes.into(),
                ..Frame::default()
            })),
        }
    }

    fn split(item: &SubscribeResponse, size: usize) -> Vec<SubscribeResponse> {
        let whole = Bytes::from(item.encode_to_vec());
        let count = whole.len().div_ceil(size);
        (0..count)
            .map(|index| {
                let data = whole.slice(index * size..whole.len().min((index + 1) * size));
                let (index, count) = (u32::try_from(index).unwrap(), u32::try_from(count).unwrap());
                SubscribeResponse {
                    item: Some(Item::Chunk(Chunk { index, count, data })),
                }
            })
            .collect()
    }

    proptest! {
        #[test]
        fn joining_undoes_splitting(
            bytes in proptest::collection::vec(any::<u8>(), 0..300), size in 1..400usize
        ) {
            let sent = item(bytes);
            let mut joiner = Joiner::default();
            // Twice, since a joiner serves a whole stream.
            for _ in 0..2 {
                let mut parts = split(&sent, size);
                let last = parts.pop().unwrap();
                for part in parts {
                    prop_assert_eq!(joiner.push(part).unwrap(), None);
                }
                prop_assert_eq!(joiner.push(last).unwrap(), sent.item.clone());
            }
        }

        #[test]
        fn a_missing_or_doubled_chunk_is_refused(
            bytes in proptest::collection::vec(any::<u8>(), 50..300), wrong in any::<prop::sample::Index>(),
            double in any::<bool>()
        ) {
            let mut parts = split(&item(bytes), 10);
            let at = wrong.index(parts.len() - 1);
            if double { parts.insert(at, parts[at].clone()) } else { drop(parts.remove(at)) }
            let mut joiner = Joiner::default();
            prop_assert!(parts.into_iter().any(|part| joiner.push(part).is_err()));
        }
    }

    #[test]
    fn an_item_between_chunks_is_refused() {
        let sent = item(vec![0; 100]);
        let mut joiner = Joiner::default();
        joiner.push(split(&sent, 10).remove(0)).unwrap();
        assert!(joiner.push(sent).is_err());
    }

    #[test]
    fn chunks_within_chunks_are_refused() {
        let inner = split(&item(vec![0; 100]), 50).remove(0);
        let mut joiner = Joiner::default();
        let outer = split(&inner, 1 << 20).remove(0);
        assert!(joiner.push(outer).is_err());
    }
}
