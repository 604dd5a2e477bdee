//! Uploads.

use bytes::Bytes;
use prost::Message as _;
use sha2::{Digest as _, Sha256};
use sinew_proto::v1::{
    Asset, AssetChunk, AssetHeader, UploadAssetRequest, mesh, upload_asset_request::Item,
};
use sinew_tests::{Refusal, TestServer, live, refused, scenes as posted};
use tonic::Code;

use super::Witness;

/// A good upload in two chunks: the grid of [`posted::small`].
fn upload() -> Vec<Item> {
    let mut scene = posted::small();
    let content = Bytes::from(posted::mesh(&mut scene).encode_to_vec());
    let header = AssetHeader {
        size: content.len() as u64,
        sha256: Sha256::digest(&content).to_vec().into(),
    };
    let chunk = |data: Bytes| {
        Item::Chunk(AssetChunk {
            crc32c: crc32c::crc32c(&data),
            data,
        })
    };
    let half = content.len() / 2;
    vec![
        Item::Header(header),
        chunk(content.slice(..half)),
        chunk(content.slice(half..)),
    ]
}

async fn send(server: &TestServer, items: Vec<Item>) -> Result<Asset, Refusal> {
    let requests = items
        .into_iter()
        .map(|item| UploadAssetRequest { item: Some(item) });
    let requests = tokio_stream::iter(requests.collect::<Vec<_>>());
    let answer = server.assets().upload_asset(requests).await;
    answer.map(tonic::Response::into_inner).map_err(Refusal::of)
}

fn header(items: &mut [Item]) -> &mut AssetHeader {
    match &mut items[0] {
        Item::Header(header) => header,
        Item::Chunk(_) => panic!("the header comes first"),
    }
}

fn chunk(items: &mut [Item], i: usize) -> &mut AssetChunk {
    match &mut items[i] {
        Item::Chunk(chunk) => chunk,
        Item::Header(_) => panic!("chunks come after the header"),
    }
}

#[test]
fn an_uploaded_grid_makes_the_session_that_the_grid_itself_makes() {
    live(async {
        let server = TestServer::start().await;
        let inline = server.create("inline", posted::small()).await;
        let asset = send(&server, upload()).await.unwrap();
        assert_eq!(send(&server, upload()).await.unwrap(), asset);
        let mut scene = posted::small();
        scene.mesh = posted::meshed(mesh::Source::Asset(asset.name));
        let uploaded = server.create("uploaded", scene).await;
        assert_eq!(uploaded.digest().await, inline.digest().await);
    });
}

#[test]
fn uploads_that_do_not_hold_what_they_say() {
    type Case = (fn(&mut Vec<Item>), &'static str, &'static str);
    let cases: [Case; 9] = [
        (|u| drop(u.remove(0)), "ASSET_HEADER_MISSING", "header"),
        (Vec::clear, "ASSET_HEADER_MISSING", "header"),
        (|u| u.swap(0, 1), "ASSET_HEADER_MISSING", "header"),
        (
            |u| u.insert(2, u[0].clone()),
            "ASSET_HEADER_REPEATED",
            "header",
        ),
        (
            |u| chunk(u, 2).crc32c ^= 1,
            "ASSET_CHECKSUM",
            "chunk.crc32c",
        ),
        (
            |u| header(u).sha256 = vec![0; 32].into(),
            "ASSET_CHECKSUM",
            "header.sha256",
        ),
        (|u| header(u).size += 1, "ASSET_SIZE", "header.size"),
        (|u| header(u).size -= 1, "ASSET_SIZE", "header.size"),
        (|u| drop(u.pop()), "ASSET_SIZE", "header.size"),
    ];
    live(async {
        let witness = Witness::start().await;
        for (change, reason, field) in cases {
            let mut items = upload();
            change(&mut items);
            let answer = send(&witness.server, items).await;
            let refusal = refused(answer, Code::InvalidArgument, reason);
            assert_eq!(refusal.field.as_deref(), Some(field));
            witness.nothing_changed(reason).await;
        }
    });
}

#[test]
fn content_that_is_no_grid() {
    live(async {
        let witness = Witness::start().await;
        let content = Bytes::from_static(&[0xFF; 100]);
        let items = vec![
            Item::Header(AssetHeader {
                size: 100,
                sha256: Sha256::digest(&content).to_vec().into(),
            }),
            Item::Chunk(AssetChunk {
                crc32c: crc32c::crc32c(&content),
                data: content,
            }),
        ];
        let answer = send(&witness.server, items).await;
        refused(answer, Code::InvalidArgument, "MESSAGE_GARBLED");
        witness.nothing_changed("an asset that is no grid").await;
    });
}

#[test]
fn more_than_the_server_holds() {
    live(async {
        let server = TestServer::with(|config| config.max_asset_bytes = 500).await;
        let answer = send(&server, upload()).await;
        refused(answer, Code::ResourceExhausted, "ASSETS_FULL");
        let mut huge = upload();
        header(&mut huge).size = u64::MAX;
        let answer = send(&server, huge).await;
        refused(answer, Code::ResourceExhausted, "ASSETS_FULL");
    });
}
