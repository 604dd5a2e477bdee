//! Grids in chunks.

use bytes::Bytes;
use prost::Message as _;
use sha2::{Digest as _, Sha256};
use sinew_proto::v1::{
    AssetChunk, AssetHeader, UnstructuredGrid, UploadAssetRequest, upload_asset_request::Item,
};

/// Far under every gRPC library's limit, far over the cost of one message.
const CHUNK_BYTES: usize = 1 << 20;

/// Bytes that the grid takes on the wire.
pub(crate) fn size(grid: &UnstructuredGrid) -> usize {
    grid.encoded_len()
}

/// The header, then the grid in chunks, each with its checksum.
pub(crate) fn requests(
    grid: &UnstructuredGrid,
) -> impl Iterator<Item = UploadAssetRequest> + use<> {
    let mut left = Bytes::from(grid.encode_to_vec());
    let header = Item::Header(AssetHeader {
        size: left.len() as u64,
        sha256: Bytes::copy_from_slice(&Sha256::digest(&left)),
    });
    let chunks = std::iter::from_fn(move || {
        (!left.is_empty()).then(|| {
            let data = left.split_to(left.len().min(CHUNK_BYTES));
            let crc32c = crc32c::crc32c(&data);
            Item::Chunk(AssetChunk { data, crc32c })
        })
    });
    std::iter::once(header)
        .chain(chunks)
        .map(|item| UploadAssetRequest { item: Some(item) })
}

#[cfg(test)]
mod tests {
    use sinew_proto::v1::{Precision, Reals};

    use super::*;

    #[test]
    fn chunks_join_to_what_the_header_says() {
        let numbers: Vec<f64> = (0..200_000_u32).map(f64::from).collect();
        let grid = UnstructuredGrid {
            positions: Some(Reals::pack(&numbers, Precision::F64)),
            ..UnstructuredGrid::default()
        };
        let mut items = requests(&grid).map(|request| request.item.unwrap());
        let Some(Item::Header(header)) = items.next() else {
            panic!("no header first")
        };
        let mut joined = Vec::new();
        for item in items {
            let Item::Chunk(chunk) = item else {
                panic!("a second header")
            };
            assert!(chunk.data.len() <= CHUNK_BYTES);
            assert_eq!(chunk.crc32c, crc32c::crc32c(&chunk.data));
            joined.extend_from_slice(&chunk.data);
        }
        assert_eq!(header.size, joined.len() as u64);
        assert_eq!(header.sha256[..], Sha256::digest(&joined)[..]);
        assert_eq!(UnstructuredGrid::decode(&joined[..]).unwrap(), grid);
    }
}
