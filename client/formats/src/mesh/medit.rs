//! Medit files: text (`.mesh`) and binary (`.meshb`).

use nalgebra::Vector3;
use sinew_mesh::CellType;

use super::assembly::Assembly;
use super::cursor::{Cursor, least_size, shown};
use super::error::Parsed;
use super::scalar::{Encoding, Endian, Scalar};

/// What a section holds: vertices per entry, and the cell that they make; none for edges.
#[derive(Clone, Copy)]
struct Section {
    vertices: usize,
    kind: Option<CellType>,
}

/// Sections with cells, by their name in text and their number in binary files.
const SECTIONS: [(&str, i64, usize, Option<CellType>); 11] = [
    ("Edges", 5, 2, None),
    ("Triangles", 6, 3, Some(CellType::Triangle)),
    ("Quadrilaterals", 7, 4, Some(CellType::Quad)),
    ("Tetrahedra", 8, 4, Some(CellType::Tetrahedron)),
    ("Prisms", 9, 6, Some(CellType::Wedge)),
    ("Hexahedra", 10, 8, Some(CellType::Hexahedron)),
    ("Pyramids", 49, 5, Some(CellType::Pyramid)),
    ("EdgesP2", 25, 3, None),
    ("TrianglesP2", 24, 6, Some(CellType::Triangle)),
    ("QuadrilateralsQ2", 27, 9, Some(CellType::Quad)),
    ("TetrahedraP2", 30, 10, Some(CellType::Tetrahedron)),
];

struct Reader<'a> {
    cursor: Cursor<'a>,
    encoding: Encoding,
    real: Scalar,
    integer: Scalar,
    dimension: usize,
    assembly: Assembly,
}

impl<'a> Reader<'a> {
    fn new(cursor: Cursor<'a>, encoding: Encoding) -> Self {
        Self {
            cursor,
            encoding,
            real: Scalar::F64,
            integer: Scalar::I32,
            dimension: 3,
            assembly: Assembly::default(),
        }
    }

    fn set_dimension(&mut self, dimension: i64) -> Parsed<()> {
        self.dimension = match dimension {
            2 => 2,
            3 => 3,
            _ => {
                let reason = format!("dimension {dimension}: a mesh has 2 or 3");
                return Err(self.cursor.flaw(reason));
            }
        };
        Ok(())
    }

    fn count(&mut self, numbers: usize, kind: Scalar) -> Parsed<usize> {
        let count = self
            .cursor
            .integer(self.encoding, self.integer, "a number of entries")?;
        let least = numbers * least_size(self.encoding, kind);
        self.cursor.claim(count, least, "entries")
    }

    fn vertices(&mut self) -> Parsed<()> {
        if !self.assembly.positions.is_empty() {
            return Err(self.cursor.flaw("a second section of vertices"));
        }
        for _ in 0..self.count(self.dimension + 1, self.real)? {
            let mut position = Vector3::zeros();
            for axis in 0..self.dimension {
                position[axis] = self.cursor.real(self.encoding, self.real, "a coordinate")?;
            }
            self.assembly.positions.push(position);
            self.reference()?;
        }
        Ok(())
    }

    fn cells(&mut self, section: Section) -> Parsed<()> {
        let vertices = self.assembly.positions.len();
        let mut cell = vec![0; section.vertices];
        for _ in 0..self.count(section.vertices + 1, self.integer)? {
            for vertex in &mut cell {
                *vertex = self
                    .cursor
                    .vertex(self.encoding, self.integer, 1, vertices)?;
            }
            match section.kind {
                None => self.assembly.skip(),
                Some(kind) => self
                    .assembly
                    .cell_with_facing_wedges(kind, &cell)
                    .map_err(|reason| self.cursor.flaw(reason))?,
            }
            self.reference()?;
        }
        Ok(())
    }

    /// The number of the region, which ends every entry.
    fn reference(&mut self) -> Parsed<()> {
        self.cursor
            .integer(self.encoding, self.integer, "a region")
            .map(drop)
    }
}

/// Reads a text file.
pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut reader = Reader::new(Cursor::with_comments(bytes), Encoding::Text);
    while let Some(word) = reader.cursor.word() {
        let section = SECTIONS.iter().find(|entry| entry.0.as_bytes() == word);
        match (word, section) {
            (b"MeshVersionFormatted", _) => {
                reader.cursor.number::<i64>("the version")?;
            }
            (b"Dimension", _) => {
                let dimension = reader.cursor.number("the dimension")?;
                reader.set_dimension(dimension)?;
            }
            (b"Vertices", _) => reader.vertices()?,
            (b"End", _) => break,
            (_, Some(&(_, _, vertices, kind))) => reader.cells(Section { vertices, kind })?,
            // Corners, ridges, normals and the like: passed up to the next name.
            _ if word[0].is_ascii_alphabetic() => {
                while reader
                    .cursor
                    .peek()
                    .is_some_and(|next| !next[0].is_ascii_alphabetic())
                {
                    reader.cursor.word();
                }
            }
            _ => {
                let reason = format!("expected the name of a section, found {}", shown(word));
                return Err(reader.cursor.flaw(reason));
            }
        }
    }
    Ok(reader.assembly)
}

/// Reads a binary file: sections chained by the position of the next.
pub(super) fn parse_binary(bytes: &[u8]) -> Parsed<Assembly> {
    const DIMENSION: i64 = 3;
    const VERTICES: i64 = 4;
    const END: i64 = 54;
    let endian = if bytes.starts_with(&[1]) {
        Endian::Little
    } else {
        Endian::Big
    };
    let mut reader = Reader::new(Cursor::new(bytes), Encoding::Binary(endian));
    reader.cursor.take(4, "the number 1")?;
    let version = reader
        .cursor
        .integer(reader.encoding, Scalar::I32, "the version")?;
    if version == 1 {
        reader.real = Scalar::F32;
    }
    if version >= 4 {
        reader.integer = Scalar::I64;
    }
    let position = if version < 3 {
        Scalar::I32
    } else {
        Scalar::I64
    };
    loop {
        let number =
            reader
                .cursor
                .integer(reader.encoding, Scalar::I32, "the number of a section")?;
        if number == END {
            return Ok(reader.assembly);
        }
        let next = reader.cursor.integer(
            reader.encoding,
            position,
            "the position of the next section",
        )?;
        let next = usize::try_from(next)
            .ok()
            .filter(|&next| next > reader.cursor.at() && next <= bytes.len())
            .ok_or_else(|| {
                let reason = format!("the next section is said to start at byte {next}");
                reader.cursor.flaw(reason)
            })?;
        let section = SECTIONS.iter().find(|entry| entry.1 == number);
        match (number, section) {
            (DIMENSION, _) => {
                let dimension =
                    reader
                        .cursor
                        .integer(reader.encoding, Scalar::I32, "the dimension")?;
                reader.set_dimension(dimension)?;
            }
            (VERTICES, _) => reader.vertices()?,
            (_, Some(&(_, _, vertices, kind))) => reader.cells(Section { vertices, kind })?,
            _ => {}
        }
        reader.cursor = reader.cursor.starting(next);
    }
}
