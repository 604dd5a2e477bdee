//! Stanford polygon files (`.ply`): text and binary of either byte order.

use nalgebra::Vector3;

use super::assembly::Assembly;
use super::cursor::{Cursor, least_size, shown};
use super::error::Parsed;
use super::scalar::{Encoding, Endian, Scalar};

struct Property {
    name: String,
    /// The kind of the count, where the property is a list.
    list: Option<Scalar>,
    kind: Scalar,
}

struct Element {
    name: String,
    count: i64,
    properties: Vec<Property>,
}

pub(crate) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let mut cursor = Cursor::new(bytes);
    cursor.keyword("ply")?;
    let (encoding, elements) = header(&mut cursor)?;
    let mut assembly = Assembly::default();
    for element in &elements {
        let sizes = element
            .properties
            .iter()
            .map(|property| least_size(encoding, property.list.unwrap_or(property.kind)));
        // An element without properties takes no bytes and holds nothing.
        let count = cursor.claim(element.count, sizes.sum::<usize>().max(1), &element.name)?;
        for _ in 0..count {
            match element.name.as_str() {
                "vertex" => vertex(&mut cursor, encoding, element, &mut assembly)?,
                "face" => face(&mut cursor, encoding, element, &mut assembly)?,
                "tristrips" => {
                    return Err(cursor.flaw("triangle strips are not read; export faces"));
                }
                name => {
                    if name == "edge" {
                        assembly.skip();
                    }
                    for property in &element.properties {
                        values(&mut cursor, encoding, property)?;
                    }
                }
            }
        }
    }
    Ok(assembly)
}

fn header(cursor: &mut Cursor<'_>) -> Parsed<(Encoding, Vec<Element>)> {
    let mut encoding = Encoding::Text;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        match cursor.text("a line of the header")? {
            "format" => {
                let name = cursor.text("the format")?;
                encoding = match name {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::Binary(Endian::Little),
                    "binary_big_endian" => Encoding::Binary(Endian::Big),
                    _ => {
                        let reason = format!("format {} is not known", shown(name.as_bytes()));
                        return Err(cursor.flaw(reason));
                    }
                };
                cursor.line();
            }
            "element" => elements.push(Element {
                name: cursor.text("the name of an element")?.to_owned(),
                count: cursor.number("the number of elements")?,
                properties: Vec::new(),
            }),
            "property" => {
                let property = property(cursor)?;
                match elements.last_mut() {
                    Some(element) => element.properties.push(property),
                    None => return Err(cursor.flaw("a property before any element")),
                }
            }
            "comment" | "obj_info" => {
                cursor.line();
            }
            "end_header" => {
                cursor.end_line()?;
                return Ok((encoding, elements));
            }
            other => {
                let reason = format!("{} is no line of a header", shown(other.as_bytes()));
                return Err(cursor.flaw(reason));
            }
        }
    }
}

fn property(cursor: &mut Cursor<'_>) -> Parsed<Property> {
    let mut list = None;
    let mut type_name = cursor.text("the type of a property")?;
    if type_name == "list" {
        type_name = cursor.text("the type of a list's length")?;
        list = Some(scalar(cursor, type_name)?);
        type_name = cursor.text("the type of a list's values")?;
    }
    let kind = scalar(cursor, type_name)?;
    let name = cursor.text("the name of a property")?.to_owned();
    Ok(Property { name, list, kind })
}

fn scalar(cursor: &Cursor<'_>, name: &str) -> Parsed<Scalar> {
    Ok(match name {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => {
            let reason = format!("{} is no type of numbers", shown(name.as_bytes()));
            return Err(cursor.flaw(reason));
        }
    })
}

fn vertex(
    cursor: &mut Cursor<'_>,
    encoding: Encoding,
    element: &Element,
    assembly: &mut Assembly,
) -> Parsed<()> {
    let mut position = Vector3::zeros();
    let mut seen = 0;
    for property in &element.properties {
        let axis = ["x", "y", "z"]
            .iter()
            .position(|name| *name == property.name);
        match (axis, property.list) {
            (Some(axis), None) => {
                position[axis] = cursor.real(encoding, property.kind, "a coordinate")?;
                seen |= 1 << axis;
            }
            _ => values(cursor, encoding, property)?,
        }
    }
    if seen != 0b111 {
        return Err(cursor.flaw("the vertices lack one of the properties x, y and z"));
    }
    assembly.positions.push(position);
    Ok(())
}

fn face(
    cursor: &mut Cursor<'_>,
    encoding: Encoding,
    element: &Element,
    assembly: &mut Assembly,
) -> Parsed<()> {
    let mut corners = None;
    for property in &element.properties {
        let holds_vertices = ["vertex_indices", "vertex_index"].contains(&property.name.as_str());
        if let (true, Some(length)) = (holds_vertices, property.list) {
            let least = least_size(encoding, property.kind);
            let count = cursor.integer(encoding, length, "the number of a face's vertices")?;
            let vertices = assembly.positions.len();
            let list: Vec<u32> = (0..cursor.claim(count, least, "vertices of a face")?)
                .map(|_| cursor.vertex(encoding, property.kind, 0, vertices))
                .collect::<Parsed<_>>()?;
            corners = Some(list);
        } else {
            values(cursor, encoding, property)?;
        }
    }
    let corners =
        corners.ok_or_else(|| cursor.flaw("the faces lack the list property vertex_indices"))?;
    assembly
        .polygon(&corners)
        .map_err(|reason| cursor.flaw(reason))
}

/// Passes a property.
fn values(cursor: &mut Cursor<'_>, encoding: Encoding, property: &Property) -> Parsed<()> {
    let least = least_size(encoding, property.kind);
    let count = match property.list {
        Some(length) => cursor.integer(encoding, length, "the length of a list")?,
        None => 1,
    };
    for _ in 0..cursor.claim(count, least, "values of a property")? {
        match encoding {
            Encoding::Text => cursor.text("a value").map(drop)?,
            Encoding::Binary(_) => cursor.take(property.kind.size(), "a value").map(drop)?,
        }
    }
    Ok(())
}
