//! How the data section is laid out: where the header and the parameters agree, and who is believed where they do not.

use super::super::error::Fault;
use super::BLOCK;
use super::bytes::Bytes;
use super::header::Header;
use super::parameters::Parameters;

/// The data section: `frames` frames, each of `points` samples and then `analog` numbers.
pub(super) struct Layout {
    pub(super) start: usize,
    pub(super) points: usize,
    pub(super) analog: usize,
    pub(super) encoding: Encoding,
    pub(super) frames: usize,
    pub(super) rate_hz: f64,
    first_frame: u32,
}

/// How a number is stored; a sample is four of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    /// 16-bit steps of `scale` units of length.
    Integer { scale: f64 },
    /// 32-bit floats in units of length.
    Real,
}

impl Encoding {
    pub(super) fn sample_bytes(self) -> usize {
        4 * self.number_bytes()
    }

    fn number_bytes(self) -> usize {
        match self {
            Self::Integer { .. } => 2,
            Self::Real => 4,
        }
    }
}

impl Layout {
    pub(super) fn read(
        bytes: &Bytes,
        header: &Header,
        parameters: &Parameters,
        warnings: &mut Vec<String>,
    ) -> Result<Self, Fault> {
        let points = agreed(
            u32::from(header.points),
            count(parameters, "POINT", "USED")?,
            "points",
            "POINT:USED",
            warnings,
        );
        if points == 0 {
            return Err(Fault::at_byte(
                Header::POINTS_AT,
                "the file holds no points",
            ));
        }
        let (first_frame, claimed) = frame_range(header, parameters, warnings)?;
        let mut layout = Self {
            start: data_start(bytes, header, parameters, warnings)?,
            points: usize::try_from(points).unwrap_or(usize::MAX),
            analog: header.analog.into(),
            encoding: encoding(header, parameters, warnings)?,
            frames: 0,
            rate_hz: rate_hz(header, parameters)?,
            first_frame,
        };
        let room = (bytes.all().len() - layout.start) / layout.frame_bytes();
        if room == 0 {
            return Err(Fault::at_byte(
                layout.start,
                format!(
                    "no room for one frame of {points} points before the file ends at {}",
                    bytes.all().len()
                ),
            ));
        }
        let claimed = usize::try_from(claimed).unwrap_or(usize::MAX);
        if room < claimed {
            warnings.push(format!(
                "the file ends at byte {} with {room} whole frames of {claimed}; these were read",
                bytes.all().len()
            ));
        }
        layout.frames = claimed.min(room);
        Ok(layout)
    }

    pub(super) fn frame_bytes(&self) -> usize {
        self.points
            .saturating_mul(4)
            .saturating_add(self.analog)
            .saturating_mul(self.encoding.number_bytes())
    }

    /// Frame number 1 is at time 0. Some programs count from 0.
    pub(super) fn first_time_seconds(&self) -> f64 {
        f64::from(self.first_frame.saturating_sub(1)) / self.rate_hz
    }
}

/// A count that the file states twice: the header's, unless that is 0.
fn agreed(
    header: u32,
    parameter: Option<u32>,
    what: &str,
    name: &str,
    warnings: &mut Vec<String>,
) -> u32 {
    match parameter {
        Some(parameter) if header == 0 => parameter,
        Some(parameter) if parameter != header => {
            warnings.push(format!(
                "{name} says {parameter} {what}, the header {header}; the header was believed"
            ));
            header
        }
        Some(_) | None => header,
    }
}

fn count(parameters: &Parameters, group: &str, name: &str) -> Result<Option<u32>, Fault> {
    let Some(parameter) = parameters.find(group, name)? else {
        return Ok(None);
    };
    Ok(parameter.counts()?.into_iter().next().flatten())
}

fn number(parameters: &Parameters, name: &str) -> Result<Option<f64>, Fault> {
    let Some(parameter) = parameters.find("POINT", name)? else {
        return Ok(None);
    };
    parameter.number()
}

fn data_start(
    bytes: &Bytes,
    header: &Header,
    parameters: &Parameters,
    warnings: &mut Vec<String>,
) -> Result<usize, Fault> {
    let parameter = count(parameters, "POINT", "DATA_START")?.filter(|&block| block > 0);
    let block = agreed(
        header.data_block.into(),
        parameter,
        "as the first data block",
        "POINT:DATA_START",
        warnings,
    );
    let start = usize::try_from(block)
        .ok()
        .and_then(|block| block.checked_sub(1)?.checked_mul(BLOCK))
        .filter(|&start| start <= bytes.all().len());
    start.ok_or_else(|| {
        Fault::at_byte(
            Header::DATA_BLOCK_AT,
            format!(
                "the data cannot begin at block {block} of a file of {} bytes",
                bytes.all().len()
            ),
        )
    })
}

fn encoding(
    header: &Header,
    parameters: &Parameters,
    warnings: &mut Vec<String>,
) -> Result<Encoding, Fault> {
    let usable = |scale: &f64| scale.is_finite() && *scale != 0.0;
    let parameter = number(parameters, "SCALE")?.filter(usable);
    let in_header = Some(header.scale).filter(usable);
    if let Some((parameter, header)) = parameter.zip(in_header)
        && parameter.signum() != header.signum()
    {
        warnings.push(format!(
            "POINT:SCALE is {parameter}, the header's {header}: one means floats, the other integers; POINT:SCALE was \
             believed"
        ));
    }
    match parameter.or(in_header) {
        Some(scale) if scale < 0.0 => Ok(Encoding::Real),
        Some(scale) => Ok(Encoding::Integer { scale }),
        None => Err(Fault::at_byte(
            Header::SCALE_AT,
            format!(
                "neither POINT:SCALE nor the header's scale of {} can be one",
                header.scale
            ),
        )),
    }
}

fn rate_hz(header: &Header, parameters: &Parameters) -> Result<f64, Fault> {
    let usable = |rate: &f64| rate.is_finite() && *rate > 0.0;
    number(parameters, "RATE")?
        .filter(usable)
        .or(Some(header.rate_hz).filter(usable))
        .ok_or_else(|| {
            Fault::at_byte(
                Header::RATE_AT,
                format!(
                    "neither POINT:RATE nor the header's rate of {} is a frame rate",
                    header.rate_hz
                ),
            )
        })
}

/// The number of the first frame and the count of frames claimed.
///
/// The header's 16 bits hold neither numbers nor counts above 65535. Beyond, programs saturate or wrap them and write
/// the truth to `TRIAL:ACTUAL_START_FIELD` and `ACTUAL_END_FIELD`, or the count to `POINT:LONG_FRAMES` or, as a float,
/// `POINT:FRAMES`.
fn frame_range(
    header: &Header,
    parameters: &Parameters,
    warnings: &mut Vec<String>,
) -> Result<(u32, u32), Fault> {
    let (first, last) = (u32::from(header.first), u32::from(header.last));
    let full = u32::from(u16::MAX);
    let in_header = (first <= last && last < full).then(|| (first, last - first + 1));

    let start = long_number(parameters, "ACTUAL_START_FIELD")?;
    let trial = start.zip(long_number(parameters, "ACTUAL_END_FIELD")?);
    let frames = match count(parameters, "POINT", "LONG_FRAMES")? {
        Some(frames) => Some(frames),
        None => count(parameters, "POINT", "FRAMES")?,
    };
    let long = trial
        .and_then(|(start, end)| Some((start, end.checked_sub(start)?.checked_add(1)?)))
        .or(frames.map(|frames| (start.unwrap_or(first), frames)))
        .filter(|&(_, frames)| frames > 0);

    match (in_header, long) {
        (_, Some((start, frames))) if frames > full => Ok((start, frames)),
        (Some((first, in_header)), _) => {
            let in_header = agreed(in_header, frames, "frames", "POINT:FRAMES", warnings);
            Ok((first, in_header))
        }
        (None, Some(long)) => Ok(long),
        (None, None) if first <= last => Ok((first, last - first + 1)),
        (None, None) => Err(Fault::at_byte(
            Header::FIRST_AT,
            format!("the last frame is {last}, before the first, {first}"),
        )),
    }
}

/// A frame number in two 16-bit words, the low one first.
fn long_number(parameters: &Parameters, name: &str) -> Result<Option<u32>, Fault> {
    let Some(parameter) = parameters.find("TRIAL", name)? else {
        return Ok(None);
    };
    Ok(match parameter.counts()?[..] {
        [Some(low), Some(high), ..] if low.max(high) <= u16::MAX.into() => Some(low | high << 16),
        _ => None,
    })
}
