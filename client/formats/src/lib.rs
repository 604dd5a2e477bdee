//! Files in and out: meshes and motion captures.

pub mod mesh;
pub mod take;
