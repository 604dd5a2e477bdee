//! Which rings of two cells are the same face.

use rayon::prelude::*;

use super::rings::{Rings, number};
use super::{Pair, Partners};

/// A ring, seen from the dart that leaves its smallest vertex.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// The vertices after and before the smallest: the smaller of them, and the larger.
    beside: [u32; 2],
    /// Four times the dart, plus 2 if the ring has three vertices, plus 1 if the vertex after is the larger.
    dart: u32,
}

impl Seen {
    fn key(&self) -> u64 {
        u64::from(self.beside[0]) << 32 | u64::from(self.beside[1])
    }

    fn dart(&self) -> u32 {
        self.dart >> 2
    }

    fn is_triangle(&self) -> bool {
        self.dart & 2 != 0
    }

    fn winds_like(&self, other: &Self) -> bool {
        self.dart & 1 == other.dart & 1
    }
}

/// Buckets by smallest vertex: a vertex is the smallest of few faces, so that each bucket is soon sorted, and all is
/// linear for any reasonable mesh.
pub(super) fn find(vertices: usize, rings: &Rings) -> Partners {
    let mut ends = vec![0u32; vertices + 1];
    let spans = || {
        rings
            .starts
            .windows(2)
            .map(|ends| ends[0] as usize..ends[1] as usize)
    };
    for span in spans() {
        let least = rings.vertex[span].iter().min();
        ends[least.map_or(0, |&least| least as usize) + 1] += 1;
    }
    for bucket in 0..vertices {
        ends[bucket + 1] += ends[bucket];
    }
    let mut seen = vec![Seen::default(); rings.starts.len() - 1];
    for span in spans() {
        let (least, ring) = view(&rings.vertex[span.clone()], span.start);
        let end = &mut ends[least as usize];
        seen[*end as usize] = ring;
        *end += 1;
    }
    // Placing moved each entry of `ends` from its bucket's start to its end. Pieces of buckets are sorted in parallel,
    // and their findings joined in order.
    let mut pieces = Vec::new();
    let (mut rest, mut start) = (&mut seen[..], 0);
    for ends in ends[..vertices].chunks(1 << 14) {
        let end = ends[ends.len() - 1];
        let (piece, after) = rest.split_at_mut((end - start) as usize);
        pieces.push((piece, ends, start));
        (rest, start) = (after, end);
    }
    let found: Vec<_> = pieces
        .into_par_iter()
        .map(|(seen, ends, start)| match_buckets(rings, seen, ends, start))
        .collect();
    let mut all = Partners::default();
    all.pairs
        .reserve_exact(found.iter().map(|found| found.pairs.len()).sum());
    for mut found in found {
        all.pairs.append(&mut found.pairs);
        all.crowded.append(&mut found.crowded);
    }
    all
}

/// `seen` holds the buckets that end at `ends`, counted from `start`.
fn match_buckets(rings: &Rings, seen: &mut [Seen], ends: &[u32], start: u32) -> Partners {
    let mut partners = Partners::default();
    partners.pairs.reserve(seen.len() / 2);
    let mut from = 0;
    for &end in ends {
        let end = (end - start) as usize;
        let bucket = &mut seen[from..end];
        bucket.sort_unstable_by_key(Seen::key);
        for group in bucket.chunk_by(|a, b| a.beside == b.beside) {
            if group.len() > 1 {
                join(rings, group, &mut partners);
            }
        }
        from = end;
    }
    partners
}

/// The smallest vertex of a ring, and the ring as seen from there.
fn view(ring: &[u32], first_dart: usize) -> (u32, Seen) {
    let mut least = 0;
    for at in 1..ring.len() {
        if ring[at] < ring[least] {
            least = at;
        }
    }
    let after = ring[if least + 1 == ring.len() {
        0
    } else {
        least + 1
    }];
    let before = ring[if least == 0 {
        ring.len() - 1
    } else {
        least - 1
    }];
    let flags = u32::from(ring.len() == 3) << 1 | u32::from(after > before);
    let dart = number(first_dart + least) << 2 | flags;
    let beside = [after.min(before), after.max(before)];
    (ring[least], Seen { beside, dart })
}

/// `group` agrees in three vertices; rings of more may still differ.
fn join(rings: &Rings, group: &[Seen], partners: &mut Partners) {
    if let [one, other] = group {
        if same(rings, one, other) {
            partners.pairs.push(pair(one, other));
        }
        return;
    }
    let mut rest = group.to_vec();
    while let Some(first) = rest.first().copied() {
        let (alike, others): (Vec<_>, _) = rest
            .into_iter()
            .partition(|other| same(rings, &first, other));
        match &alike[..] {
            [_] => {}
            [one, other] => partners.pairs.push(pair(one, other)),
            _ => {
                let mut darts: Vec<_> = alike.iter().map(Seen::dart).collect();
                darts.sort_unstable();
                partners.crowded.push(darts);
            }
        }
        rest = others;
    }
}

fn pair(one: &Seen, other: &Seen) -> Pair {
    Pair {
        darts: [one.dart(), other.dart()],
        is_mirrored: one.winds_like(other),
    }
}

/// Whether two rings that agree around their smallest vertices are the same, be it in opposite directions.
fn same(rings: &Rings, one: &Seen, other: &Seen) -> bool {
    if one.is_triangle() || other.is_triangle() {
        return one.is_triangle() && other.is_triangle();
    }
    let ring = |seen: &Seen| {
        let start = seen.dart();
        let mut at = Some(start);
        std::iter::from_fn(move || {
            let now = at?;
            at = Some(rings.next(now)).filter(|&next| next != start);
            Some(rings.vertex[now as usize])
        })
    };
    if one.winds_like(other) {
        return ring(one).eq(ring(other));
    }
    let backward: Vec<_> = ring(other).skip(1).collect();
    ring(one).skip(1).eq(backward.into_iter().rev())
}
