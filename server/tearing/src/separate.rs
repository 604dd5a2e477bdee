//! Tearing along the frontier between two points' areas.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use sinew_topology::{
    Adjacency, Cell, Dart, Edge, EditError, Face, Map, Place, Vertex, Volume, Walk,
};

use crate::areas::{Areas, Sides, View};
use crate::body::number;
use crate::commit::{Batch, Made};
use crate::cut::Cuts;
use crate::{Answer, Body, Done, Refusal};

/// Areas that do not meet grow by no more edges than this.
const MOST_GROWN: u32 = 4;

impl Body {
    /// Tears the body between two points: as their areas are, or else with areas drawn anew until that is possible.
    pub(crate) fn separate(
        &mut self,
        points: [u32; 2],
        view: &View<'_>,
        batch: &mut Batch,
    ) -> Result<Answer, Refusal> {
        let [one, other] = points;
        if one == other {
            return Err(Refusal::NoArea { point: one });
        }
        let mut rest = [Vector3::zeros(); 2];
        for (place, &point) in rest.iter_mut().zip(&points) {
            let known = view.points.get(point as usize);
            *place = *known.ok_or(Refusal::NoArea { point })?;
        }
        let areas = Areas::new(view, batch, self.rest.len(), points);
        if let Some(at) = areas.missing() {
            return Err(Refusal::NoArea { point: points[at] });
        }
        let depth = areas.depth();
        let mut first = None;
        // Fewer and fewer points: half as many each time.
        let mut kept = depth;
        while kept > 0 {
            let sides = areas.sides(kept, self.rest.len(), rest);
            match self.tear(&sides, points, view, batch) {
                Ok(done) if kept == depth => return Ok(Answer::Applied(done)),
                Ok(done) => {
                    return Ok(Answer::Refined {
                        kept,
                        grown: 0,
                        done,
                    });
                }
                Err(refusal) => first = first.or(Some(refusal)),
            }
            kept /= 2;
        }
        let mut sides = areas.sides(1, self.rest.len(), rest);
        for grown in 1..=MOST_GROWN {
            if !sides.grow(self) {
                break;
            }
            if let Ok(done) = self.tear(&sides, points, view, batch) {
                return Ok(Answer::Refined {
                    kept: 1,
                    grown,
                    done,
                });
            }
        }
        Err(first.expect("each point acts somewhere, so that sides were tried"))
    }

    /// Tears the body along the frontier between two sides.
    fn tear(
        &mut self,
        sides: &Sides,
        points: [u32; 2],
        view: &View<'_>,
        batch: &mut Batch,
    ) -> Result<Done, Refusal> {
        let (rest, walk) = (&self.rest, &mut self.walk);
        let ground = Ground {
            sides,
            points,
            rest,
            view,
            batch,
        };
        let touching = ground.touching(&self.map, &self.adjacency, walk);
        let slots = |volumes: &[Cell<Volume>]| -> Vec<u32> {
            let slots = volumes.iter().map(|volume| self.slots[volume.index()]);
            slots.collect()
        };
        if !touching.shared.is_empty() {
            let cells = slots(&touching.shared);
            return Err(Refusal::Overlap { points, cells });
        }
        if touching.volumes.is_empty() {
            let cells = self.ends(sides);
            return Err(Refusal::Gap { points, cells });
        }
        let cells = slots(&touching.volumes);
        let (made, changes) = self.map.edit(|edit| {
            let mut cuts = Cuts::default();
            for volume in touching.crossed {
                // One that cannot be cut is left whole, and the tear passes around it.
                cuts.cut(edit, volume, sides, rest, walk).ok();
            }
            let volumes = touching.volumes.iter().chain(&cuts.volumes).copied();
            let mut opened = Vec::new();
            for dart in ground.facing(edit.map(), volumes, walk) {
                opened.push([dart, edit.unsew3(dart)?]);
            }
            if opened.is_empty() {
                return Err(Refusal::Gap { points, cells });
            }
            Ok(Made {
                opened,
                placed: cuts.placed,
                ..Made::default()
            })
        })?;
        let mut done = self.commit(&changes, &made, batch);
        self.sever(sides, points, &made.opened, view, batch);
        self.torn.insert(sorted(points));
        let touched = changes.touched::<Volume>(&self.map);
        self.tear_on(&touched, view, batch, &mut done);
        Ok(done)
    }

    /// Opens what joins cells of points that were torn apart before: where cells were cut now, their parts may be another
    /// point's than the whole was.
    fn tear_on(
        &mut self,
        volumes: &[Cell<Volume>],
        view: &View<'_>,
        batch: &mut Batch,
        done: &mut Done,
    ) {
        let mut faces = Vec::new();
        for &volume in volumes {
            if self.map.try_dart(volume).is_some() {
                faces.extend(self.map.incident::<Volume, Face>(volume, &mut self.walk));
            }
        }
        faces.sort_unstable();
        faces.dedup();
        faces.retain(|&face| match self.map.volumes_of(face) {
            (one, Some(other)) => {
                let owners = [one, other].map(|volume| self.owner(volume, view, batch));
                matches!(owners, [Some(one), Some(other)] if self.torn.contains(&sorted([one, other])))
            }
            (_, None) => false,
        });
        if faces.is_empty() {
            return;
        }
        let opened = self.map.edit(|edit| {
            let mut opened = Vec::new();
            for face in faces {
                let dart = edit.map().dart(face);
                opened.push([dart, edit.unsew3(dart)?]);
            }
            Ok::<_, EditError>(opened)
        });
        let (opened, changes) = opened.expect("a face between two volumes can be opened");
        let made = Made {
            opened,
            ..Made::default()
        };
        let more = self.commit(&changes, &made, batch);
        done.take(more);
    }

    /// The point that a volume follows.
    pub(crate) fn owner(
        &mut self,
        volume: Cell<Volume>,
        view: &View<'_>,
        batch: &Batch,
    ) -> Option<u32> {
        let (mut votes, mut sum, mut count) = (Vec::new(), Vector3::zeros(), 0.0);
        for vertex in self.map.incident::<Volume, Vertex>(volume, &mut self.walk) {
            votes.extend(batch.strongest(view, number(vertex.index())));
            sum += self.rest[vertex.index()];
            count += 1.0;
        }
        owner(votes, sum / count, view.points)
    }

    /// The cells where each area is nearest to the other's point.
    fn ends(&mut self, sides: &Sides) -> Vec<u32> {
        let mut volumes = Vec::new();
        for vertex in sides.ends(&self.rest).into_iter().flatten() {
            if let Some(vertex) = self.map.cell_at::<Vertex>(vertex) {
                volumes.extend(self.map.incident::<Vertex, Volume>(vertex, &mut self.walk));
            }
        }
        volumes.sort_unstable();
        volumes.dedup();
        volumes.iter().map(|&volume| self.slot(volume)).collect()
    }

    /// Lets each point act no more on what came to be on the other's side. Where the tear ends, both sides still have the
    /// same vertices.
    fn sever(
        &self,
        sides: &Sides,
        points: [u32; 2],
        opened: &[[Dart; 2]],
        view: &View<'_>,
        batch: &mut Batch,
    ) {
        let ring = |dart| self.map.ring(dart).map(|dart| self.map.vertex(dart));
        for darts in opened {
            let rings = darts.map(|dart| ring(dart).collect::<Vec<_>>());
            for (here, side) in [(0, Place::Below), (1, Place::Above)] {
                let there = &rings[1 - here];
                for vertex in rings[here].iter().filter(|vertex| !there.contains(vertex)) {
                    let vertex = number(vertex.index());
                    let origin = batch.origin(vertex, sides.len());
                    // One that was put into an edge goes with the end on its side.
                    let mut ends = batch.parents(origin).unwrap_or_default().iter();
                    let end = ends.find(|&&end| sides.place(end as usize) == Some(side));
                    let end = end.copied();
                    let mut known = batch.points(view, end.unwrap_or(vertex));
                    if sides.place(end.unwrap_or(origin) as usize).is_some() {
                        known.retain(|point| !points.contains(point));
                        known.insert(0, points[here]);
                    }
                    batch.know(vertex, known);
                }
            }
        }
    }
}

/// What decides where a tear passes.
#[derive(Clone, Copy)]
struct Ground<'a> {
    sides: &'a Sides,
    points: [u32; 2],
    rest: &'a [Vector3<f64>],
    view: &'a View<'a>,
    batch: &'a Batch,
}

/// Volumes along a frontier.
struct Touching {
    /// Those that have vertices in both areas, and those beside them.
    volumes: Vec<Cell<Volume>>,
    /// Of these, those to be cut.
    crossed: Vec<Cell<Volume>>,
    /// Of these, those of which both areas have every vertex.
    shared: Vec<Cell<Volume>>,
}

/// How a volume lies to a frontier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lie {
    /// On one side, or on none if it is a third point's.
    Beside(Option<Place>),
    /// Across it, with no vertex elsewhere; on which side are most of them.
    Across(Place),
    /// Wholly on it.
    Within,
}

impl Ground<'_> {
    /// The volumes along the frontier, ascending.
    fn touching(
        &self,
        map: &Map,
        neighbours: &Adjacency<Vertex, Edge>,
        walk: &mut Walk,
    ) -> Touching {
        let mut volumes = Vec::new();
        for vertex in self.sides.border(map, neighbours) {
            volumes.extend(map.incident::<Vertex, Volume>(vertex, walk));
        }
        volumes.sort_unstable();
        volumes.dedup();
        volumes.retain(|&volume| self.is_in_both(map, volume, walk));
        let lies = |volume| (volume, self.lie(map, volume, walk));
        let lies: Vec<_> = volumes.iter().copied().map(lies).collect();
        let of_kind = |is: fn(Lie) -> bool| {
            let found = lies.iter().filter(|(_, lie)| is(*lie));
            found.map(|(volume, _)| *volume).collect()
        };
        let beside = volumes.iter().flat_map(|&volume| {
            let near = map.adjacent::<Volume, Face>(volume, walk);
            near.collect::<Vec<_>>()
        });
        let mut all: Vec<_> = beside.collect();
        all.append(&mut volumes);
        all.sort_unstable();
        all.dedup();
        Touching {
            volumes: all,
            crossed: of_kind(|lie| matches!(lie, Lie::Across(_))),
            shared: of_kind(|lie| lie == Lie::Within),
        }
    }

    fn is_in_both(&self, map: &Map, volume: Cell<Volume>, walk: &mut Walk) -> bool {
        let vertices = map.incident::<Volume, Vertex>(volume, walk);
        let (mut is_below, mut is_above) = (false, false);
        for place in vertices.filter_map(|vertex| self.sides.place(vertex.index())) {
            is_below |= place != Place::Above;
            is_above |= place != Place::Below;
        }
        is_below && is_above
    }

    fn lie(&self, map: &Map, volume: Cell<Volume>, walk: &mut Walk) -> Lie {
        let [one, other] = self.points;
        let (mut below, mut above, mut is_elsewhere) = (0, 0, false);
        let (mut votes, mut sum, mut count) = (Vec::new(), Vector3::zeros(), 0.0);
        for vertex in map.incident::<Volume, Vertex>(volume, walk) {
            match self.sides.place(vertex.index()) {
                Some(Place::Below) => below += 1,
                Some(Place::Above) => above += 1,
                Some(Place::On) => votes.extend([one, other]),
                None => {
                    is_elsewhere = true;
                    votes.extend(self.batch.strongest(self.view, number(vertex.index())));
                }
            }
            sum += self.rest.get(vertex.index()).copied().unwrap_or_default();
            count += 1.0;
        }
        let most = if above > below {
            Place::Above
        } else {
            Place::Below
        };
        match (below, above, is_elsewhere) {
            (0, 0, false) => Lie::Within,
            (0, _, false) | (_, 0, false) => Lie::Beside(Some(most)),
            (_, _, false) => Lie::Across(most),
            (_, _, true) => {
                votes.extend(std::iter::repeat_n(one, below));
                votes.extend(std::iter::repeat_n(other, above));
                let owner = owner(votes, sum / count, self.view.points);
                let sides = [(one, Place::Below), (other, Place::Above)];
                let side = sides.into_iter().find(|(point, _)| owner == Some(*point));
                Lie::Beside(side.map(|(_, side)| side))
            }
        }
    }

    /// A dart, below, of each face between volumes of different sides.
    fn facing(
        &self,
        map: &Map,
        volumes: impl Iterator<Item = Cell<Volume>>,
        walk: &mut Walk,
    ) -> Vec<Dart> {
        let side = |volume| match self.lie(map, volume, walk) {
            Lie::Beside(side) => (volume, side),
            Lie::Across(side) => (volume, Some(side)),
            Lie::Within => (volume, None),
        };
        let sides: BTreeMap<_, _> = volumes.map(side).collect();
        let below = sides
            .iter()
            .filter(|(_, side)| **side == Some(Place::Below));
        let mut faces = BTreeMap::new();
        for (&volume, _) in below {
            for dart in map.orbit(volume, walk) {
                let beyond = map
                    .beta3(dart)
                    .and_then(|beyond| sides.get(&map.volume(beyond)));
                if beyond == Some(&Some(Place::Above)) {
                    faces.entry(map.face(dart)).or_insert(dart);
                }
            }
        }
        faces.into_values().collect()
    }
}

/// Whose a volume is: that point's which most of its vertices vote for, of several such the nearest one's.
fn owner(mut votes: Vec<u32>, centre: Vector3<f64>, points: &[Vector3<f64>]) -> Option<u32> {
    votes.sort_unstable();
    let distance = |point: u32| (points[point as usize] - centre).norm_squared();
    let alike = votes.chunk_by(|a, b| a == b);
    let best = alike.max_by(|a, b| {
        let nearer = || distance(b[0]).total_cmp(&distance(a[0]));
        let more = a.len().cmp(&b.len());
        more.then_with(nearer).then_with(|| b[0].cmp(&a[0]))
    });
    Some(best?[0])
}

fn sorted([one, other]: [u32; 2]) -> [u32; 2] {
    [one.min(other), one.max(other)]
}
