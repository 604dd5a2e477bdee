//! Points as rows of text, apart by commas, semicolons or blanks (`.csv`, `.xyz`).

use nalgebra::Vector3;

use crate::mesh::{
    cursor::{Cursor, shown},
    error::Parsed,
};

pub(super) fn parse(bytes: &[u8]) -> Parsed<Vec<Vector3<f64>>> {
    let mut cursor = Cursor::new(bytes);
    let mut points: Vec<Vector3<f64>> = Vec::new();
    let mut columns: Option<Vec<usize>> = None;
    let mut claimed = None;
    let mut lines = 0;
    while cursor.remaining() > 0 {
        let line = cursor.line();
        lines += 1;
        let words = words(line);
        // A chemical file: a count, then a line that may say anything.
        if lines == 1
            && let [count] = words.as_slice()
            && let Some(count) = number(count)
        {
            claimed = Some(count);
            continue;
        }
        if words.is_empty() || line.starts_with(b"#") || (claimed.is_some() && lines == 2) {
            continue;
        }
        if points.is_empty() && columns.is_none() {
            columns = named(&words);
            if columns.is_some() {
                continue;
            }
        }
        let numbers = match &columns {
            Some(columns) => columns.iter().map(|&at| words.get(at).copied()).collect(),
            // An element's name stands before its place.
            None => {
                let first = usize::from(number(words[0]).is_none());
                let columns = (words.len() - first).min(3);
                words[first..first + columns]
                    .iter()
                    .map(|word| Some(*word))
                    .collect::<Vec<_>>()
            }
        };
        let mut point = Vector3::zeros();
        if numbers.len() < 2 {
            return Err(cursor.flaw(format!(
                "{} is no point: give two or three numbers",
                shown(line)
            )));
        }
        for (axis, word) in numbers.iter().enumerate() {
            let value = word.and_then(number).filter(|value| value.is_finite());
            point[axis] = value.ok_or_else(|| {
                cursor.flaw(format!(
                    "{} has no finite number for {}",
                    shown(line),
                    ["x", "y", "z"][axis]
                ))
            })?;
        }
        points.push(point);
    }
    #[expect(clippy::cast_precision_loss, reason = "a count of lines")]
    let found = points.len() as f64;
    match claimed {
        Some(claimed) if claimed != found => Err(cursor.flaw(format!(
            "{claimed} points are claimed, and {found} follow; the file is cut"
        ))),
        Some(_) | None => Ok(points),
    }
}

fn words(line: &[u8]) -> Vec<&[u8]> {
    let apart = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b',' | b';');
    line.split(apart).filter(|word| !word.is_empty()).collect()
}

fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Which words are the coordinates, by a line of names.
fn named(words: &[&[u8]]) -> Option<Vec<usize>> {
    let named = |name: &str| {
        let is = |word: &&[u8]| word.trim_ascii().eq_ignore_ascii_case(name.as_bytes());
        words.iter().position(is)
    };
    let mut columns = vec![named("x")?, named("y")?];
    columns.extend(named("z"));
    Some(columns)
}
