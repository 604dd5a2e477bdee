//! SessionService's EditMesh.

use std::sync::Arc;

use sinew_engine::{Answer, Done, Facet, Request};
use sinew_proto::v1::{self, Indices, edit_outcome::Result as Outcome, mesh_edit::Kind};

use super::{Shared, session::digest};
use crate::{
    change::Edit,
    convert,
    error::{ServiceError, invalid},
    pack,
    session::Wish,
};

impl Shared {
    pub(super) async fn edit(
        &self,
        request: v1::EditMeshRequest,
    ) -> Result<v1::EditMeshResponse, ServiceError> {
        let v1::EditMeshRequest {
            name,
            edits,
            expected_topology_version: expected,
        } = request;
        let entry = self.registry.get(&name)?;
        if edits.is_empty() {
            let remedy = "give one edit at least";
            return Err(invalid("FIELD_MISSING", "edits", "is empty", remedy));
        }
        let sent = Arc::from(edits.clone());
        let requests =
            (edits.into_iter().enumerate()).map(|(i, edit)| read(i, edit, &entry.labels));
        let requests = requests.collect::<Result<_, _>>()?;
        let edited = entry
            .handle
            .edit(Edit {
                requests,
                sent,
                expected,
            })
            .await?;
        let change = edited.frame.and_then(|frame| frame.change.clone());
        let patch = change.as_ref().and_then(|change| change.patch.as_ref());
        let report = entry.handle.ask(Wish::Describe).await?;
        Ok(v1::EditMeshResponse {
            outcomes: edited.answers.iter().map(outcome).collect(),
            patch: patch.map(pack::patch),
            topology_version: report.frame.layout.topology_version,
            digest: digest(report.digest),
        })
    }
}

fn read(index: usize, edit: v1::MeshEdit, labels: &[String]) -> Result<Request, ServiceError> {
    let field = |name: &str| format!("edits[{index}].{name}");
    let indices = |column: Option<&Indices>, name: &str| convert::indices(column, &field(name));
    match edit.kind {
        Some(Kind::Open(v1::OpenEdit { facets })) => {
            let cells = indices(facets.as_ref(), "open.facets")?;
            let remedy = "give two cells for each face";
            let facets = pairs(&cells, field("open.facets"), remedy)?;
            Ok(Request::Open { facets })
        }
        Some(Kind::Bisect(v1::BisectEdit { edges })) => {
            let ends = indices(edges.as_ref(), "bisect.edges")?;
            let remedy = "give two vertices for each edge";
            let edges = pairs(&ends, field("bisect.edges"), remedy)?;
            Ok(Request::Bisect { edges })
        }
        Some(Kind::Collapse(v1::CollapseEdit { kept, drawn })) => Ok(Request::Collapse {
            edge: [kept, drawn],
        }),
        Some(Kind::Remove(edit)) => {
            let cells = indices(edit.cells.as_ref(), "remove.cells")?;
            Ok(Request::Remove { cells })
        }
        Some(Kind::Subdivide(edit)) => {
            let cells = indices(edit.cells.as_ref(), "subdivide.cells")?;
            Ok(Request::Subdivide { cells })
        }
        Some(Kind::Separate(v1::SeparateEdit { a, b })) => {
            let a = convert::point(&a, labels, &field("separate.a"))?;
            let b = convert::point(&b, labels, &field("separate.b"))?;
            Ok(Request::Separate { points: [a, b] })
        }
        Some(Kind::Close(v1::CloseEdit { a, b, distance })) => {
            check_length(distance, &field("close.distance"))?;
            let fragments = [a, b];
            Ok(Request::Close {
                fragments,
                distance,
            })
        }
        Some(Kind::Add(v1::AddEdit { facets, thickness })) => {
            check_length(thickness, &field("add.thickness"))?;
            let facet = |(i, facet): (usize, v1::Facet)| -> Result<Facet, ServiceError> {
                let name = format!("add.facets[{i}].vertices");
                let vertices = indices(facet.vertices.as_ref(), &name)?;
                let cell = facet.cell;
                Ok(Facet { cell, vertices })
            };
            let facets = facets.into_iter().enumerate().map(facet);
            let facets = facets.collect::<Result<_, _>>()?;
            Ok(Request::Add { facets, thickness })
        }
        None => {
            let field = format!("edits[{index}]");
            let remedy = "set one of its kinds";
            Err(invalid("FIELD_MISSING", field, "says nothing", remedy))
        }
    }
}

fn pairs(numbers: &[u32], field: String, remedy: &str) -> Result<Vec<[u32; 2]>, ServiceError> {
    let (pairs, odd) = numbers.as_chunks::<2>();
    if !odd.is_empty() {
        let problem = format!("has {} numbers", numbers.len());
        return Err(invalid("LENGTH_MISMATCH", field, problem, remedy));
    }
    Ok(pairs.to_vec())
}

fn check_length(length: f64, field: &str) -> Result<(), ServiceError> {
    if length.is_finite() && length > 0.0 {
        return Ok(());
    }
    let remedy = "give a positive number of metres";
    Err(invalid(
        "VALUE_OUT_OF_RANGE",
        field,
        format!("is {length}"),
        remedy,
    ))
}

fn outcome(answer: &Answer) -> v1::EditOutcome {
    let result = match answer {
        Answer::Applied(done) => Outcome::Done(told(done)),
        Answer::Refined { kept, grown, done } => Outcome::Done(v1::EditDone {
            kept_points: *kept,
            grown_edges: *grown,
            ..told(done)
        }),
        Answer::Refused(refusal) => Outcome::Refused(v1::EditRefused {
            reason: refusal.to_string(),
            cells: Some(Indices::pack(refusal.cells())),
        }),
    };
    v1::EditOutcome {
        result: Some(result),
    }
}

fn told(done: &Done) -> v1::EditDone {
    let Done {
        opened,
        closed,
        cells,
        vertices,
        effects: _, // events tell them
    } = done;
    v1::EditDone {
        opened: *opened,
        closed: *closed,
        cells: Some(Indices::pack(cells)),
        first_vertex: vertices.start,
        vertex_count: vertices.end - vertices.start,
        ..v1::EditDone::default()
    }
}
