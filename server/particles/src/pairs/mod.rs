//! What acts between any two particles.

mod central;
mod directed;
mod form;
mod law;
mod spec;
mod table;
mod view;

use nalgebra::{Matrix3, Vector3};

pub(crate) use form::PairLoad;
pub use form::{Form, Gradient, Normalisation, Weighting};
pub use spec::{Attraction, AttractionLaw, EndingKind, PairFriction, PairSpec, Repulsion};

use self::{
    central::{Central, add_forces, add_radial},
    directed::DirectedCohesion,
    form::Pair,
    law::{Cohesion, Ending, Law, LennardJones, Repelling, TwelveSix},
    view::{Needs, View},
};
use crate::{
    guard::Bounds,
    neighbours::{Crowded, Neighbours, Search},
    rows::Rows,
    state::{Inertia, Loads, State},
};

/// Complete pairs stand in rows of this class, those that repel in the other.
const COMPLETE: usize = 0;
const REPELLING: usize = 1;

/// What acts between any two particles.
#[derive(Clone, Debug)]
pub(crate) struct PairForces {
    attraction: Option<Pull>,
    form: Option<Form>,
    friction: Option<PairFriction>,
    repulsion: Option<Ending<Repelling>>,
    reach: f64, // m
    /// Distance that pairs have at least, m.
    core: f64,
    bonds: Option<Bonds>,
    objects: Vec<u32>,
    kinds: Vec<u32>,
    search: Search,
    neighbours: Neighbours,
    view: View,
}

/// What draws pairs together.
#[derive(Clone, Debug)]
enum Pull {
    Central(Ending<Central>),
    Directed(DirectedCohesion),
}

/// Complete pairs that were given.
#[derive(Clone, Debug)]
struct Bonds {
    /// 0, 1, 2, …: rows of bonds are in the order of the particles.
    order: Vec<u32>,
    rows: Rows<u32>,
    /// For each particle those that it is bonded to, ascending.
    partners: Vec<Vec<u32>>,
}

impl Bonds {
    fn new(particles: usize, bonds: &[[u32; 2]]) -> Self {
        let mut partners = vec![Vec::new(); particles];
        for &[a, b] in bonds {
            partners[a as usize].push(b);
            partners[b as usize].push(a);
        }
        for partners in &mut partners {
            partners.sort_unstable();
        }
        Self {
            order: (0..).take(particles).collect(),
            rows: Rows::new(particles, bonds, |other, _| other),
            partners,
        }
    }

    fn holds(&self, a: u32, b: u32) -> bool {
        self.partners[a as usize].binary_search(&b).is_ok()
    }
}

/// A kind that is complete with every other but itself.
const HINGE: u32 = 0;

/// The class of a pair by the paper's rules. `[P30]`
fn class(objects: &[u32], kinds: &[u32], a: u32, b: u32) -> usize {
    let [a, b] = [a as usize, b as usize];
    let one_object = objects.is_empty() || objects[a] == objects[b];
    let one_kind = kinds.is_empty()
        || match (kinds[a], kinds[b]) {
            (HINGE, HINGE) => false,
            (HINGE, _) | (_, HINGE) => true,
            (a, b) => a == b,
        };
    if one_object && one_kind {
        COMPLETE
    } else {
        REPELLING
    }
}

impl PairForces {
    /// `spec` has been checked; `spacing` is about the distance between neighbours, m.
    pub(crate) fn new(spec: PairSpec, particles: usize, spacing: f64) -> Self {
        let PairSpec {
            attraction,
            form,
            friction,
            reach,
            bonds,
            repulsion,
            objects,
            kinds,
            skin,
        } = spec;
        let reach = if bonds.is_some() {
            f64::INFINITY
        } else {
            reach
        };
        let searched = [
            if bonds.is_some() { 0.0 } else { reach },
            repulsion.map_or(0.0, |repulsion| repulsion.reach),
        ];
        let attraction = attraction.map(|attraction| Pull::new(attraction, reach));
        Self {
            core: match &attraction {
                Some(Pull::Central(law)) => law.core,
                Some(Pull::Directed(_)) | None => 1e-3 * spacing,
            },
            attraction,
            form,
            friction,
            repulsion: repulsion.map(
                |Repulsion {
                     strength,
                     length,
                     reach,
                 }| { Ending::sharp(Repelling { strength, length }, reach) },
            ),
            reach,
            bonds: bonds.map(|bonds| Bonds::new(particles, &bonds)),
            objects,
            kinds,
            search: Search {
                reach: searched,
                skin: skin.unwrap_or(searched[0].max(searched[1]) / 8.0),
            },
            neighbours: Neighbours::default(),
            view: View::default(),
        }
    }

    /// Finds the pairs of these positions.
    pub(crate) fn update(&mut self, position: &[Vector3<f64>]) -> Result<(), Crowded> {
        if self.search.reach == [0.0; 2] {
            return Ok(());
        }
        let Self {
            search,
            neighbours,
            objects,
            kinds,
            bonds,
            ..
        } = self;
        match bonds {
            Some(bonds) => neighbours.update(search, position, |a, b| {
                (!bonds.holds(a, b)).then_some(REPELLING)
            }),
            None if objects.is_empty() && kinds.is_empty() => {
                neighbours.update(search, position, |_, _| Some(COMPLETE))
            }
            None => neighbours.update(search, position, |a, b| Some(class(objects, kinds, a, b))),
        }
    }

    /// Whether forces depend on velocities.
    pub(crate) fn is_damped(&self) -> bool {
        self.friction.is_some()
    }

    /// The order of the particles in the rows of complete pairs, and the rows.
    fn complete(&self) -> (&[u32], &Rows<u32>) {
        match &self.bonds {
            Some(bonds) => (&bonds.order, &bonds.rows),
            None => (&self.neighbours.order, &self.neighbours.rows[COMPLETE]),
        }
    }

    fn needs(&self) -> Needs {
        let directed = matches!(self.attraction, Some(Pull::Directed(_)));
        Needs {
            frames: self.form.is_some() || directed,
            motion: self.friction.is_some(),
        }
    }

    /// Adds the loads of all pairs; [`PairForces::update`] has been called with these positions.
    pub(crate) fn add_loads(&mut self, state: &State, inertia: &Inertia, loads: &mut Loads) {
        let mut view = std::mem::take(&mut self.view);
        let (order, rows) = self.complete();
        let needs = self.needs();
        view.gather(state, inertia, order, needs);
        if needs.frames || needs.motion {
            let mut load = std::mem::take(&mut view.load);
            load.resize(order.len(), [Vector3::zeros(); 2]);
            rows.add_loads(&mut load, |a, b| self.load(&view, order, a, b));
            view.load = load;
        } else if let Some(Pull::Central(law)) = &self.attraction {
            let mut force = std::mem::take(&mut view.force);
            force.resize(order.len(), Vector3::zeros());
            add_forces(law, rows, &view.position, &mut force);
            view.force = force;
        }
        view.scatter(order, loads);
        if let Some(repulsion) = &self.repulsion {
            let order = &self.neighbours.order;
            let nothing = Needs {
                frames: false,
                motion: false,
            };
            view.gather(state, inertia, order, nothing);
            let mut force = std::mem::take(&mut view.force);
            force.resize(order.len(), Vector3::zeros());
            let rows = &self.neighbours.rows[REPELLING];
            add_radial(repulsion, rows, &view.position, &mut force);
            view.force = force;
            view.scatter(order, loads);
        }
        self.view = view;
    }

    /// The load of a complete pair, by places in its order.
    fn load(&self, view: &View, order: &[u32], a: usize, b: usize) -> PairLoad {
        let mut load = PairLoad::default();
        let r = apart(view.position[b] - view.position[a], a, b, self.core);
        let square = r.norm_squared();
        if square >= self.reach * self.reach {
            return load;
        }
        match &self.attraction {
            None => {}
            Some(Pull::Directed(law)) => {
                let ends = [order[a] as usize, order[b] as usize];
                law.add_load(r, [&view.frame[a], &view.frame[b]], ends, &mut load);
            }
            Some(Pull::Central(law)) => load.push += r * law.over_distance(square),
        }
        if let Some(form) = &self.form {
            let pair = pair(form, &view.frame, order, r, square.sqrt(), [a, b]);
            form.add_load(&pair, &mut load);
        }
        if let Some(friction) = &self.friction {
            friction.add_load(r, [view.motion[a], view.motion[b]], &mut load);
        }
        load
    }

    /// J
    pub(crate) fn energy(&self, state: &State, inertia: &Inertia) -> f64 {
        let mut view = View::default();
        let (order, rows) = self.complete();
        view.gather(state, inertia, order, self.needs());
        let mut energy = 0.0;
        rows.for_each_pair(|a, b| {
            let r = view.position[b] - view.position[a];
            let length = r.norm();
            if length >= self.reach {
                return;
            }
            energy += match &self.attraction {
                None => 0.0,
                Some(Pull::Directed(law)) => {
                    let ends = [order[a] as usize, order[b] as usize];
                    law.energy(r, [&view.frame[a], &view.frame[b]], ends)
                }
                Some(Pull::Central(law)) => law.energy(length),
            };
            if let Some(form) = &self.form {
                energy += form.energy(&pair(form, &view.frame, order, r, length, [a, b]));
            }
        });
        if let Some(repulsion) = &self.repulsion {
            let order = &self.neighbours.order;
            self.neighbours.rows[REPELLING].for_each_pair(|a, b| {
                let ends = [a, b].map(|end| state.position[order[end] as usize]);
                energy += repulsion.energy((ends[1] - ends[0]).norm());
            });
        }
        energy
    }

    /// Adds the stiffness and damping that each particle meets as things stand.
    pub(crate) fn add_bounds(&self, state: &State, inertia: &Inertia, bounds: &mut Bounds) {
        let mut view = View::default();
        let (order, rows) = self.complete();
        view.gather(state, inertia, order, self.needs());
        rows.for_each_end(|a, b, _| {
            let r = apart(view.position[b] - view.position[a], a, b, self.core);
            let length = r.norm();
            if length >= self.reach {
                return;
            }
            let [i, j] = [order[a] as usize, order[b] as usize];
            let along = match &self.attraction {
                None => 0.0,
                Some(Pull::Directed(law)) => law.stiffness(),
                Some(Pull::Central(law)) => law.stiffness(length),
            };
            let sliding = self.friction.map_or(0.0, |friction| friction.sliding);
            bounds.add_pair(i, j, along, sliding);
            if let Some(form) = &self.form {
                let pair = pair(form, &view.frame, order, r, length, [a, b]);
                bounds.add_turning(i, j, form.stiffness(&pair));
            }
            if let Some(friction) = &self.friction {
                let lever = 0.5 * length;
                let turning = friction.turning + sliding * lever * lever;
                bounds.add_turning_damping(i, j, [sliding * lever, turning]);
            }
        });
        if let Some(repulsion) = &self.repulsion {
            let order = &self.neighbours.order;
            self.neighbours.rows[REPELLING].for_each_end(|a, b, _| {
                let [i, j] = [order[a] as usize, order[b] as usize];
                let length = (state.position[j] - state.position[i]).norm();
                bounds.add_pair(i, j, repulsion.stiffness(length), 0.0);
            });
        }
    }

    /// Pieces of the attraction's table and its error; `None` where there is no table.
    pub(crate) fn table(&self) -> Option<(usize, f64)> {
        match &self.attraction {
            Some(Pull::Central(Ending {
                law: Central::Table(table),
                ..
            })) => Some((table.pieces(), table.error)),
            Some(Pull::Central(_) | Pull::Directed(_)) | None => None,
        }
    }
}

impl Pull {
    fn new(attraction: Attraction, reach: f64) -> Self {
        let Attraction { law, ending, table } = attraction;
        let law = match law {
            AttractionLaw::DirectedCohesion {
                stiffness,
                sharpness,
                radii,
            } => return Self::Directed(DirectedCohesion::new(stiffness, sharpness, radii)),
            AttractionLaw::LennardJones {
                stiffness,
                rest_length,
                exponent,
            } => Law::LennardJones(LennardJones {
                stiffness,
                rest_length,
                exponent: i32::try_from(exponent).expect("at most 64"),
            }),
            AttractionLaw::TwelveSix { depth, size } => Law::TwelveSix(TwelveSix { depth, size }),
            AttractionLaw::Cohesion {
                stiffness,
                rest_length,
                sharpness,
            } => Law::Cohesion(Cohesion {
                stiffness,
                rest_length,
                sharpness,
            }),
        };
        Self::Central(Central::ending(law, reach, ending, table))
    }
}

/// A pair of a form, from places in an order to particles.
fn pair<'a>(
    form: &Form,
    frames: &'a [Matrix3<f64>],
    order: &[u32],
    r: Vector3<f64>,
    length: f64,
    [a, b]: [usize; 2],
) -> Pair<'a> {
    Pair {
        r,
        length,
        frames: [&frames[a], &frames[b]],
        curvatures: [a, b].map(|end| form.curvatures[order[end] as usize]),
    }
}

/// Two particles are at least a core apart; those in one place along x, whichever comes first to one side: any direction
/// is as good.
fn apart(r: Vector3<f64>, a: usize, b: usize, core: f64) -> Vector3<f64> {
    let length = r.norm();
    if length >= core {
        r
    } else if length > 0.0 {
        r / length * core
    } else {
        Vector3::new(if a < b { core } else { -core }, 0.0, 0.0)
    }
}

impl PairFriction {
    /// Adds the load on a pair that moves and spins like this. `[P32]`
    fn add_load(&self, r: Vector3<f64>, ends: [[Vector3<f64>; 2]; 2], load: &mut PairLoad) {
        let [[va, wa], [vb, wb]] = ends;
        let lever = r * 0.5;
        let slip = (vb - wb.cross(&lever)) - (va + wa.cross(&lever));
        let on_first = slip * self.sliding;
        let turn = (wb - wa) * self.turning;
        let moment = lever.cross(&on_first);
        load.push -= on_first;
        load.torques[0] += turn + moment;
        load.torques[1] += moment - turn;
    }
}
