//! One session: an actor task that owns the world until the session ends, and the handle by which
//! everyone else speaks to it.

mod looks;

use std::sync::Arc;

use sinew_engine::{
    Drag, EditError, Edited, Explanation, Frame, Modules, Rest, Selection, StepError, World,
};
use sinew_proto::v1;
use sinew_viewer::{Publisher, Shown};
use tokio::{
    sync::{mpsc, oneshot, watch},
    time::{Instant, Interval, MissedTickBehavior, interval},
};
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use crate::{
    change::{Edit, Effect, Remap},
    end::{End, Fault},
    error::ServiceError,
    given,
    inbox::{Arrival, Due, Inbox, Input, Progress},
    kernels::Kernels,
    metrics::Metrics,
    outlets::Outlets,
    timing::{StepTiming, now_nanos},
};

/// Commands that may wait for a session; more are held back at their RPCs.
const COMMANDS: usize = 64;

/// What a session does now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Activity {
    Paused,
    Running,
    Faulted(Fault),
}

/// What a session can tell of itself.
#[derive(Clone, Debug)]
pub(crate) struct Report {
    pub(crate) activity: Activity,
    pub(crate) frame: Arc<Frame>,
    pub(crate) digest: u128,
    pub(crate) mapping: Arc<v1::Mapping>,
    pub(crate) rest: Arc<Rest>,
    /// Inputs that led here.
    pub(crate) inputs: u64,
}

/// What is asked of a session, and where the answer goes.
enum Command {
    Fulfil {
        wish: Wish,
        reply: Reply<Report>,
    },
    Explain {
        vertex: u32,
        reply: Reply<Explanation>,
    },
    Read {
        selection: Selection,
        reply: Reply<Modules>,
    },
    Edit {
        edit: Edit,
        reply: Reply<Edited>,
    },
}

type Reply<T> = oneshot::Sender<Result<T, ServiceError>>;

#[derive(Debug)]
pub(crate) enum Wish {
    Describe,
    Run,
    Pause,
    Step { steps: u32, expected: Option<u64> },
    Remap(Box<Remap>),
}

/// How a session reaches its steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Drive {
    /// As motion is streamed in.
    External,
    /// One step for each time step of real time.
    RealTime,
    /// One step after the other.
    Unpaced,
}

/// The way to speak to a session.
#[derive(Clone)]
pub(crate) struct Handle {
    inbox: mpsc::Sender<Command>,
    pub(crate) motion: mpsc::Sender<Input>,
    /// What became of the motion.
    pub(crate) progress: watch::Receiver<Progress>,
    begun: Instant,
    pub(crate) outlets: Arc<Outlets>,
    pub(crate) cancel: CancellationToken,
}

impl Handle {
    /// Starts the session's task.
    pub(crate) fn spawn(
        world: World,
        mapping: v1::Mapping,
        drive: Drive,
        kernels: Kernels,
        viewer: Publisher,
        metrics: Arc<Metrics>,
        tasks: &TaskTracker,
    ) -> Self {
        let outlets = Arc::new(Outlets::new(world.frame()));
        let (inbox, commands) = mpsc::channel(COMMANDS);
        let begun = Instant::now();
        let (motion_inbox, motion, progress) = Inbox::new(
            begun,
            world.point_count(),
            world.time_step(),
            world.max_speed_change(),
        );
        let handle = Self {
            inbox,
            motion,
            progress,
            begun,
            outlets: Arc::clone(&outlets),
            cancel: CancellationToken::new(),
        };
        let actor = Actor {
            last: world.frame(),
            last_digest: world.digest(),
            rest: world.rest(),
            clock: clock(world.time_step()),
            world: Some(world),
            mapping: Arc::new(mapping),
            activity: Activity::Paused,
            drive,
            motion: motion_inbox,
            outlets,
            viewer: Some(viewer),
            kernels,
            metrics,
        };
        tasks.spawn(actor.run(commands, handle.cancel.clone()));
        handle
    }

    /// Asks for something and waits for the answer.
    pub(crate) async fn ask(&self, wish: Wish) -> Result<Report, ServiceError> {
        self.send(|reply| Command::Fulfil { wish, reply }).await
    }

    /// Asks why a vertex is where it is.
    pub(crate) async fn explain(&self, vertex: u32) -> Result<Explanation, ServiceError> {
        self.send(|reply| Command::Explain { vertex, reply }).await
    }

    /// Asks for places and forces of modules.
    pub(crate) async fn read_modules(&self, selection: Selection) -> Result<Modules, ServiceError> {
        self.send(|reply| Command::Read { selection, reply }).await
    }

    /// Asks for a change of the mesh.
    pub(crate) async fn edit(&self, edit: Edit) -> Result<Edited, ServiceError> {
        self.send(|reply| Command::Edit { edit, reply }).await
    }

    /// What the session's clock shows, s.
    pub(crate) fn clock_seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    async fn send<T>(&self, command: impl FnOnce(Reply<T>) -> Command) -> Result<T, ServiceError> {
        let (reply, answer) = oneshot::channel();
        let ended = || ServiceError::Ended(self.outlets.end());
        self.inbox.send(command(reply)).await.map_err(|_| ended())?;
        answer.await.map_err(|_| ended())?
    }
}

struct Actor {
    /// Away during a step; gone after a fault.
    world: Option<World>,
    /// As it stands.
    mapping: Arc<v1::Mapping>,
    last: Arc<Frame>,
    last_digest: u128,
    rest: Arc<Rest>,
    activity: Activity,
    drive: Drive,
    clock: Interval,
    motion: Inbox,
    outlets: Arc<Outlets>,
    viewer: Option<Publisher>,
    kernels: Kernels,
    metrics: Arc<Metrics>,
}

impl Actor {
    async fn run(mut self, mut commands: mpsc::Receiver<Command>, cancel: CancellationToken) {
        loop {
            let running = self.activity == Activity::Running;
            let due = self.motion.due().filter(|_| running);
            // Fair: a slow step cannot starve "pause", nor the reverse.
            tokio::select! {
                () = cancel.cancelled() => return self.outlets.finish(self.outlets.end()),
                command = commands.recv() => {
                    // Askers may have left before their answers.
                    match command {
                        None => return,
                        Some(Command::Fulfil { wish, reply }) => {
                            reply.send(self.fulfil(wish, &cancel).await).ok();
                        }
                        Some(Command::Explain { vertex, reply }) => {
                            reply.send(self.explain(vertex).await).ok();
                        }
                        Some(Command::Read { selection, reply }) => {
                            reply.send(self.read_modules(selection).await).ok();
                        }
                        Some(Command::Edit { edit, reply }) => {
                            reply.send(self.edit(edit).await).ok();
                        }
                    }
                }
                input = self.motion.recv(), if self.motion.has_room() => {
                    let Some(input) = input else { return };
                    self.motion.accept(input);
                }
                () = Due::reached(due) => {
                    let arrival = self.motion.take_due();
                    self.step(arrival).await;
                }
                _ = self.clock.tick(), if running && self.drive == Drive::RealTime => {
                    self.step(None).await;
                }
                () = std::future::ready(()), if running && self.drive == Drive::Unpaced => {
                    self.step(None).await;
                }
            }
        }
    }

    async fn fulfil(
        &mut self,
        wish: Wish,
        cancel: &CancellationToken,
    ) -> Result<Report, ServiceError> {
        match (wish, &self.activity) {
            (Wish::Describe, _) => {}
            (
                Wish::Run | Wish::Pause | Wish::Step { .. } | Wish::Remap(_),
                Activity::Faulted(fault),
            ) => {
                return Err(ServiceError::Faulted(fault.clone()));
            }
            (Wish::Run, _) => {
                self.activity = Activity::Running;
                self.clock.reset();
            }
            (Wish::Pause, _) => self.activity = Activity::Paused,
            (Wish::Step { .. }, Activity::Running) => return Err(ServiceError::Running),
            (Wish::Step { steps, expected }, Activity::Paused) => {
                self.step_many(steps, expected, cancel).await?;
            }
            (Wish::Remap(remap), Activity::Paused | Activity::Running) => {
                self.remap(*remap).await?;
            }
        }
        Ok(self.report())
    }

    async fn step_many(
        &mut self,
        steps: u32,
        expected: Option<u64>,
        cancel: &CancellationToken,
    ) -> Result<(), ServiceError> {
        let actual = self.last.step;
        if let Some(expected) = expected.filter(|expected| *expected != actual) {
            return Err(ServiceError::StepMismatch { expected, actual });
        }
        let external = self.drive == Drive::External;
        self.motion.pull();
        let (wanted, waiting) = (steps as usize, self.motion.waiting());
        if external && waiting < wanted {
            return Err(ServiceError::MotionStarved { wanted, waiting });
        }
        for _ in 0..steps {
            let arrival = self.motion.take_next();
            self.step(arrival).await;
            if let Activity::Faulted(fault) = &self.activity {
                return Err(ServiceError::Faulted(fault.clone()));
            }
            if cancel.is_cancelled() {
                break;
            }
        }
        Ok(())
    }

    async fn remap(&mut self, remap: Remap) -> Result<(), ServiceError> {
        let Remap {
            base,
            mapping,
            bound,
            blend_seconds,
            effect,
        } = remap;
        if !Arc::ptr_eq(&base, &self.mapping) {
            return Err(ServiceError::EtagMismatch);
        }
        let admitted = self.lend(move |world| match effect {
            Effect::Made => world.remap(bound, blend_seconds),
            Effect::Checked => world.may_remap(blend_seconds),
        });
        admitted.await.ok_or_else(|| self.lost())??;
        if effect == Effect::Made {
            self.mapping = Arc::clone(&mapping);
            self.outlets.inputs.record(given::Input::Mapping {
                mapping,
                blend_seconds,
            });
        }
        Ok(())
    }

    async fn edit(&mut self, edit: Edit) -> Result<Edited, ServiceError> {
        let Edit {
            requests,
            sent,
            expected,
        } = edit;
        let actual = self.last.layout.topology_version;
        if let Some(expected) = expected.filter(|expected| *expected != actual) {
            return Err(ServiceError::TopologyMismatch { expected, actual });
        }
        let started = now_nanos();
        let edited = self.lend(move |world| world.edit(requests)).await;
        match edited.ok_or_else(|| self.lost())? {
            Ok(edited) => {
                self.outlets.inputs.record(given::Input::Edits(sent));
                if let Some(frame) = &edited.frame {
                    self.give_out(Arc::clone(frame), 0, started);
                }
                Ok(edited)
            }
            Err(EditError::Step(error)) => {
                self.diverged(&error);
                Err(self.lost())
            }
            Err(error) => Err(ServiceError::Uneditable(error.to_string())),
        }
    }

    /// Lends the world to a kernel thread. Nothing comes of it where the world is gone, or where a panic there ends the
    /// session.
    async fn lend<T: Send + 'static>(
        &mut self,
        work: impl FnOnce(&mut World) -> T + Send + 'static,
    ) -> Option<T> {
        let mut world = self.world.take()?;
        let lent = self.kernels.run(move || {
            let outcome = work(&mut world);
            (world, outcome)
        });
        match lent.await {
            Ok((world, outcome)) => {
                self.world = Some(world);
                Some(outcome)
            }
            Err(panic) => {
                self.panicked(&panic);
                None
            }
        }
    }

    /// Why there is no world any more.
    fn lost(&self) -> ServiceError {
        match &self.activity {
            Activity::Faulted(fault) => ServiceError::Faulted(fault.clone()),
            Activity::Paused | Activity::Running => ServiceError::Ended(self.outlets.end()),
        }
    }

    /// One step; afterwards its frame is published, or the fault is known.
    async fn step(&mut self, arrival: Option<Arrival>) {
        let received = arrival.as_ref().map_or(0, |arrival| arrival.received_nanos);
        let started = now_nanos();
        let given = arrival.map(|arrival| Arc::new(arrival.sample));
        let drags: Arc<[Drag]> = self.motion.take_drags(self.last.step + 1).into();
        let (sample, dragged) = (given.clone(), Arc::clone(&drags));
        let stepped = self.lend(move |world| {
            dragged.iter().for_each(|drag| world.drag(*drag));
            world.step(sample.as_deref())
        });
        let frame = match stepped.await {
            Some(Ok(frame)) => frame,
            Some(Err(error)) => return self.diverged(&error),
            None => return,
        };
        let step = frame.step;
        match given {
            Some(sample) => (self.outlets.inputs).record(given::Input::Motion { step, sample }),
            // Each step is told, so that a replay knows how many there were.
            None if self.drive != Drive::External => {
                (self.outlets.inputs).record(given::Input::Drags { step, drags });
            }
            None => {}
        }
        let timing = self.give_out(Arc::clone(&frame), received, started);
        self.metrics.stepped(timing, &frame);
        self.motion.report();
    }

    /// Makes a frame the session's newest, for everyone who watches.
    fn give_out(&mut self, frame: Arc<Frame>, received: u64, started: u64) -> StepTiming {
        self.last = Arc::clone(&frame);
        let timing = StepTiming {
            received,
            started,
            published: now_nanos(),
        };
        if let Some(viewer) = &self.viewer {
            viewer.publish(Shown {
                frame: Arc::clone(&frame),
                step_seconds: timing.step_seconds(),
                latency_seconds: timing.latency_seconds(),
            });
        }
        self.outlets.publish(frame, timing);
        timing
    }

    fn diverged(&mut self, error: &StepError) {
        // The world is spent.
        if let Some(world) = self.world.take() {
            self.last_digest = world.digest();
        }
        self.end(Fault {
            reason: "SIM_DIVERGED",
            message: format!("step {}: {error}", self.last.step + 1),
        });
    }

    fn panicked(&mut self, panic: &str) {
        self.end(Fault {
            reason: "SESSION_PANICKED",
            message: format!("after step {}: an error of ours: {panic}", self.last.step),
        });
    }

    fn end(&mut self, fault: Fault) {
        tracing::warn!(
            reason = fault.reason,
            message = fault.message,
            "session faulted"
        );
        self.viewer = None;
        self.metrics.faults.inc();
        self.outlets.finish(End::Faulted(fault.clone()));
        self.activity = Activity::Faulted(fault);
    }

    fn report(&mut self) -> Report {
        if let Some(world) = &self.world {
            self.last_digest = world.digest();
            self.rest = world.rest();
        }
        Report {
            activity: self.activity.clone(),
            frame: Arc::clone(&self.last),
            digest: self.last_digest,
            mapping: Arc::clone(&self.mapping),
            rest: Arc::clone(&self.rest),
            inputs: self.outlets.inputs.count(),
        }
    }
}

/// Ticks once per step; a tick that is late delays the next, so that time never runs to catch up.
fn clock(time_step: f64) -> Interval {
    // An interval of zero panics; a step below a microsecond is paced as one of a microsecond.
    let mut clock = interval(std::time::Duration::from_secs_f64(
        time_step.clamp(1e-6, 3600.0),
    ));
    clock.set_missed_tick_behavior(MissedTickBehavior::Delay);
    clock
}
