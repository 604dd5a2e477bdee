//! Clocks: this machine's, and a peer's as far as it is known here.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use sinew_capture::Exchange;
use tokio::time::Instant;

/// This machine's clock since a source began, s.
#[derive(Clone, Copy, Debug)]
pub struct Local(Instant);

impl Local {
    /// One that shows 0 now.
    pub fn begin() -> Self {
        Self(Instant::now())
    }

    /// What it shows, s.
    pub fn now(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

/// A peer's clock, told from its answers to our pings.
#[derive(Clone, Debug)]
pub struct PeerClock {
    local: Local,
    /// From our clock to the peer's: by its words we are the source that pings. `None`: it is our own.
    fitted: Option<Arc<Mutex<sinew_capture::Clock>>>,
}

impl PeerClock {
    /// This machine's own.
    pub fn own(local: Local) -> Self {
        Self {
            local,
            fitted: None,
        }
    }

    /// One of which nothing is known yet.
    pub fn unknown(local: Local) -> Self {
        Self {
            local,
            fitted: Some(Arc::default()),
        }
    }

    fn fitted(&self) -> Option<MutexGuard<'_, sinew_capture::Clock>> {
        let fitted = self.fitted.as_ref()?;
        Some(fitted.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes in an answered ping.
    ///
    /// * `sent`, `returned` - on our clock, s.
    /// * `received`, `answered` - on the peer's, s.
    pub fn exchange(&self, sent: f64, received: f64, answered: f64, returned: f64) {
        if let Some(mut fitted) = self.fitted() {
            fitted.exchange(Exchange {
                sent,
                received,
                answered,
                returned,
            });
        }
    }

    /// Whether it can be read.
    pub fn is_known(&self) -> bool {
        self.fitted().is_none_or(|fitted| fitted.is_known())
    }

    /// What it shows now, s.
    pub fn now(&self) -> f64 {
        let now = self.local.now();
        self.fitted().map_or(now, |fitted| fitted.to_ours(now))
    }
}
