//! Roots in the parts of a mesh that came off with none.

use nalgebra::Vector3;

use crate::distance::nearest;
use crate::paths::Ground;
use crate::{Root, Start};

/// A root in each part of what floods spread over that has none: at the target that is straight the nearest to a usable point. `[W11]`
///
/// * `unreached` – the nodes that no path reaches, ascending.
/// * `centres` – of the nodes, m.
pub(crate) fn strays(
    ground: &Ground<'_>,
    unreached: &[usize],
    roots: &[Root],
    centres: &[Vector3<f64>],
    (points, usable): (&[Vector3<f64>], &[u32]),
    start: Start,
) -> Vec<Root> {
    let mut is_met = vec![false; ground.len()];
    let mut is_rooted = vec![false; ground.len()];
    for root in roots {
        is_rooted[root.node as usize] = true;
    }
    let mut found = Vec::new();
    for &first in unreached {
        if is_met[first] {
            continue;
        }
        let part = part(ground, first, &mut is_met);
        // Beyond the limit of a flood there are unreached nodes in parts with roots.
        if part.iter().any(|&node| is_rooted[node]) {
            continue;
        }
        let places: Vec<_> = part.iter().map(|&node| centres[node]).collect();
        let distances = nearest(&places, points, usable, 1);
        let row = (0..part.len())
            .min_by(|&a, &b| distances.squared[a].total_cmp(&distances.squared[b]))
            .expect("a part has a node");
        found.push(Root {
            node: u32::try_from(part[row]).expect("nodes are counted by u32"),
            source: distances.points[row],
            start: match start {
                Start::Zero => 0.0,
                Start::Distance => distances.squared[row].sqrt(),
            },
        });
    }
    found
}

/// The nodes that paths join to a node, ascending.
fn part(ground: &Ground<'_>, first: usize, is_met: &mut [bool]) -> Vec<usize> {
    let mut part = vec![first];
    is_met[first] = true;
    let mut done = 0;
    while let Some(&node) = part.get(done) {
        done += 1;
        ground.for_each_neighbour(node, |next| {
            if !std::mem::replace(&mut is_met[next as usize], true) {
                part.push(next as usize);
            }
        });
    }
    part.sort_unstable();
    part
}
