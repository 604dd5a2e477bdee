//! The way from one mapping to the next.

use nalgebra::Vector3;
use rayon::prelude::*;
use sinew_mapping::MappingError;

use crate::{digest::Digest, rest::Bound, scene::SceneError, wiring::Turn};

/// Vertices per task: enough work to pay for a task.
const TASK: usize = 8192;

/// A mapping that the mesh is leaving, and when.
#[derive(Debug)]
pub(crate) struct Blend {
    from: Bound,
    /// Simulated time at the change, s.
    start: f64,
    /// How long it takes, s, > 0.
    seconds: f64,
    /// This step's pose by `from`, m: kept between steps for its memory only.
    left: Vec<Vector3<f64>>,
}

impl Blend {
    pub(crate) fn new(from: Bound, start: f64, seconds: f64) -> Self {
        let left = vec![Vector3::zeros(); from.binding.dominant().len()];
        Self {
            from,
            start,
            seconds,
            left,
        }
    }

    /// Simulated time from which on the new mapping stands alone, s.
    pub(crate) fn end(&self) -> f64 {
        self.start + self.seconds
    }

    /// Blends the vertices as the new mapping poses them, m, with those of the mapping left. `[M12]`
    ///
    /// # Errors
    /// As [`sinew_mapping::Binding::pose`].
    pub(crate) fn mix(
        &mut self,
        points: &[Vector3<f64>],
        time: f64,
        vertices: &mut [Vector3<f64>],
    ) -> Result<(), MappingError> {
        self.from.binding.pose(points, &mut self.left)?;
        let s = smoothstep((time - self.start) / self.seconds);
        (vertices.par_iter_mut().zip(&self.left))
            .with_min_len(TASK)
            .for_each(|(new, left)| *new = (1.0 - s) * left + s * *new);
        Ok(())
    }

    /// As [`Bound::rebound`] and [`Bound::take`].
    ///
    /// # Errors
    /// As [`Rest::bind`]; nothing is changed then.
    pub(crate) fn follow(&mut self, turn: &Turn<'_>) -> Result<(), SceneError> {
        let rebound = self.from.rebound(turn)?;
        self.from.take(rebound, turn.rest.version);
        self.left.resize(turn.rest.vertices.len(), Vector3::zeros());
        Ok(())
    }

    pub(crate) fn digest(&self, digest: &mut Digest) {
        self.from.digest(digest);
        digest.words(&[self.start.to_bits(), self.seconds.to_bits()]);
    }
}

/// From 0 to 1 without a jump in velocity at either end. `[M12]`
fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
