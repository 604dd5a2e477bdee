//! AssetService: uploads in chunks, checked twice.

use std::fmt::Write as _;

use bytes::{Bytes, BytesMut};
use prost::Message as _;
use sha2::{Digest as _, Sha256};
use sinew_proto::v1::{self, asset_service_server::AssetService, upload_asset_request::Item};
use tonic::{Request, Response, Status, Streaming};

use super::Shared;
use crate::{
    error::{ServiceError, invalid},
    status,
};

#[tonic::async_trait]
impl AssetService for Shared {
    async fn upload_asset(
        &self,
        request: Request<Streaming<v1::UploadAssetRequest>>,
    ) -> Result<Response<v1::Asset>, Status> {
        let content = receive(self, request.into_inner()).await?;
        v1::UnstructuredGrid::decode(content.clone()).map_err(|error| {
            ServiceError::Garbled(format!("the asset is no UnstructuredGrid: {error}"))
        })?;
        let name = name(&content);
        let size = content.len() as u64;
        self.assets.store(name.clone(), content)?;
        Ok(Response::new(v1::Asset { name, size }))
    }
}

async fn receive(
    shared: &Shared,
    mut requests: Streaming<v1::UploadAssetRequest>,
) -> Result<Bytes, ServiceError> {
    let header = match next(&mut requests).await? {
        Some(Item::Header(header)) => header,
        Some(Item::Chunk(_)) | None => {
            return Err(invalid(
                "ASSET_HEADER_MISSING",
                "header",
                "is missing",
                "send it as the first item",
            ));
        }
    };
    shared.assets.admit(header.size)?;
    // Grows with what arrives: the header's word alone takes no memory.
    let mut content = BytesMut::new();
    while let Some(item) = next(&mut requests).await? {
        let Item::Chunk(chunk) = item else {
            return Err(invalid(
                "ASSET_HEADER_REPEATED",
                "header",
                "came again",
                "send it once",
            ));
        };
        if crc32c::crc32c(&chunk.data) != chunk.crc32c {
            let problem = format!(
                "does not fit the {} bytes at {}",
                chunk.data.len(),
                content.len()
            );
            return Err(invalid(
                "ASSET_CHECKSUM",
                "chunk.crc32c",
                problem,
                "send the chunk's CRC-32C; try again",
            ));
        }
        if (content.len() + chunk.data.len()) as u64 > header.size {
            let problem = format!("is {} and more bytes came", header.size);
            return Err(invalid(
                "ASSET_SIZE",
                "header.size",
                problem,
                "give the length of all chunks together",
            ));
        }
        content.extend_from_slice(&chunk.data);
    }
    if content.len() as u64 != header.size {
        let problem = format!("is {} and {} bytes came", header.size, content.len());
        return Err(invalid(
            "ASSET_SIZE",
            "header.size",
            problem,
            "give the length of all chunks together",
        ));
    }
    if Sha256::digest(&content)[..] != header.sha256[..] {
        let remedy = "send the SHA-256 of the whole content; try again";
        return Err(invalid(
            "ASSET_CHECKSUM",
            "header.sha256",
            "does not fit the content",
            remedy,
        ));
    }
    Ok(content.freeze())
}

async fn next(
    requests: &mut Streaming<v1::UploadAssetRequest>,
) -> Result<Option<Item>, ServiceError> {
    match requests.message().await {
        Ok(message) => Ok(message.and_then(|message| message.item)),
        Err(status) => Err(status::unreadable(&status).unwrap_or_else(|| {
            invalid(
                "ASSET_BROKEN_OFF",
                "chunk",
                "the upload broke off",
                "send it again",
            )
        })),
    }
}

fn name(content: &[u8]) -> String {
    Sha256::digest(content)
        .iter()
        .fold("assets/".to_owned(), |mut name, byte| {
            // Writing to a String cannot fail.
            let _ = write!(name, "{byte:02x}");
            name
        })
}
