//! What a cloud of points holds, and what would be wrong with a solid made of it.

use nalgebra::Vector3;
use serde_json::json;
use sinew_formats::cloud::{self, Cloud};
use sinew_particles::{Dimension, Survey};

use super::{Arguments, some};
use crate::out::{put, say};
use crate::{
    Failure,
    table::{Table, count},
};

/// How far a point sees in a solid whose scene does not say, in spacings.
const REACH: f64 = 1.9;

pub(super) fn inspect(arguments: &Arguments) -> Result<(), Failure> {
    let mut cloud = cloud::read(&arguments.file)?;
    for position in &mut cloud.positions {
        *position *= arguments.unit_scale.unwrap_or(1.0);
    }
    let flat = cloud.positions.iter().all(|x| x.z == cloud.positions[0].z);
    let dimension = if flat {
        Dimension::Plane
    } else {
        Dimension::Space
    };
    let survey = Survey::new(&cloud.positions, dimension, REACH)?;
    if arguments.json {
        say!("{:#}", to_json(&cloud, &survey, flat));
    } else {
        say!("{}: {}", arguments.file.display(), cloud.format);
        put!("{}", describe(&cloud, &survey, flat));
    }
    Ok(())
}

fn bounds(cloud: &Cloud) -> [Vector3<f64>; 2] {
    let first = cloud.positions[0];
    let widen = |[low, high]: [Vector3<f64>; 2], x: &Vector3<f64>| [low.inf(x), high.sup(x)];
    cloud.positions.iter().fold([first, first], widen)
}

/// What is wrong, each with the points and the remedy.
fn findings(survey: &Survey) -> Vec<(&'static str, String, &'static str)> {
    let Survey {
        spacing: _,
        twins,
        pieces,
        outliers,
        sparse,
    } = survey;
    let mut found = Vec::new();
    if !twins.is_empty() {
        let pairs: Vec<String> = twins.iter().map(|[a, b]| format!("{a}={b}")).collect();
        found.push(("in one place", some(&pairs), "keep one of each"));
    }
    if !outliers.is_empty() {
        let remedy = "they hold to nothing: remove them, or add points around them";
        found.push(("outliers", some(outliers), remedy));
    }
    if pieces.len() > 1 {
        let sizes: Vec<String> = pieces.iter().map(|&size| count(size as u64)).collect();
        let remedy = "nothing holds the pieces together: add points between them, or fix each";
        found.push(("pieces of", some(&sizes), remedy));
    }
    if !sparse.is_empty() {
        let remedy = "their neighbours lie in a line or a plane, within which alone they resist: \
                      add points beside them, or lengthen reach_spacings";
        found.push(("sparse", some(sparse), remedy));
    }
    found
}

fn describe(cloud: &Cloud, survey: &Survey, flat: bool) -> String {
    let mut table = Table::of_words();
    table.row(["  points", &count(cloud.positions.len() as u64)]);
    let [low, high] = bounds(cloud);
    let [a, b] = [low, high].map(|x| format!("{:.4} {:.4} {:.4}", x.x, x.y, x.z));
    table.row(["  bounds", &format!("{a} to {b}")]);
    if flat {
        table.row(["  plane", "all points share a z: SOLID_DIMENSION_PLANE"]);
    }
    let [least, middle, greatest] = survey.spacing;
    let spacing = format!("{least:.4} to {greatest:.4}, {middle:.4} in the middle");
    table.row(["  spacing", &spacing]);
    for (what, points, remedy) in findings(survey) {
        table.row([&format!("  {what}"), &format!("{points}: {remedy}")]);
    }
    table.to_string()
}

fn to_json(cloud: &Cloud, survey: &Survey, flat: bool) -> serde_json::Value {
    let Survey {
        spacing,
        twins,
        pieces,
        outliers,
        sparse,
    } = survey;
    let [low, high] = bounds(cloud).map(|x| [x.x, x.y, x.z]);
    json!({
        "format": cloud.format.to_string(),
        "points": cloud.positions.len(),
        "low": low,
        "high": high,
        "plane": flat,
        "spacing": spacing,
        "twins": twins,
        "pieces": pieces,
        "outliers": outliers,
        "sparse": sparse,
    })
}
