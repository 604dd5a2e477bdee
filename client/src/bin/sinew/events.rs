//! What happened to a session's mesh, in words.

use sinew_client::Client;
use sinew_proto::v1::{Event, ListEventsRequest, event::Kind};

use crate::{Failure, out::say, table::count};

/// Prints a session's events, page after page.
pub(crate) async fn list(
    client: &Client,
    session: String,
    after_event: Option<u64>,
) -> Result<(), Failure> {
    let mut request = ListEventsRequest {
        session,
        after_event,
        ..ListEventsRequest::default()
    };
    loop {
        let page = client.list_events(request.clone()).await?;
        if page.last_sequence == 0 {
            say!("no events");
        }
        for event in &page.events {
            say!("{}", line(event));
        }
        if page.next_page_token.is_empty() {
            return Ok(());
        }
        request.page_token = page.next_page_token;
    }
}

/// One event on one line.
pub(crate) fn line(event: &Event) -> String {
    let at = event.position.unwrap_or_default();
    let rule = event.rule.map(|rule| format!("  by rule {rule}"));
    format!(
        "event {:>6}  step {:>8}  time {:>9.3} s  {}  at ({:.3}, {:.3}, {:.3}) m{}",
        event.sequence,
        event.step,
        event.time_seconds,
        what(event.kind.as_ref()),
        at.x,
        at.y,
        at.z,
        rule.unwrap_or_default(),
    )
}

fn what(kind: Option<&Kind>) -> String {
    let number = |n: u32, one: &str| {
        let plural = if n == 1 { "" } else { "s" };
        format!("{} {one}{plural}", count(u64::from(n)))
    };
    match kind {
        None => "something that this version does not know".to_owned(),
        Some(Kind::Crossed(crossed)) => {
            format!("{:.4} crossed {:.4}", crossed.measured, crossed.threshold)
        }
        Some(Kind::Torn(torn)) => format!("torn along {}", number(torn.faces, "face")),
        Some(Kind::Glued(glued)) => format!("glued along {}", number(glued.faces, "face")),
        Some(Kind::Removed(_)) => "cells removed".to_owned(),
        Some(Kind::Added(_)) => "cells added".to_owned(),
        Some(Kind::Divided(_)) => "cells divided".to_owned(),
        Some(Kind::Collapsed(_)) => "an edge was drawn together".to_owned(),
        Some(Kind::Refused(refused)) => format!("refused: {}", refused.reason),
        Some(Kind::FragmentBorn(born)) => format!(
            "fragment {} of {} born from {}",
            born.fragment,
            number(born.cells, "cell"),
            born.parent
        ),
        Some(Kind::FragmentsJoined(joined)) => {
            format!("fragment {} joined {}", joined.absorbed, joined.fragment)
        }
        Some(Kind::InnerFracture(_)) => "fractured inside".to_owned(),
        Some(Kind::FractureOpened(_)) => "an inner fracture reached the surface".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use sinew_proto::v1::{FragmentBorn, Vector3};

    use super::*;

    #[test]
    fn an_event_reads_as_a_sentence() {
        let event = Event {
            sequence: 12,
            step: 1234,
            time_seconds: 10.283,
            rule: Some(0),
            position: Some(Vector3 {
                x: 0.5,
                y: -1.0,
                z: 0.0,
            }),
            kind: Some(Kind::FragmentBorn(FragmentBorn {
                fragment: 1,
                parent: 0,
                cells: 4096,
            })),
            ..Event::default()
        };
        assert_eq!(
            line(&event),
            "event     12  step     1234  time    10.283 s  fragment 1 of 4,096 cells born from 0  at (0.500, -1.000, 0.000) m  by rule 0"
        );
    }
}
