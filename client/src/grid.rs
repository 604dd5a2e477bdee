//! Meshes between this machine's form and the wire's.

use bytes::Bytes;
use nalgebra::Vector3;
use sinew_mesh::{Cells, Grid};
use sinew_proto::v1::{Indices, Precision, Reals, UnstructuredGrid};

use crate::ClientError;

/// Packs a grid, positions in f64.
pub fn to_proto(grid: &Grid) -> UnstructuredGrid {
    let Cells {
        types,
        connectivity,
        offsets,
        faces,
        face_offsets,
    } = &grid.cells;
    let column = |indices: &[u32]| (!indices.is_empty()).then(|| Indices::pack(indices));
    UnstructuredGrid {
        positions: Some(Reals::pack(&flatten(&grid.positions), Precision::F64)),
        cell_types: Bytes::copy_from_slice(types),
        connectivity: column(connectivity),
        offsets: column(offsets),
        faces: column(faces),
        face_offsets: column(face_offsets),
    }
}

/// Unpacks the cells of a grid; whether they fit together is not looked at.
///
/// # Errors
/// [`ClientError::Protocol`] where a column cannot be read.
pub fn cells(grid: &UnstructuredGrid) -> Result<Cells, ClientError> {
    let column = |indices: &Option<Indices>| {
        indices.as_ref().map_or(Ok(Vec::new()), |column| {
            column
                .unpack()
                .map_err(|error| ClientError::Protocol(format!("a column of a grid {error}")))
        })
    };
    Ok(Cells {
        types: grid.cell_types.to_vec(),
        connectivity: column(&grid.connectivity)?,
        offsets: column(&grid.offsets)?,
        faces: column(&grid.faces)?,
        face_offsets: column(&grid.face_offsets)?,
    })
}

/// Unpacks positions, m.
///
/// # Errors
/// [`ClientError::Protocol`] where the column cannot be read or ends within a position.
pub fn positions(column: Option<&Reals>) -> Result<Vec<Vector3<f64>>, ClientError> {
    let numbers = column
        .map_or(Ok(Vec::new()), Reals::unpack)
        .map_err(|error| ClientError::Protocol(format!("a column of positions {error}")))?;
    let (positions, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(ClientError::Protocol(format!(
            "{} numbers are no positions of 3 coordinates each",
            numbers.len()
        )));
    }
    Ok(positions.iter().map(|&p| Vector3::from(p)).collect())
}

/// x0 y0 z0 x1 y1 z1 ...
pub(crate) fn flatten(positions: &[Vector3<f64>]) -> Vec<f64> {
    positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
}
