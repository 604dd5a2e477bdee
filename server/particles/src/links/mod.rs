//! Links: typed columns, one batch per law.

mod law;
mod spec;

use nalgebra::Vector3;
pub use spec::{Elastic, LinkLaw, Links};

use self::law::{AxialLaw, Breaking, Contacts, Friction, Plastic, Springs, Table};
use crate::{
    guard::Bounds,
    rows::{Partner, Rows},
    state::State,
};

/// Links of one law.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    ends: Vec<[u32; 2]>,
    /// Where each link stands in the specification; here they are in the order of their rows.
    given: Vec<u32>,
    /// Where each link's constants are in the columns of the law.
    entries: Vec<u32>,
    rows: Rows<End>,
    law: Law,
}

#[derive(Clone, Debug)]
enum Law {
    Springs(Springs),
    Contacts(Contacts),
    Breaking(Breaking),
    Plastic(Plastic),
    Table(Table),
    Friction(Friction),
}

/// A link as one of its ends sees it.
#[derive(Clone, Copy, Debug)]
struct End {
    other: u32,
    entry: u32,
}

impl Partner for End {
    fn other(self) -> usize {
        self.other as usize
    }
}

impl Batch {
    /// `links` has been checked against `positions`.
    pub(crate) fn new(links: Links, positions: &[Vector3<f64>]) -> Self {
        let Links { ends, law } = links;
        let mut given: Vec<u32> = (0..).take(ends.len()).collect();
        given.sort_by_key(|&link| ends[link as usize].iter().min().copied());
        let ends: Vec<[u32; 2]> = given.iter().map(|&link| ends[link as usize]).collect();
        let sorted = |column: Vec<f64>| -> Vec<f64> {
            given.iter().map(|&link| column[link as usize]).collect()
        };
        let at_start = |&[a, b]: &[u32; 2]| positions[b as usize] - positions[a as usize];
        let springs = |elastic: Elastic| Springs {
            stiffness: sorted(elastic.stiffness),
            damping: Some(elastic.damping)
                .filter(|damping| damping.iter().any(|&z| z > 0.0))
                .map(sorted),
            rest_length: match elastic.rest_lengths {
                Some(lengths) => sorted(lengths),
                None => ends.iter().map(|ends| at_start(ends).norm()).collect(),
            },
        };
        let mut law = match law {
            LinkLaw::Spring(elastic) => Law::Springs(springs(elastic)),
            LinkLaw::Contact(elastic) => Law::Contacts(Contacts(springs(elastic))),
            LinkLaw::Breaking {
                elastic,
                elongations,
            } => Law::Breaking(Breaking {
                springs: springs(elastic),
                elongation: sorted(elongations),
            }),
            LinkLaw::Plastic { elastic, yields } => Law::Plastic(Plastic {
                springs: springs(elastic),
                yields: sorted(yields),
            }),
            LinkLaw::Friction { stiffness, limits } => Law::Friction(Friction {
                stiffness: sorted(stiffness),
                limit: sorted(limits),
                anchor: ends.iter().map(at_start).collect(),
            }),
            LinkLaw::Table { lengths, forces } => Law::Table(Table {
                length: lengths,
                force: forces,
            }),
        };
        let shared = match &mut law {
            Law::Springs(springs) | Law::Contacts(Contacts(springs)) => springs.share(),
            Law::Breaking(_) | Law::Plastic(_) | Law::Table(_) | Law::Friction(_) => None,
        };
        let entries = shared.unwrap_or_else(|| (0..).take(ends.len()).collect());
        let rows = Rows::new(positions.len(), &ends, |other, link| End {
            other,
            entry: entries[link],
        });
        Self {
            ends,
            given,
            entries,
            rows,
            law,
        }
    }

    /// Adds the links' forces to those of the particles, N.
    pub(crate) fn add_forces(&self, state: &State, force: &mut [Vector3<f64>]) {
        match &self.law {
            Law::Springs(law) => self.add_axial(law, state, force),
            Law::Contacts(law) => self.add_axial(law, state, force),
            Law::Breaking(law) => self.add_axial(law, state, force),
            Law::Plastic(law) => self.add_axial(law, state, force),
            Law::Table(law) => self.add_axial(law, state, force),
            Law::Friction(law) => self.rows.add_pushes(force, |i, p| {
                let link = p.entry as usize;
                let r = state.position[p.other()] - state.position[i];
                if self.ends[link][0] as usize == i {
                    law.force(link, r)
                } else {
                    -law.force(link, -r)
                }
            }),
        }
    }

    fn add_axial(&self, law: &impl AxialLaw, state: &State, force: &mut [Vector3<f64>]) {
        let motion = Motion::of(state);
        self.rows.add_pushes(force, |i, p| {
            axial_push(law, p.entry as usize, i, p.other(), motion)
        });
    }

    /// Whether forces depend on velocities.
    pub(crate) fn is_damped(&self) -> bool {
        match &self.law {
            Law::Springs(springs)
            | Law::Contacts(Contacts(springs))
            | Law::Breaking(Breaking { springs, .. })
            | Law::Plastic(Plastic { springs, .. }) => springs.damping.is_some(),
            Law::Table(_) | Law::Friction(_) => false,
        }
    }

    /// How many links there are.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Where a link of the specification stands here.
    pub(crate) fn place(&self, link: u32) -> Option<usize> {
        self.given.iter().position(|&given| given == link)
    }

    /// The force of the link at a place on its second end, N.
    pub(crate) fn force(&self, place: usize, state: &State) -> Vector3<f64> {
        let motion = Motion::of(state);
        let [a, b] = self.ends[place].map(|end| end as usize);
        let entry = self.entries[place] as usize;
        match &self.law {
            Law::Springs(law) => axial_push(law, entry, a, b, motion),
            Law::Contacts(law) => axial_push(law, entry, a, b, motion),
            Law::Breaking(law) => axial_push(law, entry, a, b, motion),
            Law::Plastic(law) => axial_push(law, entry, a, b, motion),
            Law::Table(law) => axial_push(law, entry, a, b, motion),
            Law::Friction(law) => law.force(entry, state.position[b] - state.position[a]),
        }
    }

    /// The force of each link, as [`Batch::force`], in the order of the specification.
    pub(crate) fn forces(&self, state: &State) -> Vec<Vector3<f64>> {
        self.as_given(|place| self.force(place, state))
    }

    /// The ends of each link, in the order of the specification.
    pub(crate) fn ends(&self) -> Vec<[u32; 2]> {
        self.as_given(|place| self.ends[place])
    }

    fn as_given<T: Default + Clone>(&self, at: impl Fn(usize) -> T) -> Vec<T> {
        let mut column = vec![T::default(); self.given.len()];
        for (place, &given) in self.given.iter().enumerate() {
            column[given as usize] = at(place);
        }
        column
    }

    /// Which links are broken, in the order of the specification; empty where the law does not break.
    pub(crate) fn broken(&self) -> Vec<bool> {
        let Law::Breaking(law) = &self.law else {
            return Vec::new();
        };
        self.as_given(|place| law.elongation[place] == f64::NEG_INFINITY)
    }

    /// Takes note of the lengths at the end of a step: what breaks, flows or slips.
    pub(crate) fn settle(&mut self, position: &[Vector3<f64>]) {
        let r = |&[a, b]: &[u32; 2]| position[b as usize] - position[a as usize];
        match &mut self.law {
            Law::Springs(_) | Law::Contacts(_) | Law::Table(_) => {}
            Law::Breaking(law) => settle(law, self.ends.iter().map(r)),
            Law::Plastic(law) => settle(law, self.ends.iter().map(r)),
            Law::Friction(law) => {
                for (link, ends) in self.ends.iter().enumerate() {
                    law.settle(link, r(ends));
                }
            }
        }
    }

    /// Elastic energy, J.
    pub(crate) fn energy(&self, position: &[Vector3<f64>]) -> f64 {
        let mut energy = 0.0;
        for (&[a, b], &link) in self.ends.iter().zip(&self.entries) {
            let link = link as usize;
            let r = position[b as usize] - position[a as usize];
            let length = r.norm();
            energy += match &self.law {
                Law::Springs(law) => law.energy(link, length),
                Law::Contacts(law) => law.energy(link, length),
                Law::Breaking(law) => law.energy(link, length),
                Law::Plastic(law) => law.energy(link, length),
                Law::Table(law) => law.energy(link, length),
                Law::Friction(law) => 0.5 * law.force(link, r).norm_squared() / law.stiffness[link],
            };
        }
        energy
    }

    /// Adds the stiffness and damping that each particle can meet.
    pub(crate) fn add_bounds(&self, bounds: &mut Bounds) {
        let bound = |link: usize| match &self.law {
            Law::Springs(law) => law.bounds(link),
            Law::Contacts(law) => law.bounds(link),
            Law::Breaking(law) => law.bounds(link),
            Law::Plastic(law) => law.bounds(link),
            Law::Table(law) => law.bounds(link),
            Law::Friction(law) => (law.stiffness[link], 0.0),
        };
        self.rows.for_each_end(|i, other, p| {
            let (stiffness, damping) = bound(p.entry as usize);
            bounds.add_pair(i, other, stiffness, damping);
        });
    }

    /// What the batch remembers.
    pub(crate) fn memory(&self) -> &[f64] {
        match &self.law {
            Law::Springs(_) | Law::Contacts(_) | Law::Table(_) => &[],
            Law::Breaking(law) => &law.elongation,
            Law::Plastic(law) => &law.springs.rest_length,
            Law::Friction(law) => bytemuck::cast_slice(&law.anchor),
        }
    }

    pub(crate) fn memory_mut(&mut self) -> &mut [f64] {
        match &mut self.law {
            Law::Springs(_) | Law::Contacts(_) | Law::Table(_) => &mut [],
            Law::Breaking(law) => &mut law.elongation,
            Law::Plastic(law) => &mut law.springs.rest_length,
            Law::Friction(law) => bytemuck::cast_slice_mut(&mut law.anchor),
        }
    }
}

fn settle(law: &mut impl AxialLaw, links: impl Iterator<Item = Vector3<f64>>) {
    for (link, r) in links.enumerate() {
        law.settle(link, r.norm());
    }
}

/// Positions and velocities, m and m/s.
#[derive(Clone, Copy)]
struct Motion<'a> {
    position: &'a [Vector3<f64>],
    velocity: &'a [Vector3<f64>],
}

impl<'a> Motion<'a> {
    fn of(state: &'a State) -> Self {
        Self {
            position: &state.position,
            velocity: &state.velocity,
        }
    }
}

/// The force of an axial link on its end `b`, N; none where the ends coincide, for want of an axis.
#[inline]
fn axial_push(
    law: &impl AxialLaw,
    link: usize,
    a: usize,
    b: usize,
    Motion { position, velocity }: Motion<'_>,
) -> Vector3<f64> {
    let r = position[b] - position[a];
    let length = r.norm();
    if length == 0.0 {
        return Vector3::zeros();
    }
    let rate = || (velocity[b] - velocity[a]).dot(&r) / length;
    r * (law.force(link, length, rate) / length)
}
