//! Whether the columns of a grid make sense together.

use thiserror::Error;

use crate::{CellType, Cells, Grid};

/// Why columns are no grid: the column, the entry in it and the value there.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GridError {
    /// More entries than can be numbered.
    #[error(
        "column `{column}` has {found} entries, more than the {limit} that can be numbered; split the mesh"
    )]
    TooMany {
        /// Name of the column.
        column: &'static str,
        /// Entries in it.
        found: usize,
        /// Entries allowed.
        limit: usize,
    },
    /// A column with one entry per cell, or one more, has another length.
    #[error("column `{column}` has {found} entries, but {cells} cells need {expected}")]
    Length {
        /// Name of the column.
        column: &'static str,
        /// Entries in it.
        found: usize,
        /// Entries needed.
        expected: usize,
        /// Number of cells.
        cells: usize,
    },
    /// Face streams without offsets into them.
    #[error("column `faces` has {found} entries, but column `face_offsets` is empty")]
    StrayFaces {
        /// Entries in `faces`.
        found: usize,
    },
    /// No known kind of cell has this number.
    #[error(
        "column `types`, entry {cell}, value {value}: not a known cell type (0, 5, 7, 9, 10, 12, 13, 14, 15, 16 or 42)"
    )]
    UnknownType {
        /// The cell.
        cell: usize,
        /// Its type number.
        value: u8,
    },
    /// Offsets that do not begin with 0.
    #[error("column `{column}`, entry 0, value {value}: the first offset must be 0")]
    FirstOffset {
        /// Name of the column.
        column: &'static str,
        /// The first offset.
        value: u32,
    },
    /// Offsets that decrease.
    #[error(
        "column `{column}`, entry {entry}, value {value}: less than the entry before, {before}"
    )]
    DecreasingOffset {
        /// Name of the column.
        column: &'static str,
        /// Entry in it.
        entry: usize,
        /// The offset.
        value: u32,
        /// The one before.
        before: u32,
    },
    /// Offsets that do not end where their data end.
    #[error(
        "column `{column}`, entry {entry}, value {value}: the last offset must be the {length} entries of `{into}`"
    )]
    LastOffset {
        /// Name of the column.
        column: &'static str,
        /// Entry in it.
        entry: usize,
        /// The offset.
        value: u32,
        /// The column that the offsets point into.
        into: &'static str,
        /// Its length.
        length: usize,
    },
    /// A cell with another number of vertices than its kind has.
    #[error(
        "column `offsets`, entry {cell}: cell {cell} has {found} vertices, but a {kind:?} has {expected}"
    )]
    VertexCount {
        /// The cell.
        cell: usize,
        /// Its kind.
        kind: CellType,
        /// Vertices that it has.
        found: usize,
        /// Vertices that it should have, in words.
        expected: &'static str,
    },
    /// An index beyond the last vertex.
    #[error(
        "column `{column}`, entry {entry}, value {value}: there are only {vertices} vertices, numbered from 0"
    )]
    IndexOutOfRange {
        /// Name of the column.
        column: &'static str,
        /// Entry in it.
        entry: usize,
        /// The index.
        value: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A face stream for a cell that is no polyhedron, or none for one that is.
    #[error(
        "column `face_offsets`, entry {cell}: cell {cell} is a {kind:?} with a face stream of {found} entries; polyhedra have one and other cells none"
    )]
    StreamPresence {
        /// The cell.
        cell: usize,
        /// Its kind.
        kind: CellType,
        /// Entries in its stream.
        found: usize,
    },
    /// Too few faces in a polyhedron, or too few vertices in a face.
    #[error(
        "column `faces`, entry {entry}, value {value}: {what} of cell {cell} must be {least} or more"
    )]
    TooFew {
        /// Entry of `faces`.
        entry: usize,
        /// The count there.
        value: u32,
        /// The polyhedron.
        cell: usize,
        /// What is counted.
        what: &'static str,
        /// The least count.
        least: u32,
    },
    /// A stream that ends before, or after, what its counts say.
    #[error(
        "column `faces`, entry {entry}: the face stream of cell {cell} ends at entry {end}, which its counts do not meet"
    )]
    StreamLength {
        /// Entry of `faces` where the counts fail.
        entry: usize,
        /// The polyhedron.
        cell: usize,
        /// Entry where the cell's stream ends.
        end: usize,
    },
    /// A polyhedron whose `connectivity` is not the set of its faces' vertices.
    #[error("column `{column}`, entry {entry}, value {value}: {problem} of polyhedron {cell}")]
    PolyhedronVertices {
        /// Name of the column.
        column: &'static str,
        /// Entry in it.
        entry: usize,
        /// The vertex.
        value: u32,
        /// The polyhedron.
        cell: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// A coordinate that is no number, or infinite.
    #[error(
        "column `positions`, entry {vertex}, value {value} at axis {axis}: every coordinate must be finite"
    )]
    NotFinite {
        /// The vertex.
        vertex: usize,
        /// 0, 1 or 2 for x, y or z.
        axis: usize,
        /// The coordinate.
        value: f64,
    },
}

impl Grid {
    /// Checks that the columns make sense together. Time and memory are linear in the size of the columns.
    ///
    /// What is wrong with the *shape* of a sound grid (inverted cells, holes, …), [`inspect`](crate::inspect) tells.
    ///
    /// # Errors
    /// The first [`GridError`] found.
    pub fn check(&self) -> Result<(), GridError> {
        at_most("positions", self.positions.len(), u32::MAX as usize)?;
        for (vertex, position) in self.positions.iter().enumerate() {
            if let Some(axis) = (0..3).find(|&axis| !position[axis].is_finite()) {
                let value = position[axis];
                return Err(GridError::NotFinite {
                    vertex,
                    axis,
                    value,
                });
            }
        }
        self.cells.check(self.positions.len())
    }
}

impl Cells {
    /// Checks that the columns make sense together, for `vertices` vertices. Time and memory are linear in the size of
    /// the columns and in `vertices`.
    ///
    /// # Errors
    /// The first [`GridError`] found.
    pub fn check(&self, vertices: usize) -> Result<(), GridError> {
        // Faces are numbered by u32, and a cell never has more faces than entries in both columns together.
        let entries = self.connectivity.len().saturating_add(self.faces.len());
        at_most("connectivity` and `faces", entries, u32::MAX as usize)?;
        at_most("types", self.types.len(), u32::MAX as usize - 1)?;
        let cells = self.len();
        check_offsets(
            "offsets",
            &self.offsets,
            cells,
            "connectivity",
            self.connectivity.len(),
        )?;
        check_indices("connectivity", 0, &self.connectivity, vertices)?;
        if !self.face_offsets.is_empty() {
            check_offsets(
                "face_offsets",
                &self.face_offsets,
                cells,
                "faces",
                self.faces.len(),
            )?;
        } else if !self.faces.is_empty() {
            let found = self.faces.len();
            return Err(GridError::StrayFaces { found });
        }
        let mut seen = Vec::new();
        for (cell, &value) in self.types.iter().enumerate() {
            let kind =
                CellType::from_number(value).ok_or(GridError::UnknownType { cell, value })?;
            let found = (self.offsets[cell + 1] - self.offsets[cell]) as usize;
            if let Some(expected) = wrong_count(kind, found) {
                return Err(GridError::VertexCount {
                    cell,
                    kind,
                    found,
                    expected,
                });
            }
            let stream = match self.face_offsets.get(cell..cell + 2) {
                Some(ends) => ends[0] as usize..ends[1] as usize,
                None => 0..0,
            };
            if stream.is_empty() == (kind == CellType::Polyhedron) {
                let found = stream.len();
                return Err(GridError::StreamPresence { cell, kind, found });
            }
            if kind == CellType::Polyhedron {
                self.check_stream(cell, stream.start, stream.end, vertices)?;
                seen.resize(vertices, 0);
                self.check_polyhedron_vertices(cell, &mut seen)?;
            }
        }
        Ok(())
    }

    /// The counts in a polyhedron's stream, `faces[start..end]`, and its indices.
    fn check_stream(
        &self,
        cell: usize,
        start: usize,
        end: usize,
        vertices: usize,
    ) -> Result<(), GridError> {
        let too_few = |entry, value, what, least| GridError::TooFew {
            entry,
            value,
            cell,
            what,
            least,
        };
        let faces = self.faces[start];
        if faces < 4 {
            return Err(too_few(start, faces, "the face count", 4));
        }
        let mut entry = start + 1;
        for _ in 0..faces {
            if entry == end {
                return Err(GridError::StreamLength { entry, cell, end });
            }
            let count = self.faces[entry];
            if count < 3 {
                return Err(too_few(entry, count, "a face's vertex count", 3));
            }
            let ring = entry + 1;
            if count as usize > end - ring {
                return Err(GridError::StreamLength { entry, cell, end });
            }
            entry = ring + count as usize;
            check_indices("faces", ring, &self.faces[ring..entry], vertices)?;
        }
        if entry == end {
            Ok(())
        } else {
            Err(GridError::StreamLength { entry, cell, end })
        }
    }

    /// That a polyhedron's connectivity holds each vertex of its faces, once. `seen` keeps one mark per vertex between
    /// calls: 2 `cell` + 1 where the connectivity of `cell` has the vertex, one more where a face has it, too.
    fn check_polyhedron_vertices(&self, cell: usize, seen: &mut [u64]) -> Result<(), GridError> {
        let wrong = |column, entry, value, problem| GridError::PolyhedronVertices {
            column,
            entry,
            value,
            cell,
            problem,
        };
        let listed = 2 * cell as u64 + 1;
        let used = listed + 1;
        let entries = self.offsets[cell] as usize..self.offsets[cell + 1] as usize;
        for entry in entries.clone() {
            let value = self.connectivity[entry];
            if seen[value as usize] == listed {
                let problem = "named before among the vertices";
                return Err(wrong("connectivity", entry, value, problem));
            }
            seen[value as usize] = listed;
        }
        let mut entry = self.face_offsets[cell] as usize + 1;
        while entry < self.face_offsets[cell + 1] as usize {
            let ring = entry + 1;
            entry = ring + self.faces[entry] as usize;
            for (at, &value) in (ring..entry).zip(&self.faces[ring..entry]) {
                if seen[value as usize] != listed && seen[value as usize] != used {
                    return Err(wrong("faces", at, value, "missing from the connectivity"));
                }
                seen[value as usize] = used;
            }
        }
        for entry in entries {
            let value = self.connectivity[entry];
            if seen[value as usize] != used {
                return Err(wrong("connectivity", entry, value, "in no face"));
            }
        }
        Ok(())
    }
}

/// In words, how many vertices the kind has, if not `found`.
fn wrong_count(kind: CellType, found: usize) -> Option<&'static str> {
    let (least, most, words) = match kind {
        CellType::Empty => (0, 0, "0"),
        CellType::Triangle => (3, 3, "3"),
        CellType::Quad | CellType::Tetrahedron => (4, 4, "4"),
        CellType::Pyramid => (5, 5, "5"),
        CellType::Wedge => (6, 6, "6"),
        CellType::Hexahedron => (8, 8, "8"),
        CellType::PentagonalPrism => (10, 10, "10"),
        CellType::HexagonalPrism => (12, 12, "12"),
        CellType::Polygon => (3, usize::MAX, "3 or more"),
        CellType::Polyhedron => (4, usize::MAX, "4 or more"),
    };
    (found < least || found > most).then_some(words)
}

pub(crate) fn at_most(column: &'static str, found: usize, limit: usize) -> Result<(), GridError> {
    if found <= limit {
        Ok(())
    } else {
        Err(GridError::TooMany {
            column,
            found,
            limit,
        })
    }
}

fn check_offsets(
    column: &'static str,
    offsets: &[u32],
    cells: usize,
    into: &'static str,
    length: usize,
) -> Result<(), GridError> {
    let found = offsets.len();
    let (Some(&first), Some(&last)) = (offsets.first(), offsets.last()) else {
        return Err(GridError::Length {
            column,
            found,
            expected: cells + 1,
            cells,
        });
    };
    if found != cells + 1 {
        return Err(GridError::Length {
            column,
            found,
            expected: cells + 1,
            cells,
        });
    }
    if first != 0 {
        return Err(GridError::FirstOffset {
            column,
            value: first,
        });
    }
    if let Some(at) = offsets.windows(2).position(|pair| pair[1] < pair[0]) {
        return Err(GridError::DecreasingOffset {
            column,
            entry: at + 1,
            value: offsets[at + 1],
            before: offsets[at],
        });
    }
    if last as usize != length {
        return Err(GridError::LastOffset {
            column,
            entry: cells,
            value: last,
            into,
            length,
        });
    }
    Ok(())
}

/// `indices` are the entries of `column` from `first` on.
fn check_indices(
    column: &'static str,
    first: usize,
    indices: &[u32],
    vertices: usize,
) -> Result<(), GridError> {
    match indices.iter().position(|&index| index as usize >= vertices) {
        None => Ok(()),
        Some(at) => Err(GridError::IndexOutOfRange {
            column,
            entry: first + at,
            value: indices[at],
            vertices,
        }),
    }
}
