//! Recordings on disk.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use re_sdk::external::re_log_encoding::rrd::{
    CrateVersion, Encodable as _, EncodingOptions, RRD_FOURCC, StreamHeader,
};

use crate::hub::Subscription;

/// A recording that is being written. Messages go to the file as they went to viewers, encoded once. There is no
/// footer: it would take memory for as long as the session lives.
pub(crate) struct RecordingFile {
    path: PathBuf,
    file: File,
    bytes: Vec<u8>,
}

impl RecordingFile {
    pub(crate) fn create(folder: &Path, session: &str) -> io::Result<Self> {
        let path = folder.join(format!("{session}.rrd"));
        let mut file = File::create(&path).map_err(|error| {
            io::Error::new(error.kind(), format!("{}: {error}", path.display()))
        })?;
        let header = StreamHeader {
            fourcc: RRD_FOURCC,
            version: CrateVersion::LOCAL.to_bytes(),
            options: EncodingOptions::PROTOBUF_UNCOMPRESSED,
        };
        let mut bytes = Vec::new();
        header.to_rrd_bytes(&mut bytes).map_err(io::Error::other)?;
        file.write_all(&bytes)?;
        Ok(Self { path, file, bytes })
    }

    /// Writes all that there is until the recording ends.
    pub(crate) fn run(mut self, mut messages: Subscription) {
        while let Some(message) = messages.next_blocking() {
            self.bytes.clear();
            let written = message
                .to_rrd_bytes(&mut self.bytes)
                .map_err(io::Error::other)
                .and_then(|_| self.file.write_all(&self.bytes));
            if let Err(error) = written {
                let path = self.path.display();
                tracing::error!(%error, %path, "a recording stops: its file cannot be written");
                return;
            }
        }
    }
}
