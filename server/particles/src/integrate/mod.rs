//! One step of each integrator.

mod euler;
mod implicit;
mod runge_kutta;
mod verlet;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::{
    Integrator,
    model::Model,
    state::{Loads, State},
};

/// What a step under way has computed: kept between steps for its memory, and for Verlet's last loads.
#[derive(Clone, Debug)]
pub(crate) struct Workspace {
    /// Where the step leads.
    pub(crate) next: State,
    loads: Loads,
    /// Loads at the present state, where the integrator has computed them already.
    pub(crate) kept: Option<Loads>,
    stages: Vec<Stage>,
}

/// A stage of a Runge–Kutta method.
#[derive(Clone, Debug)]
struct Stage {
    state: State,
    loads: Loads,
    /// Derivative of the orientation, 1/s; empty without frames.
    turning: Vec<Quaternion<f64>>,
}

/// An implicit step whose equations were not solved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unsolved {
    /// What is left, as a fraction of the start.
    pub(crate) residual: f64,
}

impl Workspace {
    pub(crate) fn new(state: &State) -> Self {
        Self {
            next: state.clone(),
            loads: Loads::default(),
            kept: None,
            stages: Vec::new(),
        }
    }

    /// Computes the state after a step of `dt` from `time`, both s, into [`Workspace::next`].
    pub(crate) fn step(
        &mut self,
        integrator: Integrator,
        model: &mut Model,
        state: &State,
        time: f64,
        dt: f64,
    ) -> Result<(), Unsolved> {
        match integrator {
            Integrator::SemiImplicitEuler => self.semi_implicit_euler(model, state, time, dt),
            Integrator::VelocityVerlet => self.velocity_verlet(model, state, time, dt),
            Integrator::RungeKutta4 => self.runge_kutta_4(model, state, time, dt),
            Integrator::LinearlyImplicitEuler => {
                self.linearly_implicit_euler(model, state, time, dt);
            }
            Integrator::ImplicitMidpoint => {
                self.implicit_midpoint(model, state, time, dt)?;
            }
        }
        model.impose(&mut self.next, time + dt);
        Ok(())
    }
}

impl Integrator {
    /// The power of the step that the error at a fixed time falls with.
    pub(crate) fn order(self) -> i32 {
        match self {
            Self::SemiImplicitEuler | Self::LinearlyImplicitEuler => 1,
            Self::VelocityVerlet | Self::ImplicitMidpoint => 2,
            Self::RungeKutta4 => 4,
        }
    }
}

/// An orientation turned by a rotation vector of the world frame; of length 1 to rounding for ever. `[P12]`
fn turned(orientation: &UnitQuaternion<f64>, by: Vector3<f64>) -> UnitQuaternion<f64> {
    let turn = UnitQuaternion::from_scaled_axis(by);
    UnitQuaternion::new_normalize(turn.into_inner() * orientation.quaternion())
}
