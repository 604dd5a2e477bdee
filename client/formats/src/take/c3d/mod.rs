//! C3D, the binary format of c3d.org.
//!
//! Blocks of 512 bytes: a header, a parameter section anywhere, a data section anywhere, with numbers as one of three
//! kinds of processor writes them and samples as scaled 16-bit integers or as floats.

mod bytes;
mod header;
mod layout;
mod parameters;

use nalgebra::Vector3;

use super::error::{Fault, quoted};
use super::recording::{Recorder, finite};
use super::{Format, Options, Take, Up, units};
use bytes::Bytes;
use header::Header;
use layout::{Encoding, Layout};
use parameters::Parameters;

/// The size of a block.
const BLOCK: usize = 512;

pub(super) fn parse(bytes: &[u8], options: &Options) -> Result<Take, Fault> {
    let bytes = Bytes::new(bytes)?;
    let header = Header::read(&bytes)?;
    let parameters = Parameters::read(&bytes, &header)?;
    let mut warnings = Vec::new();
    let layout = Layout::read(&bytes, &header, &parameters, &mut warnings)?;
    let metres = metres_per_unit(&parameters, options, &mut warnings)?;

    let mut recorder = Recorder::new(labels(&parameters, layout.points)?, layout.rate_hz);
    for warning in warnings {
        recorder.warn(warning);
    }
    recorder.format(Format::C3d);
    recorder.up(up(&parameters));
    recorder.first_time_seconds(layout.first_time_seconds());
    recorder.reserve_frames(layout.frames);
    let data = &bytes.all()[layout.start..][..layout.frames * layout.frame_bytes()];
    for frame in data.chunks_exact(layout.frame_bytes()) {
        let samples = &frame[..layout.points * layout.encoding.sample_bytes()];
        for sample in samples.chunks_exact(layout.encoding.sample_bytes()) {
            let position = position(&bytes, layout.encoding, sample);
            recorder.push(position.and_then(|units| finite(units * metres)));
        }
    }
    recorder.warn_of_samples_at_origin();
    Ok(recorder.finish())
}

/// The coordinates in one sample, in the file's unit of length. `None` if the fourth word is negative or NaN, which is
/// how most programs mark a gap; some leave it as it is and write NaN coordinates, which the caller drops.
fn position(bytes: &Bytes, encoding: Encoding, sample: &[u8]) -> Option<Vector3<f64>> {
    let words = match encoding {
        Encoding::Integer { scale } => {
            let word = |i: usize| f64::from(bytes.decode_i16([sample[2 * i], sample[2 * i + 1]]));
            [word(0) * scale, word(1) * scale, word(2) * scale, word(3)]
        }
        Encoding::Real => {
            let (words, _) = sample.as_chunks::<4>();
            [0, 1, 2, 3].map(|i| bytes.decode_f32(words[i]))
        }
    };
    let [x, y, z, mask_and_residual] = words;
    (mask_and_residual >= 0.0).then(|| Vector3::new(x, y, z))
}

fn metres_per_unit(
    parameters: &Parameters,
    options: &Options,
    warnings: &mut Vec<String>,
) -> Result<f64, Fault> {
    if let Some(scale) = options.unit_scale {
        return Ok(scale);
    }
    let parameter = parameters.find("POINT", "UNITS")?;
    let unit = match &parameter {
        Some(parameter) => parameter.strings()?.into_iter().next().unwrap_or_default(),
        None => String::new(),
    };
    match (units::metres_per(&unit), parameter) {
        (Some(metres), _) => Ok(metres),
        (None, Some(parameter)) if !unit.is_empty() => Err(Fault::at_byte(
            parameter.at,
            format!(
                "POINT:UNITS is {}; {remedy}",
                quoted(&unit),
                remedy = units::REMEDY
            ),
        )),
        (None, _) => {
            warnings.push("no POINT:UNITS; millimetres assumed".into());
            Ok(0.001)
        }
    }
}

/// `POINT:LABELS`, `LABELS2`, …, as many as there are points. Each holds up to 255 labels, so that 65535 points need 257.
fn labels(parameters: &Parameters, points: usize) -> Result<Vec<String>, Fault> {
    let mut labels = Vec::new();
    for number in 1..=257 {
        let name = match number {
            1 => "LABELS".to_owned(),
            _ => format!("LABELS{number}"),
        };
        match parameters.find("POINT", &name)? {
            Some(parameter) if labels.len() < points => labels.extend(parameter.strings()?),
            Some(_) | None => break,
        }
    }
    // Lists longer than the points are common: templates name markers that were not captured.
    labels.resize(points, String::new());
    Ok(labels)
}

/// The axis that points up the screen, if it is one that a take can name. Nothing depends on it: a spoilt one is none.
fn up(parameters: &Parameters) -> Option<Up> {
    let axes = parameters.find("POINT", "Y_SCREEN").ok()??.strings().ok()?;
    match axes.first()?.to_ascii_uppercase().as_str() {
        "+Y" | "Y" => Some(Up::Y),
        "+Z" | "Z" => Some(Up::Z),
        _ => None,
    }
}
