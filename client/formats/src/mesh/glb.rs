//! Binary glTF (`.glb`): the triangles of the default scene, each node's mesh in its place; vertices that were split
//! for their normals or colours become one again.

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;

use super::assembly::{Assembly, index};
use super::cursor::Cursor;
use super::error::{Flaw, Parsed};
use super::scalar::{Encoding, Endian, Scalar};
use super::weld::weld;

const TRIANGLES: u64 = 4;

pub(super) fn parse(bytes: &[u8]) -> Parsed<Assembly> {
    let encoding = Encoding::Binary(Endian::Little);
    let mut cursor = Cursor::new(bytes);
    cursor.take(4, "the mark glTF")?;
    let version = cursor.integer(encoding, Scalar::U32, "the version")?;
    if version != 2 {
        return Err(cursor.flaw(format!("glTF version {version} is not read: only 2")));
    }
    cursor.integer(encoding, Scalar::U32, "the length")?;
    let json = chunk(&mut cursor, b"JSON")?;
    let scene: Value = serde_json::from_slice(json)
        .map_err(|error| cursor.flaw(format!("the JSON part: {error}")))?;
    let binary = if cursor.remaining() > 0 {
        chunk(&mut cursor, b"BIN\0")?
    } else {
        &[]
    };
    let file = File {
        json: scene,
        binary,
        vertex_limit: bytes.len(),
    };
    file.assemble().map_err(Flaw::whole)
}

fn chunk<'a>(cursor: &mut Cursor<'a>, kind: &[u8; 4]) -> Parsed<&'a [u8]> {
    let encoding = Encoding::Binary(Endian::Little);
    let length = cursor.integer(encoding, Scalar::U32, "the length of a chunk")?;
    let found = cursor.take(4, "the kind of a chunk")?;
    if found != kind {
        let kind = String::from_utf8_lossy(kind)
            .trim_end_matches('\0')
            .to_owned();
        return Err(cursor.flaw(format!("expected the chunk {kind}")));
    }
    let length = cursor.claim(length, 1, "bytes of a chunk")?;
    cursor.take(length, "a chunk")
}

struct File<'a> {
    json: Value,
    binary: &'a [u8],
    /// A small file that repeats one mesh without end would fill any memory.
    vertex_limit: usize,
}

impl File<'_> {
    fn assemble(&self) -> Result<Assembly, String> {
        let mut assembly = Assembly::default();
        let scene = self.json["scene"].as_u64().unwrap_or(0);
        let roots = &self.entry("scenes", scene)?["nodes"];
        let mut to_visit: Vec<(u64, Matrix4<f64>)> = children(roots)
            .map(|node| (node, Matrix4::identity()))
            .collect();
        let nodes = self.json["nodes"].as_array().map_or(0, Vec::len);
        let mut visited = 0;
        while let Some((number, world_from_parent)) = to_visit.pop() {
            visited += 1;
            if visited > nodes {
                return Err("a node is its own descendant or has two parents".to_owned());
            }
            let node = self.entry("nodes", number)?;
            let world_from_node = world_from_parent * transform(node)?;
            if let Some(mesh) = node["mesh"].as_u64() {
                self.mesh(mesh, &world_from_node, &mut assembly)
                    .map_err(|reason| format!("mesh {mesh}: {reason}"))?;
            }
            // Reversed: the last one pushed is the next one visited.
            let children: Vec<u64> = children(&node["children"]).collect();
            to_visit.extend(
                children
                    .into_iter()
                    .rev()
                    .map(|child| (child, world_from_node)),
            );
        }
        Ok(assembly)
    }

    fn mesh(
        &self,
        mesh: u64,
        world_from_mesh: &Matrix4<f64>,
        assembly: &mut Assembly,
    ) -> Result<(), String> {
        let primitives = self.entry("meshes", mesh)?["primitives"]
            .as_array()
            .ok_or("it has no primitives")?;
        let mut corners: Vec<Vector3<f64>> = Vec::new();
        for primitive in primitives {
            let mode = primitive["mode"].as_u64().unwrap_or(TRIANGLES);
            if mode != TRIANGLES {
                return Err(format!(
                    "primitives of mode {mode} are not read: only triangles (4)"
                ));
            }
            if !primitive["extensions"]["KHR_draco_mesh_compression"].is_null() {
                return Err("Draco compression is not read; export without".to_owned());
            }
            let positions = self.positions(primitive, world_from_mesh)?;
            match primitive["indices"].as_u64() {
                None => corners.extend(positions),
                Some(indices) => corners.extend(self.pick(indices, &positions)?),
            }
        }
        let (positions, vertices) = weld(&corners).ok_or("more than 2^32 vertices")?;
        let first = index(assembly.positions.len())?;
        assembly.positions.extend(positions);
        if assembly.positions.len() > self.vertex_limit {
            return Err("its copies have more vertices than the file has bytes".to_owned());
        }
        let vertices: Vec<u32> = vertices.iter().map(|vertex| first + vertex).collect();
        for triangle in vertices.chunks(3) {
            assembly.polygon(triangle)?;
        }
        Ok(())
    }

    fn positions(
        &self,
        primitive: &Value,
        world_from_mesh: &Matrix4<f64>,
    ) -> Result<Vec<Vector3<f64>>, String> {
        let positions = primitive["attributes"]["POSITION"]
            .as_u64()
            .ok_or("a primitive without positions")?;
        let accessor = self.accessor(positions, "VEC3")?;
        if accessor.kind != Scalar::F32 {
            return Err("positions must be 32-bit reals".to_owned());
        }
        let place = |bytes: &[u8]| {
            let component = |axis: usize| Scalar::F32.real(&bytes[4 * axis..][..4], Endian::Little);
            let point = Vector3::from_fn(|axis, _| component(axis));
            let position = world_from_mesh.transform_point(&point.into()).coords;
            let is_finite = position.iter().all(|x| x.is_finite());
            is_finite
                .then_some(position)
                .ok_or_else(|| "a coordinate is not finite".to_owned())
        };
        accessor.elements().map(place).collect()
    }

    /// Those of `positions` that an accessor of indices names.
    fn pick(&self, indices: u64, positions: &[Vector3<f64>]) -> Result<Vec<Vector3<f64>>, String> {
        let accessor = self.accessor(indices, "SCALAR")?;
        let pick = |bytes| {
            accessor
                .kind
                .integer(bytes, Endian::Little)
                .and_then(|index| usize::try_from(index).ok())
                .and_then(|index| positions.get(index).copied())
                .ok_or_else(|| format!("an index is none of {} vertices", positions.len()))
        };
        accessor.elements().map(pick).collect()
    }

    fn accessor(&self, number: u64, shape: &str) -> Result<Accessor<'_>, String> {
        let accessor = self.entry("accessors", number)?;
        let kind = match accessor["componentType"].as_u64() {
            Some(5121) => Scalar::U8,
            Some(5123) => Scalar::U16,
            Some(5125) => Scalar::U32,
            Some(5126) => Scalar::F32,
            other => return Err(format!("accessor {number}: component type {other:?}")),
        };
        if accessor["type"] != shape || !accessor["sparse"].is_null() {
            return Err(format!("accessor {number} is no plain {shape}"));
        }
        let view = accessor["bufferView"]
            .as_u64()
            .ok_or_else(|| format!("accessor {number} has no data"))?;
        let view = self.entry("bufferViews", view)?;
        if view["buffer"].as_u64() != Some(0) || !self.json["buffers"][0]["uri"].is_null() {
            return Err("data outside the file are not read".to_owned());
        }
        let size = kind.size() * if shape == "VEC3" { 3 } else { 1 };
        let stride = size_of(&view["byteStride"]).unwrap_or(size);
        let count = size_of(&accessor["count"]).unwrap_or(0);
        let bytes = self
            .range(view, accessor, count, stride, size)
            .ok_or_else(|| {
                format!("accessor {number}: its {count} elements are not within the file")
            })?;
        Ok(Accessor {
            kind,
            bytes,
            stride,
            size,
        })
    }

    /// The bytes of `count` elements of `size` bytes, `stride` apart.
    fn range(
        &self,
        view: &Value,
        accessor: &Value,
        count: usize,
        stride: usize,
        size: usize,
    ) -> Option<&[u8]> {
        if stride < size {
            return None;
        }
        if count == 0 {
            return Some(&[]);
        }
        let start = size_of(&view["byteOffset"]).unwrap_or(0);
        let view = self
            .binary
            .get(start..start.checked_add(size_of(&view["byteLength"])?)?)?;
        let start = size_of(&accessor["byteOffset"]).unwrap_or(0);
        let length = (count - 1).checked_mul(stride)?.checked_add(size)?;
        view.get(start..start.checked_add(length)?)
    }

    fn entry(&self, list: &str, number: u64) -> Result<&Value, String> {
        usize::try_from(number)
            .ok()
            .and_then(|number| self.json[list].get(number))
            .ok_or_else(|| format!("{list} has no entry {number}"))
    }
}

/// Elements of one kind in the binary part.
struct Accessor<'a> {
    kind: Scalar,
    /// From the first byte of the first element to the last of the last.
    bytes: &'a [u8],
    stride: usize,
    size: usize,
}

impl<'a> Accessor<'a> {
    fn elements(&self) -> impl Iterator<Item = &'a [u8]> {
        let size = self.size;
        self.bytes
            .chunks(self.stride)
            .map(move |element| &element[..size])
    }
}

fn children(list: &Value) -> impl Iterator<Item = u64> {
    list.as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_u64)
}

fn size_of(value: &Value) -> Option<usize> {
    value.as_u64().and_then(|value| usize::try_from(value).ok())
}

/// A node's place in its parent: a matrix by columns, or translation, rotation (x, y, z, w) and scale.
fn transform(node: &Value) -> Result<Matrix4<f64>, String> {
    if let Some(columns) = numbers::<16>(&node["matrix"])? {
        return Ok(Matrix4::from_column_slice(&columns));
    }
    let translation = numbers::<3>(&node["translation"])?.unwrap_or([0.0; 3]);
    let [x, y, z, w] = numbers::<4>(&node["rotation"])?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let scale = numbers::<3>(&node["scale"])?.unwrap_or([1.0; 3]);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    Ok(Matrix4::new_translation(&translation.into())
        * rotation.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&scale.into()))
}

fn numbers<const N: usize>(list: &Value) -> Result<Option<[f64; N]>, String> {
    if list.is_null() {
        return Ok(None);
    }
    let numbers: Option<Vec<f64>> = list
        .as_array()
        .and_then(|list| list.iter().map(Value::as_f64).collect());
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .map(Some)
        .ok_or_else(|| format!("a node's transform is no list of {N} numbers"))
}
