//! `sinew sessions`: the sessions of a server.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use sinew_client::{Client, load_mapping};
use sinew_proto::v1::{LinkSelection, Session, SessionState, StepRequest, UpdateMappingRequest};

use crate::out::{put, say};
use crate::{
    Failure,
    connection::{Connection, session_name},
    edit, events,
    explain::explained,
    modules,
    table::{Table, count},
};

/// Lists a server's sessions; runs, pauses, steps, remaps, edits, explains or deletes one, or lists its events.
#[derive(Args)]
#[command(after_help = "Examples:
  sinew sessions                      lists them
  sinew sessions pause walk
  sinew sessions step walk --steps 10
  sinew sessions remap walk --mapping soft.toml --blend 0.5
  sinew sessions explain walk 42
  sinew sessions read chain --links 0
  sinew sessions events walk
  sinew sessions edit walk cut.json
  sinew sessions delete walk")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    connection: Connection,
}

#[derive(Subcommand)]
enum Command {
    /// Lets a session step by itself.
    Run {
        /// The session.
        session: String,
    },
    /// Stops a session after the step under way.
    Pause {
        /// The session.
        session: String,
    },
    /// Takes steps of a paused session; prints the state's digest.
    Step {
        /// The session.
        session: String,
        /// How many.
        #[arg(long, value_name = "N", default_value_t = 1)]
        steps: u32,
        /// Refuse unless the session has taken exactly so many steps.
        #[arg(long, value_name = "STEP")]
        expected_step: Option<u64>,
    },
    /// Changes how the points drive the mesh.
    #[command(after_help = "Examples:
  sinew sessions remap walk --mapping rigid.json             at the next step
  sinew sessions remap walk --mapping soft.toml --blend 0.5  over half a simulated second

rigid.json: {\"rule\": {\"shapeMatching\": {}}}
soft.toml:  filter.keep.k = 12
            rule.weightedMean = {}")]
    Remap {
        /// The session.
        session: String,
        /// What to change: fields of a scene's `mapping`, JSON or TOML. The others stay.
        #[arg(long, value_name = "FILE")]
        mapping: PathBuf,
        /// Simulated time that the mesh takes to move over, s. Without it: the next step is the new mapping's.
        #[arg(
            long,
            value_name = "SECONDS",
            default_value_t = 0.0,
            hide_default_value = true
        )]
        blend: f64,
        /// Refuse unless the mapping is the one that this etag was given for.
        #[arg(
            long,
            value_name = "ETAG",
            default_value = "",
            hide_default_value = true
        )]
        etag: String,
    },
    /// Tells why a vertex is where it is: its points, their weights, its rule.
    #[command(after_help = "Examples:
  sinew sessions explain walk 42")]
    Explain {
        /// The session.
        session: String,
        /// The vertex, by index.
        vertex: u32,
    },
    /// Reads simulated particles and links: where they are and what acts on them.
    #[command(after_help = "Examples:
  sinew sessions read chain                           all particles and links
  sinew sessions read chain --links 0                 the links of batch 0
  sinew sessions read chain --links 0:0,3 --particles 0,7")]
    Read {
        /// The session.
        session: String,
        /// Particles, by index.
        #[arg(long, value_name = "INDEX", value_delimiter = ',')]
        particles: Vec<u32>,
        /// Links: a batch of the scene's `links`, and after a colon those of it, by index; can be repeated.
        #[arg(long, value_name = "BATCH[:INDEX,…]", value_parser = modules::links)]
        links: Vec<LinkSelection>,
    },
    /// Lists what happened to a session's mesh: tears, glueings, fragments.
    #[command(after_help = "Examples:
  sinew sessions events bar               all that the server keeps
  sinew sessions events bar --after 120   those after the event with that sequence")]
    Events {
        /// The session.
        session: String,
        /// Only those after the event with this sequence.
        #[arg(long, value_name = "SEQUENCE")]
        after: Option<u64>,
    },
    /// Changes a session's mesh: tears, opens, closes, removes, adds, divides, halves or draws together.
    #[command(after_help = "Examples:
  sinew sessions edit bar cut.json

cut.json: {\"edits\": [{\"open\": {\"facets\": {\"values\": [3, 4, 11, 12]}}},
                     {\"remove\": {\"cells\": {\"values\": [7]}}},
                     {\"separate\": {\"a\": \"LKNE\", \"b\": \"LANK\"}},
                     {\"bisect\": {\"edges\": {\"values\": [12, 40]}}},
                     {\"collapse\": {\"kept\": 12, \"drawn\": 41}}]}")]
    Edit {
        /// The session.
        session: String,
        /// The edits, JSON or TOML. Each is done wholly or refused wholly.
        file: PathBuf,
        /// Refuse unless the mesh's topology is at this version.
        #[arg(long, value_name = "VERSION")]
        expected_version: Option<u64>,
    },
    /// Ends a session.
    Delete {
        /// The session.
        session: String,
    },
}

pub(crate) async fn sessions(arguments: Arguments) -> Result<(), Failure> {
    let client = arguments.connection.open().await?;
    match arguments.command {
        None => list(&client).await?,
        Some(Command::Run { session }) => {
            let session = client.run(&session_name(&session)).await?;
            say!("{} runs from step {}", session.name, session.step);
        }
        Some(Command::Pause { session }) => {
            let session = client.pause(&session_name(&session)).await?;
            say!("{} is paused at step {}", session.name, session.step);
        }
        Some(Command::Step {
            session,
            steps,
            expected_step,
        }) => {
            let request = StepRequest {
                name: session_name(&session),
                steps,
                expected_step,
            };
            step(&client, request).await?;
        }
        Some(Command::Remap {
            session,
            mapping,
            blend,
            etag,
        }) => {
            let request = UpdateMappingRequest {
                name: session_name(&session),
                mapping: Some(load_mapping(&mapping)?),
                etag,
                blend_seconds: blend,
                ..UpdateMappingRequest::default()
            };
            remap(&client, request).await?;
        }
        Some(Command::Explain { session, vertex }) => {
            let explanation = client.explain(&session_name(&session), vertex).await?;
            put!("{}", explained(&explanation));
        }
        Some(Command::Read {
            session,
            particles,
            links,
        }) => {
            modules::read(&client, session_name(&session), &particles, links).await?;
        }
        Some(Command::Events { session, after }) => {
            events::list(&client, session_name(&session), after).await?;
        }
        Some(Command::Edit {
            session,
            file,
            expected_version,
        }) => {
            edit::send(&client, session_name(&session), &file, expected_version).await?;
        }
        Some(Command::Delete { session }) => {
            let name = session_name(&session);
            client.delete_session(&name).await?;
            say!("{name} is deleted");
        }
    }
    Ok(())
}

async fn remap(client: &Client, request: UpdateMappingRequest) -> Result<(), Failure> {
    let session = client.update_mapping(request).await?;
    say!(
        "{} has a new mapping from step {} on, etag {}",
        session.name,
        session.step,
        session.etag
    );
    Ok(())
}

async fn step(client: &Client, request: StepRequest) -> Result<(), Failure> {
    let answer = client.step(request).await?;
    say!(
        "step {}  time {:.3} s  digest {}",
        answer.step,
        answer.time_seconds,
        answer.digest
    );
    Ok(())
}

async fn list(client: &Client) -> Result<(), Failure> {
    let sessions = client.all_sessions().await?;
    if sessions.is_empty() {
        say!("no sessions");
    } else {
        put!("{}", table(&sessions));
    }
    Ok(())
}

fn table(sessions: &[Session]) -> Table {
    let mut table = Table::of_numbers();
    table.row([
        "session", "state", "step", "time", "points", "vertices", "cells", "title",
    ]);
    for session in sessions {
        table.row([
            session.name.trim_start_matches("sessions/").to_owned(),
            state(session).to_owned(),
            count(session.step),
            format!("{:.2} s", session.time_seconds),
            count(u64::from(session.point_count)),
            count(u64::from(session.vertex_count)),
            count(u64::from(session.cell_count)),
            session.title.clone(),
        ]);
    }
    table
}

fn state(session: &Session) -> &'static str {
    match session.state() {
        SessionState::Unspecified => "unknown",
        SessionState::Paused => "paused",
        SessionState::Running => "running",
        SessionState::Faulted => "faulted",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_stand_in_columns() {
        let walk = Session {
            name: "sessions/walk".to_owned(),
            state: SessionState::Running.into(),
            step: 1234,
            time_seconds: 10.283,
            title: "A walk".to_owned(),
            point_count: 30,
            vertex_count: 20_000,
            cell_count: 90_000,
            ..Session::default()
        };
        assert_eq!(
            table(&[walk]).to_string(),
            "session    state   step     time  points  vertices   cells   title\n\
             walk     running  1,234  10.28 s      30    20,000  90,000  A walk\n"
        );
    }
}
