use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    Diverged, Fault, Integrator, Solid, SpecError, Stepping, SystemSpec, check,
    integrate::Workspace,
    links::Batch,
    model::Model,
    state::{Loads, State},
};

/// A link of a [`System`], found once to be read at every step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    batch: usize,
    place: usize,
}

/// Particles and what acts between and on them.
///
/// Columns have one entry per particle.
#[derive(Clone, Debug)]
pub struct System {
    pub(crate) model: Model,
    pub(crate) state: State,
    /// Simulated time, s.
    pub(crate) time: f64,
    pub(crate) integrator: Integrator,
    pub(crate) stepping: Stepping,
    /// The substep that the tolerance bore last, s.
    pub(crate) adapted: Option<f64>,
    pub(crate) workspace: Workspace,
}

impl System {
    /// Checks every value of `spec` and builds the system. Linear in particles; n log n in links.
    ///
    /// # Errors
    /// The first value at fault, with its field and what it should be.
    pub fn new(spec: SystemSpec) -> Result<Self, SpecError> {
        spec.check()?;
        let SystemSpec {
            integrator,
            stepping,
            ..
        } = spec;
        let (model, state) = Model::new(spec);
        if model.crowded.is_some() {
            return Err(check::refuse("pairs.reach", Fault::Crowded));
        }
        Ok(Self {
            workspace: Workspace::new(&state),
            model,
            state,
            time: 0.0,
            integrator,
            stepping,
            adapted: None,
        })
    }

    /// Takes a step of `dt` > 0 seconds, divided as [`SystemSpec::stepping`] says.
    ///
    /// # Errors
    /// [`Diverged`]; the system then stays as it was before the step, or before the last substep.
    pub fn step(&mut self, dt: f64) -> Result<(), Diverged> {
        let Self {
            model, state, time, ..
        } = self;
        model.drags.lay(&state.position, *time, dt);
        match self.stepping {
            Stepping::Fixed => self.substep(dt),
            Stepping::Stable { most } => self.stable_step(dt, most),
            Stepping::Adaptive { tolerance, most } => self.adaptive_step(dt, tolerance, most),
        }?;
        if let Some(solid) = &mut self.model.solid
            && !solid.tear(&self.state.position).is_empty()
        {
            // What acted before acts no more.
            self.workspace.kept = None;
        }
        Ok(())
    }

    /// Takes hold of a particle, which the next step leads straight to `target`, m, and which stays there until it is led
    /// elsewhere; or lets it go, by `None`.
    ///
    /// # Panics
    /// If there is no such particle.
    pub fn drag(&mut self, particle: u32, target: Option<Vector3<f64>>) {
        let Model { drags, inertia, .. } = &mut self.model;
        drags.set(particle, target, inertia);
    }

    /// How a step is divided.
    #[must_use]
    pub fn stepping(&self) -> Stepping {
        self.stepping
    }

    /// Positions, m.
    #[must_use]
    pub fn positions(&self) -> &[Vector3<f64>] {
        &self.state.position
    }

    /// Velocities, m/s; those of fixed particles are zero.
    #[must_use]
    pub fn velocities(&self) -> &[Vector3<f64>] {
        &self.state.velocity
    }

    /// Orientations, world from body; `None` where the particles have none.
    #[must_use]
    pub fn orientations(&self) -> Option<&[UnitQuaternion<f64>]> {
        let frames = self.state.frames.as_ref()?;
        Some(&frames.orientation)
    }

    /// Angular momenta about the particles themselves, N m s, world frame; empty without orientations.
    #[must_use]
    pub fn angular_momenta(&self) -> &[Vector3<f64>] {
        self.state.frames.as_ref().map_or(&[], |f| &f.momentum)
    }

    /// A step, s, below which small motions are bounded as things stand; infinite where every step is. `[P4]`
    ///
    /// Stiffness and damping that a particle takes part in bound the eigenvalues by Gershgorin's theorem; so the step
    /// is on the safe side for small motions. Large ones may need less.
    #[must_use]
    pub fn largest_stable_step(&self) -> f64 {
        self.model.largest_step(self.integrator, &self.state)
    }

    /// Energy of the free particles and of all that acts between particles, J: kinetic, elastic and in gravity (zero at
    /// the origin). `[P5]`
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.model.energy(&self.state)
    }

    /// What acts on each particle now, save for gravity: forces, N, and torques, N m, world frame; no torques without
    /// orientations. What a fixed particle is held against is minus this and its weight.
    ///
    /// Changes nothing: it works on a copy of all that acts, since pairs found anew would be summed in another order.
    #[must_use]
    pub fn loads(&self) -> [Vec<Vector3<f64>>; 2] {
        let mut model = self.model.clone();
        let mut loads = Loads::default();
        model.loads(&self.state, self.time, &mut loads);
        model.add_drag(&self.state, &mut loads);
        [loads.force, loads.torque]
    }

    /// How many links each batch has.
    #[must_use]
    pub fn link_counts(&self) -> Vec<usize> {
        self.model.links.iter().map(Batch::len).collect()
    }

    /// Finds a link by its batch and its index there, in time linear in the batch; `None` where there is none.
    #[must_use]
    pub fn link(&self, batch: u32, index: u32) -> Option<Link> {
        let batch = batch as usize;
        let place = self.model.links.get(batch)?.place(index)?;
        Some(Link { batch, place })
    }

    /// The force of a link on its second end, N; its opposite acts on the first.
    ///
    /// # Panics
    /// If the link is another system's and there is no such link here.
    #[must_use]
    pub fn link_force(&self, Link { batch, place }: Link) -> Vector3<f64> {
        self.model.links[batch].force(place, &self.state)
    }

    /// The force of each link of a batch on its second end, N; its opposite acts on the first.
    ///
    /// # Panics
    /// If there is no such batch.
    #[must_use]
    pub fn link_forces(&self, batch: usize) -> Vec<Vector3<f64>> {
        self.model.links[batch].forces(&self.state)
    }

    /// The two particles of each link of a batch.
    ///
    /// # Panics
    /// If there is no such batch.
    #[must_use]
    pub fn link_ends(&self, batch: usize) -> Vec<[u32; 2]> {
        self.model.links[batch].ends()
    }

    /// Which links of a batch are broken; empty where they cannot break.
    ///
    /// # Panics
    /// If there is no such batch.
    #[must_use]
    pub fn broken_links(&self, batch: usize) -> Vec<bool> {
        self.model.links[batch].broken()
    }

    /// How many pieces the table of the attraction has and how far it is off, as a fraction of the greatest attraction or
    /// of the force where that is greater; `None` where the law itself is used.
    #[must_use]
    pub fn attraction_table(&self) -> Option<(usize, f64)> {
        self.model.pairs.as_ref()?.table()
    }

    /// The elastic solid that the particles are, if they are one.
    #[must_use]
    pub fn solid(&self) -> Option<&Solid> {
        self.model.solid.as_deref()
    }

    /// Columns of numbers on which the next step depends, apart from positions: for a digest.
    #[must_use]
    pub fn hidden_state(&self) -> Vec<&[f64]> {
        let mut columns: Vec<&[f64]> = vec![
            bytemuck::cast_slice(&self.state.velocity),
            self.model.drags.summary(),
        ];
        if let Some(frames) = &self.state.frames {
            columns.push(bytemuck::cast_slice(&frames.orientation));
            columns.push(bytemuck::cast_slice(&frames.momentum));
        }
        columns.extend(self.model.links.iter().map(|batch| batch.memory()));
        columns.extend(self.model.solid.as_ref().map(|solid| solid.parted()));
        if let Some(loads) = &self.workspace.kept {
            columns
                .extend([&loads.force, &loads.torque].map(|column| bytemuck::cast_slice(column)));
        }
        columns
    }

    /// One substep, s.
    pub(crate) fn substep(&mut self, dt: f64) -> Result<(), Diverged> {
        let Self {
            model,
            state,
            workspace,
            ..
        } = self;
        let done = workspace.step(self.integrator, model, state, self.time, dt);
        done.map_err(|unsolved| Diverged::Unsolved {
            time_step: dt,
            residual: unsolved.residual,
        })?;
        if model.crowded.take().is_some() {
            return Err(Diverged::Crowded);
        }
        if let Some(particle) = workspace.next.first_not_finite() {
            return Err(Diverged::Particle {
                particle,
                time_step: dt,
                largest_stable_step: self.largest_stable_step(),
            });
        }
        std::mem::swap(state, &mut workspace.next);
        model.settle(state);
        self.time += dt;
        Ok(())
    }
}
