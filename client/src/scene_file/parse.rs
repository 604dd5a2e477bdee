//! From text to the message.

use std::path::Path;

use serde::de::DeserializeOwned;

/// How a scene file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Syntax {
    /// Protobuf's JSON mapping.
    Json,
    /// TOML with the same names.
    Toml,
}

impl Syntax {
    /// What the file's name says.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "json" => Some(Self::Json),
            "toml" => Some(Self::Toml),
            _ => None,
        }
    }
}

/// Why a text is no scene, or no mapping.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {}{problem}", prefix(field))]
pub struct ParseError {
    /// Where, from 1.
    pub line: usize,
    /// Path of the field, such as `mesh.lattice.spacing`; empty where the text itself is malformed.
    pub field: String,
    /// What is wrong.
    pub problem: String,
}

fn prefix(field: &str) -> String {
    if field.is_empty() {
        String::new()
    } else {
        format!("{field}: ")
    }
}

/// Reads a message of `sinew.v1`.
pub(super) fn message<T: DeserializeOwned>(text: &str, syntax: Syntax) -> Result<T, ParseError> {
    match syntax {
        Syntax::Json => json(text),
        Syntax::Toml => toml(text),
    }
}

fn json<T: DeserializeOwned>(text: &str) -> Result<T, ParseError> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let message = serde_path_to_error::deserialize(&mut reader).map_err(|error| ParseError {
        line: error.inner().line(),
        field: field(error.path()),
        problem: without_place(&error.inner().to_string()),
    })?;
    reader.end().map_err(|error| ParseError {
        line: error.line(),
        field: String::new(),
        problem: without_place(&error.to_string()),
    })?;
    Ok(message)
}

fn toml<T: DeserializeOwned>(text: &str) -> Result<T, ParseError> {
    let at = |error: &toml::de::Error, field| ParseError {
        line: error
            .span()
            .map_or(1, |span| 1 + text[..span.start].matches('\n').count()),
        field,
        problem: in_plain_words(error.message()),
    };
    let reader = toml::Deserializer::parse(text).map_err(|error| at(&error, String::new()))?;
    serde_path_to_error::deserialize(reader).map_err(|error| at(error.inner(), field(error.path())))
}

/// `?` stands for what was not reached, such as an unknown name: the problem names it.
fn field(path: &serde_path_to_error::Path) -> String {
    path.to_string()
        .trim_end_matches('?')
        .trim_end_matches('.')
        .to_owned()
}

/// `serde_json` ends its messages with the place, which stands in front here.
fn without_place(message: &str) -> String {
    in_plain_words(
        message
            .rsplit_once(" at line ")
            .map_or(message, |(what, _)| what),
    )
}

fn in_plain_words(message: &str) -> String {
    const NO_NUMBER: [&str; 3] = [
        "NumberDeserialize",
        "invalid float literal",
        "invalid digit found",
    ];
    if NO_NUMBER.iter().any(|words| message.contains(words)) {
        "not a number, or one out of range".to_owned()
    } else {
        message.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sinew_proto::v1;

    use super::*;

    fn scene(text: &str, syntax: Syntax) -> Result<v1::Scene, ParseError> {
        message(text, syntax)
    }

    const TOML: &str = r#"
title = "Strip"
timeStepSeconds = 0.01
up = "UP_AXIS_Y"
pace = "PACE_UNPACED"

[motion.massSpring]
positions.values = [0, 0, 0, 0.5, 0, 0]
masses = { values = [2] }
fixed.values = [0]
springs.values = [0, 1]
stiffness.values = [100.0]
gravity = { y = -9.81 }

[mesh.lattice]
shape = "CELL_SHAPE_HEXAHEDRON"
spacing = 1
radius = 2.5
[[mesh.lattice.bones]]
from = "0"
to = "1"

[mapping]
weighting.distance = { kernel = "KERNEL_INVERSE_SQUARE" }
filter.keep.k = 4
rule.shapeMatching = {}
"#;

    #[test]
    fn toml_and_json_make_the_same_scene() {
        let toml = scene(TOML, Syntax::Toml).unwrap();
        let json = serde_json::to_string_pretty(&toml).unwrap();
        assert_eq!(scene(&json, Syntax::Json).unwrap(), toml);
        let Some(v1::mesh::Source::Lattice(lattice)) = toml.mesh.unwrap().source else {
            panic!("no lattice")
        };
        assert_eq!((lattice.spacing, lattice.bones.len()), (1.0, 1));
    }

    #[test]
    fn names_may_be_written_as_in_the_proto_files() {
        let snake = TOML
            .replace("timeStepSeconds", "time_step_seconds")
            .replace("massSpring", "mass_spring")
            .replace("shapeMatching", "shape_matching");
        assert_eq!(scene(&snake, Syntax::Toml), scene(TOML, Syntax::Toml));
    }

    /// The error of the scene with one line changed, in TOML and in JSON.
    fn errors(from: &str, to: &str) -> [ParseError; 2] {
        let toml = TOML.replace(from, to);
        assert_ne!(toml, TOML);
        let value: serde_json::Value = toml::from_str(&toml).unwrap();
        let json = serde_json::to_string_pretty(&value).unwrap();
        [
            scene(&toml, Syntax::Toml).unwrap_err(),
            scene(&json, Syntax::Json).unwrap_err(),
        ]
    }

    #[test]
    fn an_unknown_name_is_refused_with_its_line_and_place() {
        for error in errors("spacing = 1", "spacign = 1") {
            assert_eq!(error.field, "mesh.lattice.spacign");
            assert!(error.problem.contains("unknown field `spacign`"), "{error}");
            assert!(error.problem.contains("`spacing`"), "{error}");
            assert!(error.line > 1, "{error}");
        }
        let [toml, _] = errors("spacing = 1", "spacign = 1");
        assert_eq!(toml.line, 17);
    }

    #[test]
    fn a_wrong_type_is_refused_with_its_field() {
        for error in errors("spacing = 1", "spacing = \"wide\"") {
            assert_eq!(error.field, "mesh.lattice.spacing");
            assert_eq!(error.problem, "not a number, or one out of range");
        }
        for error in errors("filter.keep.k = 4", "filter.keep.k = -4") {
            assert_eq!(error.field, "mapping.filter.keep.k");
        }
        for error in errors("\"CELL_SHAPE_HEXAHEDRON\"", "\"CUBE\"") {
            assert_eq!(error.field, "mesh.lattice.shape");
            assert!(error.problem.contains("CELL_SHAPE_HEXAHEDRON"), "{error}");
        }
    }

    #[test]
    fn malformed_text_is_refused_with_its_line() {
        let error = scene("title = \"a\"\nup = = 3\n", Syntax::Toml).unwrap_err();
        assert_eq!((error.line, error.field.as_str()), (2, ""));
        let error = scene("{\n\"title\": \"a\",\n}", Syntax::Json).unwrap_err();
        assert_eq!((error.line, error.field.as_str()), (3, ""));
        let error = scene("{}\n{}", Syntax::Json).unwrap_err();
        assert_eq!(error.line, 2);
    }

    proptest! {
        #[test]
        fn no_text_makes_the_reader_panic(text in any::<String>(), cut in 0..500usize) {
            let start: String = TOML.chars().take(cut).collect();
            for text in [text.clone(), start + &text] {
                drop(scene(&text, Syntax::Toml));
                drop(scene(&text, Syntax::Json));
            }
        }
    }
}
