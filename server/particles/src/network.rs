use nalgebra::Vector3;
use rayon::prelude::*;

use crate::{Diverged, NetworkError, NetworkSpec};

/// Particles per task: enough work to pay for a task, few enough for every thread to get some.
const BLOCK: usize = 1024;

/// Below this many particles plus spring ends a step takes less time than waking the other threads.
const PARALLEL_FROM: usize = 16 * BLOCK;

/// A mass-spring network: damped springs along their axes, gravity, fixed particles.
///
/// Columns have one entry per particle.
#[derive(Clone, Debug)]
pub struct Network {
    position: Vec<Vector3<f64>>, // m
    velocity: Vec<Vector3<f64>>, // m/s
    inverse_mass: Vec<f64>,      // 1/kg; 0 = fixed
    gravity: Vector3<f64>,       // m/s²
    /// The links of particle i are `links[first_link[i]..first_link[i + 1]]`, in the order of the springs.
    first_link: Vec<usize>,
    links: Vec<Link>,
    largest_stable_step: f64, // s
    /// What the step under way has computed: kept between steps for its memory only.
    next: Next,
}

/// A spring as one of its ends sees it.
#[derive(Clone, Copy, Debug)]
struct Link {
    other: u32,
    stiffness: f64,   // N/m
    damping: f64,     // N s/m
    rest_length: f64, // m
}

#[derive(Clone, Debug, Default)]
struct Next {
    position: Vec<Vector3<f64>>,
    velocity: Vec<Vector3<f64>>,
}

impl Network {
    /// Checks every value of `spec` and builds the network. Linear in particles and springs.
    ///
    /// # Errors
    /// The first value at fault, with its column, entry and what it should be.
    pub fn new(spec: NetworkSpec) -> Result<Self, NetworkError> {
        spec.check()?;
        let (first_link, links) = links(&spec);
        let NetworkSpec {
            positions: position,
            velocities: mut velocity,
            masses,
            fixed,
            gravity,
            ..
        } = spec;
        let mut inverse_mass: Vec<f64> = masses.iter().map(|mass| mass.recip()).collect();
        for particle in fixed {
            inverse_mass[particle as usize] = 0.0;
            velocity[particle as usize] = Vector3::zeros();
        }
        let next = Next {
            position: position.clone(),
            velocity: velocity.clone(),
        };
        let mut network = Self {
            position,
            velocity,
            inverse_mass,
            gravity,
            first_link,
            links,
            largest_stable_step: f64::INFINITY,
            next,
        };
        network.largest_stable_step = network.bound_step();
        Ok(network)
    }

    /// One step of semi-implicit Euler, `dt` > 0 in seconds: all velocities `[P2]`, then all positions `[P3]`.
    ///
    /// # Errors
    /// [`Diverged`] if a position or velocity would not be finite; the network then stays as it was.
    pub fn step(&mut self, dt: f64) -> Result<(), Diverged> {
        let mut next = std::mem::take(&mut self.next);
        let diverged = if rayon::current_num_threads() > 1
            && self.position.len() + self.links.len() >= PARALLEL_FROM
        {
            next.position
                .par_chunks_mut(BLOCK)
                .zip(next.velocity.par_chunks_mut(BLOCK))
                .enumerate()
                .filter_map(|(block, (position, velocity))| {
                    self.advance(block * BLOCK, position, velocity, dt)
                })
                .min()
        } else {
            self.advance(0, &mut next.position, &mut next.velocity, dt)
        };
        self.next = next;
        if let Some(particle) = diverged {
            return Err(Diverged {
                particle,
                time_step: dt,
                largest_stable_step: self.largest_stable_step,
            });
        }
        std::mem::swap(&mut self.position, &mut self.next.position);
        std::mem::swap(&mut self.velocity, &mut self.next.velocity);
        Ok(())
    }

    /// Positions, m, one per particle.
    #[must_use]
    pub fn positions(&self) -> &[Vector3<f64>] {
        &self.position
    }

    /// Velocities, m/s, one per particle; those of fixed particles are zero.
    #[must_use]
    pub fn velocities(&self) -> &[Vector3<f64>] {
        &self.velocity
    }

    /// A step, s, below which small motions about rest are stable: conservative, infinite without springs. `[P4]`
    ///
    /// The smallest positive root over the free particles i of `K_i dt² + 2 Z_i dt = 4`, where `K_i` sums over the
    /// springs of i their stiffness divided by the mass of i, twice where the other end is free, and `Z_i` their
    /// damping alike. `K_i dt² + 2 Z_i dt` bounds by Gershgorin's theorem the eigenvalues that the scheme needs below 4.
    /// Far from rest a network may need less.
    #[must_use]
    pub fn largest_stable_step(&self) -> f64 {
        self.largest_stable_step
    }

    /// Mechanical energy of the free particles and the springs, J: kinetic, elastic and in gravity (zero at the origin).
    /// `[P5]`
    #[must_use]
    pub fn energy(&self) -> f64 {
        let mut energy = 0.0;
        for (i, &inverse_mass) in self.inverse_mass.iter().enumerate() {
            if inverse_mass > 0.0 {
                let kinetic = 0.5 * self.velocity[i].norm_squared();
                energy += (kinetic - self.gravity.dot(&self.position[i])) / inverse_mass;
            }
            for link in self.links_of(i) {
                let length = (self.position[link.other as usize] - self.position[i]).norm();
                // A quarter, because each of the two ends counts the spring.
                energy += 0.25 * link.stiffness * (length - link.rest_length).powi(2);
            }
        }
        energy
    }

    fn links_of(&self, particle: usize) -> &[Link] {
        &self.links[self.first_link[particle]..self.first_link[particle + 1]]
    }

    /// Writes the next position and velocity of the particles from `first` on; returns the first that diverges.
    fn advance(
        &self,
        first: usize,
        position: &mut [Vector3<f64>],
        velocity: &mut [Vector3<f64>],
        dt: f64,
    ) -> Option<usize> {
        let mut diverged = None;
        for (i, (x, v)) in (first..).zip(position.iter_mut().zip(velocity)) {
            if self.inverse_mass[i] == 0.0 {
                continue; // both buffers hold its position and zero velocity from the start
            }
            let acceleration = self.force(i) * self.inverse_mass[i] + self.gravity;
            *v = self.velocity[i] + acceleration * dt; // [P2]
            *x = self.position[i] + *v * dt; // [P3]
            // A sum is finite only if its terms are, unless two infinities cancel: then it is not a number.
            if diverged.is_none() && !(x.sum() + v.sum()).is_finite() {
                diverged = Some(i);
            }
        }
        diverged
    }

    /// The sum of the spring forces on a particle, N, in the order of the springs. `[P1]`
    ///
    /// Each spring is evaluated at both of its ends: twice the arithmetic, but no two threads ever add to one particle,
    /// and the two forces are exactly opposite because every difference only changes its sign.
    fn force(&self, particle: usize) -> Vector3<f64> {
        let (x, v) = (self.position[particle], self.velocity[particle]);
        let mut force = Vector3::zeros();
        for link in self.links_of(particle) {
            let other = link.other as usize;
            let r = self.position[other] - x;
            let length = r.norm();
            if length == 0.0 {
                continue; // no axis to act along
            }
            let axis = r / length;
            let rate = (self.velocity[other] - v).dot(&axis);
            let tension = link.stiffness * (length - link.rest_length) + link.damping * rate;
            force += axis * tension;
        }
        force
    }

    fn bound_step(&self) -> f64 {
        let mut step = f64::INFINITY;
        for (i, &inverse_mass) in self.inverse_mass.iter().enumerate() {
            let (mut k, mut z) = (0.0, 0.0);
            for link in self.links_of(i) {
                let other_is_free = self.inverse_mass[link.other as usize] > 0.0;
                let scale = inverse_mass * if other_is_free { 2.0 } else { 1.0 };
                k += link.stiffness * scale;
                z += link.damping * scale;
            }
            // The root in the form that neither cancels nor divides by k = 0.
            step = step.min(4.0 / (z + (z * z + 4.0 * k).sqrt()));
        }
        step
    }
}

/// The springs of each particle, in the order of the springs: where each particle's begin, and all of them.
fn links(spec: &NetworkSpec) -> (Vec<usize>, Vec<Link>) {
    let mut first = vec![0; spec.positions.len() + 1];
    for &end in spec.springs.iter().flatten() {
        first[end as usize + 1] += 1;
    }
    for i in 1..first.len() {
        first[i] += first[i - 1];
    }
    let nowhere = Link {
        other: 0,
        stiffness: 0.0,
        damping: 0.0,
        rest_length: 0.0,
    };
    let mut links = vec![nowhere; 2 * spec.springs.len()];
    let mut free = first.clone();
    for (spring, &[left, right]) in spec.springs.iter().enumerate() {
        let rest_length = match &spec.rest_lengths {
            Some(lengths) => lengths[spring],
            None => (spec.positions[right as usize] - spec.positions[left as usize]).norm(),
        };
        for (end, other) in [(left, right), (right, left)] {
            links[free[end as usize]] = Link {
                other,
                stiffness: spec.stiffness[spring],
                damping: spec.damping[spring],
                rest_length,
            };
            free[end as usize] += 1;
        }
    }
    (first, links)
}
