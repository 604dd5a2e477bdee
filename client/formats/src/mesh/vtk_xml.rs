//! VTK's XML files: unstructured grids (`.vtu`) and polygonal data (`.vtp`), of one or more pieces.

use std::cell::Cell;

use nalgebra::Vector3;
use roxmltree::{Document, Node};

use super::assembly::Assembly;
use super::cursor::shown;
use super::error::{Flaw, Parsed, Place};
use super::scalar::{Endian, Scalar};
use super::shell::FaceUses;
use super::vtk_cells;
use super::vtk_xml_data::{GREATEST_RATIO, Layout, attribute, flaw_at};

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let (xml, appended_at) = without_appended(bytes)?;
    let document = Document::parse(&xml).map_err(|error| Flaw {
        place: Place::Line(error.pos().row as usize),
        reason: error.to_string(),
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "VTKFile" {
        let reason = format!(
            "{} is no VTK file",
            shown(root.tag_name().name().as_bytes())
        );
        return Err(flaw_at(root, reason));
    }
    let kind = root.attribute("type").unwrap_or_default();
    if kind != "UnstructuredGrid" && kind != "PolyData" {
        let reason = format!(
            "{} is not read: only UnstructuredGrid and PolyData are meshes of cells; convert the file",
            shown(kind.as_bytes())
        );
        return Err(flaw_at(root, reason));
    }
    let layout = layout(root, bytes, appended_at)?;
    let mut assembly = Assembly::default();
    let pieces = root
        .children()
        .filter(|node| node.has_tag_name(kind))
        .flat_map(|node| node.children())
        .filter(|node| node.has_tag_name("Piece"));
    for piece in pieces {
        let base = assembly.positions.len();
        points(&layout, piece, &mut assembly)?;
        let range = base..assembly.positions.len();
        if kind == "PolyData" {
            for (name, cell_type) in [("Verts", 2), ("Lines", 4), ("Strips", 6), ("Polys", 7)] {
                cells(&layout, piece, name, Some(cell_type), &range, &mut assembly)?;
            }
        } else {
            cells(&layout, piece, "Cells", None, &range, &mut assembly)?;
        }
    }
    Ok(assembly)
}

/// The XML before the appended data, which need not be XML, closed; and where those data start.
fn without_appended(bytes: &[u8]) -> Parsed<(String, Option<usize>)> {
    const TAG: &[u8] = b"<AppendedData";
    let tag = bytes.windows(TAG.len()).position(|window| window == TAG);
    let end_of_tag = tag.and_then(|tag| find(bytes, tag, b'>'));
    let (xml, closing, start) = match end_of_tag {
        Some(end) => {
            let underscore = find(bytes, end, b'_')
                .ok_or_else(|| Flaw::whole("the appended data do not start with _"))?;
            (&bytes[..end], "/></VTKFile>", Some(underscore + 1))
        }
        None => (bytes, "", None),
    };
    let text = std::str::from_utf8(xml).map_err(|error| Flaw {
        place: Place::Byte(error.valid_up_to()),
        reason: "the XML is not UTF-8".to_owned(),
    })?;
    Ok((format!("{text}{closing}"), start))
}

fn find(bytes: &[u8], from: usize, wanted: u8) -> Option<usize> {
    let place = bytes[from..].iter().position(|&byte| byte == wanted)?;
    Some(from + place)
}

fn layout<'a>(
    root: Node<'_, '_>,
    bytes: &'a [u8],
    appended_at: Option<usize>,
) -> Parsed<Layout<'a>> {
    let unknown = |name: &str, value: &str| {
        flaw_at(
            root,
            format!("{name} {}: not read", shown(value.as_bytes())),
        )
    };
    let endian = match root.attribute("byte_order") {
        Some("LittleEndian") | None => Endian::Little,
        Some("BigEndian") => Endian::Big,
        Some(other) => return Err(unknown("byte_order", other)),
    };
    let header = match root.attribute("header_type") {
        Some("UInt32") | None => Scalar::U32,
        Some("UInt64") => Scalar::U64,
        Some(other) => return Err(unknown("header_type", other)),
    };
    let compressed = match root.attribute("compressor") {
        None | Some("") => false,
        Some("vtkZLibDataCompressor") => true,
        Some(other) => {
            let reason = format!(
                "compressor {}: save the file with zlib or without compression",
                shown(other.as_bytes())
            );
            return Err(flaw_at(root, reason));
        }
    };
    let appended = match (appended_at, child(root, "AppendedData")) {
        (Some(start), Some(node)) => match node.attribute("encoding") {
            Some("raw") => Some((start, true)),
            Some("base64") => Some((start, false)),
            other => return Err(unknown("encoding", other.unwrap_or_default())),
        },
        _ => None,
    };
    Ok(Layout {
        bytes,
        endian,
        header,
        compressed,
        appended,
        budget: Cell::new(GREATEST_RATIO.saturating_mul(bytes.len())),
    })
}

fn points(layout: &Layout<'_>, piece: Node<'_, '_>, assembly: &mut Assembly) -> Parsed<()> {
    let claimed: usize = attribute(piece, "NumberOfPoints")?;
    let array = child(piece, "Points").and_then(|points| child(points, "DataArray"));
    let coordinates = match array {
        Some(array) => layout.reals(array)?,
        None => Vec::new(),
    };
    let (triples, rest) = coordinates.as_chunks::<3>();
    if triples.len() != claimed || !rest.is_empty() {
        let reason = format!(
            "{claimed} points are claimed, but there are {} coordinates",
            coordinates.len()
        );
        return Err(flaw_at(array.unwrap_or(piece), reason));
    }
    assembly
        .positions
        .extend(triples.iter().map(|&triple| Vector3::from(triple)));
    Ok(())
}

/// The cells of one group; their types are in the file, or all `cell_type`.
fn cells(
    layout: &Layout<'_>,
    piece: Node<'_, '_>,
    group: &str,
    cell_type: Option<i64>,
    vertices: &std::ops::Range<usize>,
    assembly: &mut Assembly,
) -> Parsed<()> {
    let Some(group) = child(piece, group) else {
        return Ok(());
    };
    let connectivity = integers(layout, group, "connectivity")?;
    let offsets = integers(layout, group, "offsets")?;
    let types = match cell_type {
        Some(cell_type) => vec![cell_type; offsets.len()],
        None => integers(layout, group, "types")?,
    };
    if types.len() != offsets.len() {
        let reason = format!("{} types for {} cells", types.len(), offsets.len());
        return Err(flaw_at(group, reason));
    }
    if cell_type.is_none() {
        let claimed: usize = attribute(piece, "NumberOfCells")?;
        if claimed != types.len() {
            let reason = format!("{claimed} cells are claimed, but there are {}", types.len());
            return Err(flaw_at(group, reason));
        }
    }
    let has_polyhedra = types.iter().any(|&number| vtk_cells::is_polyhedron(number));
    let streams = has_polyhedra
        .then(|| Streams::read(layout, group))
        .transpose()?;
    let count = vertices.len();
    let vertex = |number: i64| {
        usize::try_from(number)
            .ok()
            .filter(|&index| index < count)
            .and_then(|index| u32::try_from(vertices.start + index).ok())
            .ok_or_else(|| format!("vertex {number} does not exist: there are {count}, from 0"))
    };
    let mut start = 0;
    for (cell, (&end, &number)) in offsets.iter().zip(&types).enumerate() {
        let add = |assembly: &mut Assembly| {
            let list = slice(&connectivity, start, end)?;
            let checked = match &streams {
                Some(streams) if vtk_cells::is_polyhedron(number) => {
                    vtk_cells::check_stream(streams.of(cell)?, vertex)?
                }
                _ => list
                    .iter()
                    .map(|&number| vertex(number))
                    .collect::<Result<_, _>>()?,
            };
            vtk_cells::add(assembly, number, &checked)
        };
        add(assembly).map_err(|reason: String| flaw_at(group, format!("cell {cell}: {reason}")))?;
        start = end;
    }
    Ok(())
}

/// The face streams of polyhedra: per cell the number of faces, then per face its length and vertices.
struct Streams {
    numbers: Vec<i64>,
    /// Start and end of each cell's stream.
    ranges: Vec<[i64; 2]>,
}

impl Streams {
    fn read(layout: &Layout<'_>, group: Node<'_, '_>) -> Parsed<Self> {
        if array(group, "polyhedron_offsets").is_some() {
            return Self::from_tables(layout, group);
        }
        let ends = integers(layout, group, "faceoffsets")?;
        let mut start = 0;
        let mut ranges = Vec::with_capacity(ends.len());
        for end in ends {
            // −1 stands for a cell that is no polyhedron.
            ranges.push([start, end]);
            start = start.max(end);
        }
        Ok(Self {
            numbers: integers(layout, group, "faces")?,
            ranges,
        })
    }

    /// The layout of VTK 9.4 and later: polyhedra list faces, faces list vertices.
    fn from_tables(layout: &Layout<'_>, group: Node<'_, '_>) -> Parsed<Self> {
        let vertices = integers(layout, group, "face_connectivity")?;
        let face_ends = integers(layout, group, "face_offsets")?;
        let faces = integers(layout, group, "polyhedron_to_faces")?;
        let cell_ends = integers(layout, group, "polyhedron_offsets")?;
        let mut uses = FaceUses::of(face_ends.len());
        let mut numbers = Vec::new();
        let mut ranges = Vec::with_capacity(cell_ends.len());
        let mut start = 0;
        for end in cell_ends {
            let stream_start = length(&numbers);
            let of_cell = slice(&faces, start, end).map_err(|reason| flaw_at(group, reason))?;
            numbers.push(length(of_cell));
            for &face in of_cell {
                let ring = ring(&vertices, &face_ends, face, &mut uses).map_err(|reason| {
                    flaw_at(group, format!("face {face} of a polyhedron: {reason}"))
                })?;
                numbers.push(length(ring));
                numbers.extend_from_slice(ring);
            }
            ranges.push([stream_start, length(&numbers)]);
            start = end;
        }
        Ok(Self { numbers, ranges })
    }

    fn of(&self, cell: usize) -> Result<&[i64], String> {
        match self.ranges.get(cell) {
            Some(&[start, end]) => slice(&self.numbers, start, end),
            None => Err(format!("there are faces for {} cells", self.ranges.len())),
        }
    }
}

/// The vertices of a face, from where every face ends in `vertices`.
fn ring<'a>(
    vertices: &'a [i64],
    ends: &[i64],
    face: i64,
    uses: &mut FaceUses,
) -> Result<&'a [i64], String> {
    let place = usize::try_from(face)
        .ok()
        .filter(|&place| place < ends.len())
        .ok_or_else(|| format!("there are {}", ends.len()))?;
    uses.add(place)?;
    let start = place.checked_sub(1).map_or(0, |before| ends[before]);
    slice(vertices, start, ends[place])
}

fn length(numbers: &[i64]) -> i64 {
    i64::try_from(numbers.len()).unwrap_or(i64::MAX)
}

fn slice(numbers: &[i64], start: i64, end: i64) -> Result<&[i64], String> {
    usize::try_from(start)
        .ok()
        .zip(usize::try_from(end).ok())
        .and_then(|(start, end)| numbers.get(start..end))
        .ok_or_else(|| {
            format!(
                "its numbers are said to be {start} to {end} of {}",
                numbers.len()
            )
        })
}

fn integers(layout: &Layout<'_>, group: Node<'_, '_>, name: &str) -> Parsed<Vec<i64>> {
    let array = array(group, name).ok_or_else(|| flaw_at(group, format!("no array {name}")))?;
    layout.integers(array)
}

fn array<'a, 'd>(group: Node<'a, 'd>, name: &str) -> Option<Node<'a, 'd>> {
    group
        .children()
        .find(|node| node.has_tag_name("DataArray") && node.attribute("Name") == Some(name))
}

fn child<'a, 'd>(node: Node<'a, 'd>, name: &str) -> Option<Node<'a, 'd>> {
    node.children().find(|child| child.has_tag_name(name))
}
