//! Legacy VTK files (`.vtk`), text and binary, versions 1 to 5: unstructured grids and polygonal data.

use super::assembly::Assembly;
use super::cursor::{Cursor, least_size, shown};
use super::error::Parsed;
use super::scalar::{Encoding, Endian, Scalar};
use super::vtk_cells;

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut cursor = Cursor::new(bytes);
    cursor.line(); // "# vtk DataFile Version x.y"
    cursor.line(); // title
    let format = cursor.text("ASCII or BINARY")?;
    let encoding = match format.to_ascii_uppercase().as_str() {
        "ASCII" => Encoding::Text,
        "BINARY" => Encoding::Binary(Endian::Big),
        _ => {
            return Err(cursor.flaw(format!(
                "expected ASCII or BINARY, found {}",
                shown(format.as_bytes())
            )));
        }
    };
    cursor.keyword("DATASET")?;
    let dataset = cursor.text("a kind of data set")?;
    if !["UNSTRUCTURED_GRID", "POLYDATA"].contains(&dataset.to_ascii_uppercase().as_str()) {
        return Err(cursor.flaw(format!(
            "data set {}: only UNSTRUCTURED_GRID and POLYDATA are meshes of cells; convert the file",
            shown(dataset.as_bytes())
        )));
    }
    let mut reader = Reader {
        cursor,
        encoding,
        assembly: Assembly::default(),
        cells: None,
    };
    reader.sections()?;
    Ok(reader.assembly)
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    encoding: Encoding,
    assembly: Assembly,
    /// The cells of an unstructured grid, until their types are known.
    cells: Option<Lists>,
}

/// Lists of numbers, one after the other.
struct Lists {
    /// Where each list ends in `numbers`.
    ends: Vec<usize>,
    numbers: Vec<i64>,
}

impl Lists {
    fn iter(&self) -> impl Iterator<Item = &[i64]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts
            .zip(&self.ends)
            .map(|(&start, &end)| &self.numbers[start..end])
    }
}

impl Reader<'_> {
    fn sections(&mut self) -> Parsed<()> {
        while let Some(word) = self.cursor.word() {
            match word.to_ascii_uppercase().as_slice() {
                b"POINTS" => self.points()?,
                b"CELLS" => self.cells = Some(self.lists()?),
                b"CELL_TYPES" => self.cell_types()?,
                b"POLYGONS" => self.polygons(7)?,
                b"TRIANGLE_STRIPS" => self.polygons(6)?,
                b"LINES" => self.polygons(4)?,
                b"VERTICES" => self.polygons(2)?,
                b"FIELD" => self.skip_field()?,
                b"METADATA" => {
                    self.cursor.line();
                    while !self.cursor.line().is_empty() {}
                }
                // Values on cells or points: nothing of the mesh follows.
                b"CELL_DATA" | b"POINT_DATA" => break,
                _ => {
                    return Err(self.cursor.flaw(format!(
                        "expected a section of the file, found {}",
                        shown(word)
                    )));
                }
            }
        }
        match self.cells {
            Some(_) => Err(self.cursor.flaw("the cells have no CELL_TYPES")),
            None => Ok(()),
        }
    }

    fn points(&mut self) -> Parsed<()> {
        let count = self.cursor.number("the number of points")?;
        let kind = self.kind()?;
        self.start_numbers()?;
        let least = 3 * least_size(self.encoding, kind);
        let count = self.cursor.claim(count, least, "points")?;
        self.assembly.positions = (0..count)
            .map(|_| self.cursor.point(self.encoding, kind))
            .collect::<Parsed<_>>()?;
        Ok(())
    }

    /// Cells as lists of numbers: each preceded by its length, or since version 5 as two arrays.
    fn lists(&mut self) -> Parsed<Lists> {
        let first = self.cursor.number("a count of cells")?;
        let second = self.cursor.number("a count of numbers")?;
        let mut ahead = self.cursor.clone();
        if ahead
            .word()
            .is_some_and(|word| word.eq_ignore_ascii_case(b"OFFSETS"))
        {
            self.cursor = ahead;
            return self.two_arrays(first, second);
        }
        self.start_numbers()?;
        let total = self.claim(second, Scalar::I32)?;
        let count = self.claim(first, Scalar::I32)?;
        let mut lists = Lists {
            ends: Vec::with_capacity(count),
            numbers: Vec::with_capacity(total),
        };
        for _ in 0..count {
            let length = self.integer(Scalar::I32)?;
            for _ in 0..self.claim(length, Scalar::I32)? {
                lists.numbers.push(self.integer(Scalar::I32)?);
            }
            lists.ends.push(lists.numbers.len());
        }
        if lists.numbers.len() + count == total {
            return Ok(lists);
        }
        Err(self.cursor.flaw(format!(
            "{count} cells hold {} numbers, but {total} are claimed",
            lists.numbers.len() + count
        )))
    }

    fn two_arrays(&mut self, offsets: i64, connectivity: i64) -> Parsed<Lists> {
        let offsets = self.array(offsets)?;
        self.cursor.keyword("CONNECTIVITY")?;
        let numbers = self.array(connectivity)?;
        let rising = offsets.windows(2).all(|pair| pair[0] <= pair[1]);
        let ends: Option<Vec<usize>> = offsets
            .iter()
            .map(|&end| {
                usize::try_from(end)
                    .ok()
                    .filter(|&end| end <= numbers.len())
            })
            .collect();
        match ends {
            Some(mut ends) if rising && ends.first().is_none_or(|&first| first == 0) => {
                ends.drain(..ends.len().min(1));
                Ok(Lists { ends, numbers })
            }
            _ => Err(self.cursor.flaw(format!(
                "the offsets of the cells must rise from 0 and stay within {} numbers",
                numbers.len()
            ))),
        }
    }

    fn array(&mut self, count: i64) -> Parsed<Vec<i64>> {
        let kind = self.kind()?;
        self.start_numbers()?;
        (0..self.claim(count, kind)?)
            .map(|_| self.integer(kind))
            .collect()
    }

    fn cell_types(&mut self) -> Parsed<()> {
        let count: i64 = self.cursor.number("the number of cell types")?;
        self.start_numbers()?;
        let count = self.claim(count, Scalar::I32)?;
        let Some(cells) = self.cells.take() else {
            return Err(self.cursor.flaw("CELL_TYPES before CELLS"));
        };
        if count != cells.ends.len() {
            let reason = format!("{count} types for {} cells", cells.ends.len());
            return Err(self.cursor.flaw(reason));
        }
        for (cell, numbers) in cells.iter().enumerate() {
            let kind = self.integer(Scalar::I32)?;
            self.add(cell, kind, numbers)?;
        }
        Ok(())
    }

    fn polygons(&mut self, kind: i64) -> Parsed<()> {
        let lists = self.lists()?;
        for (cell, numbers) in lists.iter().enumerate() {
            self.add(cell, kind, numbers)?;
        }
        Ok(())
    }

    fn add(&mut self, cell: usize, kind: i64, numbers: &[i64]) -> Parsed<()> {
        let vertices = self.assembly.positions.len();
        let check = |number| self.cursor.in_range(number, 0, vertices, "vertex");
        let checked = if vtk_cells::is_polyhedron(kind) {
            vtk_cells::check_stream(numbers, check)
        } else {
            numbers.iter().map(|&number| check(number)).collect()
        };
        checked
            .and_then(|vertices| {
                vtk_cells::add(&mut self.assembly, kind, &vertices)
                    .map_err(|reason| self.cursor.flaw(reason))
            })
            .map_err(|mut flaw| {
                flaw.reason = format!("cell {cell}: {}", flaw.reason);
                flaw
            })
    }

    /// Passes `FIELD name arrays`, each array `name components tuples type` and its values.
    fn skip_field(&mut self) -> Parsed<()> {
        self.cursor.text("the name of a field")?;
        for _ in 0..self.cursor.count(1, "arrays of a field")? {
            self.cursor.text("the name of an array")?;
            let components: i64 = self.cursor.number("a number of components")?;
            let tuples: i64 = self.cursor.number("a number of tuples")?;
            let type_name = self.cursor.text("a type of numbers")?;
            let total = components.saturating_mul(tuples);
            match scalar(type_name) {
                Some(kind) => {
                    self.start_numbers()?;
                    for _ in 0..self.claim(total, kind)? {
                        match self.encoding {
                            Encoding::Text => self.cursor.text("a value of a field").map(drop)?,
                            Encoding::Binary(_) => {
                                self.cursor.take(kind.size(), "a value").map(drop)?;
                            }
                        }
                    }
                }
                None => {
                    let reason =
                        format!("field of {}: cannot be passed", shown(type_name.as_bytes()));
                    return Err(self.cursor.flaw(reason));
                }
            }
        }
        Ok(())
    }

    /// Binary numbers start right after the line that announces them.
    fn start_numbers(&mut self) -> Parsed<()> {
        match self.encoding {
            Encoding::Text => Ok(()),
            Encoding::Binary(_) => self.cursor.end_line(),
        }
    }

    fn kind(&mut self) -> Parsed<Scalar> {
        let name = self.cursor.text("a type of numbers")?;
        scalar(name).ok_or_else(|| {
            self.cursor
                .flaw(format!("{} is no type of numbers", shown(name.as_bytes())))
        })
    }

    fn claim(&self, count: i64, kind: Scalar) -> Parsed<usize> {
        let least = least_size(self.encoding, kind);
        self.cursor.claim(count, least, "numbers")
    }

    fn integer(&mut self, kind: Scalar) -> Parsed<i64> {
        self.cursor.integer(self.encoding, kind, "a whole number")
    }
}

/// VTK's names of number types; `long` has eight bytes, as on every system that writes such files today.
fn scalar(name: &str) -> Option<Scalar> {
    Some(match name.to_ascii_lowercase().as_str() {
        "char" => Scalar::I8,
        "unsigned_char" => Scalar::U8,
        "short" => Scalar::I16,
        "unsigned_short" => Scalar::U16,
        "int" => Scalar::I32,
        "unsigned_int" => Scalar::U32,
        "long" | "vtktypeint64" | "vtkidtype" => Scalar::I64,
        "unsigned_long" => Scalar::U64,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        _ => return None,
    })
}
