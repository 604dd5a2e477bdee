//! Motion capture as it arrives: on another clock, jittered, out of order, twice, and with markers that blink, swap and
//! jump. Pure: what time it is and what came are arguments, so that a replay gives the same answers.
//!
//! [`Clock`] brings the source's clock to ours, [`Buffer`] brings frames to the step grid and says for how long to wait
//! for them, and [`Tracker`] makes of what is seen a motion without jumps.

mod buffer;
mod clock;
mod course;
mod delay;
mod neighbours;
mod sample;
mod settings;
mod state;
mod tracker;

pub use buffer::{Buffer, Counts, Verdict};
pub use clock::{Clock, Exchange};
pub use delay::Delay;
pub use sample::Sample;
pub use settings::{Settings, SettingsError};
pub use state::{Doubt, State};
pub use tracker::Tracker;
