//! Markers under each other's names.

use super::{Marker, Tracker};
use crate::{Doubt, Sample};

/// Below this distance two markers under each other's names are no matter, m.
const CLOSE: f64 = 0.01;
/// How many times nearer to another's place a marker is to be that other one.
const NEARER: f64 = 2.0;

impl Tracker {
    /// Finds markers under each other's names, and gives each its own again.
    pub(super) fn tell_apart(&mut self, sample: &Sample) {
        let count = self.markers.len();
        let seen = |named: &[usize], i: usize| {
            let column = named[i];
            sample.seen[column].then(|| sample.positions[column])
        };
        let known = |marker: &Marker| marker.unseen.is_finite();
        let off = |named: &[usize], i: usize| {
            seen(named, i).map_or(0.0, |place| (place - self.expected[i]).norm())
        };
        let close = |i: usize| CLOSE + self.slack(i);
        let doubtful: Vec<usize> = (0..count)
            .filter(|&i| known(&self.markers[i]) && off(&self.named, i) > close(i))
            .collect();
        // Whose place each is in, if it is anyone's who is not there.
        let mut takes = vec![None; count];
        for &i in &doubtful {
            let Some(place) = seen(&self.named, i) else {
                continue;
            };
            // One that was carried itself is known too little to be told from another that is hidden.
            let steady = self.markers[i].unseen == 0.0;
            let free = |&j: &usize| {
                let hidden = steady && seen(&self.named, j).is_none();
                j != i && known(&self.markers[j]) && (hidden || doubtful.contains(&j))
            };
            let distance = |j: usize| (place - self.expected[j]).norm();
            let nearest = (0..count)
                .filter(free)
                .min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            takes[i] = nearest.filter(|&j| NEARER * distance(j) < off(&self.named, i));
        }
        let hidden: Vec<bool> = (0..count).map(|i| seen(&self.named, i).is_none()).collect();
        self.rename(&takes, &hidden);
    }

    /// Gives each marker that is in another's place that other's name. Swaps go all round, or end at a marker that is
    /// hidden, whose name goes to the first: markers that follow each other closely are in each other's places too when
    /// they speed up, but the last of them is in nobody's.
    fn rename(&mut self, takes: &[Option<usize>], hidden: &[bool]) {
        let mut claimed = vec![false; takes.len()];
        let mut moves = Vec::new();
        for (from, to) in takes.iter().enumerate() {
            if let Some(to) = *to
                && !std::mem::replace(&mut claimed[to], true)
            {
                moves.push((from, to));
            }
        }
        loop {
            let gives: Vec<usize> = moves.iter().map(|&(from, _)| from).collect();
            let before = moves.len();
            moves.retain(|&(_, to)| hidden[to] || gives.contains(&to));
            if moves.len() == before {
                break;
            }
        }
        claimed.fill(false);
        for &(_, to) in &moves {
            claimed[to] = true;
        }
        if moves.is_empty() {
            return;
        }
        let gives = |i: usize| moves.iter().any(|&(from, _)| from == i);
        let names: Vec<usize> = moves.iter().map(|&(from, _)| self.named[from]).collect();
        let mut left: Vec<usize> = moves
            .iter()
            .filter(|&&(_, to)| !gives(to))
            .map(|&(_, to)| self.named[to])
            .collect();
        for (&(_, to), name) in moves.iter().zip(names) {
            self.named[to] = name;
            self.markers[to].doubt = Doubt::Swap;
        }
        for &(from, _) in &moves {
            if !claimed[from] {
                self.named[from] = left.pop().expect("as many chains start as end");
                self.markers[from].doubt = Doubt::Swap;
            }
        }
    }
}
