//! Meshes as VTK files, coordinates bit for bit: legacy VTK (`.vtk`, binary) and VTU (`.vtu`, XML with inline text).

use std::io::{self, Write};

use sinew_mesh::{Cell, Grid};

/// Which of VTK's file formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `.vtk`: legacy 3.0, binary.
    Legacy,
    /// `.vtu`: XML unstructured grid, text.
    Vtu,
}

impl Format {
    /// What the file's name says.
    pub fn of(path: &std::path::Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "vtk" => Some(Self::Legacy),
            "vtu" => Some(Self::Vtu),
            _ => None,
        }
    }
}

/// Writes a checked grid.
///
/// # Errors
/// What the writer says.
///
/// # Panics
/// If the grid would not pass [`Grid::check`].
pub fn write(grid: &Grid, format: Format, to: &mut impl Write) -> io::Result<()> {
    match format {
        Format::Legacy => write_legacy(grid, to),
        Format::Vtu => write_vtu(grid, to),
    }
}

fn write_legacy(grid: &Grid, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "# vtk DataFile Version 3.0\nSinew\nBINARY")?;
    writeln!(to, "DATASET UNSTRUCTURED_GRID")?;
    writeln!(to, "POINTS {} double", grid.positions.len())?;
    for coordinate in grid.positions.iter().flatten() {
        to.write_all(&coordinate.to_be_bytes())?;
    }
    let size: usize = grid.cells.iter().map(|cell| 1 + entry(cell).len()).sum();
    writeln!(to, "\nCELLS {} {size}", grid.cells.len())?;
    for cell in grid.cells.iter() {
        let entry = entry(cell);
        let length = u32::try_from(entry.len()).expect("columns stay below u32::MAX");
        for number in std::iter::once(&length).chain(entry) {
            to.write_all(&number.to_be_bytes())?;
        }
    }
    writeln!(to, "\nCELL_TYPES {}", grid.cells.len())?;
    for kind in &grid.cells.types {
        to.write_all(&u32::from(*kind).to_be_bytes())?;
    }
    writeln!(to)
}

/// In the legacy format a polyhedron's face stream stands in place of its vertices.
fn entry(cell: Cell<'_>) -> &[u32] {
    if cell.face_stream.is_empty() {
        cell.vertices
    } else {
        cell.face_stream
    }
}

fn write_vtu(grid: &Grid, to: &mut impl Write) -> io::Result<()> {
    let cells = &grid.cells;
    writeln!(to, r#"<?xml version="1.0"?>"#)?;
    writeln!(
        to,
        r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">"#
    )?;
    writeln!(to, "<UnstructuredGrid>")?;
    writeln!(
        to,
        r#"<Piece NumberOfPoints="{}" NumberOfCells="{}">"#,
        grid.positions.len(),
        cells.len()
    )?;
    writeln!(to, "<Points>")?;
    // The shortest decimal that reads back as the same number.
    let coordinates = grid.positions.iter().flatten();
    array(
        to,
        r#"type="Float64" Name="Points" NumberOfComponents="3""#,
        3,
        coordinates,
    )?;
    writeln!(to, "</Points>\n<Cells>")?;
    array(
        to,
        r#"type="Int64" Name="connectivity""#,
        16,
        &cells.connectivity,
    )?;
    // VTU's offsets say where cells end.
    array(
        to,
        r#"type="Int64" Name="offsets""#,
        16,
        cells.offsets.iter().skip(1),
    )?;
    array(to, r#"type="UInt8" Name="types""#, 32, &cells.types)?;
    if !cells.face_offsets.is_empty() {
        array(to, r#"type="Int64" Name="faces""#, 16, &cells.faces)?;
        let ends = cells.face_offsets.windows(2).map(|ends| match ends {
            [start, end] if start < end => i64::from(*end),
            _ => -1, // no polyhedron
        });
        array(to, r#"type="Int64" Name="faceoffsets""#, 16, ends)?;
    }
    writeln!(to, "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}

/// One `DataArray` with so many numbers to a line.
fn array<T: std::fmt::Display>(
    to: &mut impl Write,
    attributes: &str,
    per_line: usize,
    numbers: impl IntoIterator<Item = T>,
) -> io::Result<()> {
    writeln!(to, r#"<DataArray {attributes} format="ascii">"#)?;
    for (index, number) in numbers.into_iter().enumerate() {
        let space = if index == 0 {
            ""
        } else if index % per_line == 0 {
            "\n"
        } else {
            " "
        };
        write!(to, "{space}{number}")?;
    }
    writeln!(to, "\n</DataArray>")
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use sinew_formats::mesh;
    use sinew_mesh::{CellType, Cells};

    use super::*;

    /// One cell of each of three kinds: hexahedron, polyhedron (a tetrahedron by its faces), wedge.
    fn mixed(numbers: [f64; 18]) -> Grid {
        let mut cells = Cells::default();
        cells.push(Cell {
            kind: CellType::Hexahedron,
            vertices: &[0, 1, 2, 3, 4, 5, 6, 7],
            face_stream: &[],
        });
        cells.push(Cell {
            kind: CellType::Polyhedron,
            vertices: &[4, 5, 6, 8],
            face_stream: &[4, 3, 4, 5, 6, 3, 4, 8, 5, 3, 5, 8, 6, 3, 6, 8, 4],
        });
        cells.push(Cell {
            kind: CellType::Wedge,
            vertices: &[0, 1, 2, 4, 5, 6],
            face_stream: &[],
        });
        let positions = (0..9)
            .map(|i| Vector3::new(numbers[i], numbers[i + 9], 0.1))
            .collect();
        Grid { positions, cells }
    }

    proptest! {
        #[test]
        fn what_is_written_reads_back_bit_for_bit(numbers in any::<[f64; 18]>()) {
            prop_assume!(numbers.iter().all(|x| x.is_finite()));
            let grid = mixed(numbers);
            for (format, name) in [(Format::Legacy, "mesh.vtk"), (Format::Vtu, "mesh.vtu")] {
                let mut file = Vec::new();
                write(&grid, format, &mut file).unwrap();
                let read = mesh::parse(name, &file).unwrap().grid;
                prop_assert_eq!(&read.cells.types, &grid.cells.types);
                prop_assert_eq!(&read.cells.faces, &grid.cells.faces);
                prop_assert_eq!(&read.cells.connectivity, &grid.cells.connectivity);
                prop_assert_eq!(&read.positions, &grid.positions);
            }
        }
    }

    #[test]
    fn an_empty_mesh_is_a_file_too() {
        for format in [Format::Legacy, Format::Vtu] {
            write(&Grid::default(), format, &mut Vec::new()).unwrap();
        }
    }
}
