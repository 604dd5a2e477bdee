//! Checks that several columns share; each names the field at fault.

use nalgebra::Vector3;

use crate::{Fault, SpecError};

pub(crate) type Checked = Result<(), SpecError>;

pub(crate) const NOT_NEGATIVE: &str = "finite and not below 0";
pub(crate) const POSITIVE: &str = "finite and above 0";

pub(crate) fn refuse(field: impl Into<String>, fault: Fault) -> SpecError {
    let field = field.into();
    SpecError { field, fault }
}

pub(crate) fn length(field: &str, found: usize, expected: usize, owner: &'static str) -> Checked {
    if found == expected {
        return Ok(());
    }
    let fault = Fault::Length {
        found,
        expected,
        owner,
    };
    Err(refuse(field, fault))
}

/// One number of a field.
pub(crate) fn number(
    field: &str,
    value: f64,
    admits: impl Fn(f64) -> bool,
    rule: &'static str,
) -> Checked {
    if admits(value) {
        return Ok(());
    }
    Err(refuse(field, Fault::Value { value, rule }))
}

pub(crate) fn positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

pub(crate) fn not_negative(value: f64) -> bool {
    value.is_finite() && value >= 0.0
}

/// Every entry of a column.
pub(crate) fn column(
    field: &str,
    values: &[f64],
    admits: impl Fn(f64) -> bool,
    rule: &'static str,
) -> Checked {
    match values.iter().position(|&value| !admits(value)) {
        None => Ok(()),
        Some(entry) => number(&format!("{field}[{entry}]"), values[entry], admits, rule),
    }
}

pub(crate) fn finite(field: &str, vectors: &[Vector3<f64>]) -> Checked {
    for (entry, vector) in vectors.iter().enumerate() {
        finite_vector(&format!("{field}[{entry}]"), vector)?;
    }
    Ok(())
}

pub(crate) fn finite_vector(field: &str, vector: &Vector3<f64>) -> Checked {
    match vector.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(&value) => {
            let rule = "finite in every component";
            Err(refuse(field, Fault::Value { value, rule }))
        }
    }
}

pub(crate) fn exists(field: &str, index: u32, particles: usize) -> Checked {
    if (index as usize) < particles {
        return Ok(());
    }
    Err(refuse(field, Fault::Index { index, particles }))
}

/// The two ends of each link: particles that exist, and two of them.
pub(crate) fn ends(field: &str, ends: &[[u32; 2]], particles: usize) -> Checked {
    for (link, &[left, right]) in ends.iter().enumerate() {
        let field = format!("{field}[{link}]");
        exists(&field, left, particles)?;
        exists(&field, right, particles)?;
        if left == right {
            return Err(refuse(field, Fault::SelfLink { particle: left }));
        }
    }
    Ok(())
}
