//! Files in and out: meshes, clouds of points and motion captures.

pub mod cloud;
pub mod mesh;
pub mod take;
