use nalgebra::Vector3;

use crate::check::{self, Checked};

/// A vector that changes with time: straight between its keys, constant before the first and after the last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Track {
    /// Times of the keys, s, each above the one before; at least one.
    pub times: Vec<f64>,
    /// One vector per key.
    pub values: Vec<Vector3<f64>>,
}

impl Track {
    /// A vector that stays.
    #[must_use]
    pub fn constant(value: Vector3<f64>) -> Self {
        Self {
            times: vec![0.0],
            values: vec![value],
        }
    }

    pub(crate) fn check(&self, field: &str) -> Checked {
        let Self { times, values } = self;
        let of_times = format!("{field}.times");
        let some = if times.is_empty() { 1 } else { times.len() };
        check::length(&of_times, times.len(), some, "keys")?;
        check::length(
            &format!("{field}.values"),
            values.len(),
            times.len(),
            "keys",
        )?;
        let mut last = f64::NEG_INFINITY;
        for (key, &time) in times.iter().enumerate() {
            let rule = "finite and above the time before it";
            let admits = |time: f64| time.is_finite() && time > last;
            check::number(&format!("{of_times}[{key}]"), time, admits, rule)?;
            last = time;
        }
        check::finite(&format!("{field}.values"), values)
    }

    /// The vector at a time, s.
    pub(crate) fn at(&self, time: f64) -> Vector3<f64> {
        let next = self.times.partition_point(|&key| key <= time);
        match (next.checked_sub(1), self.times.get(next)) {
            (None, _) => self.values[0],
            (Some(last), None) => self.values[last],
            (Some(last), Some(after)) => {
                let fraction = (time - self.times[last]) / (after - self.times[last]);
                self.values[last].lerp(&self.values[next], fraction)
            }
        }
    }

    /// Its derivative from that time on, 1/s of the vector's unit.
    pub(crate) fn rate(&self, time: f64) -> Vector3<f64> {
        let next = self.times.partition_point(|&key| key <= time);
        match (next.checked_sub(1), self.times.get(next)) {
            (Some(last), Some(after)) => {
                (self.values[next] - self.values[last]) / (after - self.times[last])
            }
            (None, _) | (_, None) => Vector3::zeros(),
        }
    }
}
