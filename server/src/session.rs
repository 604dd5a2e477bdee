//! One session: an actor task that owns the world until the session ends, and the handle by which
//! everyone else speaks to it.

use std::sync::Arc;

use sinew_engine::{Frame, MotionSample, StepError, World};
use sinew_viewer::{Publisher, Shown};
use tokio::{
    sync::{mpsc, oneshot},
    time::{Interval, MissedTickBehavior, interval},
};
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use crate::{
    end::{End, Fault},
    error::ServiceError,
    kernels::Kernels,
    metrics::Metrics,
    outlets::Outlets,
    timing::{StepTiming, now_nanos},
};

/// Commands that may wait for a session; more are held back at their RPCs.
const COMMANDS: usize = 64;
/// Motion frames that may wait for their steps; more are held back in the client by flow control.
pub(crate) const MOTION_QUEUE: usize = 64;

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
}

/// A wish, and where its answer goes. Wishes are data: they could be logged and replayed.
pub(crate) struct Command {
    pub(crate) wish: Wish,
    pub(crate) reply: oneshot::Sender<Result<Report, ServiceError>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wish {
    Describe,
    Run,
    Pause,
    Step { steps: u32, expected: Option<u64> },
}

/// A motion sample and when it came.
pub(crate) struct Arrival {
    pub(crate) sample: MotionSample,
    pub(crate) received_nanos: u64,
}

/// How a session reaches its steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Drive {
    /// One step for each motion frame.
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
    pub(crate) motion: mpsc::Sender<Arrival>,
    pub(crate) outlets: Arc<Outlets>,
    pub(crate) cancel: CancellationToken,
}

impl Handle {
    /// Starts the session's task.
    pub(crate) fn spawn(
        world: World,
        drive: Drive,
        kernels: Kernels,
        viewer: Publisher,
        metrics: Arc<Metrics>,
        tasks: &TaskTracker,
    ) -> Self {
        let outlets = Arc::new(Outlets::new(world.frame()));
        let (inbox, commands) = mpsc::channel(COMMANDS);
        let (motion, arrivals) = mpsc::channel(MOTION_QUEUE);
        let handle = Self {
            inbox,
            motion,
            outlets: Arc::clone(&outlets),
            cancel: CancellationToken::new(),
        };
        let actor = Actor {
            last: world.frame(),
            last_digest: world.digest(),
            clock: clock(world.time_step()),
            world: Some(world),
            activity: Activity::Paused,
            drive,
            arrivals,
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
        let (reply, answer) = oneshot::channel();
        let ended = || ServiceError::Ended(self.outlets.end());
        let command = Command { wish, reply };
        self.inbox.send(command).await.map_err(|_| ended())?;
        answer.await.map_err(|_| ended())?
    }
}

struct Actor {
    /// Away during a step; gone after a fault.
    world: Option<World>,
    last: Arc<Frame>,
    last_digest: u128,
    activity: Activity,
    drive: Drive,
    clock: Interval,
    arrivals: mpsc::Receiver<Arrival>,
    outlets: Arc<Outlets>,
    viewer: Option<Publisher>,
    kernels: Kernels,
    metrics: Arc<Metrics>,
}

impl Actor {
    async fn run(mut self, mut commands: mpsc::Receiver<Command>, cancel: CancellationToken) {
        loop {
            let running = self.activity == Activity::Running;
            // Fair: a slow step cannot starve "pause", nor the reverse.
            tokio::select! {
                () = cancel.cancelled() => return self.outlets.finish(self.outlets.end()),
                command = commands.recv() => {
                    let Some(Command { wish, reply }) = command else { return };
                    let answer = self.fulfil(wish, &cancel).await;
                    reply.send(answer).ok(); // the asker may have left
                }
                arrival = self.arrivals.recv(), if running && self.drive == Drive::External => {
                    let Some(arrival) = arrival else { return };
                    self.step(Some(arrival)).await;
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
            (Wish::Run | Wish::Pause | Wish::Step { .. }, Activity::Faulted(fault)) => {
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
        let (wanted, waiting) = (steps as usize, self.arrivals.len());
        if external && waiting < wanted {
            return Err(ServiceError::MotionStarved { wanted, waiting });
        }
        for _ in 0..steps {
            let arrival = if external {
                self.arrivals.try_recv().ok()
            } else {
                None
            };
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

    /// One step on a kernel thread; afterwards its frame is published, or the fault is known.
    async fn step(&mut self, arrival: Option<Arrival>) {
        let Some(mut world) = self.world.take() else {
            return;
        };
        let received = arrival.as_ref().map_or(0, |arrival| arrival.received_nanos);
        let started = now_nanos();
        let stepped = self.kernels.run(move || {
            let outcome = world.step(arrival.as_ref().map(|arrival| &arrival.sample));
            (world, outcome)
        });
        match stepped.await {
            Ok((world, Ok(frame))) => {
                self.world = Some(world);
                self.last = Arc::clone(&frame);
                let timing = StepTiming {
                    received,
                    started,
                    published: now_nanos(),
                };
                self.metrics.stepped(timing);
                if let Some(viewer) = &self.viewer {
                    viewer.publish(Shown {
                        frame: Arc::clone(&frame),
                        step_seconds: timing.step_seconds(),
                        latency_seconds: timing.latency_seconds(),
                    });
                }
                self.outlets.publish(frame, timing);
            }
            Ok((world, Err(error))) => {
                self.last_digest = world.digest();
                self.fault("SIM_DIVERGED", &error);
            }
            Err(panic) => self.panicked(&panic),
        }
    }

    fn fault(&mut self, reason: &'static str, error: &StepError) {
        let message = format!("step {}: {error}", self.last.step + 1);
        self.end(Fault { reason, message });
    }

    fn panicked(&mut self, panic: &str) {
        let message = format!(
            "step {} failed by an error of ours: {panic}",
            self.last.step + 1
        );
        self.end(Fault {
            reason: "SESSION_PANICKED",
            message,
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
        }
        Report {
            activity: self.activity.clone(),
            frame: Arc::clone(&self.last),
            digest: self.last_digest,
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
