//! Units of length, as capture programs spell them.

/// Metres per unit, `None` for a unit not known.
pub(super) fn metres_per(unit: &str) -> Option<f64> {
    match unit.trim().to_ascii_lowercase().as_str() {
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some(0.001),
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => Some(0.01),
        "m" | "meter" | "meters" | "metre" | "metres" => Some(1.0),
        "in" | "inch" | "inches" => Some(0.0254),
        _ => None,
    }
}

/// What to do about a unit that [`metres_per`] does not know.
pub(super) const REMEDY: &str =
    "known are mm, cm, m and in; for another give the unit scale in metres";
