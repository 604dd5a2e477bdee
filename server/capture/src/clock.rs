//! A source's clock, told from ours.

use std::collections::VecDeque;

/// One ping: four readings, two on each clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exchange {
    /// The source sent the ping, s, on its clock.
    pub sent: f64,
    /// We received it, s, on ours.
    pub received: f64,
    /// We answered, s, on ours.
    pub answered: f64,
    /// The source received the answer, s, on its clock.
    pub returned: f64,
}

/// Bounds of (our clock − the source's) seen at one time of the source's clock.
#[derive(Clone, Copy, Debug)]
struct Bound {
    at: f64,
    offset: f64,
}

/// Where our clock stands when a source's shows some time: a line, fitted to what packets say. `[S1]`
///
/// A packet from the source arrives no earlier than it was sent, so each bounds the offset from above; each answer
/// bounds it from below. Delays only widen the bounds: a jittered packet is no error, it says less. Of all lines between
/// the bounds this takes the slope that leaves the widest strip, and the strip's middle. So the error is half the
/// difference between the least delays of the two directions, and jitter on top of these does not enter.
///
/// Without answers there is no lower bound: the line is then the highest below the upper ones, late by the least delay.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    above: VecDeque<Bound>,
    below: VecDeque<Bound>,
    /// Both clocks when the first packet came; the line is written from there.
    origin: Option<(f64, f64)>,
    offset: f64,
    skew: f64,
}

/// Packets remembered per direction: at ten pings a second, a quarter of a minute.
const WINDOW: usize = 160;
/// No clock worth the name is off by more: 500 ppm.
const SKEW: f64 = 5e-4;
/// Halvings of the search for the slope: 2 SKEW / 1.5^60 is below 1e-13.
const SEARCH: usize = 60;

impl Clock {
    /// Takes in a ping.
    pub fn exchange(&mut self, ping: Exchange) {
        let (source, ours) = *self.origin.get_or_insert((ping.sent, ping.received));
        let above = Bound {
            at: ping.sent - source,
            offset: ping.received - ours - (ping.sent - source),
        };
        let below = Bound {
            at: ping.returned - source,
            offset: ping.answered - ours - (ping.returned - source),
        };
        if self.below.is_empty() {
            self.above.clear(); // frames bound it less well: they wait for the source's own work
        }
        remember(&mut self.above, above);
        remember(&mut self.below, below);
        self.fit();
    }

    /// Takes in a frame captured at `captured` and received at `received`, of a source that does not ping. Of one that
    /// does it says nothing new.
    pub fn frame(&mut self, captured: f64, received: f64) {
        if !self.below.is_empty() {
            return;
        }
        let (source, ours) = *self.origin.get_or_insert((captured, received));
        let at = captured - source;
        remember(
            &mut self.above,
            Bound {
                at,
                offset: received - ours - at,
            },
        );
        self.fit();
    }

    /// Whether anything is known yet.
    pub fn is_known(&self) -> bool {
        self.origin.is_some()
    }

    /// What our clock shows when the source's shows `time`, s; `time` itself as long as nothing is known.
    pub fn to_ours(&self, time: f64) -> f64 {
        let Some((source, ours)) = self.origin else {
            return time;
        };
        let at = time - source;
        ours + at + self.offset + self.skew * at
    }

    /// What the source's clock shows when ours shows `time`, s: the inverse of [`Clock::to_ours`].
    pub fn to_source(&self, time: f64) -> f64 {
        let Some((source, ours)) = self.origin else {
            return time;
        };
        source + (time - ours - self.offset) / (1.0 + self.skew)
    }

    /// How much faster our clock runs than the source's: 1e-6 is one microsecond per second.
    pub fn skew(&self) -> f64 {
        self.skew
    }

    fn fit(&mut self) {
        let height = |skew: f64| {
            let least = |bounds: &VecDeque<Bound>, sign: f64| {
                let heights = bounds.iter().map(|b| sign * (b.offset - skew * b.at));
                heights.fold(f64::INFINITY, f64::min)
            };
            (least(&self.above, 1.0), -least(&self.below, -1.0))
        };
        // What is known of the middle of the window is best; there the line without answers is pushed up.
        let span = [self.above.front(), self.above.back()];
        let middle = span.iter().flatten().map(|b| b.at).sum::<f64>() / 2.0;
        let worth = |skew: f64| match height(skew) {
            (above, below) if below.is_finite() => above - below,
            (above, _) => above + skew * middle,
        };
        // `worth` is concave: lines under lines.
        let (mut low, mut high) = (-SKEW, SKEW);
        for _ in 0..SEARCH {
            let third = (high - low) / 3.0;
            if worth(low + third) < worth(high - third) {
                low += third;
            } else {
                high -= third;
            }
        }
        self.skew = f64::midpoint(low, high);
        self.offset = match height(self.skew) {
            (above, below) if below.is_finite() => f64::midpoint(above, below),
            (above, _) => above,
        };
    }
}

fn remember(bounds: &mut VecDeque<Bound>, bound: Bound) {
    if bounds.len() == WINDOW {
        bounds.pop_front();
    }
    bounds.push_back(bound);
}
