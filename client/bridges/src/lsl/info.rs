//! What a stream of LSL says of itself.

use roxmltree::{Document, Node};

use crate::BridgeError;

/// How a stream's numbers travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    F32,
    F64,
    I8,
    I16,
    I32,
    I64,
}

impl Format {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "float32" => Self::F32,
            "double64" => Self::F64,
            "int8" => Self::I8,
            "int16" => Self::I16,
            "int32" => Self::I32,
            "int64" => Self::I64,
            _ => return None,
        })
    }

    /// Bytes of one number.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 => 1,
            Self::I16 => 2,
            Self::F32 | Self::I32 => 4,
            Self::F64 | Self::I64 => 8,
        }
    }

    /// The number in these bytes, of which there are as many as it has.
    pub(super) fn read(self, bytes: &[u8]) -> f64 {
        fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
            bytes.try_into().expect("as many bytes as the number has")
        }
        match self {
            Self::F32 => f32::from_le_bytes(array(bytes)).into(),
            Self::F64 => f64::from_le_bytes(array(bytes)),
            Self::I8 => i8::from_le_bytes(array(bytes)).into(),
            Self::I16 => i16::from_le_bytes(array(bytes)).into(),
            Self::I32 => i32::from_le_bytes(array(bytes)).into(),
            #[expect(clippy::cast_precision_loss, reason = "no coordinate has 2^53 steps")]
            Self::I64 => i64::from_le_bytes(array(bytes)) as f64,
        }
    }
}

/// A stream.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Info {
    pub(super) name: String,
    pub(super) uid: String,
    pub(super) hostname: String,
    pub(super) channels: usize,
    pub(super) format: Format,
    /// Hz; `None` where samples come irregularly.
    pub(super) rate_hz: Option<f64>,
    pub(super) data_port: u16,
    pub(super) service_port: u16,
}

/// Channels of any stream; more are refused.
const MOST: usize = 1 << 16;

fn child<'a>(node: Node<'a, '_>, name: &str) -> &'a str {
    let found = node.children().find(|child| child.has_tag_name(name));
    found
        .and_then(|child| child.text())
        .unwrap_or_default()
        .trim()
}

impl Info {
    /// Reads a description, short or full. `None` where it is none, or of a stream of text.
    pub(super) fn read(xml: &str) -> Option<Self> {
        let document = Document::parse(xml).ok()?;
        let info = document.root_element();
        let rate: f64 = child(info, "nominal_srate").parse().ok()?;
        Some(Self {
            name: child(info, "name").to_owned(),
            uid: child(info, "uid").to_owned(),
            hostname: child(info, "hostname").to_owned(),
            channels: child(info, "channel_count")
                .parse()
                .ok()
                .filter(|count| *count <= MOST)?,
            format: Format::named(child(info, "channel_format"))?,
            rate_hz: (rate.is_finite() && rate > 0.0).then_some(rate),
            data_port: child(info, "v4data_port").parse().ok()?,
            service_port: child(info, "v4service_port").parse().ok()?,
        })
    }
}

/// The points of a stream, and which of its channels speak of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Markers {
    pub(super) labels: Vec<String>,
    /// Channels of x, y and z.
    pub(super) axes: Vec<[usize; 3]>,
    /// The channel that is 0 where the point is not seen.
    pub(super) confidence: Vec<Option<usize>>,
    pub(super) unit_metres: f64,
}

/// What a channel says of its marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Axis(usize),
    Confidence,
}

fn part(word: &str) -> Option<Part> {
    let word = word.to_ascii_lowercase();
    Some(match word.strip_prefix("position").unwrap_or(&word) {
        "x" => Part::Axis(0),
        "y" => Part::Axis(1),
        "z" => Part::Axis(2),
        "confidence" | "visible" | "valid" => Part::Confidence,
        _ => return None,
    })
}

/// The marker and the part that a channel speaks of: by the fields `marker` and `type` of the convention for motion
/// capture, or by the end of its label, as in `LKNE_X`, `LKNE.x` or `LKNE x`.
fn spoken_of(channel: Node) -> Option<(String, Part)> {
    let label = child(channel, "label");
    let ending = label.rsplit_once(['_', '.', ':', '-', ' ', '/']);
    let by_label = ending.and_then(|(name, end)| Some((name, part(end)?)));
    let part = part(child(channel, "type")).or(by_label.map(|(_, part)| part))?;
    let marker = match (child(channel, "marker"), by_label) {
        ("", Some((name, _))) => name,
        ("", None) => label,
        (marker, _) => marker,
    };
    (!marker.is_empty()).then(|| (marker.to_owned(), part))
}

impl Markers {
    /// Reads a full description.
    pub(super) fn read(xml: &str, channels: usize) -> Result<Self, BridgeError> {
        let none = |problem: String| BridgeError::Layout(problem);
        let document = Document::parse(xml).map_err(|error| none(error.to_string()))?;
        let described: Vec<Node> = (document.descendants())
            .filter(|node| node.has_tag_name("channel"))
            .collect();
        if described.is_empty() && channels > 0 && channels.is_multiple_of(3) {
            return Ok(Self::numbered(channels / 3));
        }
        let mut markers = Self {
            unit_metres: 1.0,
            ..Self::default()
        };
        let mut parts: Vec<[Option<usize>; 3]> = Vec::new();
        for (channel, node) in described.iter().enumerate().take(channels) {
            let Some((marker, part)) = spoken_of(*node) else {
                continue;
            };
            let found = markers.labels.iter().position(|label| *label == marker);
            let index = found.unwrap_or_else(|| {
                markers.labels.push(marker.clone());
                markers.confidence.push(None);
                parts.push([None; 3]);
                parts.len() - 1
            });
            match part {
                Part::Confidence => markers.confidence[index] = Some(channel),
                Part::Axis(axis) => {
                    parts[index][axis] = Some(channel);
                    if let Some(unit) = metres(child(*node, "unit")) {
                        markers.unit_metres = unit;
                    }
                }
            }
        }
        for (label, axes) in markers.labels.iter().zip(parts) {
            let [Some(x), Some(y), Some(z)] = axes else {
                return Err(none(format!(
                    "marker `{label}` lacks a channel for x, y or z"
                )));
            };
            markers.axes.push([x, y, z]);
        }
        if markers.labels.is_empty() {
            let problem =
                "no channel is called as a coordinate; label them `NAME_X`, `NAME_Y`, `NAME_Z`";
            return Err(none(problem.to_owned()));
        }
        Ok(markers)
    }

    /// Of a stream that describes no channel: points one after the other.
    fn numbered(count: usize) -> Self {
        Self {
            labels: (1..=count)
                .map(|number| format!("point_{number}"))
                .collect(),
            axes: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            confidence: vec![None; count],
            unit_metres: 1.0,
        }
    }
}

fn metres(unit: &str) -> Option<f64> {
    Some(match unit.to_ascii_lowercase().as_str() {
        "m" | "meter" | "meters" | "metre" | "metres" => 1.0,
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 1e-2,
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => 1e-3,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full(channels: &str) -> String {
        format!("<info><name>x</name><desc><channels>{channels}</channels></desc></info>")
    }

    #[test]
    fn a_description_is_read() {
        let xml = "<?xml version=\"1.0\"?><info><name>Stage &amp; Co</name><channel_count>7</channel_count>\
            <channel_format>double64</channel_format><nominal_srate>120.000</nominal_srate><uid>u-1</uid>\
            <hostname>h</hostname><v4data_port>16573</v4data_port><v4service_port>16574</v4service_port><desc/></info>";
        let info = Info::read(xml).unwrap();
        assert_eq!(
            (info.name.as_str(), info.channels, info.rate_hz),
            ("Stage & Co", 7, Some(120.0))
        );
        assert_eq!(
            (info.format, info.data_port, info.service_port),
            (Format::F64, 16573, 16574)
        );
        assert_eq!(Info::read(&xml.replace("double64", "string")), None);
        assert_eq!(Info::read(&xml.replace(">7<", ">99999999<")), None);
        assert_eq!(Info::read("<info>"), None);
    }

    #[test]
    fn channels_speak_of_markers_by_fields_or_by_labels() {
        let field = |marker: &str, kind: &str| {
            format!(
                "<channel><label>c</label><marker>{marker}</marker><type>{kind}</type><unit>millimeters</unit></channel>"
            )
        };
        let label = |label: &str| format!("<channel><label>{label}</label></channel>");
        let xml = full(
            &[
                field("A", "PositionX"),
                field("A", "PositionY"),
                field("A", "PositionZ"),
                field("A", "Confidence"),
                label("trigger"),
                label("B.z"),
                label("B.x"),
                label("B.y"),
            ]
            .concat(),
        );
        let markers = Markers::read(&xml, 8).unwrap();
        assert_eq!(markers.labels, ["A", "B"]);
        assert_eq!(markers.axes, [[0, 1, 2], [6, 7, 5]]);
        assert_eq!(markers.confidence, [Some(3), None]);
        assert_eq!(markers.unit_metres, 1e-3);
    }

    #[test]
    fn streams_without_points_are_refused_with_the_reason() {
        let lacks =
            full("<channel><label>A_X</label></channel><channel><label>A_Y</label></channel>");
        let error = Markers::read(&lacks, 2).unwrap_err().to_string();
        assert!(error.contains("`A` lacks"), "{error}");
        let error = Markers::read(&full("<channel><label>C3</label></channel>"), 1).unwrap_err();
        assert!(error.to_string().contains("NAME_X"), "{error}");
        assert_eq!(
            Markers::read(&full(""), 6).unwrap().labels,
            ["point_1", "point_2"]
        );
    }
}
