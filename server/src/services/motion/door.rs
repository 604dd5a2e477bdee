//! What a source sends, brought into the session's order, frame and unit, or refused.

use std::{collections::BTreeMap, ops::RangeInclusive};

use nalgebra::Vector3;
use sinew_engine::{Drag, MotionSample, UpAxis};
use sinew_proto::v1;

use crate::{
    convert,
    error::{ServiceError, invalid},
    inbox::{Delivery, Drags},
};

/// Bits of a point's flag byte that say that its position is none: occluded, unlabelled.
const UNSEEN: u8 = 0b11;
/// Largest coordinate that a mesh can follow and still travel as binary32, m.
const LARGEST: f64 = 1e12;
/// Frames per second of anything that is captured, Hz.
const RATES: RangeInclusive<f64> = 0.01..=1e5;
/// How far a frame may be behind, in frames; one further behind starts over.
const WINDOW: usize = 64;

type Result<T, E = ServiceError> = std::result::Result<T, E>;

/// The check that every frame of a stream passes.
pub(super) struct Door {
    points: usize,
    /// For each point of a frame its index in the session; none where the orders agree.
    order: Option<Vec<usize>>,
    unit: f64,
    axes: v1::Axes,
    up: UpAxis,
    /// Capture times of the last frames, by sequence.
    recent: BTreeMap<u64, f64>,
    duplicates: u64,
}

impl Door {
    pub(super) fn open(hello: &v1::Hello, labels: &[String], up: UpAxis) -> Result<Self> {
        Ok(Self {
            points: labels.len(),
            order: order(&hello.labels, labels)?,
            unit: positive(hello.unit_metres, 1.0, "hello.unit_metres")?,
            axes: convert::known(hello.axes, "hello.axes")?,
            up,
            recent: BTreeMap::new(),
            duplicates: 0,
        })
    }

    /// Sequence of the latest frame.
    pub(super) fn last(&self) -> u64 {
        self.recent.last_key_value().map_or(0, |(last, _)| *last)
    }

    /// Frames that came twice.
    pub(super) fn duplicates(&self) -> u64 {
        self.duplicates
    }

    /// Checks a frame and brings it into the session's form; `None` where it came before.
    pub(super) fn admit(&mut self, frame: v1::MotionFrame) -> Result<Option<MotionSample>> {
        let v1::MotionFrame {
            sequence,
            capture_time_seconds: time,
            positions,
            flags,
            source_sequence,
            drags,
        } = frame;
        if !drags.is_empty() {
            let problem = format!("has {} entries for points that are streamed", drags.len());
            let remedy = "send their positions; drags are for particles";
            return Err(invalid("CONFLICT", "frame.drags", problem, remedy));
        }
        let positions = convert::vectors(positions.as_ref(), "frame.positions")?;
        self.check_length("frame.positions", positions.len())?;
        if !flags.is_empty() {
            self.check_length("frame.flags", flags.len())?;
        }
        check_time("frame.capture_time_seconds", time)?;
        let seen: Vec<bool> = match flags.is_empty() {
            true => vec![true; self.points],
            false => flags.iter().map(|flag| flag & UNSEEN == 0).collect(),
        };
        let placed = |(position, seen): (&Vector3<f64>, &bool)| match seen {
            true => self.unit * turned(*position, self.axes, self.up),
            false => Vector3::zeros(),
        };
        let places: Vec<_> = positions.iter().zip(&seen).map(placed).collect();
        let wrong = |place: &Vector3<f64>| !place.iter().all(|x| x.abs() <= LARGEST);
        if let Some(i) = places.iter().position(wrong) {
            return Err(invalid(
                "VALUE_NOT_FINITE",
                format!("frame.positions[{i}]"),
                format!("is {:?} in frame {sequence}", positions[i].as_slice()),
                "send finite metres, or flag the point as occluded",
            ));
        }
        if !self.is_new(sequence, time)? {
            return Ok(None);
        }
        let (positions, seen) = match &self.order {
            None => (places, seen),
            Some(order) => (scatter(&places, order), scatter(&seen, order)),
        };
        Ok(Some(MotionSample {
            sequence: source_sequence.unwrap_or(sequence),
            time,
            positions,
            seen,
        }))
    }

    /// Checks the drags of a frame for a session of particles; `None` where it came before.
    pub(super) fn admit_drags(
        &mut self,
        frame: v1::MotionFrame,
        labels: &[String],
    ) -> Result<Option<Drags>> {
        if frame.positions.is_some_and(|given| !given.is_empty()) || !frame.flags.is_empty() {
            return Err(ServiceError::MotionNotExternal);
        }
        let drag = |(i, given): (usize, v1::Drag)| {
            let field = |name: &str| format!("frame.drags[{i}].{name}");
            let point = convert::point(&given.point, labels, &field("point"))?;
            let place = |v1::Vector3 { x, y, z }| {
                self.unit * turned(Vector3::new(x, y, z), self.axes, self.up)
            };
            let target = given.position.map(place);
            match target {
                Some(place) if !place.iter().all(|x| x.abs() <= LARGEST) => Err(invalid(
                    "VALUE_NOT_FINITE",
                    field("position"),
                    format!("is {:?} in frame {}", place.as_slice(), frame.sequence),
                    "send finite metres, or no position to let the point go",
                )),
                Some(_) | None => Ok(Drag { point, target }),
            }
        };
        let drags = frame.drags.into_iter().enumerate().map(drag);
        let drags = drags.collect::<Result<_>>()?;
        check_time("frame.capture_time_seconds", frame.capture_time_seconds)?;
        let step = frame.sequence;
        let new = self.is_new(step, frame.capture_time_seconds)?;
        Ok(new.then_some(Drags { step, drags }))
    }

    fn check_length(&self, field: &str, found: usize) -> Result<()> {
        if found == self.points {
            return Ok(());
        }
        let problem = format!("has {found} entries for {} points", self.points);
        let remedy = "send every point in every frame; flag those not seen";
        Err(invalid("MOTION_WRONG_LENGTH", field, problem, remedy))
    }

    /// Whether a frame did not come before. One that goes back too far, or whose time contradicts its sequence, comes
    /// from a source that started over.
    fn is_new(&mut self, sequence: u64, time: f64) -> Result<bool> {
        if self.recent.contains_key(&sequence) {
            self.duplicates += 1;
            return Ok(false);
        }
        let before = self.recent.range(..sequence).next_back();
        let after = self.recent.range(sequence..).next();
        let back = if before.is_none() && self.recent.len() == WINDOW {
            Some("further than frames may be out of order")
        } else if before.is_some_and(|(_, before)| *before > time)
            || after.is_some_and(|(_, after)| *after < time)
        {
            Some("on one of its clock and its count alone")
        } else {
            None
        };
        if let Some(back) = back {
            let (last, last_time) = self
                .recent
                .last_key_value()
                .map_or((0, 0.0), |(s, t)| (*s, *t));
            return Err(ServiceError::MotionBackwards {
                sequence,
                time,
                last,
                last_time,
                back,
            });
        }
        self.recent.insert(sequence, time);
        if self.recent.len() > WINDOW {
            self.recent.pop_first();
        }
        Ok(true)
    }
}

/// How a source's frames become steps.
pub(super) fn delivery(hello: &v1::Hello, time_step: f64) -> Result<Delivery> {
    const FIELD: &str = "hello.rate_hz";
    let rate = positive(hello.rate_hz, 1.0 / time_step, FIELD)?;
    if hello.rate_hz != 0.0 && !RATES.contains(&rate) {
        let (problem, (least, most)) = (format!("is {rate}"), RATES.into_inner());
        let remedy = format!("give a rate from {least} to {most} Hz");
        return Err(invalid("VALUE_OUT_OF_RANGE", FIELD, problem, remedy));
    }
    let delivery = convert::known::<v1::Delivery>(hello.delivery, "hello.delivery")?;
    Ok(match delivery {
        v1::Delivery::Unspecified | v1::Delivery::Each => Delivery::Each,
        v1::Delivery::Live => Delivery::Live { period: 1.0 / rate },
    })
}

/// Refuses a time that is none.
pub(super) fn check_time(field: &str, time: f64) -> Result<()> {
    if time.is_finite() {
        return Ok(());
    }
    let problem = format!("is {time}");
    Err(invalid(
        "VALUE_NOT_FINITE",
        field,
        problem,
        "send finite seconds",
    ))
}

/// A number above 0; 0 stands for `default`.
fn positive(given: f64, default: f64, field: &str) -> Result<f64> {
    if given == 0.0 {
        return Ok(default);
    }
    // What is 1 over it must be a number too.
    if given.is_finite() && given > 0.0 && given.recip().is_finite() {
        return Ok(given);
    }
    let problem = format!("is {given}");
    Err(invalid(
        "VALUE_OUT_OF_RANGE",
        field,
        problem,
        "give a number above 0",
    ))
}

/// A vector of the source's axes in the scene's, whose `up` axis points up and which is right-handed.
fn turned(v: Vector3<f64>, axes: v1::Axes, up: UpAxis) -> Vector3<f64> {
    let (from, v) = match axes {
        v1::Axes::Unspecified => return v,
        v1::Axes::ZUpRightHanded => (UpAxis::Z, v),
        v1::Axes::YUpRightHanded => (UpAxis::Y, v),
        v1::Axes::ZUpLeftHanded => (UpAxis::Z, Vector3::new(v.x, -v.y, v.z)),
        v1::Axes::YUpLeftHanded => (UpAxis::Y, Vector3::new(v.x, v.y, -v.z)),
    };
    match (from, up) {
        (UpAxis::Y, UpAxis::Y) | (UpAxis::Z, UpAxis::Z) => v,
        (UpAxis::Y, UpAxis::Z) => Vector3::new(v.x, -v.z, v.y),
        (UpAxis::Z, UpAxis::Y) => Vector3::new(v.x, v.z, -v.y),
    }
}

/// Where in the session each point of a frame stands.
fn order(labels: &[String], known: &[String]) -> Result<Option<Vec<usize>>, ServiceError> {
    if labels.is_empty() || labels == known {
        return Ok(None);
    }
    let mut order = Vec::with_capacity(known.len());
    let mut taken = vec![false; known.len()];
    for (i, label) in labels.iter().enumerate() {
        let field = format!("hello.labels[{i}]");
        let Some(point) = known.iter().position(|name| name == label) else {
            let problem = format!("is `{label}`, which no point of the session has");
            return Err(invalid(
                "LABEL_UNKNOWN",
                field,
                problem,
                "stream the points of the scene",
            ));
        };
        if std::mem::replace(&mut taken[point], true) {
            let problem = format!("is `{label}` for the second time");
            return Err(invalid(
                "LABEL_DUPLICATE",
                field,
                problem,
                "name each point once",
            ));
        }
        order.push(point);
    }
    if let Some(absent) = taken.iter().position(|taken| !taken) {
        let problem = format!("lacks `{}`", known[absent]);
        return Err(invalid(
            "LABEL_MISSING",
            "hello.labels",
            problem,
            "name every point of the scene",
        ));
    }
    Ok(Some(order))
}

fn scatter<T: Copy>(values: &[T], order: &[usize]) -> Vec<T> {
    let mut placed = values.to_vec();
    for (value, slot) in values.iter().zip(order) {
        placed[*slot] = *value;
    }
    placed
}
