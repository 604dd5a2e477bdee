//! `sinew sessions edit`: a change of a session's mesh.

use std::path::Path;

use sinew_client::{Client, load_edits};
use sinew_proto::v1::{EditMeshRequest, EditMeshResponse, edit_outcome::Result as Outcome};

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
            Some(Outcome::Done(done)) => format!(
                "done: {} faces opened, {} closed, {} vertices appended",
                count(done.opened.into()),
                count(done.closed.into()),
                count(done.vertex_count.into())
            ),
            Some(Outcome::Refused(refused)) => format!("refused: {}", refused.reason),
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

#[cfg(test)]
mod tests {
    use sinew_proto::v1::{EditDone, EditOutcome, EditRefused};

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
                    vertex_count: 9,
                    ..EditDone::default()
                })),
                outcome(Outcome::Refused(EditRefused {
                    reason: "there is no cell 99, or no more".to_owned(),
                    ..EditRefused::default()
                })),
            ],
            topology_version: 1,
            digest: "00ff".to_owned(),
            ..EditMeshResponse::default()
        };
        assert_eq!(
            told(&response),
            "edit 0 done: 4 faces opened, 0 closed, 9 vertices appended\n\
             edit 1 refused: there is no cell 99, or no more\n\
             topology version 1  digest 00ff\n"
        );
    }
}
