//! `sinew sessions edit`: a change of a session's mesh.

use std::path::Path;

use sinew_client::{Client, load_edits};
use sinew_proto::v1::{
    EditDone, EditMeshRequest, EditMeshResponse, Indices, edit_outcome::Result as Outcome,
};

use crate::{Failure, out::put, table::count};

/// Sends the edits of a file, and tells what came of each.
pub(crate) async fn send(
    client: &Client,
    name: String,
    file: &Path,
    expected_topology_version: Option<u64>,
) -> Result<(), Failure> {
    let request = EditMeshRequest {
        name,
        expected_topology_version,
        ..load_edits(file)?
    };
    put!("{}", told(&client.edit_mesh(request).await?));
    Ok(())
}

fn told(response: &EditMeshResponse) -> String {
    let mut lines = String::new();
    for (edit, outcome) in response.outcomes.iter().enumerate() {
        let what = match &outcome.result {
            Some(Outcome::Done(done)) => told_done(done),
            Some(Outcome::Refused(refused)) => {
                format!(
                    "refused: {}{}",
                    refused.reason,
                    cells(refused.cells.as_ref())
                )
            }
            None => "nothing said".to_owned(),
        };
        lines += &format!("edit {edit} {what}\n");
    }
    let version = count(response.topology_version);
    format!(
        "{lines}topology version {version}  digest {}\n",
        response.digest
    )
}

fn told_done(done: &EditDone) -> String {
    let vertices = match done.vertex_count {
        0 => "no vertices".to_owned(),
        more => format!(
            "vertices {} to {}",
            done.first_vertex,
            done.first_vertex + more - 1
        ),
    };
    let redrawn = match (done.kept_points, done.grown_edges) {
        (0, _) => String::new(),
        (kept, 0) => format!(", by {kept} points of each vertex"),
        (kept, grown) => format!(", by {kept} points of each vertex and {grown} edges beyond"),
    };
    format!(
        "done: {} faces opened, {} closed, {vertices} appended{redrawn}{}",
        count(done.opened.into()),
        count(done.closed.into()),
        cells(done.cells.as_ref())
    )
}

/// The first of some cells.
fn cells(column: Option<&Indices>) -> String {
    const SHOWN: usize = 8;
    let cells = column
        .and_then(|column| column.unpack().ok())
        .unwrap_or_default();
    let mut shown: Vec<_> = cells.iter().take(SHOWN).map(u32::to_string).collect();
    if cells.len() > SHOWN {
        shown.push(format!("and {} more", count((cells.len() - SHOWN) as u64)));
    }
    match shown.is_empty() {
        true => String::new(),
        false => format!("; cells {}", shown.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use sinew_proto::v1::{EditOutcome, EditRefused};

    use super::*;

    #[test]
    fn each_edit_has_a_line() {
        let outcome = |result| EditOutcome {
            result: Some(result),
        };
        let response = EditMeshResponse {
            outcomes: vec![
                outcome(Outcome::Done(EditDone {
                    opened: 4,
                    first_vertex: 16,
                    vertex_count: 9,
                    cells: Some(Indices::pack(&[3, 4])),
                    ..EditDone::default()
                })),
                outcome(Outcome::Done(EditDone {
                    opened: 12,
                    kept_points: 1,
                    grown_edges: 2,
                    cells: Some(Indices::pack(&[1, 2, 3, 4, 5, 6, 7, 8, 9])),
                    ..EditDone::default()
                })),
                outcome(Outcome::Refused(EditRefused {
                    reason: "there is no cell 99, or no more".to_owned(),
                    cells: Some(Indices::pack(&[99])),
                })),
            ],
            topology_version: 1,
            digest: "00ff".to_owned(),
            ..EditMeshResponse::default()
        };
        assert_eq!(
            told(&response),
            "edit 0 done: 4 faces opened, 0 closed, vertices 16 to 24 appended; cells 3, 4\n\
             edit 1 done: 12 faces opened, 0 closed, no vertices appended, by 1 points of each vertex and 2 edges beyond; \
             cells 1, 2, 3, 4, 5, 6, 7, 8, and 1 more\n\
             edit 2 refused: there is no cell 99, or no more; cells 99\n\
             topology version 1  digest 00ff\n"
        );
    }
}
