//! Gmsh files (`.msh`): versions 1 and 2 in text, 2.2 and 4.1 in text and binary.

use nalgebra::Vector3;

use super::assembly::Assembly;
use super::cursor::{Cursor, least_size, shown};
use super::error::Parsed;
use super::gmsh_elements::{Element, element};
use super::labels::Labels;
use super::scalar::{Encoding, Endian, Scalar};

#[derive(Clone, Copy, PartialEq, Eq)]
enum Version {
    One,
    Two,
    Four,
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    version: Version,
    encoding: Encoding,
    /// Version 4: the kind of tags and counts.
    tag: Scalar,
    positions: Vec<Vector3<f64>>,
    labels: Option<Labels>,
}

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut reader = Reader {
        cursor: Cursor::new(bytes),
        version: Version::One,
        encoding: Encoding::Text,
        tag: Scalar::U64,
        positions: Vec::new(),
        labels: None,
    };
    let mut assembly = Assembly::default();
    while let Some(section) = reader.cursor.word() {
        match (section, reader.version) {
            (b"$MeshFormat", _) => reader.format()?,
            (b"$NOD" | b"$Nodes", Version::One | Version::Two) => reader.nodes()?,
            (b"$Nodes", Version::Four) => reader.node_blocks()?,
            (b"$ELM" | b"$Elements", Version::One | Version::Two) => {
                reader.elements(&mut assembly)?;
            }
            (b"$Elements", Version::Four) => reader.element_blocks(&mut assembly)?,
            _ => reader.skip_section(section)?,
        }
    }
    assembly.positions = reader.positions;
    Ok(assembly)
}

impl Reader<'_> {
    fn format(&mut self) -> Parsed<()> {
        let version = self.cursor.text("the version")?;
        self.version = match version {
            "2" | "2.0" | "2.1" | "2.2" => Version::Two,
            "4.1" => Version::Four,
            _ => {
                return Err(self.cursor.flaw(format!(
                    "Gmsh format {} is not read; save the mesh as version 4.1 or 2.2",
                    shown(version.as_bytes())
                )));
            }
        };
        let is_binary: i64 = self.cursor.number("0 (text) or 1 (binary)")?;
        let size: i64 = self.cursor.number("the size of numbers")?;
        match (self.version, size) {
            (_, 8) => {}
            (Version::Four, 4) => self.tag = Scalar::U32,
            _ => return Err(self.cursor.flaw(format!("numbers of {size} bytes"))),
        }
        self.encoding = match is_binary {
            0 => Encoding::Text,
            1 => {
                self.cursor.end_line()?;
                let one = self
                    .cursor
                    .take(4, "the number 1 that shows the byte order")?;
                match one {
                    [1, 0, 0, 0] => Encoding::Binary(Endian::Little),
                    [0, 0, 0, 1] => Encoding::Binary(Endian::Big),
                    _ => return Err(self.cursor.flaw("expected the number 1 in four bytes")),
                }
            }
            _ => return Err(self.cursor.flaw("expected 0 (text) or 1 (binary)")),
        };
        self.cursor.keyword("$EndMeshFormat")
    }

    /// Versions 1 and 2: a count, then a number and coordinates per node.
    fn nodes(&mut self) -> Parsed<()> {
        let end = self.end_of_section("Nodes", "$ENDNOD");
        let count = self.cursor.number("the number of nodes")?;
        self.start_numbers()?;
        let count = self.claim(count, &[Scalar::I32, Scalar::F64, Scalar::F64, Scalar::F64])?;
        let mut labels = Vec::with_capacity(count);
        for _ in 0..count {
            labels.push(self.integer(Scalar::I32, "a node number")?);
            let position = self.cursor.point(self.encoding, Scalar::F64)?;
            self.positions.push(position);
        }
        self.set_labels(labels)?;
        self.cursor.keyword(end)
    }

    /// Version 4: blocks of tags, then coordinates.
    fn node_blocks(&mut self) -> Parsed<()> {
        self.start_numbers()?;
        let [blocks, ..] = self.header()?;
        let mut labels = Vec::new();
        for _ in 0..blocks {
            let dimension = self.integer(Scalar::I32, "a dimension")?;
            self.integer(Scalar::I32, "an entity")?;
            let parametric = self.integer(Scalar::I32, "0 or 1 for parametric")?;
            let count = self.integer(self.tag, "the number of nodes of a block")?;
            let count = self.claim(count, &[self.tag, Scalar::F64, Scalar::F64, Scalar::F64])?;
            for _ in 0..count {
                labels.push(self.integer(self.tag, "a node tag")?);
            }
            let parameters = if parametric == 0 { 0 } else { dimension.min(3) };
            for _ in 0..count {
                let position = self.cursor.point(self.encoding, Scalar::F64)?;
                self.positions.push(position);
                for _ in 0..parameters {
                    self.cursor
                        .real(self.encoding, Scalar::F64, "a parametric coordinate")?;
                }
            }
        }
        self.set_labels(labels)?;
        self.cursor.keyword("$EndNodes")
    }

    fn set_labels(&mut self, labels: Vec<i64>) -> Parsed<()> {
        if self.labels.is_some() {
            return Err(self.cursor.flaw("a second section of nodes"));
        }
        let labels = Labels::new(labels.into_iter())
            .map_err(|label| self.cursor.flaw(format!("two nodes have number {label}")))?;
        self.labels = Some(labels);
        Ok(())
    }

    /// Versions 1 and 2; binary elements come in runs of one type.
    fn elements(&mut self, assembly: &mut Assembly) -> Parsed<()> {
        let end = self.end_of_section("Elements", "$ENDELM");
        let count = self.cursor.number("the number of elements")?;
        self.start_numbers()?;
        let count = self.claim(count, &[Scalar::I32, Scalar::I32])?;
        let mut done = 0;
        while done < count {
            let (number, run, tags) = match (self.version, self.encoding) {
                (_, Encoding::Binary(_)) => {
                    let number = self.integer(Scalar::I32, "an element type")?;
                    let run = self.integer(Scalar::I32, "a number of elements")?;
                    let run = self.claim(run, &[Scalar::I32, Scalar::I32])?;
                    (number, run, self.integer(Scalar::I32, "a number of tags")?)
                }
                (Version::Two, Encoding::Text) => {
                    self.integer(Scalar::I32, "an element number")?;
                    let number = self.integer(Scalar::I32, "an element type")?;
                    (number, 1, self.integer(Scalar::I32, "a number of tags")?)
                }
                (Version::One | Version::Four, Encoding::Text) => {
                    self.integer(Scalar::I32, "an element number")?;
                    // Physical and elementary region, then the number of nodes, which the type tells.
                    (self.integer(Scalar::I32, "an element type")?, 1, 3)
                }
            };
            let element = self.element(number)?;
            let tags = self.claim(tags, &[Scalar::I32])?;
            for _ in 0..run {
                if self.encoding != Encoding::Text {
                    self.integer(Scalar::I32, "an element number")?;
                }
                for _ in 0..tags {
                    self.integer(Scalar::I32, "an element tag")?;
                }
                self.add(assembly, &element, Scalar::I32)?;
            }
            done += run;
        }
        self.cursor.keyword(end)
    }

    /// Version 4: blocks of one type.
    fn element_blocks(&mut self, assembly: &mut Assembly) -> Parsed<()> {
        self.start_numbers()?;
        let [blocks, ..] = self.header()?;
        for _ in 0..blocks {
            self.integer(Scalar::I32, "a dimension")?;
            self.integer(Scalar::I32, "an entity")?;
            let number = self.integer(Scalar::I32, "an element type")?;
            let element = self.element(number)?;
            let count = self.integer(self.tag, "the number of elements of a block")?;
            for _ in 0..self.claim(count, &[self.tag, self.tag])? {
                self.integer(self.tag, "an element tag")?;
                self.add(assembly, &element, self.tag)?;
            }
        }
        self.cursor.keyword("$EndElements")
    }

    /// Number of blocks and of things in them, least and greatest tag.
    fn header(&mut self) -> Parsed<[i64; 4]> {
        let mut header = [0; 4];
        for number in &mut header {
            *number = self.integer(self.tag, "a count or tag of a section")?;
        }
        self.claim(
            header[0],
            &[Scalar::I32, Scalar::I32, Scalar::I32, self.tag],
        )?;
        Ok(header)
    }

    fn element(&self, number: i64) -> Parsed<Element> {
        element(number).ok_or_else(|| {
            self.cursor
                .flaw(format!("Gmsh's element type {number} is not read"))
        })
    }

    fn add(&mut self, assembly: &mut Assembly, element: &Element, node: Scalar) -> Parsed<()> {
        let mut vertices = Vec::with_capacity(element.nodes);
        for _ in 0..element.nodes {
            let label = self.integer(node, "a node number")?;
            let labels = self.labels.as_ref();
            vertices.push(
                labels
                    .and_then(|labels| labels.index(label))
                    .ok_or_else(|| self.cursor.flaw(format!("no node has number {label}")))?,
            );
        }
        match element.kind {
            None => assembly.skip(),
            Some(kind) => assembly
                .cell_with_facing_wedges(kind, &vertices)
                .map_err(|reason| self.cursor.flaw(reason))?,
        }
        Ok(())
    }

    /// Passes a section that holds nothing of the mesh.
    fn skip_section(&mut self, section: &[u8]) -> Parsed<()> {
        let Some(name) = section.strip_prefix(b"$") else {
            let reason = format!("expected a section ($…), found {}", shown(section));
            return Err(self.cursor.flaw(reason));
        };
        let end = [b"$End", name].concat();
        let found = self
            .cursor
            .rest()
            .windows(end.len())
            .position(|window| window.eq_ignore_ascii_case(&end));
        let Some(start) = found else {
            let reason = format!("section {} has no end", shown(section));
            return Err(self.cursor.flaw(reason));
        };
        self.cursor = self
            .cursor
            .clone()
            .starting(self.cursor.at() + start + end.len());
        Ok(())
    }

    fn end_of_section(&self, name: &str, in_version_one: &'static str) -> &'static str {
        match (self.version, name) {
            (Version::One, _) => in_version_one,
            (_, "Nodes") => "$EndNodes",
            _ => "$EndElements",
        }
    }

    /// Binary numbers start right after the line that announces them.
    fn start_numbers(&mut self) -> Parsed<()> {
        match self.encoding {
            Encoding::Text => Ok(()),
            Encoding::Binary(_) => self.cursor.end_line(),
        }
    }

    fn integer(&mut self, kind: Scalar, what: &str) -> Parsed<i64> {
        self.cursor.integer(self.encoding, kind, what)
    }

    /// `count` records of at least these numbers.
    fn claim(&self, count: i64, record: &[Scalar]) -> Parsed<usize> {
        let sizes = record.iter().map(|&kind| least_size(self.encoding, kind));
        self.cursor.claim(count, sizes.sum(), "records")
    }
}
