//! Hash of a state.

use nalgebra::Vector3;
use xxhash_rust::xxh3::Xxh3;

/// XXH3-128 over columns, each preceded by its length in bytes.
#[derive(Default)]
pub(crate) struct Digest(Xxh3);

impl Digest {
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    pub(crate) fn words(&mut self, words: &[u64]) {
        self.bytes(bytemuck::cast_slice(words));
    }

    pub(crate) fn vectors(&mut self, vectors: &[Vector3<f64>]) {
        self.bytes(bytemuck::cast_slice(vectors));
    }

    pub(crate) fn finish(&self) -> u128 {
        self.0.digest128()
    }
}
