//! Meshes as they come: VTK's unstructured grids, borrowed.

use thiserror::Error;

use crate::cell_pattern::Pattern;

/// The number of a polyhedron among VTK's cell types.
pub(crate) const POLYHEDRON: u8 = 42;

/// The cells of a mesh, in VTK's form. Types are 5 (triangle), 7 (polygon) and 9 (quad), or 10 (tetrahedron), 12
/// (hexahedron), 13 (wedge), 14 (pyramid), 15 and 16 (prisms over pentagons and hexagons) and 42 (polyhedron).
#[derive(Clone, Copy, Debug)]
pub struct MeshCells<'a> {
    /// How many vertices there are.
    pub vertices: usize,
    /// VTK's type of each cell.
    pub types: &'a [u8],
    /// The vertices of all cells, one cell after the other.
    pub connectivity: &'a [u32],
    /// Where each cell starts in `connectivity`; one entry more than cells.
    pub offsets: &'a [u32],
    /// Face streams of the polyhedra: face count, then per face its vertex count and vertices.
    pub faces: &'a [u32],
    /// Where each cell's stream starts in `faces`; one entry more than cells, or empty without polyhedra.
    pub face_offsets: &'a [u32],
}

/// Why columns are no mesh: the column, the entry in it and the value there.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum InputError {
    /// More than the map can number.
    #[error("the mesh has {found} {what}, more than the {limit} that a map can number; split it")]
    TooMany {
        /// What.
        what: &'static str,
        /// How many.
        found: usize,
        /// How many there may be.
        limit: usize,
    },
    /// Offsets that do not fit the columns.
    #[error(
        "column `{column}`, entry {entry}: offsets start at 0, never fall, and end at the {length} entries of their column; there is one more than cells"
    )]
    Offsets {
        /// Name of the column.
        column: &'static str,
        /// Entry in it.
        entry: usize,
        /// Length of the column that they point into.
        length: usize,
    },
    /// A type that is none of those known.
    #[error(
        "cell {cell} has type {value}; known are 5, 7 and 9 on surfaces, and 10, 12, 13, 14, 15, 16 and 42"
    )]
    Type {
        /// The cell.
        cell: usize,
        /// Its type.
        value: u8,
    },
    /// Surface cells among volumes.
    #[error(
        "cell {cell} has type {value}, unlike cell 0: surface cells and volumes make no map together; drop either"
    )]
    Mixed {
        /// The cell.
        cell: usize,
        /// Its type.
        value: u8,
    },
    /// A cell with another number of vertices than its type has.
    #[error("cell {cell} of type {value} has {found} vertices")]
    VertexCount {
        /// The cell.
        cell: usize,
        /// Its type.
        value: u8,
        /// Vertices that it has.
        found: usize,
    },
    /// An index beyond the last vertex.
    #[error("column `{column}`, entry {entry}: vertex {value}, but there are only {vertices}")]
    Vertex {
        /// Name of the column.
        column: &'static str,
        /// Entry in it.
        entry: usize,
        /// The index.
        value: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A face stream whose counts do not meet its end.
    #[error(
        "column `faces`, entry {entry}: the counts in the stream of cell {cell} do not meet its end, or are below 3"
    )]
    Stream {
        /// The polyhedron.
        cell: usize,
        /// Entry in `faces`.
        entry: usize,
    },
}

/// What is known of a mesh that was looked through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub(crate) is_surface: bool,
    pub(crate) darts: usize,
    pub(crate) rings: usize,
}

impl<'a> MeshCells<'a> {
    pub(crate) fn vertices_of(&self, cell: usize) -> &'a [u32] {
        &self.connectivity[self.offsets[cell] as usize..self.offsets[cell + 1] as usize]
    }

    /// The rings of a polyhedron.
    pub(crate) fn rings_of(&self, cell: usize) -> impl Iterator<Item = &'a [u32]> + use<'a> {
        let ends = self.face_offsets[cell] as usize..self.face_offsets[cell + 1] as usize;
        let mut rest = &self.faces[ends][1..];
        std::iter::from_fn(move || {
            let (&count, from) = rest.split_first()?;
            let (ring, after) = from.split_at(count as usize);
            rest = after;
            Some(ring)
        })
    }

    /// That the columns make sense together, so that nothing else has to look again.
    pub(crate) fn check(&self) -> Result<Extent, InputError> {
        let cells = self.types.len();
        at_most("vertices", self.vertices, u32::MAX as usize - 1)?;
        check_offsets("offsets", self.offsets, cells, self.connectivity.len())?;
        if !self.face_offsets.is_empty() || !self.faces.is_empty() {
            check_offsets("face_offsets", self.face_offsets, cells, self.faces.len())?;
        }
        self.check_vertices("connectivity", 0, self.connectivity)?;
        let is_surface = self.types.first().is_some_and(|&kind| kind < 10);
        let (mut darts, mut rings) = (0usize, 0usize);
        for (cell, &value) in self.types.iter().enumerate() {
            let found = self.vertices_of(cell).len();
            let (cell_darts, cell_rings) = match Pattern::shape(value) {
                None => return Err(InputError::Type { cell, value }),
                Some(shape) if shape.is_surface != is_surface => {
                    return Err(InputError::Mixed { cell, value });
                }
                Some(_) if value == POLYHEDRON => self.check_stream(cell)?,
                Some(shape) => {
                    if found < shape.least || found > shape.most {
                        return Err(InputError::VertexCount { cell, value, found });
                    }
                    let darts = if is_surface { found } else { shape.darts };
                    (darts, shape.rings)
                }
            };
            darts += cell_darts;
            rings += cell_rings;
        }
        at_most("darts", darts, crate::Dart::MOST)?;
        Ok(Extent {
            is_surface,
            darts,
            rings,
        })
    }

    fn check_vertices(
        &self,
        column: &'static str,
        first: usize,
        indices: &[u32],
    ) -> Result<(), InputError> {
        let vertices = self.vertices;
        match indices.iter().position(|&index| index as usize >= vertices) {
            None => Ok(()),
            Some(at) => Err(InputError::Vertex {
                column,
                entry: first + at,
                value: indices[at],
                vertices,
            }),
        }
    }

    /// Darts and rings of a polyhedron.
    fn check_stream(&self, cell: usize) -> Result<(usize, usize), InputError> {
        let ends = match self.face_offsets.get(cell..cell + 2) {
            Some(ends) => ends[0] as usize..ends[1] as usize,
            None => 0..0,
        };
        let wrong = |entry| InputError::Stream { cell, entry };
        let Some(&count) = self.faces[ends.clone()].first() else {
            return Err(wrong(ends.start));
        };
        let (mut entry, mut darts) = (ends.start + 1, 0);
        for _ in 0..count {
            if entry >= ends.end {
                return Err(wrong(entry));
            }
            let length = self.faces[entry] as usize;
            if length < 3 || length > ends.end - entry - 1 {
                return Err(wrong(entry));
            }
            let ring = entry + 1..entry + 1 + length;
            self.check_vertices("faces", ring.start, &self.faces[ring.clone()])?;
            (entry, darts) = (ring.end, darts + length);
        }
        if entry != ends.end || count < 2 {
            return Err(wrong(entry.min(ends.end)));
        }
        Ok((darts, count as usize))
    }
}

fn at_most(what: &'static str, found: usize, limit: usize) -> Result<(), InputError> {
    if found <= limit {
        return Ok(());
    }
    Err(InputError::TooMany { what, found, limit })
}

fn check_offsets(
    column: &'static str,
    offsets: &[u32],
    cells: usize,
    length: usize,
) -> Result<(), InputError> {
    let wrong = |entry| InputError::Offsets {
        column,
        entry,
        length,
    };
    if offsets.len() != cells + 1 {
        return Err(wrong(offsets.len()));
    }
    if offsets[0] != 0 {
        return Err(wrong(0));
    }
    if let Some(at) = offsets.windows(2).position(|pair| pair[1] < pair[0]) {
        return Err(wrong(at + 1));
    }
    if offsets[cells] as usize != length {
        return Err(wrong(cells));
    }
    Ok(())
}
