//! Which darts of two cells of a surface are the same edge.

use super::rings::{Rings, number};
use super::{Pair, Partners};

pub(super) fn find(_vertices: usize, rings: &Rings) -> Partners {
    let mut uses: Vec<_> = (0..number(rings.vertex.len()))
        .map(|dart| {
            let from = rings.vertex[dart as usize];
            let to = rings.vertex[rings.next(dart) as usize];
            (from.min(to), from.max(to), dart, from > to)
        })
        .collect();
    uses.sort_unstable();
    let mut partners = Partners::default();
    for edge in uses.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        match *edge {
            [_] => {}
            [one, other] => partners.pairs.push(Pair {
                darts: [one.2, other.2],
                is_mirrored: one.3 == other.3,
            }),
            _ => {
                let darts = edge.iter().map(|&(_, _, dart, _)| dart);
                partners.crowded.push(darts.collect());
            }
        }
    }
    partners
}
