//! From the engine's types to the wire's.

use bytes::Bytes;
use sinew_engine::{Effect, Event, EventKind, Patch, Seam, SeamKind};
use sinew_mesh::Cells;
use sinew_proto::v1::{self, Indices, UnstructuredGrid, event::Kind};

/// Cells, without positions.
pub(crate) fn cells(cells: &Cells) -> UnstructuredGrid {
    let Cells {
        types,
        connectivity,
        offsets,
        faces,
        face_offsets,
    } = cells;
    UnstructuredGrid {
        positions: None,
        cell_types: Bytes::copy_from_slice(types),
        connectivity: Some(Indices::pack(connectivity)),
        offsets: Some(Indices::pack(offsets)),
        faces: (!faces.is_empty()).then(|| Indices::pack(faces)),
        face_offsets: (!face_offsets.is_empty()).then(|| Indices::pack(face_offsets)),
    }
}

/// A patch, without the frame.
pub(crate) fn patch(patch: &Patch) -> v1::TopologyPatch {
    let Patch {
        from_version,
        vertex_parents,
        vertex_parent_offsets,
        slots,
        cells: forms,
        cell_parents,
        seams,
        hash: _, // the frame has it
    } = patch;
    v1::TopologyPatch {
        from_version: *from_version,
        to_version: from_version + 1,
        vertex_parents: Some(Indices::pack(vertex_parents)),
        vertex_parent_offsets: Some(Indices::pack(vertex_parent_offsets)),
        slots: Some(Indices::pack(slots)),
        cells: Some(cells(forms)),
        cell_parents: Some(Indices::pack(cell_parents)),
        seams: (!seams.is_empty()).then(|| pack_seams(seams)),
        frame: None,
    }
}

fn pack_seams(seams: &[Seam]) -> v1::Seams {
    let kind = |seam: &Seam| match seam.kind {
        SeamKind::Opened => 1,
        SeamKind::Closed => 2,
    };
    let cells: Vec<u32> = seams.iter().flat_map(|seam| seam.cells).collect();
    let mut vertices = Vec::new();
    let mut offsets = vec![0];
    for seam in seams {
        vertices.extend_from_slice(&seam.vertices);
        offsets.push(u32::try_from(vertices.len()).unwrap_or(u32::MAX));
    }
    v1::Seams {
        kinds: seams.iter().map(kind).collect(),
        cells: Some(Indices::pack(&cells)),
        vertices: Some(Indices::pack(&vertices)),
        offsets: Some(Indices::pack(&offsets)),
    }
}

/// What an event is, without when it was.
pub(crate) fn event(event: &Event) -> v1::Event {
    let Event {
        kind,
        rule,
        position,
        cells,
    } = event;
    v1::Event {
        rule: *rule,
        position: Some(v1::Vector3 {
            x: position.x,
            y: position.y,
            z: position.z,
        }),
        cells: (!cells.is_empty()).then(|| Indices::pack(cells)),
        kind: Some(event_kind(kind)),
        ..v1::Event::default()
    }
}

fn event_kind(kind: &EventKind) -> Kind {
    match *kind {
        EventKind::Crossed {
            measured,
            threshold,
        } => Kind::Crossed(v1::Crossed {
            measured,
            threshold,
        }),
        EventKind::Torn { faces } => Kind::Torn(v1::Torn { faces }),
        EventKind::Glued { faces } => Kind::Glued(v1::Glued { faces }),
        EventKind::Removed => Kind::Removed(v1::Removed {}),
        EventKind::Added => Kind::Added(v1::Added {}),
        EventKind::Divided => Kind::Divided(v1::Divided {}),
        EventKind::Collapsed => Kind::Collapsed(v1::Collapsed {}),
        EventKind::Refused(ref reason) => Kind::Refused(v1::Refused {
            reason: reason.clone(),
        }),
        EventKind::Followed(effect) => effect_kind(effect),
    }
}

fn effect_kind(effect: Effect) -> Kind {
    match effect {
        Effect::FragmentBorn {
            fragment,
            parent,
            cells,
        } => Kind::FragmentBorn(v1::FragmentBorn {
            fragment,
            parent,
            cells,
        }),
        Effect::FragmentsJoined { fragment, absorbed } => {
            Kind::FragmentsJoined(v1::FragmentsJoined { fragment, absorbed })
        }
        Effect::InnerFracture => Kind::InnerFracture(v1::InnerFracture {}),
        Effect::FractureOpened => Kind::FractureOpened(v1::FractureOpened {}),
    }
}
