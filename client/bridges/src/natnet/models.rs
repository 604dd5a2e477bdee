//! What a NatNet server calls its points.

use std::collections::BTreeMap;

use super::message::Version;
use crate::{Garbled, cursor::Cursor};

/// Bytes of a force plate's calibration (12 × 12) and corners (4 × 3), binary32.
const PLATE: usize = 4 * (144 + 12);

/// A set of markers with names; what is called "all" repeats the others.
#[derive(Clone, Debug, Default, PartialEq)]
struct MarkerSet {
    name: String,
    markers: Vec<String>,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Body {
    name: String,
    id: u32,
}

/// Where a frame says something of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place {
    /// A marker of a model (a rigid body, a skeleton, a trained set), from 1.
    Marker { model: u32, marker: u32 },
    /// A marker of a set that is no model: by its place in [`Models::sets`] and in the set.
    InSet { set: usize, marker: u32 },
    /// A rigid body's centre.
    Body { id: u32 },
    /// A bone of a skeleton or a trained set.
    Bone { model: u32, bone: u32 },
}

/// The labels of all points, and where frames speak of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Models {
    pub(super) labels: Vec<String>,
    pub(super) places: BTreeMap<Place, usize>,
    /// Names of the marker sets.
    pub(super) sets: Vec<String>,
}

/// What descriptions say, before it is put together.
#[derive(Default)]
struct Described {
    sets: Vec<MarkerSet>,
    bodies: Vec<Body>,
    /// Skeletons and trained sets, with their bones.
    models: Vec<(Body, Vec<Body>)>,
}

impl Models {
    /// Reads the answer to a request for the models.
    pub(super) fn decode(payload: &[u8], version: Version) -> Result<Self, Garbled> {
        let mut cursor = Cursor::new(payload);
        let mut described = Described::default();
        for _ in 0..cursor.u32("the number of models")? {
            let kind = cursor.u32("a model's kind")?;
            let sized = version >= Version(4, 1);
            let size = sized.then(|| cursor.u32("a model's size")).transpose()?;
            let mut inside = cursor;
            let known = described.read(kind, &mut inside, version)?;
            match size {
                Some(size) => drop(cursor.bytes(size as usize, "a model")?),
                None if known => cursor = inside,
                None => break, // how long it is nobody knows
            }
        }
        Ok(described.put_together())
    }

    fn add(&mut self, place: Place, label: String) {
        self.places.entry(place).or_insert_with(|| {
            self.labels.push(label);
            self.labels.len() - 1
        });
    }
}

impl Described {
    fn read(&mut self, kind: u32, cursor: &mut Cursor, version: Version) -> Result<bool, Garbled> {
        match kind {
            0 => self.sets.push(marker_set(cursor)?),
            1 => self.bodies.push(body(cursor, version)?),
            2 => {
                let name = cursor.text("a skeleton's name")?;
                let id = cursor.u32("a skeleton's number")?;
                let bones = bones(cursor, version)?;
                self.models.push((Body { name, id }, bones));
            }
            3 => plate(cursor)?,
            4 => device(cursor)?,
            5 => {
                cursor.text("a camera's name")?;
                cursor.bytes(28, "a camera's pose")?;
            }
            6 => {
                let name = cursor.text("an asset's name")?;
                cursor.u32("an asset's kind")?;
                let id = cursor.u32("an asset's number")?;
                let bones = bones(cursor, version)?;
                for _ in 0..cursor.u32("the number of an asset's markers")? {
                    cursor.text("a marker's name")?;
                    cursor.bytes(4 + 12 + 4 + 2, "a marker")?;
                }
                self.models.push((Body { name, id }, bones));
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn put_together(self) -> Models {
        let mut models = Models::default();
        let ids: BTreeMap<&str, u32> = (self.bodies.iter())
            .chain(self.models.iter().map(|(model, _)| model))
            .map(|body| (body.name.as_str(), body.id))
            .collect();
        models.sets = self.sets.iter().map(|set| set.name.clone()).collect();
        for (set, MarkerSet { name, markers }) in self.sets.iter().enumerate() {
            if name == "all" {
                continue;
            }
            for (marker, label) in (0..).zip(markers) {
                let place = match ids.get(name.as_str()) {
                    Some(model) => Place::Marker {
                        model: *model,
                        marker: marker + 1,
                    },
                    None => Place::InSet { set, marker },
                };
                models.add(place, format!("{name}:{label}"));
            }
        }
        for body in self.bodies {
            models.add(Place::Body { id: body.id }, body.name);
        }
        for (model, bones) in self.models {
            for bone in bones {
                let place = Place::Bone {
                    model: model.id,
                    bone: bone.id,
                };
                models.add(place, format!("{}:{}", model.name, bone.name));
            }
        }
        distinct(&mut models.labels);
        models
    }
}

/// Numbers labels that come again: a skeleton's marker may be called as one of its bones is.
fn distinct(labels: &mut [String]) {
    let mut seen = std::collections::BTreeSet::new();
    for label in labels {
        let mut number = 2;
        let own = label.clone();
        while !seen.insert(label.clone()) {
            *label = format!("{own}_{number}");
            number += 1;
        }
    }
}

fn marker_set(cursor: &mut Cursor) -> Result<MarkerSet, Garbled> {
    let name = cursor.text("a marker set's name")?;
    let mut markers = Vec::new();
    for _ in 0..cursor.u32("the number of a set's markers")? {
        markers.push(cursor.text("a marker's name")?);
    }
    Ok(MarkerSet { name, markers })
}

fn body(cursor: &mut Cursor, version: Version) -> Result<Body, Garbled> {
    let name = cursor.text("a rigid body's name")?;
    let id = cursor.u32("a rigid body's number")?;
    cursor.bytes(4 + 12, "a rigid body's parent and place")?;
    if version >= Version(4, 2) {
        cursor.bytes(16, "a rigid body's turn")?;
    }
    let markers = cursor.u32("the number of a rigid body's markers")?;
    for _ in 0..markers {
        cursor.bytes(12 + 4, "a rigid body's marker")?; // places first, then what they are called by active tags
    }
    if version >= Version(4, 0) {
        for _ in 0..markers {
            cursor.text("a marker's name")?;
        }
    }
    Ok(Body { name, id })
}

fn bones(cursor: &mut Cursor, version: Version) -> Result<Vec<Body>, Garbled> {
    let mut bones = Vec::new();
    for _ in 0..cursor.u32("the number of bones")? {
        bones.push(body(cursor, version)?);
    }
    Ok(bones)
}

fn plate(cursor: &mut Cursor) -> Result<(), Garbled> {
    cursor.u32("a force plate's number")?;
    cursor.text("a force plate's serial number")?;
    cursor.bytes(4 * 5, "a force plate's size and place")?;
    cursor.bytes(PLATE, "a force plate's calibration")?;
    cursor.bytes(8, "a force plate's kind")?;
    channels(cursor)
}

fn device(cursor: &mut Cursor) -> Result<(), Garbled> {
    cursor.u32("a device's number")?;
    cursor.text("a device's name")?;
    cursor.text("a device's serial number")?;
    cursor.bytes(8, "a device's kind")?;
    channels(cursor)
}

fn channels(cursor: &mut Cursor) -> Result<(), Garbled> {
    for _ in 0..cursor.u32("the number of channels")? {
        cursor.text("a channel's name")?;
    }
    Ok(())
}
