//! What acts on the particles.

use nalgebra::Vector3;

use crate::{
    Driven, ExternalForce, Integrator, SystemSpec,
    drags::Drags,
    guard::Bounds,
    links::Batch,
    neighbours::Crowded,
    pairs::PairForces,
    solid::Solid,
    state::{Frames, Inertia, Loads, State},
};

/// Everything of a system that is not its state.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) inertia: Inertia,
    pub(crate) gravity: Vector3<f64>, // m/s²
    pub(crate) drag: f64,             // N s/m
    pub(crate) spin_drag: f64,        // N m s
    pub(crate) links: Vec<Batch>,
    pub(crate) pairs: Option<PairForces>,
    pub(crate) solid: Option<Box<Solid>>,
    /// Whether a step under way has met more pairs than memory should hold.
    pub(crate) crowded: Option<Crowded>,
    pub(crate) drags: Drags,
    driven: Vec<Driven>,
    forces: Vec<ExternalForce>,
    /// About the distance between neighbours, m: what a small displacement is small against.
    pub(crate) spacing: f64,
}

impl Model {
    /// A model and its state at the start; `spec` has been checked.
    pub(crate) fn new(spec: SystemSpec) -> (Self, State) {
        let SystemSpec {
            positions: position,
            velocities: velocity,
            mut masses,
            fixed,
            driven,
            forces,
            gravity,
            damping: drag,
            frames,
            links,
            pairs,
            solid,
            integrator: _,
            stepping: _,
        } = spec;
        let solid = solid.map(|solid| Box::new(Solid::checked(&solid, position.clone())));
        if let (Some(solid), true) = (&solid, masses.is_empty()) {
            masses = solid.masses().to_vec();
        }
        let held = (fixed.iter().copied()).chain(driven.iter().map(|driven| driven.particle));
        let mut inverse_mass: Vec<f64> = masses.iter().map(|mass| mass.recip()).collect();
        for particle in held {
            inverse_mass[particle as usize] = 0.0;
        }
        let spin_drag = frames.as_ref().map_or(0.0, |frames| frames.damping);
        let (frames, inverse_moments) = match frames {
            Some(spec) => {
                let (frames, inverse_moments) = Frames::new(spec, &inverse_mass);
                (Some(frames), inverse_moments)
            }
            None => (None, Vec::new()),
        };
        let mut state = State {
            position,
            velocity,
            frames,
        };
        for (v, &w) in state.velocity.iter_mut().zip(&inverse_mass) {
            if w == 0.0 {
                *v = Vector3::zeros();
            }
        }
        let mut model = Self {
            inertia: Inertia {
                inverse_mass,
                inverse_moments,
            },
            gravity,
            drag,
            spin_drag,
            links: Vec::new(),
            pairs: None,
            solid,
            crowded: None,
            drags: Drags::default(),
            driven,
            forces,
            spacing: spacing(&state.position),
        };
        model.impose(&mut state, 0.0);
        let batches = links.into_iter();
        model.links = batches
            .map(|links| Batch::new(links, &state.position))
            .collect();
        model.pairs =
            pairs.map(|pairs| PairForces::new(pairs, state.position.len(), model.spacing));
        model.update_pairs(&state.position);
        model.settle(&state);
        (model, state)
    }

    /// Moves the driven particles and those held to where they are at a time, s.
    pub(crate) fn impose(&self, state: &mut State, time: f64) {
        for Driven { particle, path } in &self.driven {
            let i = *particle as usize;
            state.position[i] = path.at(time);
            state.velocity[i] = path.rate(time);
        }
        for (i, position, velocity) in self.drags.at(time) {
            state.position[i] = position;
            state.velocity[i] = velocity;
        }
    }

    fn update_pairs(&mut self, position: &[Vector3<f64>]) {
        if let Some(pairs) = &mut self.pairs {
            self.crowded = self.crowded.or(pairs.update(position).err());
        }
    }

    /// What acts at a time, s, save for gravity and for the drag on every particle.
    pub(crate) fn loads(&mut self, state: &State, time: f64, loads: &mut Loads) {
        loads.clear(state.position.len(), state.frames.is_some());
        for batch in &self.links {
            batch.add_forces(state, &mut loads.force);
        }
        self.update_pairs(&state.position);
        if let Some(pairs) = &mut self.pairs {
            pairs.add_loads(state, &self.inertia, loads);
        }
        if let Some(solid) = &mut self.solid {
            solid.add_forces(&state.position, &state.velocity, &mut loads.force);
        }
        for ExternalForce { particle, force } in &self.forces {
            loads.force[*particle as usize] += force.at(time);
        }
    }

    /// Adds the drag on every particle.
    pub(crate) fn add_drag(&self, state: &State, loads: &mut Loads) {
        if self.drag > 0.0 {
            for (force, velocity) in loads.force.iter_mut().zip(&state.velocity) {
                *force -= velocity * self.drag;
            }
        }
        if let Some(frames) = &state.frames
            && self.spin_drag > 0.0
        {
            for (i, torque) in loads.torque.iter_mut().enumerate() {
                let (q, momentum) = (&frames.orientation[i], &frames.momentum[i]);
                *torque -= self.inertia.spin(i, q, momentum) * self.spin_drag;
            }
        }
    }

    /// Whether loads depend on velocities.
    pub(crate) fn is_damped(&self) -> bool {
        self.links.iter().any(Batch::is_damped)
            || self.pairs.as_ref().is_some_and(PairForces::is_damped)
            || self.solid.as_ref().is_some_and(|solid| solid.is_damped())
    }

    /// m/s²; zero for a particle that is held.
    pub(crate) fn acceleration(&self, i: usize, loads: &Loads) -> Vector3<f64> {
        if self.inertia.is_free(i) {
            loads.force[i] * self.inertia.inverse_mass[i] + self.gravity
        } else {
            Vector3::zeros()
        }
    }

    /// N m; zero for a particle that is held.
    pub(crate) fn torque(&self, i: usize, loads: &Loads) -> Vector3<f64> {
        if self.inertia.is_free(i) {
            loads.torque[i]
        } else {
            Vector3::zeros()
        }
    }

    /// Takes note of the state at the end of a step: what breaks, flows or slips.
    pub(crate) fn settle(&mut self, state: &State) {
        for batch in &mut self.links {
            batch.settle(&state.position);
        }
    }

    /// The largest step that keeps small motions bounded, s, as things stand.
    pub(crate) fn largest_step(&self, integrator: Integrator, state: &State) -> f64 {
        let mut bounds = Bounds::new(&self.inertia, self.drag, self.spin_drag);
        for batch in &self.links {
            batch.add_bounds(&mut bounds);
        }
        if let Some(pairs) = &self.pairs {
            pairs.add_bounds(state, &self.inertia, &mut bounds);
        }
        if let Some(solid) = &self.solid {
            bounds.add_all(solid.bounds(&state.position));
        }
        bounds.largest_step(integrator)
    }

    /// Energy of the free particles and of all that acts between particles, J. `[P5]`
    pub(crate) fn energy(&self, state: &State) -> f64 {
        let mut energy = 0.0;
        for (i, &inverse_mass) in self.inertia.inverse_mass.iter().enumerate() {
            if inverse_mass > 0.0 {
                let kinetic = 0.5 * state.velocity[i].norm_squared();
                energy += (kinetic - self.gravity.dot(&state.position[i])) / inverse_mass;
            }
            if let Some(Frames {
                orientation,
                momentum,
            }) = &state.frames
            {
                let spin = self.inertia.spin(i, &orientation[i], &momentum[i]);
                energy += 0.5 * spin.dot(&momentum[i]);
            }
        }
        let links = self.links.iter().map(|batch| batch.energy(&state.position));
        let pairs = (self.pairs.as_ref()).map_or(0.0, |pairs| pairs.energy(state, &self.inertia));
        let solid = (self.solid.as_ref()).map_or(0.0, |solid| solid.energy(&state.position));
        energy + links.sum::<f64>() + pairs + solid
    }
}

/// The spread of the positions divided among them, m; 1 where they do not spread.
fn spacing(positions: &[Vector3<f64>]) -> f64 {
    let [low, high] = positions.iter().fold(
        [f64::INFINITY, f64::NEG_INFINITY].map(Vector3::repeat),
        |[low, high], x| [low.inf(x), high.sup(x)],
    );
    #[expect(clippy::cast_precision_loss, reason = "a count of particles")]
    let spacing = (high - low).norm() / (positions.len() as f64).cbrt();
    if spacing.is_finite() && spacing > 0.0 {
        spacing
    } else {
        1.0
    }
}
