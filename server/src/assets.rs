//! Uploaded grids, by the SHA-256 of their bytes.

use std::{
    collections::BTreeMap,
    sync::{Mutex, PoisonError},
};

use bytes::Bytes;

use crate::error::ServiceError;

/// All assets of this process.
pub(crate) struct Assets {
    stored: Mutex<BTreeMap<String, Bytes>>,
    capacity: u64,
}

impl Assets {
    pub(crate) fn new(capacity: u64) -> Self {
        Self {
            stored: Mutex::default(),
            capacity,
        }
    }

    /// Whether `size` more bytes find room.
    pub(crate) fn admit(&self, size: u64) -> Result<(), ServiceError> {
        let stored = self.stored.lock().unwrap_or_else(PoisonError::into_inner);
        let held: u64 = stored.values().map(|bytes| bytes.len() as u64).sum();
        if held.saturating_add(size) > self.capacity {
            return Err(ServiceError::AssetsFull(self.capacity));
        }
        Ok(())
    }

    /// Stores bytes under `name`; the same name is the same content.
    pub(crate) fn store(&self, name: String, bytes: Bytes) -> Result<(), ServiceError> {
        self.admit(bytes.len() as u64)?;
        self.stored
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .entry(name)
            .or_insert(bytes);
        Ok(())
    }

    pub(crate) fn get(&self, name: &str) -> Result<Bytes, ServiceError> {
        self.stored
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get(name)
            .cloned()
            .ok_or_else(|| ServiceError::AssetUnknown(name.to_owned()))
    }
}
