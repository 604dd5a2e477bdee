//! The laws of links. Lengths are above 0; a positive force pushes apart.

use std::collections::BTreeMap;

use nalgebra::Vector3;

/// A law along the line between the ends of a link.
pub(super) trait AxialLaw: Sync {
    /// N, at a length, m, that grows at a rate, m/s, which only damped laws ask for.
    fn force(&self, link: usize, length: f64, rate: impl FnOnce() -> f64) -> f64;
    /// Elastic energy, J, zero where the force is zero for good; a table's is zero at its first length.
    fn energy(&self, link: usize, length: f64) -> f64;
    /// The greatest stiffness, N/m, and damping, N s/m, that the link can show.
    fn bounds(&self, link: usize) -> (f64, f64);
    /// Takes note of the length at the end of a step.
    fn settle(&mut self, _link: usize, _length: f64) {}
}

/// Damped springs. `[P1]`
#[derive(Clone, Debug)]
pub(super) struct Springs {
    pub(super) stiffness: Vec<f64>,
    /// `None` where no link is damped.
    pub(super) damping: Option<Vec<f64>>,
    pub(super) rest_length: Vec<f64>,
}

/// Most constants that are shared: a table in the processor's nearest memory, or there is nothing to gain.
const SHARED: usize = 1024;

impl Springs {
    /// Keeps equal constants once, and returns where those of each link are: reading them is what large networks spend
    /// their time on. `None` where there are too many different ones; nothing has changed then.
    pub(super) fn share(&mut self) -> Option<Vec<u32>> {
        let constants = |link: usize| {
            let damping = self.damping.as_ref().map_or(0.0, |damping| damping[link]);
            [self.stiffness[link], damping, self.rest_length[link]]
        };
        let mut found = BTreeMap::new();
        let mut first = Vec::new();
        let mut entries = Vec::with_capacity(self.stiffness.len());
        for link in 0..self.stiffness.len() {
            let next = u32::try_from(first.len()).expect("at most SHARED");
            let entry = *found
                .entry(constants(link).map(f64::to_bits))
                .or_insert(next);
            if entry == next {
                if first.len() == SHARED {
                    return None;
                }
                first.push(link);
            }
            entries.push(entry);
        }
        let shared =
            |column: &mut Vec<f64>| *column = first.iter().map(|&link| column[link]).collect();
        shared(&mut self.stiffness);
        shared(&mut self.rest_length);
        self.damping.iter_mut().for_each(shared);
        Some(entries)
    }

    #[inline]
    fn drag(&self, link: usize, rate: impl FnOnce() -> f64) -> f64 {
        match &self.damping {
            Some(damping) => -damping[link] * rate(),
            None => 0.0,
        }
    }
}

impl AxialLaw for Springs {
    #[inline]
    fn force(&self, link: usize, length: f64, rate: impl FnOnce() -> f64) -> f64 {
        -self.stiffness[link] * (length - self.rest_length[link]) + self.drag(link, rate)
    }

    fn energy(&self, link: usize, length: f64) -> f64 {
        0.5 * self.stiffness[link] * (length - self.rest_length[link]).powi(2)
    }

    fn bounds(&self, link: usize) -> (f64, f64) {
        let damping = self.damping.as_ref().map_or(0.0, |damping| damping[link]);
        (self.stiffness[link], damping)
    }
}

/// Buffers. `[P6]`
#[derive(Clone, Debug)]
pub(super) struct Contacts(pub(super) Springs);

impl AxialLaw for Contacts {
    #[inline]
    fn force(&self, link: usize, length: f64, rate: impl FnOnce() -> f64) -> f64 {
        if length < self.0.rest_length[link] {
            // Without the limit a leaving mass would stick to what it leaves.
            self.0.force(link, length, rate).max(0.0)
        } else {
            0.0
        }
    }

    fn energy(&self, link: usize, length: f64) -> f64 {
        self.0.energy(link, length.min(self.0.rest_length[link]))
    }

    fn bounds(&self, link: usize) -> (f64, f64) {
        self.0.bounds(link)
    }
}

/// Springs that break. `[P7]`
#[derive(Clone, Debug)]
pub(super) struct Breaking {
    pub(super) springs: Springs,
    /// Elongation beyond which a link is broken, m; of a broken one, minus infinity.
    pub(super) elongation: Vec<f64>,
}

impl Breaking {
    fn holds(&self, link: usize, length: f64) -> bool {
        length - self.springs.rest_length[link] <= self.elongation[link]
    }
}

impl AxialLaw for Breaking {
    #[inline]
    fn force(&self, link: usize, length: f64, rate: impl FnOnce() -> f64) -> f64 {
        if self.holds(link, length) {
            self.springs.force(link, length, rate)
        } else {
            0.0
        }
    }

    fn energy(&self, link: usize, length: f64) -> f64 {
        if self.holds(link, length) {
            self.springs.energy(link, length)
        } else {
            0.0
        }
    }

    fn bounds(&self, link: usize) -> (f64, f64) {
        if self.elongation[link] == f64::NEG_INFINITY {
            (0.0, 0.0)
        } else {
            self.springs.bounds(link)
        }
    }

    fn settle(&mut self, link: usize, length: f64) {
        if !self.holds(link, length) {
            self.elongation[link] = f64::NEG_INFINITY;
        }
    }
}

/// Springs that flow. `[P8]`
#[derive(Clone, Debug)]
pub(super) struct Plastic {
    pub(super) springs: Springs,
    /// m
    pub(super) yields: Vec<f64>,
}

impl Plastic {
    fn elongation(&self, link: usize, length: f64) -> f64 {
        let limit = self.yields[link];
        (length - self.springs.rest_length[link]).clamp(-limit, limit)
    }
}

impl AxialLaw for Plastic {
    #[inline]
    fn force(&self, link: usize, length: f64, rate: impl FnOnce() -> f64) -> f64 {
        -self.springs.stiffness[link] * self.elongation(link, length)
            + self.springs.drag(link, rate)
    }

    fn energy(&self, link: usize, length: f64) -> f64 {
        0.5 * self.springs.stiffness[link] * self.elongation(link, length).powi(2)
    }

    fn bounds(&self, link: usize) -> (f64, f64) {
        self.springs.bounds(link)
    }

    fn settle(&mut self, link: usize, length: f64) {
        let limit = self.yields[link];
        let rest_length = &mut self.springs.rest_length[link];
        // As it was, to the bit, where the link does not flow.
        *rest_length = rest_length.clamp(length - limit, length + limit);
    }
}

/// A piecewise linear characteristic. `[P10]`
#[derive(Clone, Debug)]
pub(super) struct Table {
    pub(super) length: Vec<f64>,
    pub(super) force: Vec<f64>,
}

impl Table {
    /// The segment that serves a length, and its slope, N/m.
    fn segment(&self, length: f64) -> (usize, f64) {
        let after = self.length.partition_point(|&key| key <= length);
        let segment = after.clamp(1, self.length.len() - 1) - 1;
        (segment, self.slope(segment))
    }

    fn slope(&self, segment: usize) -> f64 {
        (self.force[segment + 1] - self.force[segment])
            / (self.length[segment + 1] - self.length[segment])
    }
}

impl AxialLaw for Table {
    fn force(&self, _link: usize, length: f64, _rate: impl FnOnce() -> f64) -> f64 {
        let (segment, slope) = self.segment(length);
        self.force[segment] + slope * (length - self.length[segment])
    }

    fn energy(&self, link: usize, length: f64) -> f64 {
        let (segment, _) = self.segment(length);
        let done: f64 = (0..segment)
            .map(|s| {
                0.5 * (self.force[s] + self.force[s + 1]) * (self.length[s + 1] - self.length[s])
            })
            .sum();
        let here = 0.5 * (self.force[segment] + self.force(link, length, || 0.0));
        -done - here * (length - self.length[segment])
    }

    fn bounds(&self, _link: usize) -> (f64, f64) {
        let slopes = (0..self.length.len() - 1).map(|segment| self.slope(segment).abs());
        (slopes.fold(0.0, f64::max), 0.0)
    }
}

/// Dry friction. `[P9]`
#[derive(Clone, Debug)]
pub(super) struct Friction {
    pub(super) stiffness: Vec<f64>,
    pub(super) limit: Vec<f64>,
    /// Where the second end sticks, seen from the first, m.
    pub(super) anchor: Vec<Vector3<f64>>,
}

impl Friction {
    /// N on the second end, at its position seen from the first.
    pub(super) fn force(&self, link: usize, r: Vector3<f64>) -> Vector3<f64> {
        let pull = (self.anchor[link] - r) * self.stiffness[link];
        let size = pull.norm();
        if size > self.limit[link] {
            pull * (self.limit[link] / size)
        } else {
            pull
        }
    }

    pub(super) fn settle(&mut self, link: usize, r: Vector3<f64>) {
        let slips = (self.anchor[link] - r).norm() * self.stiffness[link] > self.limit[link];
        if slips {
            self.anchor[link] = r + self.force(link, r) / self.stiffness[link];
        }
    }
}
