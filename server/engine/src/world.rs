//! A scene come alive.

use std::sync::Arc;

use nalgebra::Vector3;
use sinew_capture::Tracker;
use sinew_particles::{Diverged, System};

use crate::{
    blend::Blend,
    digest::Digest,
    frame::{Doubt, Frame, Layout},
    modules,
    rest::{Bound, Rest},
    rules::{Rules, Step},
    scene::MotionSample,
    topology::Topology,
};

/// Why a step could not be taken. The world is spent.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepError {
    /// A particle left the finite numbers.
    #[error(transparent)]
    Diverged(#[from] Diverged),
    /// A position left the finite numbers, or the range in which it can travel as binary32.
    #[error("{what} {index} is at {position:?}, beyond what positions may be")]
    OutOfRange {
        /// `point` or `vertex`.
        what: &'static str,
        /// Its index.
        index: usize,
        /// Where it is, m.
        position: [f64; 3],
    },
    /// The mapping could not be evaluated.
    #[error("the mapping failed: {0}")]
    Mapping(#[from] sinew_mapping::MappingError),
}

/// Why the mapping is not changed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RemapError {
    /// A time that no blend can take.
    #[error("is {seconds}; give seconds from 0, which is at once, to {LONGEST_BLEND}")]
    BlendSeconds {
        /// The time given, s.
        seconds: f64,
    },
    /// A blend is under way.
    #[error(
        "the mesh blends to its new mapping until {until} s of simulated time; wait for that, or change at once by 0 blend_seconds"
    )]
    Blending {
        /// Simulated time of its end, s.
        until: f64,
    },
    /// A rule tears between points, and the mapping would not show it.
    #[error(
        "weighs points by straight distances, which lead through a tear, and a rule of the scene separates points; keep a flood"
    )]
    Straight,
    /// The topology of the mesh changed since the mapping was bound.
    #[error("the mesh changed meanwhile; bind the mapping to its rest pose as it is now")]
    Outdated,
}

/// A day, s.
const LONGEST_BLEND: f64 = 86_400.0;

/// What moves the points.
#[derive(Debug)]
pub(crate) enum Source {
    /// Whoever calls [`World::step`].
    External(Box<Tracker>),
    Particles(Box<System>),
}

/// Takes hold of a point of particles, or lets it go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// The point's index.
    pub point: u32,
    /// Where the next step leads it, m; `None`: nowhere, it is let go.
    pub target: Option<Vector3<f64>>,
}

/// Points, mesh and mapping, and the step that binds them.
#[derive(Debug)]
pub struct World {
    pub(crate) source: Source,
    /// What is read at every step.
    pub(crate) probes: Vec<modules::Found>,
    pub(crate) rest: Arc<Rest>,
    pub(crate) bound: Bound,
    /// Where the mesh comes from, while it moves over to `bound`.
    pub(crate) blend: Option<Blend>,
    /// `None` where the scene has none.
    pub(crate) rules: Option<Box<Rules>>,
    /// `None` where nothing asked for a change yet, nor may a rule.
    pub(crate) topology: Option<Box<Topology>>,
    /// Steps taken when the mapping changed last.
    pub(crate) changed_at_step: u64,
    /// What the next frame belongs to.
    pub(crate) layout: Arc<Layout>,
    pub(crate) time_step: f64,
    pub(crate) warnings: Vec<String>,
    /// The state after the last step.
    pub(crate) frame: Arc<Frame>,
    /// Frames given out before; their memory is used again when nobody reads them any more.
    pub(crate) retired: Vec<Arc<Frame>>,
}

/// Frames kept for their memory: as many as readers may hold at once in the ordinary case.
const RETIRED: usize = 12;

impl World {
    /// One step: motion, then geometry. External points move to `sample`; those not seen are carried on. `[S4]`
    ///
    /// # Errors
    /// [`StepError`]; the world is then spent.
    ///
    /// # Panics
    /// If the sample has another number of points than the world: [`MotionSample`]s are checked
    /// against [`World::point_count`] before.
    pub fn step(&mut self, sample: Option<&MotionSample>) -> Result<Arc<Frame>, StepError> {
        let mut next = self.blank();
        next.step = self.frame.step + 1;
        #[expect(clippy::cast_precision_loss, reason = "exact for 2^53 steps")]
        let time = next.step as f64 * self.time_step;
        next.time_seconds = time;
        match &mut self.source {
            Source::External(tracker) => follow(tracker, sample, &mut next),
            Source::Particles(system) => {
                system.step(self.time_step)?;
                next.points.copy_from_slice(system.positions());
                next.orientations
                    .copy_from_slice(system.orientations().unwrap_or_default());
            }
        }
        modules::read_all(&self.probes, &self.source, &mut next.readings);
        self.blend = self.blend.take().filter(|blend| time < blend.end());
        self.pose(&mut next)?;
        self.act(&mut next)?;
        Ok(self.publish(next))
    }

    /// Takes hold of a particle, or lets it go; external points are held by their source alone.
    ///
    /// # Panics
    /// If there is no such point.
    pub fn drag(&mut self, Drag { point, target }: Drag) {
        match &mut self.source {
            Source::Particles(system) => system.drag(point, target),
            Source::External(_) => {}
        }
    }

    /// Poses the vertices on the points.
    pub(crate) fn pose(&mut self, next: &mut Frame) -> Result<(), StepError> {
        self.bound.binding.pose(&next.points, &mut next.vertices)?;
        if let Some(blend) = &mut self.blend {
            blend.mix(&next.points, next.time_seconds, &mut next.vertices)?;
        }
        self.bound.is_posed = true;
        check_range("point", &next.points)?;
        check_range("vertex", &next.vertices)
    }

    /// Poses these vertices, where all others are posed on the same points.
    pub(crate) fn pose_alone(&self, next: &mut Frame, vertices: &[u32]) -> Result<(), StepError> {
        (self.bound.binding).pose_alone(vertices, &mut next.vertices);
        let place = |&vertex: &u32| next.vertices[vertex as usize];
        let places: Vec<_> = vertices.iter().map(place).collect();
        match first_out_of_range(&places) {
            None => Ok(()),
            Some(at) => Err(StepError::OutOfRange {
                what: "vertex",
                index: vertices[at] as usize,
                position: places[at].into(),
            }),
        }
    }

    /// Measures, and does what the rules ask for.
    fn act(&mut self, next: &mut Frame) -> Result<(), StepError> {
        let Some(rules) = &mut self.rules else {
            return Ok(());
        };
        let step = Step {
            time: next.time_seconds,
            states: &next.point_states,
            doubts: &next.doubts,
            points: &next.points,
            vertices: &next.vertices,
            posed_alone: self.blend.is_none(),
        };
        let scale = self.bound.scale(&self.layout.cells, &self.rest);
        let body = self.topology.as_ref().map(|topology| &topology.body);
        let (events, asks) = rules.measure(&step, scale, body, &mut next.measures);
        self.change(next, events, &asks)?;
        Ok(())
    }

    /// Makes `next` the state.
    pub(crate) fn publish(&mut self, next: Frame) -> Arc<Frame> {
        let next = Frame {
            sequence: self.frame.sequence + 1,
            ..next
        };
        let done = std::mem::replace(&mut self.frame, Arc::new(next));
        if self.retired.len() < RETIRED {
            self.retired.push(done);
        }
        self.frame()
    }

    /// Changes the mapping from the next step on: at once, or over `blend_seconds` of simulated time, during which both
    /// mappings are posed. `[M12]` Shape matching starts from no rotation, as in a new world.
    ///
    /// # Errors
    /// As [`World::may_remap`], where `bound` is bound to another rest pose than [`World::rest`], and where a rule separates
    /// points and `bound` knows no paths; nothing is changed then.
    pub fn remap(&mut self, bound: Bound, blend_seconds: f64) -> Result<(), RemapError> {
        self.may_remap(blend_seconds)?;
        if bound.version != self.rest.version {
            return Err(RemapError::Outdated);
        }
        let metric = &bound.mapping.recipe.weighting.metric;
        if self
            .rules
            .as_ref()
            .is_some_and(|rules| rules.cannot_show(metric))
        {
            return Err(RemapError::Straight);
        }
        let dominant = bound.binding.dominant().to_vec();
        let Layout {
            epoch,
            topology_version,
            hash,
            ref cells,
            dominant: _,
        } = *self.layout;
        self.layout = Arc::new(Layout {
            epoch,
            topology_version,
            hash,
            cells: Arc::clone(cells),
            dominant,
        });
        let left = std::mem::replace(&mut self.bound, bound);
        self.blend =
            (blend_seconds > 0.0).then(|| Blend::new(left, self.frame.time_seconds, blend_seconds));
        if let Some(rules) = &mut self.rules {
            rules.rebind(&self.bound.scale(&self.layout.cells, &self.rest));
        }
        self.changed_at_step = self.frame.step;
        Ok(())
    }

    /// Whether the mapping may be changed now: a change at once always may, and ends a blend under way.
    ///
    /// # Errors
    /// [`RemapError`] where the time is negative, not finite or above a day, or where a blend is under way already.
    pub fn may_remap(&self, blend_seconds: f64) -> Result<(), RemapError> {
        if !(0.0..=LONGEST_BLEND).contains(&blend_seconds) {
            return Err(RemapError::BlendSeconds {
                seconds: blend_seconds,
            });
        }
        let until = self.blend.as_ref().map_or(f64::NEG_INFINITY, Blend::end);
        if blend_seconds > 0.0 && self.frame.time_seconds < until {
            return Err(RemapError::Blending { until });
        }
        Ok(())
    }

    /// The pose that mappings are bound to.
    pub fn rest(&self) -> Arc<Rest> {
        Arc::clone(&self.rest)
    }

    /// A frame to be filled: a copy of the last one's small parts, with memory for the large ones.
    fn blank(&mut self) -> Frame {
        let free = self
            .retired
            .iter_mut()
            .position(|frame| Arc::get_mut(frame).is_some());
        let reused = free.and_then(|i| Arc::try_unwrap(self.retired.swap_remove(i)).ok());
        let last = &self.frame;
        match reused {
            Some(mut frame) => {
                frame.layout = Arc::clone(&self.layout);
                frame.vertices.resize(last.vertices.len(), Vector3::zeros());
                frame.measures.clear();
                frame.change = None;
                frame.capture_time_seconds = last.capture_time_seconds;
                frame.motion_sequence = last.motion_sequence;
                frame
            }
            None => Frame {
                layout: Arc::clone(&self.layout),
                measures: Vec::new(),
                change: None,
                ..Frame::clone(last)
            },
        }
    }

    /// The state after the last step.
    pub fn frame(&self) -> Arc<Frame> {
        Arc::clone(&self.frame)
    }

    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.frame.points.len()
    }

    /// The greatest change of speed from one step to the next that is believed of a point that others move, m/s.
    pub fn max_speed_change(&self) -> f64 {
        match &self.source {
            Source::External(tracker) => tracker.settings().max_speed_change,
            Source::Particles(_) => f64::INFINITY,
        }
    }

    /// Simulated time of one step, s.
    pub fn time_step(&self) -> f64 {
        self.time_step
    }

    /// What the scene's author should know.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Bytes of the mesh's combinatorial map. 0 where there is none: where no rule may change the mesh, and nobody did.
    pub fn map_bytes(&self) -> usize {
        let topology = self.topology.as_ref();
        topology.map_or(0, |topology| topology.body.map().bytes())
    }

    /// Hash of the whole state: equal for the same scene and inputs on any number of threads.
    pub fn digest(&self) -> u128 {
        let Frame {
            layout,
            sequence: _,
            step,
            time_seconds,
            capture_time_seconds,
            motion_sequence,
            points,
            orientations: _,
            point_states,
            doubts: _,
            vertices,
            measures: _,
            readings: _,
            change: _,
        } = &*self.frame;
        let Layout {
            epoch,
            topology_version,
            hash,
            cells: _,
            dominant: _,
        } = &**layout;
        let mut digest = Digest::default();
        digest.words(&[*epoch, *topology_version, *hash, *step]);
        digest.words(&[
            time_seconds.to_bits(),
            capture_time_seconds.map_or(u64::MAX, f64::to_bits),
        ]);
        digest.words(&[motion_sequence.unwrap_or(u64::MAX)]);
        digest.vectors(points);
        digest.bytes(
            &point_states
                .iter()
                .map(|state| *state as u8)
                .collect::<Vec<_>>(),
        );
        digest.vectors(vertices);
        self.bound.digest(&mut digest);
        if let Some(blend) = &self.blend {
            blend.digest(&mut digest);
        }
        if let Some(rules) = &self.rules {
            rules.digest(&mut digest);
        }
        if let Some(topology) = &self.topology {
            topology.digest(&mut digest);
        }
        match &self.source {
            Source::Particles(system) => {
                for column in system.hidden_state() {
                    digest.bytes(bytemuck::cast_slice(column));
                }
            }
            Source::External(tracker) => digest.words(&tracker.state().collect::<Vec<_>>()),
        }
        digest.finish()
    }
}

/// Moves external points to where they are seen, or else carried.
fn follow(tracker: &mut Tracker, sample: Option<&MotionSample>, next: &mut Frame) {
    tracker.step(sample);
    if let Some(sample) = sample {
        next.capture_time_seconds = Some(sample.time);
        next.motion_sequence = Some(sample.sequence);
    }
    next.points.copy_from_slice(tracker.positions());
    next.point_states.clear();
    next.point_states.extend(tracker.states());
    let doubts = (0..).zip(tracker.doubts());
    next.doubts.clear();
    (next.doubts).extend(doubts.filter(|(_, doubt)| *doubt != Doubt::None));
}

/// Positions must survive the way to binary32.
fn check_range(what: &'static str, positions: &[Vector3<f64>]) -> Result<(), StepError> {
    match first_out_of_range(positions) {
        None => Ok(()),
        Some(index) => Err(StepError::OutOfRange {
            what,
            index,
            position: positions[index].into(),
        }),
    }
}

/// Coordinates stay below this, m.
pub(crate) const LIMIT: f64 = 1e30;

/// The first position that is not finite or has a coordinate of [`LIMIT`] or more.
pub(crate) fn first_out_of_range(positions: &[Vector3<f64>]) -> Option<usize> {
    // Without a branch per coordinate, so that blocks of them are compared at once; a NaN is not below.
    let inside = |vs: &[Vector3<f64>]| {
        let coordinates: &[f64] = bytemuck::cast_slice(vs);
        coordinates
            .iter()
            .fold(true, |inside, c| inside & (c.abs() < LIMIT))
    };
    let mut blocks = positions.chunks(256).enumerate();
    let (block, outside) = blocks.find(|(_, block)| !inside(block))?;
    let within = outside
        .iter()
        .position(|v| !inside(std::slice::from_ref(v)))?;
    Some(256 * block + within)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_position_out_of_range_is_found_wherever_it_is() {
        for wrong in [LIMIT, -LIMIT, f64::NAN, f64::NEG_INFINITY] {
            for at in [0, 1, 255, 256, 999] {
                let mut positions = vec![Vector3::repeat(-0.9 * LIMIT); 1000];
                assert_eq!(first_out_of_range(&positions), None);
                positions[at].y = wrong;
                positions[999].x = wrong;
                assert_eq!(first_out_of_range(&positions), Some(at));
            }
        }
    }
}
