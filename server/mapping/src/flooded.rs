//! What a binding keeps of its flood, to follow a mesh of which little changes.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use crate::arcs::{Arc, Arcs, Rewired};
use crate::distance::{Distances, nearest};
use crate::flood::{Nearest, Root};
use crate::paths::Floods;
use crate::reflood::{Bounds, Change, Reflood, Row};
use crate::roots::TIE;
use crate::{Graph, Paths, Roots, Start};

/// Points whose nearest targets went, beyond which all of them are looked for.
const MOST_LOST: usize = 64;

/// A flood and all that it came from: 16 bytes for each arc both ways, 24 m for the position of a target, and
/// 12 k for its k nearest points.
#[derive(Clone, Debug)]
pub(crate) struct Flooded {
    arcs: Arcs,
    /// Of the targets, m.
    centres: Vec<Vector3<f64>>,
    /// By node and source; starts in the units of the arcs.
    roots: Vec<Root>,
    /// Of each point the least squared distance of a target, m²; for [`Roots::Nearest`].
    least: Vec<f64>,
    strays: Vec<Stray>,
    floods: Vec<(Bounds, Nearest)>,
}

/// A part without a root, and the one that it was given. `[W11]`
#[derive(Clone, Debug)]
struct Stray {
    root: Root,
    /// Ascending.
    nodes: Vec<u32>,
}

/// A flood that follows a change, before it is taken over.
#[derive(Clone, Debug)]
pub(crate) struct Renewed {
    /// The targets that are new or have other points or distances, ascending.
    pub(crate) targets: Vec<u32>,
    /// How far each of these is from its points.
    pub(crate) distances: Distances,
    rewired: Rewired,
    centres: Vec<(u32, Vector3<f64>)>,
    rooted: Rooted,
    strays: Vec<Stray>,
    rows: Vec<Vec<(u32, Row)>>,
}

/// Other roots.
#[derive(Clone, Debug, Default)]
struct Rooted {
    gone: Vec<Root>,
    come: Vec<Root>,
    least: Vec<(u32, f64)>,
}

/// What a change of the targets leads to.
pub(crate) struct Turned<'a> {
    pub(crate) rewired: Rewired,
    /// Of the targets after the change, m.
    pub(crate) centres: &'a [Vector3<f64>],
    pub(crate) points: &'a [Vector3<f64>],
    pub(crate) usable: &'a [u32],
    pub(crate) paths: &'a Paths,
    /// Targets whose rows are asked for, changed or not, ascending.
    pub(crate) asked: &'a [u32],
}

impl Flooded {
    /// `None` where a change of few targets may change all: see [`Binding::renewal`](crate::Binding::renewal).
    ///
    /// * `roots` – without those of parts that came off, which are `strays`.
    pub(crate) fn new(
        graph: &Graph,
        centres: &[Vector3<f64>],
        points: &[Vector3<f64>],
        [roots, strays]: [&[Root]; 2],
        floods: &Floods,
    ) -> Option<Self> {
        let arcs = Arcs::new(graph)?;
        let mut least = vec![f64::INFINITY; points.len()];
        for root in roots {
            let far = centres[root.node as usize] - points[root.source as usize];
            let least = &mut least[root.source as usize];
            *least = least.min(far.norm_squared());
        }
        let rounded = |root: &Root| Root {
            start: arcs.round(root.start),
            ..*root
        };
        let mut own: Vec<Root> = roots.iter().map(rounded).collect();
        sort(&mut own);
        let stray = |root: &Root| Stray {
            root: rounded(root),
            nodes: part(root.node, |node| arcs.row(node), &mut BTreeSet::new()),
        };
        Some(Self {
            strays: strays.iter().map(stray).collect(),
            centres: centres.to_vec(),
            roots: own,
            least,
            floods: floods.each().to_vec(),
            arcs,
        })
    }

    pub(crate) fn arcs(&self) -> &Arcs {
        &self.arcs
    }

    /// The rows that a flood of all would make after a change, where they are others than before. `None` where that needs
    /// a look at all of it, or no path reaches some target.
    pub(crate) fn renewed(&self, turned: Turned<'_>) -> Option<Renewed> {
        let rooted = self.rooted(&turned)?;
        let roots = rooted.applied(&self.roots);
        let (dropped, mut strays): (Vec<&Stray>, Vec<&Stray>) = (self.strays.iter())
            .partition(|stray| stray.is_touched(turned.rewired.nodes(), &rooted));
        let lost: Vec<u32> = (dropped.iter())
            .flat_map(|stray| &stray.nodes)
            .copied()
            .collect();
        let change = Change {
            before: &self.arcs,
            rewired: &turned.rewired,
            gone: &rooted.gone,
            come: &rooted.come,
            roots: &roots,
        };
        let mut floods: Vec<Reflood<'_>> = (self.floods.iter())
            .map(|(bounds, known)| Reflood::new(known, *bounds, &change, &lost))
            .collect();
        // The last one reaches all that any does.
        let unreached = floods.last()?.unreached();
        let found = self.strays(&unreached, &change, &turned)?;
        if !found.is_empty() {
            let roots: Vec<Root> = found.iter().map(|stray| stray.root).collect();
            for flood in &mut floods {
                flood.start(&roots, &change);
            }
            if !floods.last()?.unreached().is_empty() {
                return None;
            }
        }
        strays.extend(&found);
        let strays = strays.into_iter().cloned().collect();
        let mut targets: Vec<u32> = floods.iter().flat_map(Reflood::changed).collect();
        targets.extend(turned.asked);
        targets.sort_unstable();
        targets.dedup();
        let rows: Vec<Row> = targets
            .iter()
            .map(|&target| merged(&floods, target))
            .collect();
        let moved = turned.rewired.nodes().iter();
        let centres = moved.map(|&node| (node, turned.centres[node as usize]));
        Some(Renewed {
            distances: Distances::of_rows(&rows),
            targets,
            centres: centres.collect(),
            rooted,
            strays,
            rows: floods.into_iter().map(Reflood::into_rows).collect(),
            rewired: turned.rewired,
        })
    }

    /// Takes over what [`Self::renewed`] found.
    pub(crate) fn take(&mut self, renewed: Renewed) {
        let Renewed {
            targets: _,
            distances: _,
            rewired,
            centres,
            rooted,
            strays,
            rows,
        } = renewed;
        self.arcs.take(&rewired);
        for (node, centre) in centres {
            match self.centres.get_mut(node as usize) {
                Some(own) => *own = centre,
                None => self.centres.push(centre),
            }
        }
        if let Cow::Owned(roots) = rooted.applied(&self.roots) {
            self.roots = roots;
        }
        for (source, least) in rooted.least {
            self.least[source as usize] = least;
        }
        self.strays = strays;
        for ((_, known), rows) in self.floods.iter_mut().zip(rows) {
            known.take(rows);
        }
    }

    /// What of the roots changes. `None` where too many points lose theirs, or may have others for more than that.
    fn rooted(&self, turned: &Turned<'_>) -> Option<Rooted> {
        let mut rooted = Rooted::default();
        let (mut come, mut known) = (Vec::new(), BTreeMap::new());
        for &node in turned.rewired.nodes() {
            let now = turned.centres[node as usize];
            let before = self.centres.get(node as usize);
            let before = before.filter(|_| !self.arcs.row(node).is_empty());
            let is_open = turned.is_open(node, &self.arcs);
            if let Some(before) = before {
                known.insert(bits(before), node);
                if is_open && *before == now {
                    continue;
                }
                rooted.gone.extend(at(&self.roots, node));
            }
            if is_open {
                come.push(node);
            }
        }
        match turned.paths.roots {
            Roots::Containing => None,
            Roots::Ball(radius) => {
                for &node in &come {
                    let all = turned.usable.iter().copied();
                    let near = all.filter(|&point| turned.squared(node, point) <= radius * radius);
                    (rooted.come).extend(near.map(|point| turned.root(node, point, &self.arcs)));
                }
                Some(rooted)
            }
            Roots::Nearest => self.nearest(turned, rooted, &come, &known),
        }
    }

    /// The roots of points in their nearest targets, after some targets went and these came; `known` are some that there
    /// were, by their places.
    fn nearest(
        &self,
        turned: &Turned<'_>,
        mut rooted: Rooted,
        come: &[u32],
        known: &BTreeMap<[u64; 3], u32>,
    ) -> Option<Rooted> {
        let mut lost: Vec<u32> = rooted.gone.iter().map(|root| root.source).collect();
        for &node in come {
            let Some(&twin) = known.get(&bits(&turned.centres[node as usize])) else {
                // It may be nearer to a point than all that it had.
                let least = |point: u32| bound(self.least[point as usize]);
                let all = turned.usable.iter().copied();
                lost.extend(all.filter(|&point| turned.squared(node, point) <= least(point)));
                continue;
            };
            let theirs = at(&self.roots, twin).map(|root| root.source);
            (rooted.come).extend(theirs.map(|point| turned.root(node, point, &self.arcs)));
        }
        lost.sort_unstable();
        lost.dedup();
        if lost.len() > MOST_LOST {
            return None;
        }
        let is_lost = |root: &Root| lost.binary_search(&root.source).is_ok();
        rooted.come.retain(|root| !is_lost(root));
        (rooted.gone).extend(self.roots.iter().filter(|root| is_lost(root)).copied());
        let nodes = (0..).take(turned.centres.len());
        let nodes = nodes.filter(|&node| turned.is_open(node, &self.arcs));
        for &point in &lost {
            let squares = nodes.clone().map(|node| turned.squared(node, point));
            let least = squares.fold(f64::INFINITY, f64::min);
            let is_near = |node: &u32| turned.squared(*node, point) <= bound(least);
            let near = nodes.clone().filter(is_near);
            (rooted.come).extend(near.map(|node| turned.root(node, point, &self.arcs)));
            rooted.least.push((point, least));
        }
        Some(rooted)
    }

    /// The parts without a root among nodes that no path reaches, and a root for each. `[W11]` `None` where a part has one,
    /// too far for its flood.
    fn strays(
        &self,
        unreached: &[u32],
        change: &Change<'_>,
        turned: &Turned<'_>,
    ) -> Option<Vec<Stray>> {
        let mut met = BTreeSet::new();
        let mut found = Vec::new();
        for &first in unreached {
            if met.contains(&first) {
                continue;
            }
            let nodes = part(first, |node| change.row(node), &mut met);
            if nodes
                .iter()
                .any(|&node| at(change.roots, node).next().is_some())
            {
                return None;
            }
            let places: Vec<_> = (nodes.iter())
                .map(|&node| turned.centres[node as usize])
                .collect();
            let far = nearest(&places, turned.points, turned.usable, 1);
            let row = (0..nodes.len())
                .min_by(|&a, &b| far.squared[a].total_cmp(&far.squared[b]))
                .expect("a part has a node");
            let start = match turned.paths.start {
                Start::Zero => 0.0,
                Start::Distance => self.arcs.round(far.squared[row].sqrt()),
            };
            let (node, source) = (nodes[row], far.points[row]);
            let root = Root {
                node,
                source,
                start,
            };
            found.push(Stray { root, nodes });
        }
        Some(found)
    }
}

impl Turned<'_> {
    /// Whether paths may start at a target: one that is left over has no arc.
    fn is_open(&self, node: u32, before: &Arcs) -> bool {
        !self.rewired.row(before, node).is_empty()
    }

    /// How far a target is straight from a point, m².
    fn squared(&self, node: u32, point: u32) -> f64 {
        (self.centres[node as usize] - self.points[point as usize]).norm_squared()
    }

    fn root(&self, node: u32, point: u32, arcs: &Arcs) -> Root {
        let far = self.centres[node as usize] - self.points[point as usize];
        Root {
            node,
            source: point,
            start: match self.paths.start {
                Start::Zero => 0.0,
                Start::Distance => arcs.round(far.norm()),
            },
        }
    }
}

impl Stray {
    fn is_touched(&self, nodes: &[u32], rooted: &Rooted) -> bool {
        let is_here = |node: &u32| self.nodes.binary_search(node).is_ok();
        let roots = rooted.gone.iter().chain(&rooted.come);
        nodes.iter().any(is_here) || roots.map(|root| root.node).any(|node| is_here(&node))
    }
}

impl Rooted {
    /// The roots after this change.
    fn applied<'a>(&self, roots: &'a [Root]) -> Cow<'a, [Root]> {
        if self.gone.is_empty() && self.come.is_empty() {
            return Cow::Borrowed(roots);
        }
        let mut gone: Vec<[u32; 2]> = self.gone.iter().map(key).collect();
        gone.sort_unstable();
        let mut roots = roots.to_vec();
        roots.retain(|root| gone.binary_search(&key(root)).is_err());
        roots.extend(&self.come);
        sort(&mut roots);
        Cow::Owned(roots)
    }
}

/// The greatest squared distance that is as near as this one, m².
fn bound(least: f64) -> f64 {
    least * (1.0 + TIE) * (1.0 + TIE)
}

fn key(root: &Root) -> [u32; 2] {
    [root.node, root.source]
}

fn sort(roots: &mut [Root]) {
    roots.sort_by_key(key);
}

/// The roots at a node, of sorted ones.
fn at(roots: &[Root], node: u32) -> impl Iterator<Item = Root> + '_ {
    let first = roots.partition_point(|root| root.node < node);
    let roots = roots[first..].iter().copied();
    roots.take_while(move |root| root.node == node)
}

fn bits(place: &Vector3<f64>) -> [u64; 3] {
    (*place).map(f64::to_bits).into()
}

/// The nodes that arcs join to a node, ascending.
fn part<'a>(first: u32, row: impl Fn(u32) -> &'a [Arc], met: &mut BTreeSet<u32>) -> Vec<u32> {
    let mut part = vec![first];
    met.insert(first);
    let mut done = 0;
    while let Some(&node) = part.get(done) {
        done += 1;
        part.extend((row(node).iter()).filter_map(|&(next, _)| met.insert(next).then_some(next)));
    }
    part.sort_unstable();
    part
}

/// The points of a target in all floods, each at its least squared distance.
fn merged(floods: &[Reflood<'_>], target: u32) -> Row {
    let mut row: Row = floods
        .iter()
        .flat_map(|flood| flood.entries(target))
        .collect();
    row.sort_unstable_by(|a, b| a.1.cmp(&b.1).then(a.0.total_cmp(&b.0)));
    row.dedup_by_key(|entry| entry.1);
    row.iter_mut().for_each(|entry| entry.0 *= entry.0);
    row.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    row
}
